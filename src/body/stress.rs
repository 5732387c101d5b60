//! Stress, strain and inner forces, to be read.

use super::body::DeformableBody;
use crate::fem::{ElementState, element_states, section_forces, sheet_stresses};
use crate::math::{Mat3, Vec3, to_real};
use rapier3d::math::Vector;

/// Cauchy stress, of an element or at a vertex: force per area of now. Tension is positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeformableStress {
    /// Its components along x, y and z \[Pa\]; symmetric.
    pub cauchy: [[f64; 3]; 3],
}

impl From<Mat3> for DeformableStress {
    fn from(cauchy: Mat3) -> Self {
        Self { cauchy: cauchy.into() }
    }
}

impl DeformableStress {
    fn matrix(&self) -> Mat3 {
        self.cauchy.into()
    }

    /// `−tr σ / 3` \[Pa\].
    pub fn pressure(&self) -> f64 {
        -self.matrix().trace() / 3.0
    }

    /// The uniaxial tension that would change the shape with as much energy, `√(3/2 s : s)` of the part s without
    /// pressure \[Pa\].
    pub fn von_mises(&self) -> f64 {
        let s = self.matrix() + Mat3::identity() * self.pressure();
        (1.5 * s.dot(&s)).sqrt()
    }

    /// Principal stresses \[Pa\], largest tension first, and their unit directions.
    pub fn principal(&self) -> ([f64; 3], [Vector; 3]) {
        let eigen = self.matrix().symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let direction = |k: usize| to_real(&eigen.eigenvectors.column(k).into());
        (order.map(|k| eigen.eigenvalues[k]), order.map(direction))
    }

    /// Force per area on a plane with this unit normal \[Pa\], on the side from which it points.
    pub fn traction(&self, normal: Vector) -> Vector {
        to_real(&(self.matrix() * crate::math::from_real(normal)))
    }
}

impl DeformableBody {
    fn element_states(&self) -> Vec<ElementState> {
        element_states(&self.model, &self.materials, &self.state.x)
    }

    /// Stress of each tetrahedron, in the order of [`DeformableModel::tetrahedra`](crate::DeformableModel::tetrahedra); damping's is
    /// not in it. An element that is inverted has none that means something.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [5, 1, 1]);
    /// let mut bar = bar.material(DeformableMaterial::new(1.0e6, 0.0)).build()?;
    /// // Stretched by one percent.
    /// for vertex in 0..bar.vertex_count() {
    ///     let [x, y, z] = bar.position(vertex)?;
    ///     bar.set_position(vertex, [1.01 * x, y, z])?;
    /// }
    /// let stress = bar.stresses()[0];
    /// assert!((stress.cauchy[0][0] - 1.0e4).abs() < 1.0 && (stress.von_mises() - 1.0e4).abs() < 1.0);
    /// assert!(stress.principal().1[0].x.abs() > 0.999);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn stresses(&self) -> Vec<DeformableStress> {
        self.element_states().iter().map(|state| state.stress.into()).collect()
    }

    /// Stress at each vertex: the mean of the tetrahedra around it, by volume. Zero at vertices without such.
    pub fn vertex_stresses(&self) -> Vec<DeformableStress> {
        let mut sums = vec![(Mat3::zeros(), 0.0); self.vertex_count()];
        for (tet, state) in self.model.tetrahedra().zip(self.element_states()) {
            for vertex in tet {
                sums[vertex as usize].0 += state.stress * state.volume;
                sums[vertex as usize].1 += state.volume;
            }
        }
        let mean = |(sum, volume): (Mat3, f64)| if volume > 0.0 { sum / volume } else { sum };
        sums.into_iter().map(|sum| mean(sum).into()).collect()
    }

    /// Stress in the middle plane of each triangle of the sheets, in the order of
    /// [`DeformableModel::sheet_triangles`](crate::DeformableModel::sheet_triangles): force per length over the thickness at rest.
    /// What bending adds on either side and damping are not in it.
    pub fn sheet_stresses(&self) -> Vec<DeformableStress> {
        let all = sheet_stresses(&self.model, &self.materials, &self.state.x);
        all.into_iter().map(Into::into).collect()
    }

    /// Tension of each segment of the rods \[N\], negative when pressed, in the order of
    /// [`DeformableModel::rod_segments`](crate::DeformableModel::rod_segments).
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let rope = DeformableBodyBuilder::rope(&[Vector::ZERO, Vector::X], 0.01);
    /// let mut rope = rope.material(DeformableMaterial::new(1.0e6, 0.3)).build()?;
    /// rope.set_position(1, [1.01, 0.0, 0.0])?;
    /// // E A ε
    /// assert!((rope.rod_tensions()[0] - 1.0e6 * 1.0e-4 * std::f64::consts::PI * 0.01).abs() < 1e-5);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn rod_tensions(&self) -> Vec<f64> {
        section_forces(&self.model, &self.materials, &self.state.x).0
    }

    /// The bending moments of rods \[N·m\], about their direction: of each vertex between two segments, with the vertex, in the order
    /// of the rods.
    pub fn rod_moments(&self) -> Vec<(usize, [f64; 3])> {
        let moments = section_forces(&self.model, &self.materials, &self.state.x).1;
        moments.into_iter().map(|(node, moment)| (self.model.vertex(node as usize), moment.into())).collect()
    }

    /// Green's strain `(FᵀF − 1)/2` of each tetrahedron: which no rotation changes.
    pub fn strains(&self) -> Vec<[[f64; 3]; 3]> {
        let strain = |F: Mat3| (F.transpose() * F - Mat3::identity()) * 0.5;
        self.element_states().iter().map(|state| strain(state.F).into()).collect()
    }

    /// Elastic energy of each tetrahedron \[J\]. They sum to [`DeformableBody::elastic_energy`] but for sheets, rods, springs
    /// and fibres.
    pub fn element_energies(&self) -> Vec<f64> {
        self.element_states().iter().map(|state| state.energy).collect()
    }

    /// What the elasticity of the body does to each of its vertices \[N\]. At rest the opposite of what acts on it: weight,
    /// contacts, and at pins their reactions.
    pub fn elastic_forces(&self) -> Vec<[f64; 3]> {
        let forces = self.in_user_order(&self.elastic_response().1);
        forces.into_iter().map(Into::into).collect()
    }

    /// Surface of now that belongs to each vertex \[m²\]: a third of the triangles around it; of sheets one side, of rods their
    /// length times their diameter.
    pub fn vertex_areas(&self) -> Vec<f64> {
        let mut of_node = vec![0.0; self.vertex_count()];
        let (x, surface) = (&self.state.x, &self.model.surface);
        for triangle in &surface.triangles {
            let [a, b, c] = triangle.map(|n| x[n as usize]);
            let share = (b - a).cross(&(c - a)).norm() / 6.0;
            triangle.iter().for_each(|n| of_node[*n as usize] += share);
        }
        for segment in &surface.segments {
            let [a, b] = surface.edges[*segment as usize].map(|n| n as usize);
            let half = 0.5 * (x[b] - x[a]).norm();
            [a, b].iter().for_each(|n| of_node[*n] += half * 2.0 * self.model.half_thickness[*n]);
        }
        self.in_user_order(&of_node)
    }

    /// Area of now of the surface's triangles all of whose vertices are meant \[m²\].
    pub(crate) fn area_within(&self, is_meant: impl Fn(usize) -> bool) -> f64 {
        let x = &self.state.x;
        let meant = |triangle: &&[u32; 3]| triangle.iter().all(|n| is_meant(self.model.vertex(*n as usize)));
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|n| x[n as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        self.model.surface.triangles.iter().filter(meant).map(area).sum()
    }

    pub(super) fn in_user_order<T: Copy>(&self, of_node: &[T]) -> Vec<T> {
        (0..of_node.len()).filter_map(|vertex| Some(of_node[self.model.node(vertex)?])).collect()
    }

    /// Energy \[J\], and forces on nodes \[N\], without damping.
    pub(crate) fn elastic_response(&self) -> (f64, Vec<Vec3>) {
        use crate::fem::StiffnessDamping;
        use crate::fem::elastic_forces::{Evaluation, add_forces};
        let mut force = vec![Vec3::zeros(); self.state.x.len()];
        let (undamped, frame) = (StiffnessDamping::default(), Mat3::identity());
        let at = Evaluation { damping: &undamped, x: &self.state.x, frame: &frame, limit: f64::INFINITY };
        let energy = add_forces(&self.elements(), &at, &mut force).energy;
        (energy + self.add_twist_response(&mut force), force)
    }
}
