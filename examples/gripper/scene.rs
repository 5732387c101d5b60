//! A parallel gripper: two fingers slide on a hand, each with a soft pad, and are pressed together by
//! motors of limited force.

use foible3d::prelude::*;
use rapier3d::prelude::*;

/// What the gripper is made of.
#[derive(Clone, Copy)]
pub struct Setup {
    /// Squeeze of each motor \[N\].
    pub squeeze: f32,
    /// Mass of the box \[kg\].
    pub mass: f32,
    /// Friction of pads and box.
    pub friction: f32,
    /// Young's modulus of the pads \[Pa\].
    pub stiffness: f64,
}

/// Everything in motion.
pub struct Gripper {
    pub physics: PhysicsWorld,
    pub world: DeformableWorld,
    hand: RigidBodyHandle,
    joints: [ImpulseJointHandle; 2],
    pads: [DeformableBodyHandle; 2],
    load: RigidBodyHandle,
    load_shape: ColliderHandle,
}

const HAND_HEIGHT: f32 = 0.4;
const LOAD_HALF: f32 = 0.04;

impl Gripper {
    pub fn new(setup: Setup) -> Self {
        let mut physics = PhysicsWorld::new();
        let mut world = DeformableWorld::new();
        let floor = ColliderBuilder::cuboid(2.0, 0.5, 2.0).friction(setup.friction);
        physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), floor);
        let shape = ColliderBuilder::cuboid(LOAD_HALF, LOAD_HALF, LOAD_HALF).mass(setup.mass);
        let load = RigidBodyBuilder::dynamic().translation(Vector::Y * LOAD_HALF).can_sleep(false);
        let (load, load_shape) = physics.insert(load, shape.friction(setup.friction));
        let hand = RigidBodyBuilder::kinematic_position_based().translation(Vector::Y * HAND_HEIGHT);
        let hand = physics.insert_body(hand);
        let mut finger = |side: f32| {
            // The finger hangs from the hand; its pad reaches down to the box.
            let at = Vector::new(side * 0.12, 0.06, 0.0);
            let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
            let groups = InteractionGroups::none();
            let shape = ColliderBuilder::cuboid(0.01, 0.05, 0.03).mass(0.3).collision_groups(groups);
            let (finger, _) = physics.insert(body, shape);
            let slide = PrismaticJointBuilder::new(Vector::X)
                .local_anchor1(at - Vector::Y * HAND_HEIGHT)
                .motor_model(MotorModel::ForceBased)
                .motor_velocity(-side * 0.2, 1e4)
                .motor_max_force(setup.squeeze);
            let joint = physics.impulse_joints.insert(hand, finger, slide, true);
            let pad = DeformableBodyBuilder::cuboid(Vector::new(0.02, 0.03, 0.03), [4, 5, 5])
                .translation(Vector::new(side * 0.09, LOAD_HALF, 0.0))
                .material(DeformableMaterial::new(setup.stiffness, 0.3).friction(f64::from(setup.friction)))
                .can_sleep(false);
            let pad = world.insert(pad).expect("a valid pad");
            let back = |x: [f64; 3]| x[0] * f64::from(side) > 0.0199;
            let body = &world.bodies[pad];
            let glued: Vec<usize> =
                (0..body.vertex_count()).filter(|&v| back(body.model().rest_position(v))).collect();
            let pose = *physics.bodies[finger].position();
            let to = AttachTo::RigidBody(finger, pose);
            world.bodies.attach(pad, &glued, to).expect("vertices on the surface");
            (joint, pad)
        };
        let (left, right) = (finger(-1.0), finger(1.0));
        let (joints, pads) = ([left.0, right.0], [left.1, right.1]);
        Self { physics, world, hand, joints, pads, load, load_shape }
    }

    /// Steps with the hand at a height above where it began, and to the side \[m\].
    pub fn step(&mut self, lift: f32, aside: f32) {
        let to = Vector::new(0.0, HAND_HEIGHT + lift, aside);
        self.physics.bodies[self.hand].set_next_kinematic_translation(to);
        self.world.step(&mut self.physics);
    }

    /// Runs the motors apart.
    pub fn open(&mut self) {
        for (joint, side) in self.joints.into_iter().zip([-1.0, 1.0]) {
            if let Some(joint) = self.physics.impulse_joints.get_mut(joint, true) {
                joint.data.set_motor_velocity(JointAxis::LinX, side * 0.2, 1e4);
            }
        }
    }

    /// Height of the box above the floor \[m\].
    pub fn load_height(&self) -> f32 {
        self.physics.bodies[self.load].translation().y - LOAD_HALF
    }

    /// Place of the box against the hand \[m\].
    pub fn load_in_hand(&self) -> Vector {
        self.physics.bodies[self.load].translation() - self.physics.bodies[self.hand].translation()
    }

    /// Force with which each pad presses on the box \[N\].
    pub fn grip(&self) -> [f32; 2] {
        self.pads.map(|pad| self.world.contact_force(pad, self.load_shape).x.abs())
    }
}
