//! Builders of colliders, after rapier's.

use crate::arrays::{Placed, Triple, heights, indices, not_negative, real_points, size};
use crate::collider::PyCollider;
use crate::enums::{PyCombineRule, PyGroups};
use crate::errors::{bad_value, without_panic};
use crate::options::apply;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rapier3d::geometry::{ColliderBuilder, SharedShape};

/// What a collider is made of.
///
/// Made by ``Collider.cuboid`` and the like. Every method returns a new builder; each may be given as a keyword argument as well:
/// ``Collider.ball(0.1, density=500.0)``.
#[pyclass(frozen, name = "ColliderBuilder", module = "foible3d")]
#[derive(Clone)]
pub struct PyColliderBuilder(pub ColliderBuilder);

type Options<'a, 'py> = &'a Bound<'py, PyDict>;
type Built<'py> = PyResult<Bound<'py, PyColliderBuilder>>;

impl PyColliderBuilder {
    fn new_with(&self, change: impl FnOnce(ColliderBuilder) -> ColliderBuilder) -> Self {
        Self(change(self.0.clone()))
    }

    fn build<'py>(
        py: Python<'py>,
        builder: ColliderBuilder,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        apply(Bound::new(py, Self(builder))?, options, &[])
    }
}

#[pymethods]
impl PyColliderBuilder {
    /// Sets where it is on its body, or in the world if it is on none [m].
    fn translation(&self, v: Triple) -> PyResult<Self> {
        let v = v.finite("translation")?;
        Ok(self.new_with(|b| b.translation(v)))
    }

    /// Sets how it is turned on its body, as axis times angle [rad].
    fn rotation(&self, scaled_axis: Triple) -> PyResult<Self> {
        let angle = scaled_axis.finite("rotation")?;
        Ok(self.new_with(|b| b.rotation(angle)))
    }

    /// Sets where it is on its body and how it is turned: a translation [m], and a quaternion (x, y, z, w).
    fn position(&self, p: Placed) -> PyResult<Self> {
        let pose = p.pose("position")?;
        Ok(self.new_with(|b| b.position(pose)))
    }

    /// Sets its density [kg/m³]; rapier's default is 1.
    fn density(&self, d: f64) -> PyResult<Self> {
        let d = not_negative("density", d)?;
        Ok(self.new_with(|b| b.density(d)))
    }

    /// Sets its mass [kg], in the place of the density.
    fn mass(&self, m: f64) -> PyResult<Self> {
        let m = not_negative("mass", m)?;
        Ok(self.new_with(|b| b.mass(m)))
    }

    /// Sets its coefficient of friction [–].
    fn friction(&self, f: f64) -> PyResult<Self> {
        let f = not_negative("friction", f)?;
        Ok(self.new_with(|b| b.friction(f)))
    }

    /// Sets its coefficient of restitution [–].
    fn restitution(&self, r: f64) -> PyResult<Self> {
        let r = not_negative("restitution", r)?;
        Ok(self.new_with(|b| b.restitution(r)))
    }

    /// Sets how friction combines with that of what it touches.
    fn friction_combine_rule(&self, r: PyCombineRule) -> Self {
        self.new_with(|b| b.friction_combine_rule(r.into()))
    }

    /// Sets how restitution combines with that of what it touches.
    fn restitution_combine_rule(&self, r: PyCombineRule) -> Self {
        self.new_with(|b| b.restitution_combine_rule(r.into()))
    }

    /// Sets whether it only senses what is in it.
    fn sensor(&self, b: bool) -> Self {
        self.new_with(|builder| builder.sensor(b))
    }

    /// Sets what it collides with.
    fn collision_groups(&self, g: PyGroups) -> Self {
        self.new_with(|b| b.collision_groups(g.0))
    }

    /// Sets what it exchanges forces with.
    fn solver_groups(&self, g: PyGroups) -> Self {
        self.new_with(|b| b.solver_groups(g.0))
    }

    /// Sets the thickness of a skin around it [m].
    fn contact_skin(&self, f: f64) -> PyResult<Self> {
        let f = not_negative("contact_skin", f)?;
        Ok(self.new_with(|b| b.contact_skin(f)))
    }

    /// Sets whether it takes part in the simulation.
    fn enabled(&self, b: bool) -> Self {
        self.new_with(|builder| builder.enabled(b))
    }

    /// Sets a number of the user's own.
    fn user_data(&self, d: u128) -> Self {
        self.new_with(|b| b.user_data(d))
    }

    fn __repr__(&self) -> String {
        format!("<ColliderBuilder: {:?}>", self.0.shape.shape_type())
    }
}

fn sizes<const N: usize>(named: [(&str, f64); N]) -> PyResult<[f32; N]> {
    let mut sizes = [0.0; N];
    for (own, (name, value)) in sizes.iter_mut().zip(named) {
        *own = size(name, value)?;
    }
    Ok(sizes)
}

fn capsule_ends(half_height: f64, radius: f64) -> PyResult<[f32; 2]> {
    // A capsule of no height is a ball.
    let half = if half_height == 0.0 { 0.0 } else { size("half_height", half_height)? };
    Ok([half, size("radius", radius)?])
}

#[pymethods]
impl PyCollider {
    /// A ball of this radius [m].
    #[staticmethod]
    #[pyo3(signature = (radius, **options))]
    fn ball<'py>(py: Python<'py>, radius: f64, options: Option<Options<'_, 'py>>) -> Built<'py> {
        PyColliderBuilder::build(py, ColliderBuilder::ball(size("radius", radius)?), options)
    }

    /// A cuboid of these half extents [m].
    #[staticmethod]
    #[pyo3(signature = (hx, hy, hz, **options))]
    fn cuboid<'py>(
        py: Python<'py>,
        hx: f64,
        hy: f64,
        hz: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let [hx, hy, hz] = sizes([("hx", hx), ("hy", hy), ("hz", hz)])?;
        PyColliderBuilder::build(py, ColliderBuilder::cuboid(hx, hy, hz), options)
    }

    /// A capsule along y: half the distance between the centres of its ends, and its radius [m].
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, **options))]
    fn capsule<'py>(
        py: Python<'py>,
        half_height: f64,
        radius: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        Self::capsule_y(py, half_height, radius, options)
    }

    /// A capsule along x: half the distance between the centres of its ends, and its radius [m].
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, **options))]
    fn capsule_x<'py>(
        py: Python<'py>,
        half_height: f64,
        radius: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let [h, r] = capsule_ends(half_height, radius)?;
        PyColliderBuilder::build(py, ColliderBuilder::capsule_x(h, r), options)
    }

    /// A capsule along y: half the distance between the centres of its ends, and its radius [m].
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, **options))]
    fn capsule_y<'py>(
        py: Python<'py>,
        half_height: f64,
        radius: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let [h, r] = capsule_ends(half_height, radius)?;
        PyColliderBuilder::build(py, ColliderBuilder::capsule_y(h, r), options)
    }

    /// A capsule along z: half the distance between the centres of its ends, and its radius [m].
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, **options))]
    fn capsule_z<'py>(
        py: Python<'py>,
        half_height: f64,
        radius: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let [h, r] = capsule_ends(half_height, radius)?;
        PyColliderBuilder::build(py, ColliderBuilder::capsule_z(h, r), options)
    }

    /// A cylinder along y: half its height, and its radius [m].
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, **options))]
    fn cylinder<'py>(
        py: Python<'py>,
        half_height: f64,
        radius: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let [h, r] = sizes([("half_height", half_height), ("radius", radius)])?;
        PyColliderBuilder::build(py, ColliderBuilder::cylinder(h, r), options)
    }

    /// A cone along y with its tip up: half its height, and its radius [m].
    #[staticmethod]
    #[pyo3(signature = (half_height, radius, **options))]
    fn cone<'py>(
        py: Python<'py>,
        half_height: f64,
        radius: f64,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let [h, r] = sizes([("half_height", half_height), ("radius", radius)])?;
        PyColliderBuilder::build(py, ColliderBuilder::cone(h, r), options)
    }

    /// All that is below a plane through the origin, which has this normal.
    #[staticmethod]
    #[pyo3(signature = (outward_normal, **options))]
    fn halfspace<'py>(
        py: Python<'py>,
        outward_normal: Triple,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let Some(normal) = outward_normal.finite("outward_normal")?.try_normalize() else {
            return Err(bad_value(format!("outward_normal has no direction: {:?}", outward_normal.0)));
        };
        PyColliderBuilder::build(py, ColliderBuilder::new(SharedShape::halfspace(normal)), options)
    }

    /// The convex hull of points, an array of shape (n, 3) [m].
    #[staticmethod]
    #[pyo3(signature = (points, **options))]
    fn convex_hull<'py>(
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let points = real_points(points, "points")?;
        let hull = without_panic(|| ColliderBuilder::convex_hull(&points)).ok().flatten();
        let none = || bad_value(format!("these {} points have no convex hull with a volume", points.len()));
        PyColliderBuilder::build(py, hull.ok_or_else(none)?, options)
    }

    /// A triangle mesh: vertices of shape (n, 3) [m], and three of their indices per triangle, of shape (m, 3).
    #[staticmethod]
    #[pyo3(signature = (vertices, indices, **options))]
    fn trimesh<'py>(
        py: Python<'py>,
        vertices: &Bound<'py, PyAny>,
        indices: &Bound<'py, PyAny>,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let (vertices, triangles) = mesh(vertices, indices, "indices")?;
        let mesh = without_panic(|| ColliderBuilder::trimesh(vertices, triangles))?;
        let mesh = mesh.map_err(|error| bad_value(format!("the triangle mesh is refused: {error}")))?;
        PyColliderBuilder::build(py, mesh, options)
    }

    /// A height field: heights of shape (rows, columns), rows along z and columns along x, and the size of all of it along x,
    /// y and z [m]; heights are times that along y. It is centred at the origin.
    #[staticmethod]
    #[pyo3(signature = (heights, scale, **options))]
    fn heightfield<'py>(
        py: Python<'py>,
        heights: &Bound<'py, PyAny>,
        scale: Triple,
        options: Option<Options<'_, 'py>>,
    ) -> Built<'py> {
        let grid = self::heights(heights)?;
        let [x, y, z] = scale.0;
        sizes([("scale[0]", x), ("scale[1]", y), ("scale[2]", z)])?;
        PyColliderBuilder::build(py, ColliderBuilder::heightfield(grid, scale.real()), options)
    }
}

/// Vertices and triangles over them.
pub fn mesh(
    vertices: &Bound<'_, PyAny>,
    triangles: &Bound<'_, PyAny>,
    name: &str,
) -> PyResult<(Vec<rapier3d::math::Vector>, Vec<[u32; 3]>)> {
    let (vertices, triangles) = (real_points(vertices, "vertices")?, indices::<3>(triangles, name)?);
    for (place, triangle) in triangles.iter().enumerate() {
        if let Some(index) = triangle.iter().find(|index| **index as usize >= vertices.len()) {
            let count = vertices.len();
            return Err(bad_value(format!(
                "{name}[{place}] refers to vertex {index}, but there are {count} vertices"
            )));
        }
    }
    Ok((vertices, triangles))
}
