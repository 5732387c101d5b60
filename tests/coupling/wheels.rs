//! Soft tyres around rigid hubs: they roll on.
use crate::common::bones::energy_of_all;
use crate::common::*;
use foible3d::prelude::*;
use rapier3d::prelude::*;

/// A ring about the third axis of `around` edges and four layers, from 0.4 of the radius to the rim.
fn ring(radius: f64, around: usize) -> TetMesh {
    let at = |i: usize, layer: usize, side: usize| ((i % around) * 5 + layer) * 2 + side;
    let mut vertices = Vec::new();
    for i in 0..around {
        let angle = std::f64::consts::TAU * i as f64 / around as f64;
        for layer in 0..5 {
            let r = radius * (0.4 + 0.15 * layer as f64);
            vertices.extend([-1.0, 1.0].map(|side| [r * angle.cos(), r * angle.sin(), 0.25 * radius * side]));
        }
    }
    let mut tetrahedra = Vec::new();
    for i in 0..around {
        for layer in 0..4 {
            let corner = |c: usize| at(i + (c >> 1 & 1), layer + (c & 1), c >> 2 & 1);
            // The six tetrahedra around a diagonal.
            for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                tetrahedra.push([0, a, b, 7].map(|c| corner(c) as u32));
            }
        }
    }
    TetMesh::new(vertices, tetrahedra).unwrap()
}

#[derive(Clone, Copy, Debug)]
enum Hub {
    /// A region of the wheel.
    Region,
    /// A body of rapier's, to which the inner vertices are attached.
    Attached,
}

const RADIUS: f64 = 0.2;
const AROUND: usize = 96;

fn world(dt: f32) -> PhysicsWorld {
    let mut physics = PhysicsWorld::default();
    physics.integration_parameters.dt = dt;
    let floor = ColliderBuilder::cuboid(50.0, 0.5, 5.0).friction(1.0);
    physics.insert(RigidBodyBuilder::fixed().translation(Vector::Y * -0.5), floor);
    physics
}

/// A rigid body that stands on the floor and rolls.
fn rolling(spin: f32) -> RigidBodyBuilder {
    let velocity = Vector::X * (spin * RADIUS as f32);
    let at = Vector::Y * RADIUS as f32;
    RigidBodyBuilder::dynamic().translation(at).linvel(velocity).angvel(Vector::Z * -spin).can_sleep(false)
}

fn insert(
    world: &mut DeformableWorld,
    physics: &mut PhysicsWorld,
    hub: Hub,
    modulus: f64,
    spin: f32,
) -> (DeformableBodyHandle, RigidBodyHandle) {
    let material = DeformableMaterial::new(modulus, 0.3).density(1_000.0).friction(1.0).mass_damping(0.0);
    let mesh = ring(RADIUS, AROUND);
    let builder = DeformableBodyBuilder::mesh(&mesh).material(material).can_sleep(false);
    let builder = builder.translation(Vector::Y * RADIUS as f32);
    let builder = builder.linvel(Vector::X * (spin * RADIUS as f32)).angvel(Vector::Z * -spin);
    match hub {
        Hub::Region => {
            let inner = |[x, y, _]: [f64; 3]| u32::from(x.hypot(y) < 0.55 * RADIUS);
            let kind = RigidRegionBody::New(2_000.0);
            let (body, hubs) =
                world.insert_with_rigid_regions(builder.regions(inner), &[(1, kind)], physics).unwrap();
            (body, hubs[0].body)
        }
        Hub::Attached => {
            let along = Vector::X * std::f32::consts::FRAC_PI_2;
            let shape = ColliderBuilder::cylinder(0.05, 0.07).rotation(along).density(5_000.0);
            let hub = physics.insert(rolling(spin), shape).0;
            let body = world.insert(builder).unwrap();
            let inner = at_rest_where(&world.bodies[body], |[x, y, _]| x.hypot(y) < 0.45 * RADIUS);
            let to = AttachTo::RigidBody(hub, *physics.bodies[hub].position());
            let attachment = world.bodies.attach(body, &inner, to).unwrap();
            world.bodies.attachment_mut(attachment).unwrap().set_contacts_enabled(false);
            (body, hub)
        }
    }
}

/// What is left of the speed of a wheel after a second, and the most that it had of its energy.
fn roll(hub: Hub, modulus: f64, dt: f32, spin: f32) -> [f64; 2] {
    let (mut physics, mut world) = (world(dt), DeformableWorld::new());
    let (body, hub) = insert(&mut world, &mut physics, hub, modulus, spin);
    // Rapier gives its bodies their masses in their first step.
    world.step(&mut physics);
    let weight = G * (world.bodies[body].mass() + f64::from(physics.bodies[hub].mass()));
    let energy = |world: &DeformableWorld, physics: &PhysicsWorld| {
        energy_of_all(&world.bodies[body], &[&physics.bodies[hub]]) - weight * RADIUS
    };
    let speed = |world: &DeformableWorld| world.bodies[body].linvel()[0];
    let (start, first, mut most) = (energy(&world, &physics), speed(&world), 0.0f64);
    for _ in 0..(1.0 / dt) as usize {
        world.step(&mut physics);
        most = most.max(energy(&world, &physics) / start);
    }
    [speed(&world) / first, most]
}

/// What is left of the speed of rapier's own rigid body of the same facets.
fn rigid_wheel(dt: f32, spin: f32) -> f64 {
    let mut physics = world(dt);
    let mesh = ring(RADIUS, AROUND);
    let points: Vec<Vector> =
        mesh.vertices().iter().map(|v| Vector::from_array(v.map(|c| c as f32))).collect();
    let hull = ColliderBuilder::convex_hull(&points).unwrap().friction(1.0);
    let wheel = physics.insert(rolling(spin), hull).0;
    (0..(1.0 / dt) as usize).for_each(|_| physics.step());
    f64::from(physics.bodies[wheel].linvel().x / spin) / RADIUS
}

/// On straight ways of the attached points, at 12 rad/s and 1/60 s, wheels of 1e5, 1e6 and 1e7 Pa kept 0.47, 0.35 and 0.16 of their speed.
fn keeps_its_speed(hubs: &[Hub], modulus: f64, dt: f32, spin: f32, least: f64) {
    let rigid = rigid_wheel(dt, spin);
    for &hub in hubs {
        let [left, most] = roll(hub, modulus, dt, spin);
        println!(
            "{modulus:e} Pa, {spin} rad/s, {dt:.4} s, {hub:?}: {left:.3} left, rigid {rigid:.3}, energy at most {most:.3}"
        );
        assert!(left > least && left > rigid && left < 1.01, "{left} {rigid}");
        assert!(most < 1.02, "{most}");
    }
}

#[test]
fn soft_wheels_roll_on() {
    keeps_its_speed(&[Hub::Region, Hub::Attached], 1e5, 1.0 / 60.0, 12.0, 0.96);
    keeps_its_speed(&[Hub::Attached], 1e6, 1.0 / 60.0, 12.0, 0.985);
}

#[test]
fn stiff_wheels_roll_on() {
    keeps_its_speed(&[Hub::Region, Hub::Attached], 1e7, 1.0 / 60.0, 12.0, 0.985);
    keeps_its_speed(&[Hub::Region], 1e7, 1.0 / 60.0, 6.0, 0.92);
}

/// Down a slope of 0.2 rad a wheel goes as a rigid one does, `g sin α / (1 + I/m r²)`.
#[test]
fn wheels_roll_down_a_slope_as_rigid_ones_do() {
    for (hub, modulus, dt) in
        [(Hub::Region, 1e6, 1.0 / 60.0), (Hub::Attached, 1e7, 1.0 / 60.0), (Hub::Region, 1e7, 1.0 / 240.0)]
    {
        let (mut physics, mut world) = (world(dt), DeformableWorld::new());
        let (body, hub_body) = insert(&mut world, &mut physics, hub, modulus, 0.0);
        physics.gravity = Vector::new(9.81 * 0.2f32.sin(), -9.81 * 0.2f32.cos(), 0.0);
        world.step(&mut physics);
        let (own, rigid) = (&world.bodies[body], &physics.bodies[hub_body]);
        let mass = f64::from(rigid.mass());
        let square = match hub {
            Hub::Region => 0.5 * (0.4f64.powi(2) + 0.55f64.powi(2)) * RADIUS * RADIUS,
            Hub::Attached => 0.5 * 0.07 * 0.07,
        };
        let (all, inertia) = (own.mass() + mass, own.inertia()[2][2] + mass * square);
        let expected = 9.81 * 0.2f64.sin() / (1.0 + inertia / (all * RADIUS * RADIUS));
        let speed = |world: &DeformableWorld| world.bodies[body].linvel()[0];
        let (start, steps) = (speed(&world), (1.0 / dt) as usize);
        (0..steps).for_each(|_| world.step(&mut physics));
        let found = (speed(&world) - start) / (steps as f64 * f64::from(dt));
        println!("{modulus:e} Pa, {dt:.4} s, {hub:?}: {found:.4} of {expected:.4} m/s²");
        // Each of its 96 facets takes some.
        assert!(found > 0.92 * expected && found < 1.02 * expected, "{found} {expected}");
    }
}

/// A cart on a wheel whose hub a motor turns at 10 rad/s, by an impulse joint or as a link of a multibody: it goes as fast as the rim.
#[test]
fn a_motor_drives_a_cart_on_a_soft_wheel() {
    for (modulus, is_link) in [(1e7, false), (1e6, true)] {
        let (mut physics, mut world) = (world(1.0 / 60.0), DeformableWorld::new());
        let (_, hub) = insert(&mut world, &mut physics, Hub::Attached, modulus, 0.0);
        // So that it hardly tilts.
        let large = MassProperties::new(Vector::ZERO, 20.0, Vector::splat(2_000.0));
        let cart = RigidBodyBuilder::dynamic().translation(Vector::Y * RADIUS as f32);
        let cart = physics.insert_body(cart.additional_mass_properties(large));
        let joint = RevoluteJointBuilder::new(Vector::Z).motor_velocity(-10.0, 200.0).motor_max_force(40.0);
        if is_link {
            physics.insert_multibody_joint(cart, hub, joint);
        } else {
            physics.insert_impulse_joint(cart, hub, joint);
        }
        let mut speeds = Vec::new();
        for step in 0..150 {
            world.step(&mut physics);
            if step >= 120 {
                speeds.push(f64::from(physics.bodies[cart].linvel().x));
            }
        }
        let turn = -f64::from(physics.bodies[hub].angvel().z);
        let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
        let rolled = mean / (turn * RADIUS);
        println!(
            "{modulus:e} Pa, link {is_link}: hub {turn:.3} rad/s, cart {mean:.4} m/s, {rolled:.3} of the rim"
        );
        assert!(turn > 9.0 && turn < 10.1 && (rolled - 1.0).abs() < 0.05, "{turn} {rolled}");
    }
}

#[test]
fn wheels_roll_on_in_short_steps() {
    keeps_its_speed(&[Hub::Region, Hub::Attached], 1e5, 1.0 / 240.0, 6.0, 0.96);
}
