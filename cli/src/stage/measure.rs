//! What can be measured of a scene at one time.

use super::Stage;
use crate::scene::Quantity;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Something with a name.
#[derive(Clone, Copy, Debug)]
enum Thing {
    Rigid(RigidBodyHandle, ColliderHandle),
    Soft(DeformableBodyHandle),
    Probe(DeformableBodyHandle, usize),
}

impl Stage {
    fn thing(&self, name: &str) -> Option<Thing> {
        let rigid = self.rigid.iter().find(|r| r.0 == name).map(|r| Thing::Rigid(r.1, r.2));
        let soft = || self.deformable.iter().find(|d| d.0 == name).map(|d| Thing::Soft(d.1));
        let probe = || self.probes.iter().find(|p| p.0 == name).map(|p| Thing::Probe(p.1, p.2));
        rigid.or_else(soft).or_else(probe)
    }

    /// Of a named thing, of its centre of mass or where it is, the position \[m\]; NaN if it is not there.
    pub fn position(&self, name: &str) -> [f64; 3] {
        match self.thing(name) {
            Some(Thing::Rigid(body, _)) => {
                self.physics.bodies[body].center_of_mass().to_array().map(f64::from)
            }
            Some(Thing::Soft(body)) => self.world.bodies[body].center_of_mass(),
            Some(Thing::Probe(body, vertex)) => {
                self.world.bodies[body].position(vertex).unwrap_or([f64::NAN; 3])
            }
            None => [f64::NAN; 3],
        }
    }

    /// The velocity there \[m/s\].
    pub fn velocity(&self, name: &str) -> [f64; 3] {
        match self.thing(name) {
            Some(Thing::Rigid(body, _)) => self.physics.bodies[body].linvel().to_array().map(f64::from),
            Some(Thing::Soft(body)) => self.world.bodies[body].linvel(),
            Some(Thing::Probe(body, vertex)) => {
                self.world.bodies[body].velocity(vertex).unwrap_or([f64::NAN; 3])
            }
            None => [f64::NAN; 3],
        }
    }

    /// The present value of a quantity of a named thing, "all" for energies of the whole scene; NaN if it has none.
    pub fn measure(&self, quantity: Quantity, of: &str, on: Option<&str>) -> f64 {
        let [x, y, z] = self.position(of);
        match quantity {
            Quantity::X => x,
            Quantity::Y => y,
            Quantity::Z => z,
            Quantity::VelocityY => self.velocity(of)[1],
            Quantity::Speed => match self.thing(of) {
                Some(Thing::Soft(body)) => self.world.bodies[body].max_speed(),
                _ => size(self.velocity(of)),
            },
            Quantity::Force => self.force(of, on)[1],
            Quantity::ForceSize => size(self.force(of, on)),
            Quantity::SlipSpeed => self.slip_speed(of, on),
            Quantity::Tilt => self.tilt(of),
            Quantity::Drift => self
                .start
                .get(of)
                .map_or(f64::NAN, |start| (x - start.position[0]).hypot(z - start.position[2])),
            Quantity::CableTension | Quantity::CableLength => self.of_cable(quantity, of),
            Quantity::Signal => self.world.actuators.get(of).map_or(f64::NAN, |signal| signal.value()),
            // A difference over time: the run's.
            Quantity::AccelerationG => f64::NAN,
            energy if energy.is_energy() => self.energy(energy, of),
            of_soft => match self.thing(of) {
                Some(Thing::Soft(body)) => self.of_soft(of_soft, body),
                _ => f64::NAN,
            },
        }
    }

    fn of_cable(&self, quantity: Quantity, of: &str) -> f64 {
        let Some((_, handle)) = self.cables.iter().find(|(name, _)| name == of) else { return f64::NAN };
        match quantity {
            Quantity::CableTension => self.world.bodies.cable(*handle).map_or(f64::NAN, |c| c.tension()),
            _ => self.world.bodies.cable_length(*handle, &self.physics.bodies),
        }
    }

    fn of_soft(&self, quantity: Quantity, handle: DeformableBodyHandle) -> f64 {
        let body = &self.world.bodies[handle];
        match quantity {
            Quantity::VolumeRatio => body.volume() / body.model().volume(),
            Quantity::Penetration => {
                let pairs = self.world.pair_contacts().iter();
                let own = pairs.filter(|c| c.body1 == handle || c.body2 == handle).map(|c| -c.gap);
                self.world.contacts_of(handle).map(|c| -c.gap).chain(own).fold(0.0, f64::max)
            }
            Quantity::Stress | Quantity::Strain => largest_of_elements(quantity, body).0,
            Quantity::Deformation => deformation(body),
            Quantity::CavityPressure => {
                let pressures =
                    (0..body.model().cavities().len()).filter_map(|k| body.cavity_pressure(k).ok());
                pressures.fold(f64::NAN, f64::max)
            }
            Quantity::CavityVolume => {
                (0..body.model().cavities().len()).filter_map(|k| body.cavity_volume(k).ok()).sum()
            }
            _ => f64::NAN,
        }
    }

    /// The largest stress or strain of a soft body, and the middle of the element that has it \[m\].
    pub fn measure_with_place(&self, quantity: Quantity, of: &str) -> (f64, [f64; 3]) {
        match self.thing(of) {
            Some(Thing::Soft(body)) => largest_of_elements(quantity, &self.world.bodies[body]),
            _ => (f64::NAN, [f64::NAN; 3]),
        }
    }

    /// How fast the contacts between two bodies slide, the mean by their forces.
    fn slip_speed(&self, of: &str, on: Option<&str>) -> f64 {
        let (mut slid, mut forces) = (0.0, 0.0);
        let mut add = |velocity: Vector, normal: Vector, force: Vector| {
            let along = velocity - normal * velocity.dot(normal);
            slid += f64::from(along.length() * force.length());
            forces += f64::from(force.length());
        };
        let point = |body: DeformableBodyHandle, vertices: &[usize; 3], weights: &[f64; 3]| {
            let velocity =
                |v: &usize| self.world.bodies[body].velocity(*v).unwrap_or([0.0; 3]).map(|c| c as f32);
            vertices.iter().zip(weights).map(|(v, w)| Vector::from(velocity(v)) * *w as f32).sum::<Vector>()
        };
        match (self.thing(of), on.and_then(|on| self.thing(on))) {
            (Some(Thing::Soft(soft)), Some(Thing::Rigid(body, collider)))
            | (Some(Thing::Rigid(body, collider)), Some(Thing::Soft(soft))) => {
                for c in self.world.contacts_of(soft).filter(|c| c.collider == collider) {
                    let other = self.physics.bodies[body].velocity_at_point(c.point);
                    add(point(soft, &c.vertices, &c.weights) - other, c.normal, c.force);
                }
            }
            (Some(Thing::Soft(one)), Some(Thing::Soft(other))) => {
                let pair = [one, other];
                let between =
                    |c: &&DeformablePairContact| [c.body1, c.body2] == pair || [c.body2, c.body1] == pair;
                for c in self.world.pair_contacts().iter().filter(between) {
                    let first = point(c.body1, &c.vertices[0], &c.weights[0]);
                    add(first - point(c.body2, &c.vertices[1], &c.weights[1]), c.normal, c.force);
                }
            }
            _ => {}
        }
        if forces > 0.0 { slid / forces } else { 0.0 }
    }

    /// Degrees between the upright axis of a body and where that was at the start.
    fn tilt(&self, of: &str) -> f64 {
        let up = |rotation: Rotation| rotation * Vector::Y;
        match (self.rotation(of), self.start.get(of)) {
            (Some(now), Some(start)) => f64::from(up(now).angle_between(up(start.rotation)).to_degrees()),
            _ => f64::NAN,
        }
    }

    /// How a body is turned.
    pub(super) fn rotation(&self, of: &str) -> Option<Rotation> {
        match self.thing(of)? {
            Thing::Rigid(body, _) => Some(*self.physics.bodies[body].rotation()),
            Thing::Soft(body) => Some(self.world.bodies[body].pose().rotation),
            Thing::Probe(..) => None,
        }
    }

    fn energy(&self, quantity: Quantity, of: &str) -> f64 {
        if of == "all" {
            let moving = self.rigid.iter().filter(|r| self.physics.bodies[r.1].is_dynamic()).map(|r| &r.0);
            return moving
                .chain(self.deformable.iter().map(|d| &d.0))
                .map(|name| self.energy(quantity, name))
                .sum();
        }
        let gravity = self.physics.gravity.to_array().map(f64::from);
        let height_of = |at: [f64; 3]| -at.iter().zip(gravity).map(|(x, g)| x * g).sum::<f64>();
        let height = height_of(self.position(of));
        let [kinetic, elastic, gravity] = match self.thing(of) {
            Some(Thing::Rigid(body, _)) => {
                let body = &self.physics.bodies[body];
                [f64::from(body.kinetic_energy()), 0.0, f64::from(body.mass()) * height]
            }
            Some(Thing::Soft(body)) => {
                let body = &self.world.bodies[body];
                let own = [body.kinetic_energy(), body.elastic_energy(), body.mass() * height];
                self.bones_of(of).fold(own, |[kinetic, elastic, gravity], bone| {
                    let height = height_of(bone.center_of_mass().to_array().map(f64::from));
                    let mass = f64::from(bone.mass());
                    [kinetic + f64::from(bone.kinetic_energy()), elastic, gravity + mass * height]
                })
            }
            _ => [f64::NAN; 3],
        };
        match quantity {
            Quantity::KineticEnergy => kinetic,
            Quantity::ElasticEnergy => elastic,
            Quantity::GravityEnergy => gravity,
            Quantity::StepLoss => self.step_loss(of),
            Quantity::EnergyBalance => kinetic + elastic + gravity + self.step_loss(of),
            _ => kinetic + elastic + gravity,
        }
    }

    /// Force \[N\] that one named body has from another, one of them soft.
    pub fn force(&self, of: &str, on: Option<&str>) -> [f64; 3] {
        let both = (self.thing(of), on.and_then(|on| self.thing(on)));
        let (Some(of), Some(on)) = both else { return [0.0; 3] };
        let force = match (of, on) {
            (Thing::Soft(body), Thing::Soft(other)) => self.world.pair_force(body, other),
            (Thing::Soft(body), Thing::Rigid(_, collider)) => self.world.contact_force(body, collider),
            // As it stands in scene files: the force that soft bodies have of the rigid one that is named first.
            (Thing::Rigid(_, collider), Thing::Soft(body)) => self.world.contact_force(body, collider),
            _ => Vector::ZERO,
        };
        force.to_array().map(f64::from)
    }
}

pub(crate) fn size([x, y, z]: [f64; 3]) -> f64 {
    x.hypot(y).hypot(z)
}

/// The largest distance of a vertex from the shape at rest, that placed to fit.
fn deformation(body: &DeformableBody) -> f64 {
    let (pose, rest) = (body.pose(), body.model());
    let distance = |vertex: usize| {
        let at = body.position(vertex).unwrap_or([f64::NAN; 3]);
        let should = pose.transform_point(Vector::from(rest.rest_position(vertex).map(|c| c as f32)));
        let off = at.iter().zip(should.to_array()).map(|(x, s)| x - f64::from(s));
        off.map(|d| d * d).sum::<f64>().sqrt()
    };
    (0..body.vertex_count()).map(distance).fold(0.0, |a, d| if d.is_nan() { d } else { a.max(d) })
}

/// The largest von Mises stress or principal strain, and the middle of its tetrahedron; zero and NaN where there is none.
fn largest_of_elements(quantity: Quantity, body: &DeformableBody) -> (f64, [f64; 3]) {
    let principal = |strain: [[f64; 3]; 3]| {
        let (values, _) = DeformableStress { cauchy: strain }.principal();
        values.into_iter().map(f64::abs).fold(0.0, f64::max)
    };
    let values: Vec<f64> = match quantity {
        Quantity::Stress => body.stresses().iter().map(DeformableStress::von_mises).collect(),
        _ => body.strains().into_iter().map(principal).collect(),
    };
    let largest = values.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    let Some((element, value)) = largest else { return (0.0, [f64::NAN; 3]) };
    let mut middle = [0.0; 3];
    for vertex in body.model().tetrahedra().nth(element).into_iter().flatten() {
        let position = body.position(vertex as usize).unwrap_or([f64::NAN; 3]);
        middle.iter_mut().zip(position).for_each(|(m, x)| *m += 0.25 * x);
    }
    (*value, middle)
}
