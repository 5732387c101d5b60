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
            Quantity::Tilt => self.tilt(of),
            Quantity::Drift => self
                .start
                .get(of)
                .map_or(f64::NAN, |start| (x - start.position[0]).hypot(z - start.position[2])),
            // A difference over time: the run's.
            Quantity::AccelerationG => f64::NAN,
            energy if energy.is_energy() => self.energy(energy, of),
            of_soft => match self.thing(of) {
                Some(Thing::Soft(body)) => self.of_soft(of_soft, body),
                _ => f64::NAN,
            },
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
            Quantity::Stress => body.stresses().iter().map(DeformableStress::von_mises).fold(0.0, f64::max),
            Quantity::Strain => {
                let strains = body.strains().into_iter().map(|strain| {
                    let (values, _) = DeformableStress { cauchy: strain }.principal();
                    values.into_iter().map(f64::abs).fold(0.0, f64::max)
                });
                strains.fold(0.0, f64::max)
            }
            _ => f64::NAN,
        }
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
        let height = {
            let gravity = self.physics.gravity.to_array().map(f64::from);
            -self.position(of).iter().zip(gravity).map(|(x, g)| x * g).sum::<f64>()
        };
        let [kinetic, elastic, gravity] = match self.thing(of) {
            Some(Thing::Rigid(body, _)) => {
                let body = &self.physics.bodies[body];
                [f64::from(body.kinetic_energy()), 0.0, f64::from(body.mass()) * height]
            }
            Some(Thing::Soft(body)) => {
                let body = &self.world.bodies[body];
                [body.kinetic_energy(), body.elastic_energy(), body.mass() * height]
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
