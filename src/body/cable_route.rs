//! Cables are laid through bodies, found and taken away.

use super::cable::{CablePoint, DeformableCable, DeformableCableBuilder, Guide};
use super::handle::{DeformableBodyHandle, DeformableCableHandle};
use super::set::DeformableBodySet;
use crate::error::{BodyError, DeformableBodyError};
use crate::math::{Pose64, Vec3, from_real, to_real};
use nalgebra::Matrix3;
use rapier3d::dynamics::RigidBodyHandle;
use rapier3d::math::Vector;

/// How far outside of its body, in shares of a tetrahedron, a point that a user names may be: rounding of `f32`.
const OUTSIDE: f64 = 1.0e-4;

impl DeformableBodySet {
    /// Lays a cable through bodies: tendons of soft fingers, ropes over pulleys, hoists. Its tension is one unknown in the same solve as
    /// contacts and joints.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let (mut physics, mut deformables) = (PhysicsWorld::new(), DeformableWorld::new());
    /// // A soft finger 12 cm long that is held at one end, with a tendon 1 cm below its axis.
    /// let finger = DeformableBodyBuilder::cuboid(Vector::new(0.06, 0.02, 0.02), [12, 4, 4])
    ///     .material(DeformableMaterial::new(1.0e6, 0.4).mass_damping(20.0));
    /// let finger = deformables.insert(finger)?;
    /// let body = &mut deformables.bodies[finger];
    /// let base = body.vertices_where(|x| x.x < -0.0599);
    /// for vertex in base {
    ///     body.pin(vertex)?;
    /// }
    /// let at = |x: f32| CablePoint::Inside(finger, Vector::new(x, -0.01, 0.0));
    /// let points = (0..=6).rev().map(|k| at(-0.0599 + 0.02 * k as f32 * 0.998));
    /// // Tied to the tip, drawn at the base with 2 N.
    /// let tendon = DeformableCableBuilder::new(points).tension(2.0);
    /// let tendon = deformables.bodies.insert_cable(tendon)?;
    /// for _ in 0..120 {
    ///     deformables.step(&mut physics);
    /// }
    /// let tensions = deformables.bodies.cable(tendon).unwrap().tensions();
    /// assert!(tensions.iter().all(|t| (t - 2.0).abs() < 1.0e-9));
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// [`BodyError::BadCable`] for numbers that no cable has, fewer than two points, or none on a deformable body;
    /// [`HandleError::NoSuchBody`](crate::HandleError::NoSuchBody); [`BodyError::NoSuchVertex`]; [`BodyError::NotInside`] for a point that
    /// no tetrahedron holds; [`BodyError::NotFinite`].
    pub fn insert_cable(
        &mut self,
        cable: DeformableCableBuilder,
    ) -> Result<DeformableCableHandle, DeformableBodyError> {
        cable.check()?;
        let route = cable.points.iter().map(|point| self.guide(*point)).collect::<Result<Vec<_>, _>>()?;
        if !route.iter().any(|guide| matches!(guide, Guide::Soft(..))) {
            let what = "none of its points is on a deformable body";
            return Err(BodyError::BadCable { what }.into());
        }
        let handle = DeformableCableHandle(self.cabled);
        self.cabled += 1;
        self.cables.insert(handle, DeformableCable::new(route, &cable));
        Ok(handle)
    }

    fn guide(&self, point: CablePoint) -> Result<Guide, DeformableBodyError> {
        let body = |handle: DeformableBodyHandle| self.get(handle).ok_or_else(|| handle.no_such_body());
        Ok(match point {
            CablePoint::World(at) => Guide::World(finite(at)?),
            CablePoint::RigidBody(handle, at) => Guide::Rigid(handle, finite(at)?),
            CablePoint::Vertex(handle, vertex) => {
                let node = body(handle)?.node(vertex)? as u32;
                Guide::Soft(handle, [node, 0, 0, 0], [1.0, 0.0, 0.0, 0.0])
            }
            CablePoint::Inside(handle, at) => {
                let (body, at) = (body(handle)?, finite(at)?);
                let tetrahedra = body.model.tetrahedra.iter();
                let shares = tetrahedra.map(|nodes| (nodes, shares(nodes, &body.state.x, &at)));
                let inside = shares.max_by(|(_, a), (_, b)| least(a).total_cmp(&least(b)));
                match inside.filter(|(_, weights)| least(weights) >= -OUTSIDE) {
                    Some((nodes, weights)) => Guide::Soft(handle, *nodes, weights),
                    None => return Err(BodyError::NotInside { point: to_real(&at) }.into()),
                }
            }
        })
    }

    /// Takes a cable away; `None` if it was removed before.
    pub fn remove_cable(&mut self, handle: DeformableCableHandle) -> Option<DeformableCable> {
        let cable = self.cables.remove(&handle)?;
        for body in cable.bodies() {
            if let Some(body) = self.get_mut(body) {
                body.wake_up();
            }
        }
        Some(cable)
    }

    /// The cable of a handle.
    pub fn cable(&self, handle: DeformableCableHandle) -> Option<&DeformableCable> {
        self.cables.get(&handle)
    }

    /// The cable of a handle, to be changed.
    pub fn cable_mut(&mut self, handle: DeformableCableHandle) -> Option<&mut DeformableCable> {
        self.cables.get_mut(&handle)
    }

    /// All cables, oldest first.
    pub fn cables(&self) -> impl Iterator<Item = (DeformableCableHandle, &DeformableCable)> {
        self.cables.iter().map(|(handle, cable)| (*handle, cable))
    }

    /// All cables, to be changed.
    pub(crate) fn cables_mut(
        &mut self,
    ) -> impl Iterator<Item = (DeformableCableHandle, &mut DeformableCable)> {
        self.cables.iter_mut().map(|(handle, cable)| (*handle, cable))
    }

    /// Finds where the points of a cable are; false if something that carries them is gone.
    pub(crate) fn locate(
        &self,
        cable: &DeformableCable,
        pose: impl Fn(RigidBodyHandle) -> Option<Pose64>,
        points: &mut Vec<Vec3>,
    ) -> bool {
        points.clear();
        points.extend(cable.route.iter().map_while(|guide| match guide {
            Guide::World(point) => Some(*point),
            Guide::Rigid(handle, point) => Some(pose(*handle)?.transform(point)),
            Guide::Soft(handle, nodes, weights) => {
                let x = &self.get(*handle)?.state.x;
                Some(nodes.iter().zip(weights).map(|(n, w)| x[*n as usize] * *w).sum())
            }
        }));
        points.len() == cable.route.len()
    }
}

fn finite(point: Vector) -> Result<Vec3, BodyError> {
    super::body::finite("point of a cable", point)?;
    Ok(from_real(point))
}

/// Shares of the corners of a tetrahedron in a point; NaN of a flat one.
fn shares(nodes: &[u32; 4], x: &[Vec3], at: &Vec3) -> [f64; 4] {
    let [a, b, c, d] = nodes.map(|n| x[n as usize]);
    let edges = Matrix3::from_columns(&[b - a, c - a, d - a]);
    let Some(inverse) = edges.try_inverse() else { return [f64::NAN; 4] };
    let s = inverse * (at - a);
    [1.0 - s.sum(), s.x, s.y, s.z]
}

/// The least of them; of what has none, less than any.
fn least(shares: &[f64; 4]) -> f64 {
    let least = shares.iter().copied().fold(f64::INFINITY, f64::min);
    if shares.iter().any(|s| s.is_nan()) { f64::NEG_INFINITY } else { least }
}
