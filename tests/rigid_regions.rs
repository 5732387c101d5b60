//! Regions that are rigid: bones and inserts, as rapier bodies of their own or part of one.
mod common;
use common::games::{Random, weightless};
use common::*;
use foible3d::prelude::*;
use foible3d::{BodyError, HandleError, MeshError};
use rapier3d::prelude::*;

const BONE: u32 = 1;

/// A bar of 20 × 4 × 4 cm with a core of 10 × 2 × 2 cm.
fn bar(modulus: f64) -> DeformableBodyBuilder {
    DeformableBodyBuilder::cuboid(Vector::new(0.1, 0.02, 0.02), [20, 4, 4])
        .regions(|[x, y, z]| BONE * u32::from(x.abs() < 0.05 && y.abs() < 0.01 && z.abs() < 0.01))
        .material(DeformableMaterial::new(modulus, 0.4).density(1_100.0).mass_damping(0.0))
        .can_sleep(false)
}

/// The largest change of a distance between vertices, over the longest.
fn distortion(body: &DeformableBody, vertices: &[usize]) -> f64 {
    if vertices.is_empty() {
        return 0.0;
    }
    let x: Vec<[f64; 3]> = vertices.iter().map(|&v| body.position(v).unwrap()).collect();
    let at_rest: Vec<[f64; 3]> = vertices.iter().map(|&v| body.model().rest_position(v)).collect();
    let length = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let (mut worst, mut longest) = (0.0f64, 0.0f64);
    for i in 0..x.len() {
        for j in 0..i {
            let l = length(&at_rest[i], &at_rest[j]);
            (worst, longest) = (worst.max((length(&x[i], &x[j]) - l).abs()), longest.max(l));
        }
    }
    worst / longest
}

/// Elastic, kinetic and of height \[J\].
fn energy_of_all(own: &DeformableBody, rigid: &[&RigidBody]) -> f64 {
    let weight = |body: &&RigidBody| f64::from(body.mass()) * f64::from(body.center_of_mass().y);
    let kinetic: f64 = rigid.iter().map(|body| f64::from(body.kinetic_energy())).sum();
    let height = own.center_of_mass()[1] * own.mass() + rigid.iter().map(weight).sum::<f64>();
    total_energy(own) + kinetic + G * height
}

fn attached(body: &DeformableBody) -> Vec<usize> {
    let on = |c: f64, half: f64| c.abs() < half + 1e-6;
    at_rest_where(body, |[x, y, z]| on(x, 0.05) && on(y, 0.01) && on(z, 0.01))
}

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
fn an_insert_moves_rigidly_thrown_and_dropped() {
    let mut all_unsolved = 0;
    for (modulus, dt) in [(1e4, 1.0 / 60.0), (1e6, 1.0 / 60.0), (1e8, 1.0 / 60.0), (1e6, 1e-3), (1e6, 0.05)] {
        let (mut physics, floor) = world_with_floor(dt);
        let mut world = DeformableWorld::new();
        let thrown = bar(modulus).translation(Vector::Y * 0.4).angvel(Vector::new(3.0, 4.0, 8.0));
        let kind = RigidRegionBody::New(7_800.0);
        let (body, bones) = world.insert_with_rigid_regions(thrown, &[(BONE, kind)], &mut physics).unwrap();
        let core = attached(&world.bodies[body]);
        let (mut worst, mut off, mut unsolved, mut left) = (0.0f64, 0.0f64, 0, 0.0f64);
        let energy = |world: &DeformableWorld, physics: &PhysicsWorld| {
            energy_of_all(&world.bodies[body], &[&physics.bodies[bones[0].body]])
        };
        let (mut start, mut most) = (f64::NAN, 0.0f64);
        let mut factorizations = 0;
        let mut touched = false;
        // It lands after 0.26 s.
        let seconds = if dt < 2e-3 { 0.4 } else { 1.0 };
        for step in 0..(seconds / dt) as usize {
            world.step(&mut physics);
            factorizations += world.counters().contact_factorizations;
            let own = &world.bodies[body];
            touched |= world.contact_force(body, floor) != Vector::ZERO;
            // Rapier gives its bodies their masses in their first step.
            start = if step == 0 { energy(&world, &physics) } else { start };
            most = most.max(energy(&world, &physics) / start);
            let error = distortion(own, &core);
            if own.last_step_rejected() || world.counters().contact_error > 1e-3 {
                (unsolved, left) = (unsolved + 1, left.max(error));
                continue;
            }
            worst = worst.max(error);
            // And is where rapier has the bone, to single precision and the forces' accuracy.
            let pose = physics.bodies[bones[0].body].position();
            for &v in &core {
                let at_rest = own.model().rest_position(v).map(|c| c as f32);
                let at = pose.transform_point(Vector::from_array(at_rest)).to_array();
                let x = own.position(v).unwrap();
                off = (0..3).map(|k| (x[k] - f64::from(at[k])).abs()).fold(off, f64::max);
            }
        }
        println!(
            "{modulus:e} Pa, {dt} s: distortion {worst:.1e}, off the bone {off:.1e} m, energy at most {most:.4} of the start, {unsolved} unsolved steps with {left:.1e}, {factorizations} factorizations"
        );
        assert!(touched && worst < 1e-9, "{worst:e}");
        assert!(most < 1.005, "{most}");
        // Rapier turns it in substeps, and gyroscopically.
        let near = if dt > 0.04 { 6e-3 } else { 3e-3 };
        assert!(off < near && unsolved <= 3, "{off:e} {unsolved}");
        all_unsolved += unsolved;
    }
    assert!(all_unsolved <= 6, "{all_unsolved}");
}

#[test]
fn what_flies_keeps_its_momentum_and_makes_no_energy() {
    for modulus in [1e4, 1e6, 1e9] {
        let (mut physics, mut world) = (weightless(), DeformableWorld::new());
        let thrown = bar(modulus).linvel(Vector::X).angvel(Vector::new(0.5, 2.0, 6.0));
        let kind = RigidRegionBody::New(7_800.0);
        let (body, bones) = world.insert_with_rigid_regions(thrown, &[(BONE, kind)], &mut physics).unwrap();
        let masses = |world: &DeformableWorld, physics: &PhysicsWorld| {
            let (own, bone) = (&world.bodies[body], &physics.bodies[bones[0].body]);
            let m = f64::from(bone.mass());
            let v = bone.linvel().to_array().map(f64::from);
            let soft = own.linvel();
            let momentum = [0, 1, 2].map(|k| own.mass() * soft[k] + m * v[k]);
            let energy = total_energy(own) + f64::from(bone.kinetic_energy());
            (momentum, energy)
        };
        // Rapier gives its bodies their masses in their first step.
        world.step(&mut physics);
        let (start, energy) = masses(&world, &physics);
        let (mut drift, mut most) = (0.0f64, energy);
        for _ in 0..240 {
            world.step(&mut physics);
            let (momentum, energy) = masses(&world, &physics);
            drift = (0..3).map(|k| (momentum[k] - start[k]).abs() / start[0]).fold(drift, f64::max);
            most = most.max(energy);
        }
        let (_, end) = masses(&world, &physics);
        println!("{modulus:e}: momentum {drift:.1e}, energy {energy:.4} J at most {most:.4} ends {end:.4}");
        assert!(drift < 1e-5, "{drift:e}");
        assert!(most < 1.002 * energy, "{most} of {energy}");
        // What is stiff loses next to nothing; what is soft what implicit Euler takes.
        assert!(end > if modulus == 1e9 { 0.998 } else { 0.9 } * energy, "{end} of {energy}");
    }
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

/// What became of a throw.
struct Throw {
    /// The most that its energy comes to over that after the first step.
    most: f64,
    /// Steps that were solved, and those of them in which a core was off by more than 1e-9 of its length.
    solved: usize,
    off: usize,
}

/// A bar with a core, or with a block glued to either end, thrown on a floor in one of many ways.
fn throw(seed: u64, has_core: bool) -> Throw {
    let mut random = Random(seed * 7919 + 17);
    (0..5).for_each(|_| _ = random.unit());
    let modulus = 10f64.powi(4 + random.below(6) as i32);
    let dt = [1.0 / 240.0, 1.0 / 60.0, 1.0 / 30.0, 0.05][random.below(4) as usize];
    let density = [1_000.0, 7_800.0, 20_000.0][random.below(3) as usize];
    let spin = Vector::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5) * 20.0;
    let (mut physics, _) = world_with_floor(dt);
    let mut world = DeformableWorld::new();
    let thrown = bar(modulus).translation(Vector::Y * 0.4).angvel(spin);
    let (body, rigid) = if has_core {
        let kind = RigidRegionBody::New(f64::from(density));
        let (body, bones) = world.insert_with_rigid_regions(thrown, &[(BONE, kind)], &mut physics).unwrap();
        (body, vec![bones[0].body])
    } else {
        let body = world.insert(thrown).unwrap();
        let mut block = |side: f32| {
            let arm = Vector::X * side * 0.12;
            let at = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.4 + arm);
            let at = at.linvel(spin.cross(arm)).angvel(spin);
            let shape = ColliderBuilder::cuboid(0.02, 0.02, 0.02).density(density);
            let block = physics.insert(at, shape).0;
            let end = at_rest_where(&world.bodies[body], |x| f64::from(side) * x[0] > 0.1 - 1e-6);
            let to = AttachTo::RigidBody(block, *physics.bodies[block].position());
            world.bodies.attach(body, &end, to).unwrap();
            block
        };
        (body, [-1.0, 1.0].map(&mut block).to_vec())
    };
    let energy = |world: &DeformableWorld, physics: &PhysicsWorld| {
        let rigid: Vec<&RigidBody> = rigid.iter().map(|&handle| &physics.bodies[handle]).collect();
        energy_of_all(&world.bodies[body], &rigid)
    };
    // Rapier gives its bodies their masses in their first step.
    world.step(&mut physics);
    let start = energy(&world, &physics);
    let core = if has_core { attached(&world.bodies[body]) } else { Vec::new() };
    let mut found = Throw { most: 0.0, solved: 0, off: 0 };
    for _ in 0..(1.2 / dt) as usize {
        world.step(&mut physics);
        let now = energy(&world, &physics) / start;
        // NaN is no largest number: it is told.
        found.most = if now.is_nan() { f64::INFINITY } else { found.most.max(now) };
        let own = &world.bodies[body];
        if !own.last_step_rejected() && world.counters().contact_error <= 1e-3 {
            found.solved += 1;
            found.off += usize::from(distortion(own, &core) > 1e-9);
        }
    }
    found
}

/// Seeds 1 to 3 made 1e25, 1e13 and 364 times their energy while arcs of attached points took the turn of the step's start.
#[test]
fn random_throws_make_no_energy() {
    for seed in 0..4 {
        let most = [true, false].map(|has_core| throw(seed, has_core).most);
        println!("throw {seed}: {most:.4?} of the start");
        assert!(most.iter().all(|most| *most < 1.01), "{seed} {most:?}");
    }
}

#[test]
#[ignore = "slow tier"]
fn more_random_throws_make_no_energy_and_keep_cores_rigid_in_most_steps() {
    let (mut solved, mut off) = (0, 0);
    for seed in 4..16 {
        let thrown = [true, false].map(|has_core| throw(seed, has_core));
        assert!(thrown.iter().all(|thrown| thrown.most < 1.01), "{seed}");
        (solved, off) = (solved + thrown[0].solved, off + thrown[0].off);
    }
    println!("{off} of {solved} solved steps leave a core off by more than 1e-9 of its length");
    assert!(solved > 500 && off < solved / 128, "{off} of {solved}");
}
