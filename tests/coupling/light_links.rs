//! Multibodies with links that have no inertia, or next to none.
use foible3d::prelude::*;
use rapier3d::prelude::*;
use rayon::prelude::*;

/// A root, what is between, and a hub that carries a soft block and is turned by a motor.
#[derive(Clone, Copy, Debug)]
struct Machine {
    /// \[kg\] and \[kg m²\] of the root, and of a link between it and the hub if there is one.
    root: (f32, f32),
    between: Option<(f32, f32)>,
    /// Half the edge of the hub \[m\].
    hub: f32,
    speed: f32,
    torque: f32,
    damping: Option<f32>,
    gravity: bool,
    dt: f32,
}

fn massive(mass: f32, inertia: f32) -> RigidBodyBuilder {
    let builder = RigidBodyBuilder::dynamic();
    match inertia {
        0.0 => builder.additional_mass(mass),
        _ => builder.additional_mass_properties(MassProperties::new(
            Vector::ZERO,
            mass,
            Vector::splat(inertia),
        )),
    }
}

impl Machine {
    /// The largest speeds that anything comes to in a second, of points and angular [m/s, rad/s].
    fn run(&self) -> [f64; 2] {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = self.dt;
        if !self.gravity {
            physics.gravity = Vector::ZERO;
        }
        let root = physics.insert_body(massive(self.root.0, self.root.1));
        let mut links = vec![root];
        if let Some((mass, inertia)) = self.between {
            let link = physics.insert_body(massive(mass, inertia));
            physics.insert_multibody_joint(links[0], link, RevoluteJointBuilder::new(Vector::X));
            links.push(link);
        }
        let hub = physics
            .insert(RigidBodyBuilder::dynamic(), ColliderBuilder::cuboid(self.hub, self.hub, self.hub))
            .0;
        let joint = RevoluteJointBuilder::new(Vector::Z)
            .motor_velocity(self.speed, 200.0)
            .motor_max_force(self.torque);
        let made = physics.insert_multibody_joint(*links.last().unwrap(), hub, joint).unwrap();
        links.push(hub);
        if let Some(damping) = self.damping {
            let (multibody, _) = physics.multibody_joints.get_mut(made).unwrap();
            multibody.damping_mut().fill(damping);
        }
        let mut world = DeformableWorld::new();
        let block = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2, 2, 2])
            .material(DeformableMaterial::new(1e5, 0.3));
        let block =
            world.insert(block.translation(Vector::NEG_Y * (self.hub + 0.1)).can_sleep(false)).unwrap();
        let top = world.bodies[block].vertices_where(|x| x.y > -self.hub - 0.001);
        let pose = *physics.bodies[hub].position();
        world.bodies.attach(block, &top, AttachTo::RigidBody(hub, pose)).unwrap();
        let mut fastest = [0.0_f64; 2];
        for _ in 0..(1.0 / self.dt) as usize {
            world.step(&mut physics);
            for (_, body) in world.bodies.iter() {
                fastest[0] = fastest[0].max(if body.is_enabled() { body.max_speed() } else { f64::INFINITY });
            }
            for link in &links {
                let body = &physics.bodies[*link];
                let speeds = [body.linvel(), body.angvel()].map(|v| f64::from(v.length()));
                fastest.iter_mut().zip(speeds).for_each(|(fastest, speed)| {
                    // NaN must not vanish in a maximum.
                    *fastest = if speed.is_nan() { f64::INFINITY } else { fastest.max(speed) };
                });
            }
        }
        fastest
    }
}

/// A cart without inertia, a hub that a motor turns: once the hub came to 3e5 rad/s in the second step.
#[test]
fn a_motor_against_a_root_without_inertia_throws_nothing_away() {
    for mass in [0.01, 20.0] {
        let machine = Machine {
            root: (mass, 0.0),
            between: None,
            hub: 0.1,
            speed: -10.0,
            torque: 40.0,
            damping: None,
            gravity: false,
            dt: 1.0 / 60.0,
        };
        let [speed, turn] = machine.run();
        println!("{mass} kg: {speed:.1} m/s, {turn:.1} rad/s");
        assert!(speed < 5.0 && turn < 20.0, "{mass} kg: {speed} m/s, {turn} rad/s");
    }
}

fn random_machines(count: usize, seed: u64) -> usize {
    let mut state = seed;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f32 / (1u64 << 31) as f32
    };
    let mut machine = || {
        let mut pick = |of: &[f32]| of[(random() * of.len() as f32) as usize % of.len()];
        let (masses, inertias) = ([1e-3, 0.1, 1.0, 20.0], [0.0, 0.0, 1e-9, 1e-6, 1e-4, 1e-2]);
        Machine {
            root: (pick(&masses), pick(&inertias)),
            between: (pick(&[0.0, 1.0]) > 0.0).then_some((pick(&masses), pick(&inertias))),
            hub: pick(&[0.02, 0.1, 0.3]),
            speed: pick(&[-10.0, 3.0, 30.0]),
            torque: pick(&[0.1, 1.0, 40.0]),
            // By default 0.1 N m s/rad.
            damping: (pick(&[0.0, 0.0, 1.0]) > 0.0).then_some(1e-3),
            gravity: pick(&[0.0, 1.0]) > 0.0,
            dt: pick(&[1.0 / 240.0, 1.0 / 60.0, 1.0 / 30.0]),
        }
    };
    let machines: Vec<Machine> = (0..count).map(|_| machine()).collect();
    let is_thrown = |machine: &&Machine| {
        let [speed, turn] = machine.run();
        let is_thrown = !(speed < 60.0 && turn < 1e4);
        if is_thrown {
            println!("{machine:?}: {speed:.1e} m/s, {turn:.1e} rad/s");
        }
        is_thrown
    };
    machines.par_iter().filter(is_thrown).count()
}

#[test]
fn random_machines_with_links_without_inertia_are_not_thrown_away() {
    assert_eq!(random_machines(150, 7), 0);
}

/// Of other seeds two of 2000 were, of little damping.
#[test]
#[ignore = "a minute"]
fn hardly_any_of_two_thousand_machines_are_thrown_away() {
    assert!(random_machines(2000, 11) <= 4);
}
