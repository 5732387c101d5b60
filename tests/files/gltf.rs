//! Runs as glTF: read back by the library that reads such files, and by another in the slow tier.
use crate::common::world_with_floor;
use foible3d::prelude::*;
use foible3d::{GltfRecording, MeshError};
use gltf::Gltf;
use gltf::animation::util::ReadOutputs;
use rapier3d::prelude::*;

/// A node's vertices in each frame as the file has them: positions, normals, size.
struct Shown {
    frames: Vec<(Vec<Vector>, Vec<Vector>, f32)>,
}

fn vectors(list: impl Iterator<Item = [f32; 3]>) -> Vec<Vector> {
    list.map(Vector::from).collect()
}

/// Plays a file: `position + Σ w target` at the time of each frame.
fn play(bytes: &[u8]) -> (Vec<f32>, Vec<(String, Shown)>) {
    let Gltf { document, blob } = Gltf::from_slice(bytes).unwrap();
    let blob = blob.unwrap();
    let own = |_: gltf::Buffer<'_>| Some(&blob[..]);
    let channels: Vec<_> = document.animations().flat_map(|a| a.channels()).collect();
    let times: Vec<f32> = channels[0].reader(own).read_inputs().unwrap().collect();
    let mut nodes = Vec::new();
    for node in document.nodes() {
        let primitive = node.mesh().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(own);
        let base = vectors(reader.read_positions().unwrap());
        let normals = reader.read_normals().map(vectors).unwrap_or_default();
        assert!(reader.read_indices().unwrap().into_u32().all(|v| (v as usize) < base.len()));
        let targets: Vec<[Vec<Vector>; 2]> = reader
            .read_morph_targets()
            .map(|(p, n, _)| [p, n].map(|list| list.map(vectors).unwrap_or_default()))
            .collect();
        let mut weights = vec![vec![0.0; targets.len()]; times.len()];
        let (mut sizes, mut places) = (vec![1.0; times.len()], vec![Vector::ZERO; times.len()]);
        let (place, mut turns) = (node.transform().decomposed(), vec![Rotation::IDENTITY; times.len()]);
        places.fill(Vector::from(place.0));
        turns.fill(Rotation::from_array(place.1));
        for channel in channels.iter().filter(|c| c.target().node().index() == node.index()) {
            assert_eq!(channel.reader(own).read_inputs().unwrap().collect::<Vec<_>>(), times);
            match channel.reader(own).read_outputs().unwrap() {
                ReadOutputs::MorphTargetWeights(all) => {
                    let all: Vec<f32> = all.into_f32().collect();
                    weights = all.chunks(targets.len()).map(<[f32]>::to_vec).collect();
                }
                ReadOutputs::Scales(all) => sizes = all.map(|s| s[0]).collect(),
                ReadOutputs::Translations(all) => places = vectors(all),
                ReadOutputs::Rotations(all) => turns = all.into_f32().map(Rotation::from_array).collect(),
            }
        }
        assert_eq!([weights.len(), sizes.len(), places.len(), turns.len()], [times.len(); 4]);
        let frames = (0..times.len()).map(|k| {
            let sum = |base: &[Vector], of: usize| {
                let add = |v: usize| {
                    base[v] + weights[k].iter().zip(&targets).map(|(w, t)| t[of][v] * *w).sum::<Vector>()
                };
                (0..base.len()).map(|v| turns[k] * add(v) + places[k] * (1 - of) as f32).collect::<Vec<_>>()
            };
            (sum(&base, 0), sum(&normals, 1), sizes[k])
        });
        nodes.push((node.name().unwrap().to_string(), Shown { frames: frames.collect() }));
    }
    (times, nodes)
}

/// What a body looks like now.
fn drawn(body: &DeformableBody) -> (Vec<Vector>, Vec<Vector>) {
    let mut mesh = DeformableSurfaceMesh::new(body.model());
    let skin = DeformableSkin::bind(body.model(), &mesh.vertices, &mesh.normals).unwrap();
    skin.update(body, &mut mesh.vertices, &mut mesh.normals).unwrap();
    (mesh.vertices, mesh.normals)
}

/// Bytes of the file.
fn bytes(recording: &GltfRecording, name: &str) -> Vec<u8> {
    let path = std::env::temp_dir().join(format!("foible3d-gltf-{}-{name}.glb", std::process::id()));
    recording.write(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    bytes
}

fn cube(at: f32) -> DeformableBodyBuilder {
    let cube =
        DeformableBodyBuilder::cuboid(Vector::splat(0.2), [3; 3]).translation(Vector::new(at, 0.3, 0.0));
    cube.material(DeformableMaterial::new(1e5, 0.3))
}

type Frame = Vec<Option<(Vec<Vector>, Vec<Vector>)>>;

/// Bodies that come and go, and a rigid crate; with what each frame has to show of three bodies, and where the crate is.
fn run(recording: &mut GltfRecording) -> (Vec<Frame>, Vec<Pose>, DeformableBodyHandle) {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let tumbling = RigidBodyBuilder::dynamic()
        .translation(Vector::new(0.0, 1.0, 0.0))
        .angvel(Vector::new(3.0, 1.0, 2.0));
    let (tumbling, _) = physics.insert(tumbling, ColliderBuilder::cuboid(0.1, 0.1, 0.1));
    let sensor = ColliderBuilder::ball(1.0).sensor(true);
    physics.insert(RigidBodyBuilder::fixed(), sensor);
    let mut world = DeformableWorld::new();
    let first = world.insert(cube(0.0).angvel(Vector::Y)).unwrap();
    let rope = Structure::rod(&[[1.0, 0.1, 0.0], [1.2, 0.2, 0.0], [1.4, 0.1, 0.0]], 0.01).unwrap();
    let rope = world.insert(DeformableBodyBuilder::structure(&rope)).unwrap();
    let (mut frames, mut poses, mut late) = (Vec::new(), Vec::new(), None);
    for frame in 0..30 {
        match frame {
            8 => late = Some(world.insert(cube(-1.0)).unwrap()),
            20 => drop(world.remove(rope)),
            _ => {}
        }
        world.step(&mut physics);
        let now = [Some(first), Some(rope), late].map(|h| h.and_then(|h| world.bodies.get(h)).map(drawn));
        frames.push(now.to_vec());
        poses.push(*physics.bodies[tumbling].position());
        recording.push_with_colliders(&world, physics.colliders.iter(), f64::from(frame) / 60.0).unwrap();
    }
    (frames, poses, first)
}

#[test]
fn every_frame_of_every_body_is_read_back() {
    let mut recording = GltfRecording::new(100);
    let (frames, poses, _) = run(&mut recording);
    let (times, nodes) = play(&bytes(&recording, "frames"));
    assert_eq!((times.len(), times[29]), (30, (29.0f64 / 60.0) as f32));
    let names: Vec<&str> = nodes.iter().map(|(name, _)| &name[..]).collect();
    assert_eq!(names, ["body_0", "body_1", "body_2", "collider_0", "collider_1"], "no sensor");
    for (k, all) in frames.iter().enumerate() {
        for (own, (name, shown)) in all.iter().zip(&nodes) {
            let (positions, normals, size) = &shown.frames[k];
            let Some((places, turned)) = own else {
                assert_eq!(*size, 0.0, "{name} is not there in frame {k}");
                continue;
            };
            assert_eq!((*size, places.len()), (1.0, positions.len()));
            // Two roundings of numbers of up to 2 m: half a unit in the last place each.
            let off = |a: &[Vector], b: &[Vector]| {
                a.iter().zip(b).map(|(a, b)| (a - b).abs().max_element()).fold(0.0, f32::max)
            };
            assert!(
                off(places, positions) <= 2.0 * f32::EPSILON,
                "{name}, frame {k}: {}",
                off(places, positions)
            );
            assert!(
                off(turned, normals) <= 2.0 * f32::EPSILON,
                "{name}, frame {k}: {}",
                off(turned, normals)
            );
        }
        // A corner of the crate.
        let corners: Vec<Vector> = Cuboid::new(Vector::splat(0.1)).to_trimesh().0;
        let own: Vec<Vector> = corners.iter().map(|c| poses[k].transform_point(*c)).collect();
        for (a, b) in own.iter().zip(&nodes[4].1.frames[k].0) {
            assert!((a - b).length() < 1e-6, "frame {k}: {a} {b}");
        }
    }
}

#[test]
fn files_are_bounded_and_what_rests_takes_no_room() {
    let (mut physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    world.insert(cube(0.0).linvel(Vector::X)).unwrap();
    world.insert(cube(2.0).body_type(RigidBodyType::Fixed)).unwrap();
    let mut recording = GltfRecording::new(16);
    let mut sizes = Vec::new();
    for frame in 0..200 {
        world.step(&mut physics);
        recording.push(&world, f64::from(frame) / 60.0).unwrap();
        assert!(recording.len() <= 16);
        sizes.push(bytes(&recording, "bounded").len());
    }
    // Evenly spaced, from the first on: 200 frames, one in sixteen.
    let spaced = recording.times().iter().enumerate().all(|(k, t)| (t - k as f32 * 16.0 / 60.0).abs() < 1e-5);
    assert!(spaced && recording.len() == 13, "{:?}", recording.times());
    // Vertices of two cubes: positions and normals at first, of one in each further frame.
    let (vertices, triangles) = (2 * 6 * 16, 2 * 6 * 18);
    let most = 24 * vertices + 12 * triangles + 15 * 12 * vertices + 4 * 16 * 15 + 16 * 800;
    assert!(sizes.iter().all(|size| *size < most), "{} {most}", sizes.iter().max().unwrap());
    let file = Gltf::from_slice(&bytes(&recording, "rest")).unwrap();
    let targets: Vec<usize> =
        file.meshes().map(|m| m.primitives().next().unwrap().morph_targets().count()).collect();
    assert!(targets[1] == 0 && targets[0] <= 12, "a fixed body takes no target: {targets:?}");
}

#[test]
fn skins_are_drawn_and_bad_frames_refused() {
    let mut world = DeformableWorld::new();
    let body = world.insert(cube(0.0)).unwrap();
    let (vertices, triangles) = Ball::new(0.2).to_trimesh(8, 6);
    let normals: Vec<Vector> = vertices.iter().map(|v| v.normalize()).collect();
    let skin = DeformableSkin::bind(world.bodies[body].model(), &vertices, &normals).unwrap();
    let mut recording = GltfRecording::new(2);
    let bad = recording.set_skin(body, skin.clone(), vec![[0, 1, 900]]).unwrap_err();
    assert!(matches!(bad, MeshError::TriangleOutOfRange { triangle: 0, vertex: 900, .. }));
    recording.set_skin(body, skin.clone(), triangles.clone()).unwrap();
    recording.push(&world, 0.0).unwrap();
    let file = SurfaceMesh::read_bytes("glb", &bytes(&recording, "skin")).unwrap();
    assert_eq!(file.triangles, triangles);
    assert!(
        file.vertices
            .iter()
            .zip(&vertices)
            .all(|(a, b)| (a - b - Vector::new(0.0, 0.3, 0.0)).length() < 1e-6)
    );
    assert!(recording.set_skin(body, skin, triangles).unwrap_err().to_string().contains("frames"));
    for time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(recording.push(&world, time).is_err(), "{time}");
    }
    recording.push(&world, 0.1).unwrap();
    assert!(recording.write("/no/such/folder/run.glb").is_err());
    // Without a frame it is a file without a scene.
    assert!(Gltf::from_slice(&bytes(&GltfRecording::new(5), "empty")).unwrap().nodes().next().is_none());
}

/// Read by pygltflib and trimesh, which python3 has to find: the highest vertex of each body in each frame.
#[test]
#[ignore = "slow: needs python with pygltflib and trimesh"]
fn an_independent_reader_plays_the_same() {
    let mut recording = GltfRecording::new(100);
    let (frames, ..) = run(&mut recording);
    let path = std::env::temp_dir().join(format!("foible3d-gltf-{}.glb", std::process::id()));
    recording.write(&path).unwrap();
    let script = r#"
import numpy, pygltflib, sys, trimesh
file = pygltflib.GLTF2().load(sys.argv[1])
blob = file.binary_blob()
def read(index):
    a = file.accessors[index]
    v = file.bufferViews[a.bufferView]
    wide = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[a.type]
    data = numpy.frombuffer(blob, "<f4", a.count * wide, v.byteOffset).reshape(a.count, wide)
    if a.min: assert numpy.allclose(data.min(0), a.min) and numpy.allclose(data.max(0), a.max)
    return data
animation = file.animations[0]
for n, node in enumerate(file.nodes):
    if not node.name.startswith("body"): continue
    part = file.meshes[node.mesh].primitives[0]
    base = read(part.attributes.POSITION)
    targets = numpy.array([read(t["POSITION"] if isinstance(t, dict) else t.POSITION) for t in part.targets])
    own = {c.target.path: animation.samplers[c.sampler] for c in animation.channels if c.target.node == n}
    weights = read(own["weights"].output).reshape(-1, len(targets))
    for w in weights: print((base + numpy.tensordot(w, targets, 1))[:, 1].max())
scene = trimesh.load(sys.argv[1])
assert len(scene.geometry) == 5, scene.geometry
"#;
    let answer = std::process::Command::new("python3").args(["-c", script]).arg(&path).output().unwrap();
    let said = String::from_utf8_lossy(&answer.stdout).into_owned();
    assert!(answer.status.success(), "{said} {}", String::from_utf8_lossy(&answer.stderr));
    let tops: Vec<f32> = said.lines().map(|line| line.parse().unwrap()).collect();
    assert_eq!(tops.len(), 3 * 30);
    for (k, all) in frames.iter().enumerate() {
        for (b, own) in all.iter().enumerate() {
            let Some((places, _)) = own else { continue };
            let top = places.iter().map(|p| p.y).fold(f32::MIN, f32::max);
            assert!((top - tops[30 * b + k]).abs() < 1e-6, "body {b}, frame {k}");
        }
    }
    std::fs::remove_file(path).unwrap();
}
