//! Vertices attached to the world, to rigid bodies and links, and to one another.
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

const SETTLED: usize = 300;

fn slab() -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.2, 0.05, 0.05), [8, 2, 2])
        .can_sleep(false)
        .material(DeformableMaterial::new(1e6, 0.3).mass_damping(5.0))
}

fn left(body: &DeformableBody) -> Vec<usize> {
    at_rest_where(body, |x| x[0] < -0.199)
}

fn right(body: &DeformableBody) -> Vec<usize> {
    at_rest_where(body, |x| x[0] > 0.199)
}

#[test]
fn attached_to_the_world_is_as_good_as_pinned() {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let pinned = world.insert(slab().pinned(|x| x.x < -0.199)).unwrap();
    let attached = world.insert(slab().translation(Vector::Z)).unwrap();
    let ends = left(&world.bodies[attached]);
    let attachment = world.bodies.attach(attached, &ends, AttachTo::World).unwrap();
    for _ in 0..SETTLED {
        world.step(&mut physics);
    }
    let weight = world.bodies[attached].mass() * G;
    let force = world.bodies.attachment(attachment).unwrap().force();
    assert!((f64::from(force.y) / weight - 1.0).abs() < 1e-4, "{force} of {weight} N");
    let tip = |b| mean_position(&world.bodies[b], &right(&world.bodies[b]))[1];
    // Not quite the same: attached vertices are solved for to 1e-8 of the force, pinned ones are not unknowns.
    assert!((tip(attached) / tip(pinned) - 1.0).abs() < 1e-3, "{} {}", tip(attached), tip(pinned));
    // Moved along with what it is attached to, and let go.
    world.bodies.attachment_mut(attachment).unwrap().translate(Vector::Y * 0.2);
    (0..SETTLED).for_each(|_| world.step(&mut physics));
    let end = mean_position(&world.bodies[attached], &ends);
    assert!((end[1] - 0.2).abs() < 1e-5, "{end:?}");
    assert!(world.bodies.detach(attachment).is_some() && world.bodies.detach(attachment).is_none());
    (0..60).for_each(|_| world.step(&mut physics));
    assert!(world.bodies[attached].center_of_mass()[1] < -1.0);
}

#[test]
fn a_box_hangs_on_a_strap_and_a_compliant_one_gives_way() {
    for compliance in [0.0, 1e-3] {
        let mut physics = PhysicsWorld::new();
        let body = RigidBodyBuilder::dynamic().translation(Vector::X * 0.35).can_sleep(false);
        let (load, _) = physics.insert(body, ColliderBuilder::cuboid(0.1, 0.1, 0.1).density(250.0));
        let mut world = DeformableWorld::new();
        let strap = slab().pinned(|x| x.x < -0.199).collision_groups(InteractionGroups::none());
        let strap = world.insert(strap).unwrap();
        let pose = *physics.bodies[load].position();
        let ends = right(&world.bodies[strap]);
        let attachment = world.bodies.attach(strap, &ends, AttachTo::RigidBody(load, pose)).unwrap();
        world.bodies.attachment_mut(attachment).unwrap().set_compliance(compliance).unwrap();
        for _ in 0..900 {
            world.step(&mut physics);
        }
        let rigid = &physics.bodies[load];
        let weight = f64::from(rigid.mass()) * G;
        let force = f64::from(world.bodies.attachment(attachment).unwrap().force().y);
        println!("compliance {compliance}: {force} N, {:e} m/s", rigid.linvel().length());
        assert!((force / -weight - 1.0).abs() < 1e-3, "{force} N of {weight} N");
        // Where the vertices are against their places on the box: by C f each.
        let local: Vec<[f64; 3]> = ends
            .iter()
            .map(|&v| world.bodies[strap].position(v).unwrap())
            .zip(&ends)
            .map(|(p, &v)| {
                let rest = world.bodies[strap].model().rest_position(v);
                let at = Vector::new(rest[0] as f32 - 0.35, rest[1] as f32, rest[2] as f32);
                let place = rigid.position().transform_point(at);
                [p[0] - f64::from(place.x), p[1] - f64::from(place.y), p[2] - f64::from(place.z)]
            })
            .collect();
        let mean = local.iter().map(|d| d[1]).sum::<f64>() / local.len() as f64;
        let expected = compliance * weight / ends.len() as f64;
        assert!((mean - expected).abs() < 1e-4 + 0.01 * expected, "{mean} m, {expected} m");
    }
}

#[test]
fn an_overloaded_attachment_breaks() {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let body = world.insert(slab()).unwrap();
    let ends = left(&world.bodies[body]);
    let attachment = world.bodies.attach(body, &ends, AttachTo::World).unwrap();
    let weight = world.bodies[body].mass() * G;
    world.bodies.attachment_mut(attachment).unwrap().set_break_force(0.5 * weight).unwrap();
    (0..60).for_each(|_| world.step(&mut physics));
    assert!(world.bodies.attachment(attachment).unwrap().is_broken());
    assert!(world.bodies[body].center_of_mass()[1] < -1.0);
}

#[test]
fn two_bodies_tied_end_to_end_hang_as_one() {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let first = world.insert(slab().pinned(|x| x.x < -0.199)).unwrap();
    let second = world.insert(slab().translation(Vector::X * 0.4)).unwrap();
    let (ends, starts) = (right(&world.bodies[first]), left(&world.bodies[second]));
    // The lattices agree, so do the orders of their vertices.
    let attachment = world.bodies.attach(first, &ends, AttachTo::Deformable(second, starts.clone())).unwrap();
    for _ in 0..900 {
        world.step(&mut physics);
    }
    let weight = world.bodies[second].mass() * G;
    let force = f64::from(world.bodies.attachment(attachment).unwrap().force().y);
    assert!((force / -weight - 1.0).abs() < 1e-3, "{force} N of {weight} N");
    for (a, b) in ends.iter().zip(&starts) {
        let (p, q) = (world.bodies[first].position(*a).unwrap(), world.bodies[second].position(*b).unwrap());
        let apart = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
        assert!(apart < 1e-6, "{apart:e} m apart");
    }
}

#[test]
fn vertices_that_cannot_be_attached_are_named() {
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(DeformableMaterial::new(1e6, 0.3), 1.0)).unwrap();
    let inside = at_rest_where(&world.bodies[body], |x| x.iter().all(|c| c.abs() < 0.01));
    let error = |vertices: &[usize], world: &mut DeformableWorld| {
        world.bodies.attach(body, vertices, AttachTo::World).unwrap_err().to_string()
    };
    assert!(error(&inside, &mut world).contains("not on the surface"));
    assert!(error(&[100_000], &mut world).contains("100000"));
    assert!(error(&[], &mut world).contains("empty"));
    assert_eq!(world.bodies.attachments().count(), 0);
}

#[test]
fn cable_without_compliance_does_not_stretch_under_a_thousand_times_the_weight_and_pushes_nothing() {
    // A block on three metres of cable, slack at first; then a thousand times its weight on it.
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let block = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3])
        .material(DeformableMaterial::new(1e8, 0.3).mass_damping(0.2))
        .can_sleep(false);
    let block = world.insert(block).unwrap();
    let top = at_rest_where(&world.bodies[block], |p| p[1] > 0.0999 && p[0] == 0.0 && p[2] == 0.0);
    let cable = world.bodies.attach(block, &top, AttachTo::World).unwrap();
    let anchor = [0.0, 0.1, 0.0];
    world.bodies.attachment_mut(cable).unwrap().set_length(0.5).unwrap();
    let distance = |world: &DeformableWorld| {
        let p = world.bodies[block].position(top[0]).unwrap();
        (0..3).map(|k| (p[k] - anchor[k]).powi(2)).sum::<f64>().sqrt()
    };
    // Half a metre of free fall takes 0.32 s.
    for _ in 0..15 {
        world.step(&mut physics);
        assert!(world.bodies.attachment(cable).unwrap().force().length() == 0.0);
    }
    assert!((distance(&world) - 0.5 * G * 0.25f64.powi(2)).abs() < 0.03);
    let mut farthest = 0.0f64;
    for _ in 0..600 {
        world.step(&mut physics);
        farthest = farthest.max(distance(&world));
    }
    let weight = world.bodies[block].mass() * G;
    let force = f64::from(world.bodies.attachment(cable).unwrap().force().y);
    println!("cable: farthest {farthest:.6} m of 0.5, force/weight {:.6}", force / weight);
    // Farthest where its fall is caught, 4e-6 m beyond.
    assert!(farthest < 0.5 * (1.0 + 1e-5) && (force / weight - 1.0).abs() < 1e-5, "{farthest} {force}");
    let bottom = at_rest_where(&world.bodies[block], |p| p[1] < -0.0999);
    world.bodies[block].add_force(&bottom, Vector::NEG_Y * (999.0 * weight) as f32).unwrap();
    for _ in 0..600 {
        world.step(&mut physics);
        farthest = farthest.max(distance(&world));
    }
    let force = f64::from(world.bodies.attachment(cable).unwrap().force().y);
    println!("loaded: farthest {farthest:.6} m, force/weight {:.3}", force / weight);
    assert!(
        farthest < 0.5 * (1.0 + 1e-5) && (force / weight / 1000.0 - 1.0).abs() < 1e-5,
        "{farthest} {force}"
    );
}

#[test]
fn node_that_two_attachments_and_a_pin_hold_carries_no_more_than_the_weight() {
    let mut physics = PhysicsWorld::new();
    let frame = RigidBodyBuilder::kinematic_position_based().translation(Vector::new(0.3, 0.7, -0.2));
    let frame = physics.insert_body(frame);
    let mut world = DeformableWorld::new();
    let body = world.insert(slab().pinned(|x| x.x < -0.199 && x.z < -0.09)).unwrap();
    let ends = left(&world.bodies[body]);
    let on = || AttachTo::RigidBody(frame, *physics.bodies[frame].position());
    let attachments = [
        world.bodies.attach(body, &ends, on()).unwrap(),
        world.bodies.attach(body, &ends[1..], on()).unwrap(),
        world.bodies.attach(body, &ends[..1], AttachTo::World).unwrap(),
    ];
    for step in 0..120 {
        // Away, once it hangs still.
        let away = Vector::new(0.3, 0.7 + 0.001 * (step as f32 - 60.0).max(0.0), -0.2);
        physics.bodies[frame].set_next_kinematic_translation(away);
        world.step(&mut physics);
        for attachment in attachments {
            let force = world.bodies.attachment(attachment).unwrap().force();
            assert!(force.length() < 1e5, "step {step}: {force}");
        }
    }
    assert!(world.bodies[body].is_enabled() && world.bodies[body].max_speed() < 1.0);
}

#[test]
fn attachment_of_infinite_compliance_holds_nothing_and_disturbs_nothing() {
    let (mut physics, floor) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let body = world.insert(slab().translation(Vector::Y * 0.3)).unwrap();
    let ends = left(&world.bodies[body]);
    let attachment = world.bodies.attach(body, &ends, AttachTo::World).unwrap();
    world.bodies.attachment_mut(attachment).unwrap().set_compliance(f64::INFINITY).unwrap();
    for _ in 0..240 {
        world.step(&mut physics);
    }
    let force: f64 = world.contacts_with(floor).map(|c| f64::from(c.force.y)).sum();
    assert!((force / (world.bodies[body].mass() * G) - 1.0).abs() < 1e-3, "{force}");
}

#[test]
fn numbers_of_attachments_out_of_range_are_refused_by_name_and_value() {
    let mut world = DeformableWorld::new();
    let body = world.insert(slab()).unwrap();
    let ends = left(&world.bodies[body]);
    let handle = world.bodies.attach(body, &ends, AttachTo::World).unwrap();
    assert_eq!(DeformableAttachmentHandle::from_raw_parts(handle.into_raw_parts()), handle);
    let attachment = world.bodies.attachment_mut(handle).unwrap();
    attachment.set_compliance(1e-3).unwrap();
    attachment.set_length(0.1).unwrap();
    attachment.set_break_force(5.0).unwrap();
    for bad in [f64::NAN, -1.0, f64::NEG_INFINITY] {
        let told = |name: &str| format!("{name} is {bad:?}, but must be zero or positive");
        assert_eq!(attachment.set_compliance(bad).unwrap_err().to_string(), told("compliance"));
        assert_eq!(attachment.set_length(bad).unwrap_err().to_string(), told("length"));
        assert_eq!(attachment.set_break_force(bad).unwrap_err().to_string(), told("break_force"));
    }
    assert_eq!((attachment.compliance(), attachment.length(), attachment.break_force()), (1e-3, 0.1, 5.0));
    // Infinity is a number that each has a meaning for: it lets go, and never breaks.
    attachment.set_break_force(f64::INFINITY).unwrap();
    attachment.set_length(f64::INFINITY).unwrap();
}

#[test]
fn breaking_wakes_what_sleeps_on_it_and_so_does_removing_what_it_is_attached_to() {
    for breaks in [true, false] {
        let mut physics = PhysicsWorld::new();
        let anchor = physics.insert_body(RigidBodyBuilder::fixed().translation(Vector::Y));
        let mut world = DeformableWorld::new();
        let body = slab().material(DeformableMaterial::new(1e6, 0.3).mass_damping(8.0)).can_sleep(true);
        let body = world.insert(body).unwrap();
        let ends = left(&world.bodies[body]);
        let on = AttachTo::RigidBody(anchor, *physics.bodies[anchor].position());
        let attachment = world.bodies.attach(body, &ends, on).unwrap();
        for _ in 0..400 {
            world.step(&mut physics);
        }
        assert!(world.bodies[body].is_sleeping());
        if breaks {
            world.bodies.attachment_mut(attachment).unwrap().set_break_force(1.0).unwrap();
        } else {
            physics.remove_body(anchor);
        }
        let before = world.bodies[body].center_of_mass()[1];
        for _ in 0..30 {
            world.step(&mut physics);
        }
        let fallen = before - world.bodies[body].center_of_mass()[1];
        assert!(fallen > 0.1, "breaks {breaks}: {fallen}");
    }
}
