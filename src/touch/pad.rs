//! A pad of taxels on the surface of a body.

use super::taxels::share_out;
use crate::body::{DeformableBody, DeformableBodyHandle};
use crate::error::{BodyError, DeformableBodyError};
use crate::math::{Pose64, Vec3, from_real, to_real};
use crate::pipeline::DeformableWorld;
use rapier3d::math::{Pose, Vector};

/// A grid of taxels over a part of a body's surface, seen along the z axis of a frame, with a marker in the middle of each.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
/// // A pad 4 cm wide and 1 cm thick on a table, and a ball of 100 g on it.
/// let pad = DeformableBodyBuilder::cuboid(Vector::new(0.02, 0.005, 0.02), [16, 4, 16])
///     .material(DeformableMaterial::new(1.0e5, 0.4).mass_damping(20.0));
/// let pad = deformables.insert(pad)?;
/// let body = &mut deformables.bodies[pad];
/// for vertex in body.vertices_where(|x| x.y < -0.0049) {
///     body.pin(vertex)?;
/// }
/// let ball = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.0149);
/// physics.insert(ball, ColliderBuilder::ball(0.01).mass(0.1));
/// // 8 by 8 taxels on its upper face: z of the frame points up.
/// let up = Pose::new(Vector::Y * 0.005, Vector::X * -std::f32::consts::FRAC_PI_2);
/// let skin = TactilePad::new(&deformables.bodies[pad], up, [0.02, 0.02], [8, 8])?;
/// for _ in 0..240 {
///     deformables.step(&mut physics);
/// }
/// let reading = skin.read(&deformables, pad)?;
/// assert!((reading.total()[2] + 0.1 * 9.81).abs() < 0.01);
/// assert!(reading.pressure(3, 3) > 10.0 * reading.pressure(0, 0));
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct TactilePad {
    taxels: [usize; 2],
    /// In the body's rest frame.
    frame: Pose64,
    /// Vertex, taxel, and the vertex's share in it; of each vertex they sum to one.
    shares: Vec<(u32, u32, f64)>,
    vertices: usize,
    areas: Vec<f64>,
    markers: Vec<Option<Marker>>,
}

/// A material point of the surface.
#[derive(Clone, Copy, Debug)]
struct Marker {
    vertices: [usize; 3],
    weights: [f64; 3],
    /// In the pad's frame, at rest.
    rest: Vec3,
}

/// What a pad felt in a step.
#[derive(Clone, Debug, PartialEq)]
pub struct TactileReading {
    taxels: [usize; 2],
    /// Force on the body by taxels, row by row, in the frame of the pad \[N\]: z is away from it, so that what presses is negative.
    pub forces: Vec<[f64; 3]>,
    /// Area of the surface in each taxel at rest \[m²\]; zero where there is none.
    pub areas: Vec<f64>,
}

/// Cosine of the angle to the frame's z beyond which a triangle is not seen. 70°: flanks are not projected to slivers.
const FACING: f64 = 0.342;

impl TactilePad {
    /// Taxels, so many along x and along y, over what of the body's surface is within `half_extents` \[m\] along the x and y axes of a
    /// frame and turned towards its z axis; the frame is in the body's rest frame, as [`DeformableBody::pose`] leads it.
    /// Vertices at the rim count with what there is of them in the pad.
    ///
    /// # Errors
    /// [`BodyError::NoVertices`] if no surface is there; [`BodyError::NotFinite`], [`BodyError::NoRotation`],
    /// [`BodyError::BadPad`] for a grid without taxels, of more than a million, or without extent.
    pub fn new(
        body: &DeformableBody,
        frame: Pose,
        half_extents: [f32; 2],
        taxels: [usize; 2],
    ) -> Result<Self, BodyError> {
        crate::body::check_pose("frame of a pad", &frame)?;
        let count = taxels[0].checked_mul(taxels[1]).filter(|count| (1..=MOST_TAXELS).contains(count));
        let Some(count) = count else {
            return Err(BodyError::BadPad { what: "it has no taxels, or too many" });
        };
        if !half_extents.iter().all(|half| half.is_finite() && *half > 0.0) {
            return Err(BodyError::BadPad { what: "its extents are not positive" });
        }
        let frame = Pose64::from_real(&frame);
        let mut pad = Self {
            taxels,
            frame,
            shares: Vec::new(),
            vertices: body.vertex_count(),
            areas: vec![0.0; count],
            markers: vec![None; count],
        };
        let rest = |v: u32| frame.inverse_transform(&Vec3::from(body.model().rest_position(v as usize)));
        for triangle in body.model().surface_triangles() {
            pad.add_triangle(triangle, triangle.map(rest), half_extents.map(f64::from));
        }
        pad.shares.sort_unstable_by_key(|share| (share.0, share.1));
        for own in pad.shares.chunk_by_mut(|a, b| a.0 == b.0) {
            let sum: f64 = own.iter().map(|share| share.2).sum();
            own.iter_mut().for_each(|share| share.2 /= sum);
        }
        if pad.shares.is_empty() { Err(BodyError::NoVertices { quantity: "pad" }) } else { Ok(pad) }
    }

    fn add_triangle(&mut self, vertices: [u32; 3], corners: [Vec3; 3], half: [f64; 2]) {
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let area = 0.5 * normal.norm();
        if !(normal.z > FACING * 2.0 * area) {
            return;
        }
        let cells = self.taxels;
        let in_cells = |p: Vec3| [0, 1].map(|k| (p[k] + half[k]) / (2.0 * half[k]) * cells[k] as f64);
        let flat = corners.map(in_cells);
        share_out(flat, cells, |[column, row], shares| {
            let taxel = row * cells[0] + column;
            self.areas[taxel] += area * shares.iter().sum::<f64>();
            self.shares.extend((0..3).map(|k| (vertices[k], taxel as u32, area * shares[k])));
            let weights = inside(&flat, [column as f64 + 0.5, row as f64 + 0.5]);
            if let Some(weights) = weights {
                let rest = (0..3).map(|k| corners[k] * weights[k]).sum();
                self.markers[taxel] = Some(Marker { vertices: vertices.map(|v| v as usize), weights, rest });
            }
        });
    }

    /// Number of taxels along x and y.
    pub fn taxels(&self) -> [usize; 2] {
        self.taxels
    }

    /// Where the frame of the pad is, led by the body's pose as a whole.
    pub fn frame(&self, body: &DeformableBody) -> Pose {
        body.pose() * self.frame.to_real()
    }

    /// What the contacts of the last step do to the taxels of a body, in the frame that the body's pose leads.
    ///
    /// # Errors
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody); [`BodyError::WrongSize`] for a body of another mesh.
    pub fn read(
        &self,
        world: &DeformableWorld,
        body: DeformableBodyHandle,
    ) -> Result<TactileReading, DeformableBodyError> {
        let frame = self.frame(self.known(world, body)?);
        self.read_in(world, body, &frame)
    }

    /// The same in a frame of the user's, such as that of the mount.
    ///
    /// # Errors
    /// As [`TactilePad::read`].
    pub fn read_in(
        &self,
        world: &DeformableWorld,
        body: DeformableBodyHandle,
        frame: &Pose,
    ) -> Result<TactileReading, DeformableBodyError> {
        self.known(world, body)?;
        let mut loads = vec![Vec3::zeros(); self.vertices];
        world.for_each_contact_force(body, |_, _, force, vertices, weights| {
            for (vertex, weight) in vertices.iter().zip(weights) {
                if let Some(load) = loads.get_mut(*vertex) {
                    *load += from_real(force) * *weight;
                }
            }
        });
        let turn = Pose64::from_real(frame).rotation.transpose();
        let mut forces = vec![Vec3::zeros(); self.areas.len()];
        for (vertex, taxel, share) in &self.shares {
            forces[*taxel as usize] += loads[*vertex as usize] * *share;
        }
        let forces = forces.iter().map(|force| (turn * force).into()).collect();
        Ok(TactileReading { taxels: self.taxels, forces, areas: self.areas.clone() })
    }

    /// Where the markers are, row by row; `None` where there is no surface.
    ///
    /// # Errors
    /// [`BodyError::WrongSize`] for a body of another mesh.
    pub fn markers(&self, body: &DeformableBody) -> Result<Vec<Option<Vector>>, BodyError> {
        let now = self.marker_points(body)?;
        Ok(now.into_iter().map(|point| point.map(|p| to_real(&p))).collect())
    }

    /// How far the markers have moved in a frame, such as that of the mount, from where they are in it at rest \[m\]; `None` where
    /// there is no surface.
    ///
    /// # Errors
    /// As [`TactilePad::markers`].
    pub fn marker_displacements(
        &self,
        body: &DeformableBody,
        frame: &Pose,
    ) -> Result<Vec<Option<Vector>>, BodyError> {
        let (now, frame) = (self.marker_points(body)?, Pose64::from_real(frame));
        let moved = |(point, marker): (Option<Vec3>, &Option<Marker>)| {
            Some(to_real(&(frame.inverse_transform(&point?) - (*marker)?.rest)))
        };
        Ok(now.into_iter().zip(&self.markers).map(moved).collect())
    }

    fn marker_points(&self, body: &DeformableBody) -> Result<Vec<Option<Vec3>>, BodyError> {
        self.check(body)?;
        let point = |marker: &Marker| -> Result<Vec3, BodyError> {
            let mut sum = Vec3::zeros();
            for (vertex, weight) in marker.vertices.iter().zip(marker.weights) {
                sum += Vec3::from(body.position(*vertex)?) * weight;
            }
            Ok(sum)
        };
        self.markers.iter().map(|marker| marker.as_ref().map(point).transpose()).collect()
    }

    fn known<'a>(
        &self,
        world: &'a DeformableWorld,
        handle: DeformableBodyHandle,
    ) -> Result<&'a DeformableBody, DeformableBodyError> {
        let body = world.bodies.get(handle).ok_or_else(|| handle.no_such_body())?;
        self.check(body)?;
        Ok(body)
    }

    fn check(&self, body: &DeformableBody) -> Result<(), BodyError> {
        let vertices = body.vertex_count();
        let fits = vertices == self.vertices;
        if fits { Ok(()) } else { Err(BodyError::WrongSize { vertices, expected: self.vertices }) }
    }
}

/// Taxels of a pad, at the most.
const MOST_TAXELS: usize = 1 << 20;

/// Shares of a triangle's corners in a point, if it is inside.
fn inside([a, b, c]: &[[f64; 2]; 3], at: [f64; 2]) -> Option<[f64; 3]> {
    let cross = |p: &[f64; 2], q: &[f64; 2], r: &[f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    let whole = cross(a, b, c);
    let weights = [cross(&at, b, c), cross(a, &at, c), cross(a, b, &at)].map(|part| part / whole);
    weights.iter().all(|w| *w >= -1.0e-12).then_some(weights)
}

impl TactileReading {
    fn taxel(&self, column: usize, row: usize) -> usize {
        assert!(column < self.taxels[0] && row < self.taxels[1], "no taxel ({column}, {row})");
        row * self.taxels[0] + column
    }

    /// Normal force per area on a taxel \[Pa\]; zero where there is no surface.
    ///
    /// # Panics
    /// If there is no such taxel; also [`TactileReading::shear`].
    pub fn pressure(&self, column: usize, row: usize) -> f64 {
        let taxel = self.taxel(column, row);
        if self.areas[taxel] > 0.0 { -self.forces[taxel][2] / self.areas[taxel] } else { 0.0 }
    }

    /// Force per area along the pad on a taxel \[Pa\].
    pub fn shear(&self, column: usize, row: usize) -> [f64; 2] {
        let (taxel, [x, y, _]) = (self.taxel(column, row), self.forces[self.taxel(column, row)]);
        if self.areas[taxel] > 0.0 { [x, y].map(|f| f / self.areas[taxel]) } else { [0.0; 2] }
    }

    /// Sum over the taxels \[N\]: of all contacts whose vertices the pad has.
    pub fn total(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        self.forces.iter().for_each(|force| (0..3).for_each(|k| sum[k] += force[k]));
        sum
    }
}
