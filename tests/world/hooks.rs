//! Hooks that are asked about contacts of deformable bodies: belts, one-way platforms, pairs that do not touch.

use crate::common::games::{H, cube};
use crate::common::world_with_floor;
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::collections::BTreeMap;

/// What hooks do in a test: belts and one-way platforms by the user data of colliders, and pairs of bodies.
#[derive(Default)]
struct Hooks {
    belts: BTreeMap<u128, Vector>,
}

impl PhysicsHooks for Hooks {}

impl DeformableHooks for Hooks {
    fn modify_deformable_contacts(&self, context: &mut DeformableContactModificationContext<'_>) {
        let name = match context.pair.partner {
            DeformableContactPartner::Collider(handle) => context.pair.colliders[handle].user_data,
            DeformableContactPartner::Deformable(handle) => context.pair.deformables[handle].user_data,
        };
        if name == 100 {
            context.update_as_oneway_platform(Vector::Y, 0.3);
        }
        if let Some(velocity) = self.belts.get(&name) {
            context.contacts.iter_mut().for_each(|contact| contact.tangent_velocity = *velocity);
        }
    }
}

#[test]
fn a_belt_carries_a_block_at_its_speed() {
    for (integrator, h) in
        [(Integrator::ImplicitEuler, H), (Integrator::Bdf2, H), (Integrator::ImplicitEuler, 1.0 / 240.0)]
    {
        let (mut physics, floor) = world_with_floor(h);
        let floor = &mut physics.colliders[floor];
        floor.user_data = 7;
        floor.set_active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
        let mut world = DeformableWorld::new();
        let body = cube(0.1).translation(Vector::Y * 0.1).tune(|settings| settings.integrator = integrator);
        let body = world
            .insert(body.material(DeformableMaterial::new(1.0e5, 0.3).friction(0.5).stiffness_damping(0.02)))
            .unwrap();
        let belt = Vector::new(0.8, 0.0, 0.3);
        let hooks = Hooks { belts: BTreeMap::from([(7, belt)]) };
        for step in 0..(3.0 / h).round() as usize {
            world.step_with_events(&mut physics, &hooks, &());
            let v = Vector::from(world.bodies[body].linvel().map(|c| c as f32));
            // As it sticks it swings in shear.
            assert!(v.length() < 1.1 * belt.length(), "step {step}: {v}");
        }
        let v = Vector::from(world.bodies[body].linvel().map(|c| c as f32));
        let [x, _, z] = world.bodies[body].center_of_mass();
        // It slides at first, with μ g, and stays behind by v²/(2 μ g).
        let (behind, expected) = (3.0 * f64::from(belt.length()) - x.hypot(z), 0.0744);
        println!("{integrator:?} {h}: {v}, behind by {behind} m of {expected}");
        assert!((v - belt).length() < 1e-3, "{v}");
        assert!((behind / expected - 1.0).abs() < 0.15, "{behind}");
        assert!(!world.bodies[body].is_sleeping());
    }
}

/// Either of them may be the older one.
#[test]
fn a_soft_belt_carries_a_soft_block() {
    for first in [false, true] {
        let (mut physics, _) = world_with_floor(H);
        let mut world = DeformableWorld::new();
        let slab = DeformableBodyBuilder::cuboid(Vector::new(1.0, 0.05, 0.3), [20, 1, 6])
            .translation(Vector::Y * 0.06)
            .pinned(|x| x.y < 0.02)
            .user_data(7)
            .active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
        let block = cube(0.1).translation(Vector::new(-0.5, 0.215, 0.0));
        let slab_first = first.then(|| world.insert(slab.clone()).unwrap());
        let block = world.insert(block).unwrap();
        if slab_first.is_none() {
            world.insert(slab).unwrap();
        }
        let belt = Vector::X * 0.4;
        // Its own contact with the slab: the belt is whichever has the number, so the sign is that of the pair's partner.
        struct Moving(Vector);
        impl PhysicsHooks for Moving {}
        impl DeformableHooks for Moving {
            fn modify_deformable_contacts(&self, context: &mut DeformableContactModificationContext<'_>) {
                let DeformableContactPartner::Deformable(partner) = context.pair.partner else { return };
                let belt = if context.pair.deformables[partner].user_data == 7 { self.0 } else { -self.0 };
                let up = context.pair.deformables[partner].user_data == 7;
                for contact in context.contacts.iter_mut() {
                    assert!(contact.normal().y == 0.0 || (contact.normal().y > 0.0) == up);
                    assert!((contact.point().y - 0.11).abs() < 0.03, "{}", contact.point());
                    contact.tangent_velocity = belt;
                }
            }
        }
        for _ in 0..120 {
            world.step_with_events(&mut physics, &Moving(belt), &());
        }
        let v = world.bodies[block].linvel();
        assert!((v[0] - 0.4).abs() < 4e-3 && v[1].abs() < 1e-2, "{first}: {v:?}");
    }
}

#[test]
fn a_soft_ball_passes_a_one_way_platform_upward_only() {
    for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2] {
        let (mut physics, _) = world_with_floor(H);
        let platform = ColliderBuilder::cuboid(1.0, 0.05, 1.0)
            .user_data(100)
            .active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
        physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * 1.5), platform);
        let mut world = DeformableWorld::new();
        let ball = DeformableBodyBuilder::filled(&Ball::new(0.2), 0.1)
            .translation(Vector::Y * 0.5)
            .linvel(Vector::Y * 6.5)
            .tune(|settings| settings.integrator = integrator)
            .material(DeformableMaterial::new(2.0e5, 0.3).mass_damping(1.0));
        let ball = world.insert(ball).unwrap();
        let hooks = Hooks::default();
        let (mut highest, mut within) = (0.0f64, 0);
        for _ in 0..300 {
            world.step_with_events(&mut physics, &hooks, &());
            let aabb = world.bodies[ball].aabb();
            highest = highest.max(world.bodies[ball].center_of_mass()[1]);
            within += usize::from(aabb.mins.y < 1.55 && aabb.maxs.y > 1.45);
        }
        let y = world.bodies[ball].center_of_mass()[1];
        println!("{integrator:?}: up to {highest}, rests at {y}, {within} steps across");
        // Free flight against damping c = 1/s: 0.5 + (v + g)(1 − e⁻ᵗ) − g t at t = ln(1 + v/g) is 2.007 m.
        assert!((1.94..2.03).contains(&highest) && (y - 1.74).abs() < 0.03, "{highest} {y}");
        // From above it holds, upside down it does not.
        world.bodies[ball].teleport(Pose::from_translation(Vector::Y * -0.9)).unwrap();
        world.bodies[ball].set_linvel(Vector::Y * 3.0).unwrap();
        for _ in 0..120 {
            world.step_with_events(&mut physics, &hooks, &());
        }
        assert!(world.bodies[ball].center_of_mass()[1] < 1.3);
    }
}

#[test]
fn pairs_that_hooks_filter_do_not_touch() {
    struct Apart;
    impl PhysicsHooks for Apart {}
    impl DeformableHooks for Apart {
        fn filter_deformable_contact_pair(&self, pair: &DeformablePairFilterContext<'_>) -> bool {
            matches!(pair.partner, DeformableContactPartner::Collider(_))
        }
    }
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let lower = world.insert(cube(0.1).translation(Vector::Y * 0.1)).unwrap();
    let upper = cube(0.1).translation(Vector::Y * 0.35).active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS);
    let upper = world.insert(upper).unwrap();
    for _ in 0..120 {
        world.step_with_events(&mut physics, &Apart, &());
        assert_eq!(world.pair_force(lower, upper), Vector::ZERO);
    }
    let heights = [lower, upper].map(|h| world.bodies[h].center_of_mass()[1]);
    assert!(heights.iter().all(|y| (y - 0.1).abs() < 0.01), "{heights:?}");
}

/// Two rows of vertices below and above: in between a cube has no contacts, and has not passed.
#[test]
fn coarse_cubes_pass_one_way_platforms_too() {
    for thickness in [0.005f32, 0.05] {
        for h in [H, 1.0 / 240.0] {
            for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2] {
                let (mut physics, _) = world_with_floor(h);
                let platform = ColliderBuilder::cuboid(3.0, thickness, 3.0)
                    .user_data(100)
                    .active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
                physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * 1.5), platform);
                let mut world = DeformableWorld::new();
                let body = DeformableBodyBuilder::cuboid(Vector::splat(0.15), [2; 3])
                    .translation(Vector::Y * 0.6)
                    .linvel(Vector::Y * 7.0)
                    .angvel(Vector::new(0.3, 0.2, 0.0))
                    .tune(|settings| settings.integrator = integrator)
                    .material(DeformableMaterial::new(1.0e5, 0.3).stiffness_damping(0.02));
                let body = world.insert(body).unwrap();
                let mut highest = 0.0f64;
                for _ in 0..(4.0 / h) as usize {
                    world.step_with_events(&mut physics, &Hooks::default(), &());
                    highest = highest.max(world.bodies[body].center_of_mass()[1]);
                }
                let rests = world.bodies[body].aabb().mins.y;
                println!("{thickness} {h} {integrator:?}: up to {highest}, rests on {rests}");
                // 0.6 + v²/2g = 3.1 m; implicit Euler's steps fall g h/2 short of v.
                assert!((3.0..3.12).contains(&highest), "{highest}");
                assert!((rests - 1.5 - thickness).abs() < 5e-3, "{rests}");
            }
        }
    }
}

/// Slower than what counts as still.
#[test]
fn slow_belts_carry_on() {
    let (mut physics, floor) = world_with_floor(H);
    physics.colliders[floor].user_data = 7;
    physics.colliders[floor].set_active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(0.1).translation(Vector::Y * 0.1)).unwrap();
    let hooks = Hooks { belts: BTreeMap::from([(7, Vector::X * 0.008)]) };
    for _ in 0..600 {
        world.step_with_events(&mut physics, &hooks, &());
    }
    // Less what the cube's drag of 2/s costs where it slips: nothing, it sticks.
    let x = world.bodies[body].center_of_mass()[0];
    assert!((x - 0.08).abs() < 2e-3, "{x}");
}
