//! Forces and impulses: on vertices, on the body as a whole, on its surface.

use super::body::{DeformableBody, finite};
use crate::error::BodyError;
use crate::math::{Vec3, inertia_about, solve_semidefinite};
use rapier3d::math::Vector;

impl DeformableBody {
    /// Adds a force \[N\], shared by the vertices in proportion to their masses: alone it moves them without deforming what
    /// they are of. Like rapier's, it persists until [`DeformableBody::reset_forces`].
    ///
    /// # Errors
    /// [`BodyError::NoSuchVertex`], [`BodyError::NotFinite`], [`BodyError::NoVertices`]; nothing is
    /// applied then.
    pub fn add_force(&mut self, vertices: &[usize], force: Vector) -> Result<(), BodyError> {
        let acceleration = self.per_mass("force", vertices, force)?;
        self.push(vertices.iter().map(|&vertex| (vertex, acceleration)))
    }

    /// Adds a force \[N\] on the whole body at a `point` of the world \[m\], as on a rigid body: shared by mass, with its moment
    /// about the present centre of mass. Forces stay as they are while the body turns; until [`DeformableBody::reset_forces`].
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn add_force_at_point(&mut self, force: Vector, point: Vector) -> Result<(), BodyError> {
        let accelerations = self.rigid_response("force", force, Some(point), Vector::ZERO)?;
        self.push(accelerations.into_iter().enumerate())
    }

    /// Adds a torque [N m] on the whole body, as forces `m α × r` about its present centre of mass, with the α that a rigid
    /// body would get. They stay as they are while the body turns; until [`DeformableBody::reset_forces`].
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn add_torque(&mut self, torque: Vector) -> Result<(), BodyError> {
        let accelerations = self.rigid_response("torque", Vector::ZERO, None, torque)?;
        self.push(accelerations.into_iter().enumerate())
    }

    /// Adds a traction \[Pa\], force per area at rest, on the surface triangles whose corners are all among the vertices, a
    /// third of each to a corner; until [`DeformableBody::reset_forces`]. Returns the area that it acts on \[m²\].
    ///
    /// # Errors
    /// As [`DeformableBody::add_force`]; [`BodyError::NoVertices`] too if no triangle lies between the vertices.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let bar = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.1), [10, 2, 2]);
    /// let mut bar = bar.pinned(|x| x.x < -0.499).build()?;
    /// let end = bar.vertices_where(|x| x.x > 0.499);
    /// let area = bar.add_traction(&end, Vector::X * 1.0e4)?;
    /// assert!((area - 0.2 * 0.2).abs() < 1.0e-8);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    pub fn add_traction(&mut self, vertices: &[usize], traction: Vector) -> Result<f64, BodyError> {
        let traction = finite("traction", traction)?;
        self.check("traction", vertices)?;
        let mut is_meant = vec![false; self.vertex_count()];
        vertices.iter().for_each(|&v| is_meant[v] = true);
        let model = self.model.clone();
        let mut forces = vec![Vec3::zeros(); is_meant.len()];
        let mut total = 0.0;
        for triangle in model.surface_triangles().map(|t| t.map(|v| v as usize)) {
            if triangle.iter().all(|&v| is_meant[v]) {
                let [a, b, c] = triangle.map(|v| Vec3::from(model.rest_position(v)));
                let area = 0.5 * (b - a).cross(&(c - a)).norm();
                triangle.iter().for_each(|&v| forces[v] += traction * (area / 3.0));
                total += area;
            }
        }
        if total == 0.0 {
            return Err(BodyError::NoVertices { quantity: "traction" });
        }
        let masses = self.masses()?;
        self.push(forces.into_iter().zip(masses).map(|(force, mass)| force / mass).enumerate())?;
        Ok(total)
    }

    /// Removes all forces added so far.
    pub fn reset_forces(&mut self) {
        self.wake_up();
        self.forces.clear();
    }

    /// Applies an impulse [N s] at once, shared by the vertices in proportion to their masses: all of them gain the same
    /// velocity.
    ///
    /// # Errors
    /// As [`DeformableBody::add_force`].
    pub fn apply_impulse(&mut self, vertices: &[usize], impulse: Vector) -> Result<(), BodyError> {
        let gain = self.per_mass("impulse", vertices, impulse)?;
        self.hit(vertices.iter().map(|&vertex| (vertex, gain)))
    }

    /// Applies an impulse [N s] to the whole body at a `point` of the world \[m\], as to a rigid body.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn apply_impulse_at_point(&mut self, impulse: Vector, point: Vector) -> Result<(), BodyError> {
        let gains = self.rigid_response("impulse", impulse, Some(point), Vector::ZERO)?;
        self.hit(gains.into_iter().enumerate())
    }

    /// Applies an impulse [N s] to the surface around a `point` of the world \[m\], where a foot or a wheel presses: shared by the
    /// vertices of the surface within `radius` \[m\] by their areas times 1 − (distance/radius)². A radius of less than 1.5 times
    /// the distance of the nearest one is taken as that.
    ///
    /// ```
    /// use foible3d::prelude::*;
    /// use rapier3d::prelude::*;
    /// let mut pad = DeformableBodyBuilder::cuboid(Vector::new(0.5, 0.1, 0.5), [10, 2, 10]).build()?;
    /// let (weight, dt) = (80.0 * 9.81, 1.0 / 60.0);
    /// pad.apply_impulse_on_surface(-Vector::Y * weight * dt, Vector::Y * 0.1, 0.15)?;
    /// assert!((pad.linvel()[1] * pad.mass() + 80.0 * 9.81 / 60.0).abs() < 1.0e-5);
    /// # Ok::<(), DeformableBodyError>(())
    /// ```
    ///
    /// # Errors
    /// [`BodyError::NotFinite`]; the radius as the first component of a vector. [`BodyError::NoVertices`] of a body without
    /// a surface.
    pub fn apply_impulse_on_surface(
        &mut self,
        impulse: Vector,
        point: Vector,
        radius: f32,
    ) -> Result<(), BodyError> {
        let (impulse, point) = (finite("impulse", impulse)?, finite("point", point)?);
        let radius = finite("radius", Vector::new(radius, 0.0, 0.0))?.x;
        let distances: Vec<f64> = (0..self.vertex_count())
            .map(|vertex| Ok((Vec3::from(self.position(vertex)?) - point).norm()))
            .collect::<Result<_, BodyError>>()?;
        let areas = self.vertex_areas();
        let on_surface = distances.iter().zip(&areas).filter(|(_, area)| **area > 0.0);
        let nearest = on_surface.map(|(distance, _)| *distance).fold(f64::INFINITY, f64::min);
        if !nearest.is_finite() {
            return Err(BodyError::NoVertices { quantity: "impulse" });
        }
        // A vertex at the point itself has all of it.
        let radius = radius.max(1.5 * nearest).max(f64::MIN_POSITIVE.sqrt());
        let share = |(distance, area): (&f64, &f64)| area * (1.0 - (distance / radius).powi(2)).max(0.0);
        let shares: Vec<f64> = distances.iter().zip(&areas).map(share).collect();
        let (total, masses) = (shares.iter().sum::<f64>(), self.masses()?);
        let gains = shares.iter().zip(masses).map(|(share, mass)| impulse * (share / (total * mass)));
        self.hit(gains.enumerate())
    }

    /// Applies an angular impulse [N m s] to the whole body, as to a rigid body.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`].
    pub fn apply_torque_impulse(&mut self, torque_impulse: Vector) -> Result<(), BodyError> {
        let gains = self.rigid_response("torque impulse", Vector::ZERO, None, torque_impulse)?;
        self.hit(gains.into_iter().enumerate())
    }

    /// Applies impulses away from a `centre` in the world \[m\], that of a blast: each vertex gains `speed` [m/s] at the centre,
    /// falling to nothing at `radius` \[m\] in proportion to the distance.
    ///
    /// # Errors
    /// [`BodyError::NotFinite`]; speed and radius as the first two components.
    pub fn apply_radial_impulse(&mut self, centre: Vector, speed: f32, radius: f32) -> Result<(), BodyError> {
        let centre = finite("centre", centre)?;
        let scales = finite("speed and radius", Vector::new(speed, radius, 0.0))?;
        let gain = |vertex: usize| {
            let away = Vec3::from(self.position(vertex)?) - centre;
            let share = (1.0 - away.norm() / scales.y).max(0.0);
            // None at the centre itself, and none of a radius of nothing.
            let gain = away.try_normalize(0.0).filter(|_| scales.y > 0.0).unwrap_or_default();
            Ok((vertex, gain * (share * scales.x)))
        };
        let gains = (0..self.vertex_count()).map(gain).collect::<Result<Vec<_>, BodyError>>()?;
        self.hit(gains.into_iter())
    }

    /// Adds forces, given as accelerations of vertices [m/s²].
    fn push(&mut self, accelerations: impl Iterator<Item = (usize, Vec3)>) -> Result<(), BodyError> {
        self.wake_up();
        self.forces.resize(self.state.x.len(), Vec3::zeros());
        for (vertex, acceleration) in accelerations {
            let node = self.node(vertex)?;
            let mass = self.node_mass(node);
            self.forces[node] += acceleration * mass;
        }
        Ok(())
    }

    /// Adds to velocities of vertices [m/s].
    fn hit(&mut self, gains: impl Iterator<Item = (usize, Vec3)>) -> Result<(), BodyError> {
        if !self.takes_velocities() {
            return Ok(());
        }
        for (vertex, gain) in gains {
            let node = self.node(vertex)?;
            self.state.v[node] += gain;
        }
        Ok(())
    }

    /// Masses by vertex \[kg\].
    fn masses(&self) -> Result<Vec<f64>, BodyError> {
        (0..self.vertex_count()).map(|vertex| Ok(self.node_mass(self.node(vertex)?))).collect()
    }

    fn check(&self, quantity: &'static str, vertices: &[usize]) -> Result<(), BodyError> {
        vertices.iter().try_for_each(|&vertex| self.node(vertex).map(|_| ()))?;
        if vertices.is_empty() { Err(BodyError::NoVertices { quantity }) } else { Ok(()) }
    }

    /// What a total is over the mass of vertices; each counts as often as it is named.
    fn per_mass(&self, quantity: &'static str, vertices: &[usize], total: Vector) -> Result<Vec3, BodyError> {
        self.check(quantity, vertices)?;
        let mut mass = 0.0;
        for &vertex in vertices {
            mass += self.node_mass(self.node(vertex)?);
        }
        Ok(finite(quantity, total)? / mass)
    }

    /// What the vertices of a rigid body of this shape and mass gain from a force at a point (the centre of mass if there is
    /// none) and a torque, or from impulses.
    fn rigid_response(
        &self,
        quantity: &'static str,
        force: Vector,
        point: Option<Vector>,
        torque: Vector,
    ) -> Result<Vec<Vec3>, BodyError> {
        let (force, torque) = (finite(quantity, force)?, finite(quantity, torque)?);
        let centre = self.weighted_mean(&self.state.x);
        let point = point.map_or(Ok(centre), |point| finite("point", point))?;
        let inertia = inertia_about(&centre, &self.state.x, &self.masses);
        let angular = solve_semidefinite(&inertia, &(torque + (point - centre).cross(&force)));
        let linear = force / self.mass();
        let gain = |vertex: usize| {
            let node = self.node(vertex)?;
            Ok(linear + angular.cross(&(self.state.x[node] - centre)))
        };
        (0..self.vertex_count()).map(gain).collect()
    }
}
