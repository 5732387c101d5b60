//! Worlds that are saved and loaded.

use crate::common::games::{H, Random};
use crate::common::world_with_floor;
use foible3d::prelude::*;
use foible3d::{BodyError, DeformableState};
use rapier3d::prelude::*;
use serde::{Deserialize, Serialize};
use std::process::Command;

/// Rapier's world and ours, written beside one another.
#[derive(Serialize)]
struct Saved<'a>(&'a PhysicsWorld, &'a DeformableWorld);

#[derive(Deserialize)]
struct Loaded(PhysicsWorld, DeformableWorld);

fn save(physics: &PhysicsWorld, world: &DeformableWorld) -> Vec<u8> {
    postcard::to_stdvec(&Saved(physics, world)).unwrap()
}

fn load(bytes: &[u8]) -> (PhysicsWorld, DeformableWorld) {
    let Loaded(physics, world) = postcard::from_bytes(bytes).unwrap();
    (physics, world)
}

/// Every bit of what moves.
fn bits(physics: &PhysicsWorld, world: &DeformableWorld) -> Vec<u64> {
    let soft = world.bodies.iter().flat_map(|(_, body)| {
        (0..body.vertex_count()).flat_map(|v| {
            let (x, u) = (body.position(v).unwrap(), body.velocity(v).unwrap());
            x.into_iter().chain(u).map(f64::to_bits).collect::<Vec<_>>()
        })
    });
    let rigid = physics.bodies.iter().flat_map(|(_, body)| {
        let (at, v) = (body.translation(), body.linvel());
        [at.x, at.y, at.z, v.x, v.y, v.z].map(|c| u64::from(c.to_bits()))
    });
    soft.chain(rigid).collect()
}

/// Twenty bodies of two models and some boxes that fall on one another, in mid-fall or at rest.
fn pile() -> (PhysicsWorld, DeformableWorld) {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let sole = DeformableMaterial::new(1e6, 0.2).density(1500.0).friction(0.9);
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.12), [4; 3]);
    let cube = cube.regions(|[_, y, _]| u32::from(y < -0.06)).region_material(1, sole);
    let ball = DeformableBodyBuilder::filled(&Ball::new(0.13), 0.0625);
    for k in 0..20 {
        let at = Vector::new(0.2 * (k % 3) as f32 - 0.2, 0.2 + 0.16 * k as f32, 0.17 * (k % 2) as f32);
        let (builder, integrator) = match k % 4 {
            0 | 1 => (&cube, Integrator::ImplicitEuler),
            2 => (&ball, Integrator::ImplicitEuler),
            _ => (&ball, Integrator::Bdf2),
        };
        let body = builder.clone().translation(at).rotation(Vector::new(0.3, 0.1, 0.2) * k as f32);
        let body = body.material(DeformableMaterial::new(3e5, 0.3).restitution(0.2).mass_damping(1.0));
        let body = body.tune(|settings| settings.integrator = integrator).active_events(ActiveEvents::all());
        world.insert(body).unwrap();
        if k % 5 == 0 {
            let at = RigidBodyBuilder::dynamic().translation(at + Vector::X * 0.4);
            physics.insert(at, ColliderBuilder::cuboid(0.1, 0.1, 0.1));
        }
    }
    (physics, world)
}

#[test]
fn a_pile_goes_on_with_the_same_bits_in_a_fresh_process() {
    let (mut physics, mut world) = pile();
    for _ in 0..90 {
        world.step(&mut physics);
    }
    let path = std::env::temp_dir().join(format!("foible3d-snapshot-{}", std::process::id()));
    let bytes = save(&physics, &world);
    std::fs::write(&path, &bytes).unwrap();
    let mut events = Vec::new();
    for _ in 0..120 {
        world.step(&mut physics);
        events.extend_from_slice(world.collision_events());
    }
    let other = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "snapshots::in_a_fresh_process", "--ignored", "--nocapture"])
        .env("FOIBLE3D_SNAPSHOT", &path)
        .output()
        .unwrap();
    std::fs::remove_file(&path).unwrap();
    let printed = String::from_utf8_lossy(&other.stdout);
    let last = |name: &str| {
        let line =
            printed.lines().find_map(|line| line.split_once(name)).unwrap_or_else(|| panic!("{printed}"));
        line.1.trim().to_string()
    };
    assert_eq!(last("bits:"), fingerprint(&bits(&physics, &world)));
    assert_eq!(last("events:"), format!("{events:?}"));
}

fn fingerprint(bits: &[u64]) -> String {
    let hash = bits.iter().fold(0xcbf2_9ce4_8422_2325u64, |h, b| (h ^ b).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{} numbers, {hash:016x}", bits.len())
}

#[test]
#[ignore = "slow: the other half of the test above, which runs it"]
fn in_a_fresh_process() {
    let Ok(path) = std::env::var("FOIBLE3D_SNAPSHOT") else { return };
    let (mut physics, mut world) = load(&std::fs::read(path).unwrap());
    let mut events = Vec::new();
    for _ in 0..120 {
        world.step(&mut physics);
        events.extend_from_slice(world.collision_events());
    }
    println!("\nbits: {}", fingerprint(&bits(&physics, &world)));
    println!("events: {events:?}");
}

#[test]
fn a_snapshot_is_small_and_models_are_shared() {
    let (mut physics, mut world) = pile();
    for _ in 0..90 {
        world.step(&mut physics);
    }
    let bytes = postcard::to_stdvec(&world).unwrap();
    let loaded: DeformableWorld = postcard::from_bytes(&bytes).unwrap();
    let mut models: Vec<_> =
        loaded.bodies.iter().map(|(_, body)| std::sync::Arc::as_ptr(body.model())).collect();
    models.sort_unstable();
    models.dedup();
    assert_eq!(models.len(), 2);
    let tets: usize = loaded.bodies.iter().map(|(_, body)| body.model().tetrahedron_count()).sum();
    let nodes: usize = loaded.bodies.iter().map(|(_, body)| body.vertex_count()).sum();
    let per_tet = bytes.len() as f64 / tets as f64;
    println!(
        "{} bytes, {tets} tetrahedra, {nodes} vertices: {per_tet:.1} bytes per tetrahedron",
        bytes.len()
    );
    // Positions and velocities are 48 bytes a vertex; contacts, history and models come on top.
    assert!(bytes.len() > 48 * nodes && bytes.len() < 130 * nodes, "{per_tet}");
    assert_eq!(postcard::to_stdvec(&loaded).unwrap(), bytes, "what is loaded is what was saved");
}

/// Everything that a set holds: sheets, ropes, fibres, smoothed bodies, kinds, pins, wind, attachments, a cable, gaps in the slots.
fn menagerie() -> (PhysicsWorld, DeformableWorld) {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let at = |k: usize| Vector::new(0.6 * k as f32 - 2.0, 0.5, 0.0);
    let cube = || DeformableBodyBuilder::cuboid(Vector::splat(0.12), [2; 3]);
    let gone = world.insert(cube()).unwrap();
    let bodies = [
        cube().smoothed(),
        DeformableBodyBuilder::cloth([0.2, 0.2], [3, 3], 1e-3).pinned(|x| x.x < -1.5),
        DeformableBodyBuilder::rope(&[0, 1, 2, 3].map(|k| Vector::Y * 0.1 * k as f32), 0.01),
        DeformableBodyBuilder::spring_network(&TetMesh::cuboid([0.1; 3], [1; 3]).unwrap()),
        DeformableBodyBuilder::model(std::sync::Arc::new(
            DeformableModel::new(&TetMesh::cuboid([0.1, 0.2, 0.1], [1, 2, 1]).unwrap())
                .with_fibres(|_| [0.0, 2.0, 0.0])
                .smoothed(),
        )),
        cube().body_type(RigidBodyType::KinematicVelocityBased).linvel(Vector::Z * 0.1),
    ];
    let handles: Vec<_> =
        bodies.into_iter().enumerate().map(|(k, b)| world.insert(b.translation(at(k))).unwrap()).collect();
    let material = DeformableMaterial::new(1e5, 0.3).fibre_modulus(1e5);
    world.bodies[handles[4]].set_material(material).unwrap();
    world.bodies[handles[4]].set_activation(0.9).unwrap();
    world.bodies[handles[1]].set_wind(Some(DeformableWind::new(Vector::Z * 3.0))).unwrap();
    world.bodies[handles[0]].add_force(&[0, 1], Vector::X).unwrap();
    world.bodies.attach(handles[2], &[3], AttachTo::World).unwrap();
    world.bodies.attach(handles[3], &[0], AttachTo::Deformable(handles[0], vec![5])).unwrap();
    let (carrier, _) =
        physics.insert(RigidBodyBuilder::dynamic().translation(at(6)), ColliderBuilder::ball(0.1));
    let to = AttachTo::RigidBody(carrier, *physics.bodies[carrier].position());
    world.bodies.attach(handles[4], &[0, 1], to).unwrap();
    let points = [
        CablePoint::Vertex(handles[0], 7),
        CablePoint::RigidBody(carrier, Vector::Y * 0.05),
        CablePoint::World(at(6) + Vector::Y),
    ];
    world.bodies.insert_cable(DeformableCableBuilder::new(points).friction(0.3).tension(2.0)).unwrap();
    world.remove(gone).unwrap();
    world.query_colliders = Some(DeformableColliders::new());
    (physics, world)
}

#[test]
fn everything_that_a_world_holds_comes_back() {
    for before in [0, 1, 45] {
        let (mut physics, mut world) = menagerie();
        (0..before).for_each(|_| world.step(&mut physics));
        let (mut physics2, mut world2) = load(&save(&physics, &world));
        // Handles of what comes after are the same, too.
        let new = || DeformableBodyBuilder::cuboid(Vector::splat(0.1), [1; 3]).translation(Vector::Y * 3.0);
        assert_eq!(world.insert(new()).unwrap(), world2.insert(new()).unwrap());
        for step in 0..60 {
            world.step(&mut physics);
            world2.step(&mut physics2);
            assert_eq!(bits(&physics, &world), bits(&physics2, &world2), "step {step} after {before}");
        }
    }
}

#[test]
fn what_sleeps_sleeps_on() {
    let (mut physics, _) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let material = DeformableMaterial::new(1e5, 0.3).mass_damping(3.0);
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::Y * 0.1);
    let body = world.insert(cube.material(material).active_events(ActiveEvents::COLLISION_EVENTS)).unwrap();
    for _ in 0..180 {
        world.step(&mut physics);
    }
    assert!(world.bodies[body].is_sleeping());
    let (mut physics, mut world) = load(&save(&physics, &world));
    world.step(&mut physics);
    assert!(world.bodies[body].is_sleeping() && world.collision_events().is_empty());
}

#[test]
fn what_slept_lists_its_contacts_after_it_is_loaded_or_cloned() {
    let (mut physics, floor) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]);
    let cube = cube.material(DeformableMaterial::new(1e5, 0.3).mass_damping(3.0));
    let [lower, upper] = [0.1, 0.3].map(|y| world.insert(cube.clone().translation(Vector::Y * y)).unwrap());
    (0..300).for_each(|_| world.step(&mut physics));
    assert!(world.bodies.iter().all(|(_, body)| body.is_sleeping()));
    let (contacts, pairs) = (world.contacts().to_vec(), world.pair_contacts().to_vec());
    // 8 kg on 8 kg.
    let (all, one) = (world.contact_force(lower, floor).y, world.pair_force(upper, lower).y);
    assert!((all - 157.0).abs() < 0.1 && (one - 78.5).abs() < 0.1, "{all} {one}");
    let (mut loaded_physics, mut loaded) = load(&save(&physics, &world));
    let mut cloned = world.clone();
    for (physics, world) in [(&mut loaded_physics, &mut loaded), (&mut physics, &mut cloned)] {
        world.step(physics);
        assert_eq!((world.contacts(), world.pair_contacts()), (&contacts[..], &pairs[..]));
        // Gone with what they were with.
        world.bodies[upper].teleport(Pose::from_translation(Vector::Y)).unwrap();
        world.step(physics);
        assert!(world.pair_contacts().is_empty() && !world.bodies[lower].is_sleeping());
    }
}

#[test]
fn what_is_put_to_sleep_lists_its_contacts_after_it_is_loaded() {
    let (mut physics, floor) = world_with_floor(H);
    let mut world = DeformableWorld::new();
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.1), [2; 3]).translation(Vector::Y * 0.1);
    let body = world.insert(cube.material(DeformableMaterial::new(1e5, 0.3).mass_damping(3.0))).unwrap();
    (0..20).for_each(|_| world.step(&mut physics));
    world.bodies[body].sleep();
    world.step(&mut physics);
    let force = world.contact_force(body, floor);
    assert!(world.bodies[body].is_sleeping() && force.y > 10.0);
    let (mut physics, mut world) = load(&save(&physics, &world));
    world.step(&mut physics);
    assert_eq!(world.contact_force(body, floor), force);
}

#[test]
fn text_formats_without_infinity_hold_a_world_to_the_bit() {
    let (mut physics, mut world) = pile();
    let colliders = DeformableColliders::new();
    world.query_colliders = Some(colliders);
    let handles: Vec<DeformableBodyHandle> = world.bodies.iter().map(|(handle, _)| handle).collect();
    let held = world.bodies.attach(handles[3], &[0, 1, 2], AttachTo::World).unwrap();
    let body = &mut world.bodies[handles[4]];
    body.set_sleep_thresholds(f64::INFINITY, f64::NAN);
    body.set_material(DeformableMaterial::new(2e5, 0.2).maxwell_branches([(0.5, 0.1)])).unwrap();
    world.bodies[handles[5]].set_sleep_thresholds(f64::NAN, 1.0);
    (0..60).for_each(|_| world.step(&mut physics));
    let text = serde_json::to_string(&world).unwrap();
    let mut again: DeformableWorld = serde_json::from_str(&text).unwrap();
    let mut physics2: PhysicsWorld = postcard::from_bytes(&postcard::to_stdvec(&physics).unwrap()).unwrap();
    assert_eq!(again.bodies.attachment(held).unwrap().break_force(), f64::INFINITY);
    for step in 0..60 {
        world.step(&mut physics);
        again.step(&mut physics2);
        assert_eq!(bits(&physics, &world), bits(&physics2, &again), "step {step}");
    }
}

#[test]
fn another_version_is_refused_by_name() {
    let mut bytes = postcard::to_stdvec(&DeformableBodySet::new()).unwrap();
    assert_eq!(bytes[0], 11, "the version comes first");
    bytes[0] = 12;
    let refused = serde_error(&bytes);
    assert!(refused.contains("version 12") && refused.contains("version 11"), "{refused}");
}

/// Postcard keeps no messages: read by a format that does.
fn serde_error(bytes: &[u8]) -> String {
    use serde::de::value::{Error, U32Deserializer};
    use serde::de::{self, IntoDeserializer, SeqAccess, Visitor};
    struct One(u32);
    impl<'de> SeqAccess<'de> for One {
        type Error = Error;
        fn next_element_seed<T: de::DeserializeSeed<'de>>(
            &mut self,
            seed: T,
        ) -> Result<Option<T::Value>, Error> {
            let first: U32Deserializer<Error> = self.0.into_deserializer();
            seed.deserialize(first).map(Some)
        }
    }
    struct Format(u32);
    impl<'de> de::Deserializer<'de> for Format {
        type Error = Error;
        fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
            visitor.visit_seq(One(self.0))
        }
        serde::forward_to_deserialize_any! {
            bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
            newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
        }
    }
    match DeformableBodySet::deserialize(Format(bytes[0].into())) {
        Ok(_) => String::new(),
        Err(error) => error.to_string(),
    }
}

/// Cut, with bits turned, with numbers replaced: an error, or a world. Of those all step, or one in `every`.
fn damage(every: usize) {
    let (mut physics, mut world) = menagerie();
    (0..45).for_each(|_| world.step(&mut physics));
    let bytes = postcard::to_stdvec(&world).unwrap();
    let rapier = postcard::to_stdvec(&physics).unwrap();
    let mut random = Random(0x1234_5678_9abc_def1);
    let mut next = |n: usize| random.below(n as u32) as usize;
    let (mut refused, mut loaded, mut stepped) = (0, 0, 0);
    for case in 0..10_000 {
        let mut damaged = bytes.clone();
        match case % 4 {
            0 => damaged.truncate(next(bytes.len())),
            1 => damaged[next(bytes.len())] ^= 1 << next(8),
            2 => damaged[next(bytes.len())] = [0, 0x7f, 0x80, 0xff][next(4)],
            _ => (0..8).for_each(|_| damaged[next(bytes.len())] = next(256) as u8),
        }
        let Ok(mut world) = postcard::from_bytes::<DeformableWorld>(&damaged) else {
            refused += 1;
            continue;
        };
        loaded += 1;
        if loaded % every == 0 {
            stepped += 1;
            let mut physics: PhysicsWorld = postcard::from_bytes(&rapier).unwrap();
            (0..2).for_each(|_| world.step(&mut physics));
            assert!(physics.bodies.iter().all(|(_, body)| body.translation().is_finite()));
        }
    }
    println!("{} bytes: {refused} refused, {loaded} loaded, {stepped} stepped", bytes.len());
    assert!(refused > 2500 && stepped > 2500 / every);
}

#[test]
fn damaged_snapshots_are_refused_or_step() {
    damage(5);
}

#[test]
#[ignore = "slow: all that load step"]
fn damaged_snapshots_are_refused_or_all_step() {
    damage(1);
}

#[test]
fn states_are_saved_by_themselves_and_checked_when_they_come_back() {
    let (mut physics, mut world) = pile();
    (0..30).for_each(|_| world.step(&mut physics));
    let (handle, body) = world.bodies.iter().next().unwrap();
    let state = postcard::to_stdvec(body.state()).unwrap();
    let back: DeformableState = postcard::from_bytes(&state).unwrap();
    assert_eq!(&back, body.state());
    world.bodies[handle].restore(back).unwrap();
    let mut damaged = 0;
    for place in 0..state.len() {
        let mut bytes = state.clone();
        bytes[place] ^= 0x40;
        if let Ok(back) = postcard::from_bytes::<DeformableState>(&bytes)
            && let Err(error) = world.bodies[handle].restore(back)
        {
            damaged += usize::from(matches!(error, BodyError::BadState { .. }));
        }
    }
    assert!(damaged > 0);
}
