//! The models of the tests in a world with a floor.
#![allow(dead_code)]

use foible_robots::{JointSolver, Robot, RobotBuilder};
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// Steps per second.
pub const RATE: f32 = 120.0;
/// Of pads and objects; rapier and foible3d take the mean.
pub const FRICTION: f32 = 0.8;
pub const GRAVITY: f32 = 9.81;
/// Cells of the arm's pads in their file.
pub const PAD_CELLS: [usize; 3] = [4, 2, 4];

/// A robot and an object on a floor.
pub struct Scene {
    pub physics: PhysicsWorld,
    pub deformables: DeformableWorld,
    pub robot: Robot,
    pub floor: ColliderHandle,
    /// What the motors draw to.
    targets: Vec<(&'static str, f32, [f32; 2])>,
}

/// Stiffness and damping of motors: of arms, and of fingers.
pub const STIFF: [f32; 2] = [1.0e5, 5.0e3];
pub const FINGER: [f32; 2] = [4.0e3, 1.0e2];

impl Scene {
    pub fn new(builder: RobotBuilder, solver: JointSolver) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::NEG_Z * GRAVITY;
        physics.integration_parameters.dt = 1.0 / RATE;
        let ground = RigidBodyBuilder::fixed().translation(Vector::NEG_Z * 0.05);
        let floor = ColliderBuilder::cuboid(1.0, 1.0, 0.05).friction(FRICTION);
        let (_, floor) = physics.insert(ground, floor);
        let mut deformables = DeformableWorld::new();
        let robot = builder.joint_solver(solver).insert(&mut physics, &mut deformables);
        let robot = robot.unwrap_or_else(|error| panic!("{error}"));
        Self { physics, deformables, robot, floor, targets: Vec::new() }
    }

    pub fn arm(solver: JointSolver) -> Self {
        Self::arm_with_pads(solver, PAD_CELLS)
    }

    /// The arm with pads of so many cells.
    pub fn arm_with_pads(solver: JointSolver, cells: [usize; 3]) -> Self {
        let parts = std::fs::read_to_string("models/arm.soft.toml").expect("the file of soft parts");
        let parts = parts.replace(&format!("{PAD_CELLS:?}"), &format!("{cells:?}"));
        let builder = RobotBuilder::urdf("models/arm.urdf").soft_parts_text(parts, "models");
        let mut scene = Self::new(builder, solver);
        for (joint, gains) in
            [("swing", STIFF), ("lift", STIFF), ("wrist", STIFF), ("left", FINGER), ("right", FINGER)]
        {
            scene.drive(joint, 0.0, gains);
        }
        scene
    }

    pub fn put(&mut self, shape: ColliderBuilder, mass: f32, at: Vector) -> RigidBodyHandle {
        let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
        self.physics.insert(body, shape.mass(mass).friction(FRICTION)).0
    }

    /// Draws a joint to a place from now on.
    pub fn drive(&mut self, joint: &'static str, target: f32, gains: [f32; 2]) {
        let [stiffness, damping] = gains;
        let set = self.robot.set_motor_position(&mut self.physics, joint, target, stiffness, damping);
        set.unwrap_or_else(|error| panic!("{error}"));
        self.targets.retain(|(name, ..)| *name != joint);
        self.targets.push((joint, target, gains));
    }

    pub fn step(&mut self) {
        self.robot.step(&mut self.physics, &mut self.deformables);
    }

    pub fn wait(&mut self, seconds: f32) {
        for _ in 0..(seconds * RATE) as usize {
            self.step();
        }
    }

    /// Moves joints smoothly to places, all at once; `each` sees the scene after every step.
    pub fn go(&mut self, to: &[(&'static str, f32)], seconds: f32, mut each: impl FnMut(&Self)) {
        let from: Vec<(&'static str, f32, f32, [f32; 2])> = to
            .iter()
            .map(|(joint, end)| {
                let (_, start, gains) =
                    self.targets.iter().find(|(name, ..)| name == joint).expect("a driven joint");
                (*joint, *start, *end, *gains)
            })
            .collect();
        let steps = (seconds * RATE) as usize;
        for step in 1..=steps {
            let t = step as f32 / steps as f32;
            // Jerks neither at its beginning nor at its end.
            let part = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
            for (joint, start, end, gains) in &from {
                self.drive(joint, start + (end - start) * part, *gains);
            }
            self.step();
            each(self);
        }
    }

    pub fn place(&self, body: RigidBodyHandle) -> Vector {
        self.physics.bodies[body].translation()
    }

    /// Pose of a body in a link's frame.
    pub fn in_link(&self, body: RigidBodyHandle, link: &str) -> Pose {
        let link = self.robot.link(link).expect("a link").body;
        self.physics.bodies[link].position().inverse() * self.physics.bodies[body].position()
    }

    /// The point of a part that is pressed by a body: its vertices with their shares in the force. Empty if it is not.
    pub fn pressed(&self, part: &str, body: RigidBodyHandle) -> Vec<(usize, f32)> {
        let handle = self.robot.part(part).expect("a part").body;
        let collider = self.physics.bodies[body].colliders()[0];
        let contacts = || self.deformables.contacts_of(handle).filter(|c| c.collider == collider);
        let total: f32 = contacts().map(|c| c.force.length()).sum();
        let shares = contacts().flat_map(|c| {
            let share = c.force.length() / total.max(f32::MIN_POSITIVE);
            (0..3).map(move |i| (c.vertices[i], share * c.weights[i] as f32))
        });
        shares.filter(|(_, share)| *share > 0.0).collect()
    }

    /// Where such a point is in a body's frame \[m\]: what is held between pads slips by what this changes, however the pads
    /// give way and however it turns about the line between them.
    pub fn mark(&self, part: &str, point: &[(usize, f32)], body: RigidBodyHandle) -> Vector {
        let handle = self.robot.part(part).expect("a part").body;
        let pose = self.physics.bodies[body].position().inverse();
        let place = |(v, share): &(usize, f32)| {
            let x = self.deformables.bodies[handle].position(*v).expect("a vertex");
            pose * Vector::from_array(x.map(|c| c as f32)) * *share
        };
        point.iter().map(place).sum()
    }

    /// Force with which a part presses on a body, across the hand \[N\].
    pub fn press(&self, part: &str, body: RigidBodyHandle) -> f32 {
        let handle = self.robot.part(part).expect("a part").body;
        let hand = self.robot.link("hand").expect("the arm's hand").body;
        let across = self.physics.bodies[hand].rotation() * Vector::Y;
        self.deformables.contact_force(handle, self.physics.bodies[body].colliders()[0]).dot(across).abs()
    }

    pub fn force_on(&self, part: &str) -> Vector {
        let attachment = self.robot.part(part).expect("a part").attachment.expect("an attached part");
        self.deformables.bodies.attachment(attachment).expect("an attachment").force()
    }

    pub fn is_finite(&self) -> bool {
        let rigid =
            self.physics.bodies.iter().all(|(_, b)| {
                b.translation().is_finite() && b.rotation().is_finite() && b.linvel().is_finite()
            });
        rigid
            && self
                .deformables
                .bodies
                .iter()
                .all(|(_, b)| !b.is_quarantined() && b.center_of_mass().iter().all(|c| c.is_finite()))
    }
}
