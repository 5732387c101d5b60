//! Regions that are rigid: bones and inserts, as rapier bodies of their own or part of one.
use crate::common::bones::*;
use crate::common::games::weightless;
use crate::common::*;
use foible3d::prelude::*;
use foible3d::{BodyError, HandleError, MeshError};
use rapier3d::prelude::*;

#[test]
fn mass_and_inertia_are_those_of_the_solid() {
    let (rest, regions) = bar(1e5).without_regions(&[BONE]).unwrap();
    let (bone, density) = (&regions[0], 7_800.0);
    // Cells of rapier's single precision.
    let [a, b, c] = [0.1f32, 0.02, 0.02].map(f64::from);
    let mass = density * a * b * c;
    assert!((bone.volume() / (a * b * c) - 1.0).abs() < 1e-12);
    assert!(bone.centre().iter().all(|c| c.abs() < 1e-15));
    let inertia = bone.inertia(density);
    let closed = [b * b + c * c, a * a + c * c, a * a + b * b].map(|s| mass * s / 12.0);
    for r in 0..3 {
        for c in 0..3 {
            let exact = if r == c { closed[r] } else { 0.0 };
            assert!((inertia[r][c] - exact).abs() < 1e-12 * closed[2], "{r} {c} {}", inertia[r][c]);
        }
    }
    // All of the core's surface, and nothing of the bar's.
    assert_eq!(bone.vertices().len(), 11 * 3 * 3 - 9);
    assert!(bone.surface().1.is_empty());
    let rest = rest.build().unwrap();
    assert_eq!(rest.model().vertex_count(), 21 * 25 - 9);
    let whole = [0.1f32, 0.02, 0.02].map(|half| 2.0 * f64::from(half)).iter().product::<f64>();
    assert!((rest.mass() - 1_100.0 * (whole - a * b * c)).abs() < 1e-12);
    // In rapier's single precision.
    let (mut physics, mut world) = (weightless(), DeformableWorld::new());
    let (_, bones) = world
        .insert_with_rigid_regions(bar(1e5), &[(BONE, RigidRegionBody::New(density))], &mut physics)
        .unwrap();
    world.step(&mut physics);
    let own = physics.bodies[bones[0].body].mass_properties().local_mprops.principal_inertia();
    let mut own = own.to_array().map(f64::from);
    own.sort_by(f64::total_cmp);
    let mut closed = closed;
    closed.sort_by(f64::total_cmp);
    assert!(own.iter().zip(&closed).all(|(o, c)| (o / c - 1.0).abs() < 1e-6), "{own:?} {closed:?}");
    assert!((f64::from(physics.bodies[bones[0].body].mass()) / mass - 1.0).abs() < 1e-6);
}

#[test]
fn a_rigid_core_is_one_of_a_hundred_thousand_times_the_stiffness() {
    let clamped = |builder: DeformableBodyBuilder| builder.pinned(|x| x.x < -0.099).settings(converged());
    let mut tips = Vec::new();
    for rigid in [true, false] {
        let (mut physics, mut world) = (PhysicsWorld::new(), DeformableWorld::new());
        let soft = DeformableMaterial::new(2e5, 0.4).density(1_100.0).mass_damping(8.0);
        let builder = clamped(bar(2e5).material(soft));
        let body = if rigid {
            let kind = RigidRegionBody::New(1_100.0);
            let (body, bones) =
                world.insert_with_rigid_regions(builder, &[(BONE, kind)], &mut physics).unwrap();
            physics.bodies[bones[0].body].set_linear_damping(8.0);
            body
        } else {
            let stiff = DeformableMaterial::new(2e10, 0.4).density(1_100.0);
            world.insert(builder.region_material(BONE, stiff)).unwrap()
        };
        (0..300).for_each(|_| world.step(&mut physics));
        let tip = at_rest_where(&world.bodies[body], |x| x[0] > 0.099);
        tips.push(mean_position(&world.bodies[body], &tip)[1]);
    }
    println!("tips {tips:?}");
    assert!((tips[0] / tips[1] - 1.0).abs() < 1e-3, "{tips:?}");
}

/// Steps three seconds; the fastest vertex of the last quarter of a second [m/s].
fn settle(world: &mut DeformableWorld, physics: &mut PhysicsWorld, body: DeformableBodyHandle) -> f64 {
    let mut fastest = 0.0f64;
    for step in 0..180 {
        world.step(physics);
        fastest = if step < 165 { 0.0 } else { fastest.max(world.bodies[body].max_speed()) };
    }
    fastest
}

#[test]
fn what_is_on_the_outside_stands_on_the_floor() {
    // A rigid back of steel, below and above.
    for (side, modulus) in [(-1.0, 1e5), (1.0, 1e5), (-1.0, 1e7), (1.0, 1e7)] {
        let (mut physics, floor) = world_with_floor(1.0 / 60.0);
        let mut world = DeformableWorld::new();
        let soft = DeformableMaterial::new(modulus, 0.4).density(1_100.0).mass_damping(2.0);
        let backed = DeformableBodyBuilder::cuboid(Vector::new(0.1, 0.02, 0.02), [10, 4, 4])
            .regions(move |[_, y, _]| BONE * u32::from(y * side > 0.01))
            .material(soft)
            .translation(Vector::Y * 0.03);
        let kind = RigidRegionBody::New(7_800.0);
        let (body, bones) = world.insert_with_rigid_regions(backed, &[(BONE, kind)], &mut physics).unwrap();
        assert!(bones[0].collider.is_some());
        let fastest = settle(&mut world, &mut physics, body);
        let bone = &physics.bodies[bones[0].body];
        let low = bone.translation().y - 0.02;
        let carried = world.contact_force(body, floor).y;
        let weight = (f64::from(bone.mass()) + world.bodies[body].mass()) * G;
        println!(
            "side {side}, {modulus:e} Pa: {fastest:.1e} m/s, frame {low:.1e} m, soft feet carry {carried:.3} of {weight:.3} N"
        );
        assert!(fastest < 1e-3, "{fastest:e}");
        if side > 0.0 {
            assert!((f64::from(carried) / weight - 1.0).abs() < 1e-3, "{carried} of {weight}");
        } else {
            assert!(low.abs() < 2e-3, "{low}");
        }
    }
}

#[test]
fn a_region_is_part_of_a_link_that_leads_it() {
    let mut physics = PhysicsWorld::new();
    let arm = RigidBodyBuilder::kinematic_position_based();
    let arm = physics.insert_body(arm);
    let mut world = DeformableWorld::new();
    let part = RigidRegionBody::PartOf(arm);
    let (body, regions) = world.insert_with_rigid_regions(bar(1e5), &[(BONE, part)], &mut physics).unwrap();
    assert_eq!((regions[0].body, regions[0].collider, regions[0].region), (arm, None, BONE));
    let core = attached(&world.bodies[body]);
    for step in 1..=60 {
        let pose = Pose::new(Vector::Y * 0.002 * step as f32, Vector::Z * 0.03 * step as f32);
        physics.bodies[arm].set_next_kinematic_position(pose);
        world.step(&mut physics);
        let error = distortion(&world.bodies[body], &core);
        assert!(error < 1e-9, "{error:e}");
    }
    // It carries the weight.
    (0..600).for_each(|_| world.step(&mut physics));
    let held = world.bodies.attachment(regions[0].attachment).unwrap().force().y;
    let weight = world.bodies[body].mass() * G;
    assert!((f64::from(held) / weight - 1.0).abs() < 1e-3, "{held} of {weight}");
    // Let go, it falls.
    assert!(world.bodies.detach(regions[0].attachment).is_some());
    (0..30).for_each(|_| world.step(&mut physics));
    assert!(world.bodies[body].linvel()[1] < -4.0);
}

#[test]
fn without_contacts_a_body_passes_through_what_it_is_attached_to() {
    for enabled in [true, false] {
        let mut physics = PhysicsWorld::new();
        let shelf = RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.1, 0.0));
        let (shelf, collider) = physics.insert(shelf, ColliderBuilder::cuboid(0.2, 0.02, 0.2));
        let mut world = DeformableWorld::new();
        let body = world.insert(bar(1e5)).unwrap();
        let end = at_rest_where(&world.bodies[body], |x| x[0] < -0.099);
        let pose = *physics.bodies[shelf].position();
        let held = world.bodies.attach(body, &end, AttachTo::RigidBody(shelf, pose)).unwrap();
        world.bodies.attachment_mut(held).unwrap().set_contacts_enabled(enabled);
        let mut touched = false;
        for _ in 0..120 {
            world.step(&mut physics);
            touched |= world.contact_force(body, collider) != Vector::ZERO;
        }
        assert_eq!(touched, enabled);
    }
}

#[test]
fn what_cannot_be_rigid_says_why() {
    let mut physics = PhysicsWorld::new();
    let mut world = DeformableWorld::new();
    let mut insert = |builder, regions: &[(u32, RigidRegionBody)]| {
        world.insert_with_rigid_regions(builder, regions, &mut physics).map(|_| ()).unwrap_err()
    };
    let new = RigidRegionBody::New(1e3);
    assert_eq!(insert(bar(1e5), &[(7, new)]), MeshError::RegionNotSolid { region: 7 }.into());
    let halves = |[x, ..]: [f64; 3]| 1 + u32::from(x > 0.0);
    let both = insert(bar(1e5).regions(halves), &[(1, new), (2, new)]);
    assert!(
        matches!(both, DeformableBodyError::Mesh(MeshError::RegionsTouch { regions: [1, 2], .. })),
        "{both}"
    );
    assert_eq!(insert(bar(1e5).regions(|_| 1), &[(1, new)]), MeshError::Empty.into());
    let cloth = DeformableBodyBuilder::cloth([0.1, 0.1], [4, 4], 1e-3).regions(|_| 1);
    assert_eq!(insert(cloth, &[(1, new)]), MeshError::RegionNotSolid { region: 1 }.into());
    // Every other cell: what is left hangs together by edges.
    let checks = |x: [f64; 3]| x.iter().map(|c| ((c + 0.2) / 0.01) as u32).sum::<u32>() % 2;
    let checks = insert(bar(1e5).regions(checks), &[(1, new)]);
    assert!(matches!(checks, DeformableBodyError::Mesh(_)), "{checks}");
    // Two blocks that do not meet, in one mesh.
    let block = TetMesh::cuboid([0.1; 3], [1; 3]).unwrap();
    let mut points = block.vertices().to_vec();
    points.extend(block.vertices().iter().map(|[x, y, z]| [x + 1.0, *y, *z]));
    let count = block.vertices().len() as u32;
    let mut tets = block.tetrahedra().to_vec();
    tets.extend(block.tetrahedra().iter().map(|tet| tet.map(|v| v + count)));
    let pair = DeformableBodyBuilder::mesh(&TetMesh::new(points, tets).unwrap());
    let apart = insert(pair.regions(|[x, ..]| u32::from(x > 0.5)), &[(1, new)]);
    assert!(matches!(apart, DeformableBodyError::Body(BodyError::NoVertices { .. })), "{apart}");
    for density in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = insert(bar(1e5), &[(BONE, RigidRegionBody::New(density))]);
        assert!(matches!(
            error,
            DeformableBodyError::Body(BodyError::OutOfRange { quantity: "density", .. })
        ));
    }
    let gone = insert(bar(1e5), &[(BONE, RigidRegionBody::PartOf(RigidBodyHandle::from_raw_parts(3, 4)))]);
    assert_eq!(gone, HandleError::NoSuchRigidBody { index: 3, generation: 4 }.into());
    assert_eq!((physics.bodies.len(), world.bodies.iter().count()), (0, 0));
}
