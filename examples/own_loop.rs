//! A game that keeps rapier's sets itself and steps them in its own loop: `cargo run --release --example own_loop`.

use foible3d::prelude::*;
use rapier3d::prelude::*;

/// What such a game has of rapier.
#[derive(Default)]
struct Rapier {
    parameters: IntegrationParameters,
    pipeline: PhysicsPipeline,
    islands: IslandManager,
    broad_phase: DefaultBroadPhase,
    narrow_phase: NarrowPhase,
    bodies: RigidBodySet,
    colliders: ColliderSet,
    impulse_joints: ImpulseJointSet,
    multibody_joints: MultibodyJointSet,
    soft_bodies: SoftBodySet,
    ccd_solver: CCDSolver,
}

const GRAVITY: Vector = Vector::new(0.0, -9.81, 0.0);

impl Rapier {
    /// What a step of deformables reads and writes: the same gravity and `dt` as rapier's own step.
    fn parts(&mut self) -> PhysicsParts<'_> {
        PhysicsParts {
            gravity: GRAVITY,
            dt: self.parameters.dt,
            substeps: self.parameters.num_solver_iterations,
            bodies: &mut self.bodies,
            colliders: &self.colliders,
            narrow_phase: &self.narrow_phase,
            impulse_joints: &mut self.impulse_joints,
            multibody_joints: &mut self.multibody_joints,
        }
    }

    #[rustfmt::skip]
    fn step(&mut self) {
        self.pipeline.step(
            GRAVITY, &self.parameters, &mut self.islands, &mut self.broad_phase, &mut self.narrow_phase,
            &mut self.bodies, &mut self.colliders, &mut self.impulse_joints, &mut self.multibody_joints,
            &mut self.soft_bodies, &mut self.ccd_solver, &(), &(),
        );
    }
}

fn main() -> Result<(), DeformableBodyError> {
    let mut rapier = Rapier::default();
    let ground = ColliderBuilder::cuboid(5.0, 0.1, 5.0).translation(Vector::NEG_Y * 0.1);
    let floor = rapier.colliders.insert(ground);
    let ball = rapier.bodies.insert(RigidBodyBuilder::dynamic().translation(Vector::Y * 0.6));
    let shape = ColliderBuilder::ball(0.1).density(500.0);
    rapier.colliders.insert_with_parent(shape, ball, &mut rapier.bodies);

    let mut deformables = DeformableBodySet::new();
    let parameters = DeformableParameters::default();
    let mut pipeline = DeformablePipeline::new();
    let pad =
        DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.1, 0.2), [6, 3, 6]).translation(Vector::Y * 0.1);
    let pad = deformables.insert(pad.material(DeformableMaterial::new(1.0e5, 0.3).mass_damping(5.0)))?;

    for step in 1..=300 {
        pipeline.before_step(&parameters, &mut deformables, &mut rapier.parts());
        rapier.step();
        pipeline.after_step(&mut rapier.parts());
        if step % 60 == 0 {
            let height = rapier.bodies[ball].translation().y;
            let load: f32 =
                pipeline.contacts().iter().filter(|c| c.collider == floor).map(|c| c.force.y).sum();
            println!("{} s: ball at {height:.4} m, the floor carries {load:.2} N", step / 60);
        }
    }
    let weight = (f64::from(rapier.bodies[ball].mass()) + deformables[pad].mass()) * 9.81;
    let load: Vector = pipeline.contacts().iter().filter(|c| c.collider == floor).map(|c| c.force).sum();
    println!("pad and ball weigh {weight:.2} N");
    assert!((f64::from(load.y) / weight - 1.0).abs() < 1.0e-3, "what lies still weighs what it weighs");
    Ok(())
}
