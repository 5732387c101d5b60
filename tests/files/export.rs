//! Files that others read: read back here, and by an independent reader of VTK's format in the slow tier.
use crate::common::world_with_floor;
use foible3d::prelude::*;
use foible3d::{SurfaceSequence, VtkSeries};
use rapier3d::prelude::*;
use std::path::{Path, PathBuf};
use vtkio::Vtk;
use vtkio::model::{Attribute, CellType, DataSet, Piece, UnstructuredGridPiece};

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("foible3d-export-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A cube of two regions on the floor, a cloth over it, a rope, and a network.
fn scene() -> (PhysicsWorld, DeformableWorld) {
    let (physics, _) = world_with_floor(1.0 / 60.0);
    let mut world = DeformableWorld::new();
    let cube = DeformableBodyBuilder::cuboid(Vector::splat(0.2), [4; 3]).translation(Vector::Y * 0.2);
    let cube = cube
        .regions(|[_, y, _]| 9 * u32::from(y < 0.0))
        .region_material(9, DeformableMaterial::new(1e7, 0.2));
    world.insert(cube.material(DeformableMaterial::new(1e5, 0.3).mass_damping(5.0))).unwrap();
    let cloth = DeformableBodyBuilder::cloth([0.3, 0.3], [6, 6], 1e-3).translation(Vector::Y * 0.45);
    world.insert(cloth).unwrap();
    let points = [[1.0, 0.1, 0.0], [1.2, 0.1, 0.0], [1.4, 0.1, 0.0]];
    world.insert(DeformableBodyBuilder::structure(&Structure::rod(&points, 0.01).unwrap())).unwrap();
    let mesh = TetMesh::cuboid([0.1; 3], [1; 3]).unwrap();
    let network = DeformableBodyBuilder::structure(&Structure::spring_network(&mesh));
    world.insert(network.translation(Vector::new(-1.0, 0.1, 0.0))).unwrap();
    (physics, world)
}

fn read(path: &Path) -> UnstructuredGridPiece {
    let DataSet::UnstructuredGrid { mut pieces, .. } = Vtk::import(path).unwrap().data else { panic!() };
    let Piece::Inline(piece) = pieces.remove(0) else { panic!() };
    *piece
}

fn field(list: &[Attribute], name: &str) -> Vec<f64> {
    let of = |a: &Attribute| match a {
        Attribute::DataArray(array) if array.name == name => array.data.cast_into(),
        _ => None,
    };
    list.iter().find_map(of).unwrap_or_else(|| panic!("there is no {name}"))
}

#[test]
fn a_series_holds_what_the_bodies_say() {
    let (mut physics, mut world) = scene();
    let folder = folder("series");
    let mut series = VtkSeries::create(folder.join("a & b.pvd")).unwrap();
    for step in 0..60 {
        world.step(&mut physics);
        if step % 20 == 19 {
            series.push(&world, f64::from(step + 1) / 60.0).unwrap();
        }
    }
    assert_eq!(series.len(), 3);
    let list = std::fs::read_to_string(folder.join("a & b.pvd")).unwrap();
    assert!(list.contains("timestep=\"1\"") && list.contains("file=\"a &amp; b_00002.vtu\""), "{list}");
    let grid = read(&folder.join("a & b_00002.vtu"));
    let points: Vec<f64> = grid.points.cast_into().unwrap();
    let bodies: Vec<_> = world.bodies.iter().collect();
    let all: Vec<[f64; 3]> =
        bodies.iter().flat_map(|(_, b)| (0..b.vertex_count()).map(|v| b.position(v).unwrap())).collect();
    assert_eq!(points, all.as_flattened(), "positions to the bit");
    let count = |kind| grid.cells.types.iter().filter(|k| **k == kind).count();
    let tets: usize = bodies.iter().map(|(_, b)| b.model().tetrahedron_count()).sum();
    assert_eq!([count(CellType::Tetra), count(CellType::Triangle), count(CellType::Line)], [tets, 6 * 13, 2]);
    let (cube, cells, of_points) = (bodies[0].1, &grid.data.cell, &grid.data.point);
    let von_mises = field(cells, "von_mises");
    for (written, stress) in von_mises.iter().zip(cube.stresses()) {
        assert!((written - stress.von_mises()).abs() < 1e-6 * stress.von_mises());
    }
    assert!(von_mises.last().unwrap().is_nan(), "a network has no stress");
    let region = field(cells, "region");
    assert_eq!(region[..tets - 5].iter().filter(|r| **r == 9.0).count(), (tets - 5) / 2);
    assert_eq!(field(cells, "body").last(), Some(&3.0));
    let energy: f64 = field(cells, "energy_density")
        .iter()
        .zip(cube.model().tetrahedra())
        .map(|(d, t)| {
            let [a, b, c, d4] = t.map(|v| nalgebra::Vector3::from(cube.model().rest_position(v as usize)));
            d * (b - a).cross(&(c - a)).dot(&(d4 - a)) / 6.0
        })
        .sum();
    assert!((energy / cube.elastic_energy() - 1.0).abs() < 1e-5);
    // Tractions times areas carry what lies on the floor.
    let (areas, traction) = (cube.vertex_areas(), field(of_points, "traction"));
    let carried: f64 = areas.iter().enumerate().map(|(v, a)| a * traction[3 * v + 1]).sum();
    assert!((carried / (cube.mass() * 9.81) - 1.0).abs() < 0.02, "{carried}");
    let displacement = field(of_points, "displacement");
    for v in 0..cube.vertex_count() {
        let moved = cube.position(v).unwrap()[1] - cube.model().rest_position(v)[1];
        assert!((displacement[3 * v + 1] - moved).abs() < 1e-6);
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// What is written is a mesh that is read, regions and all.
#[test]
fn a_written_body_is_read_as_a_mesh() {
    let (_, world) = scene();
    let folder = folder("mesh");
    world.write_vtu(folder.join("scene.vtu")).unwrap();
    let mesh = TetMesh::read(folder.join("scene.vtu")).unwrap();
    let (_, cube) = world.bodies.iter().next().unwrap();
    assert_eq!(mesh.tetrahedra().len(), cube.model().tetrahedron_count() + 5);
    assert!((mesh.volume() - cube.model().volume() - 8e-3).abs() < 1e-9);
    assert_eq!(mesh.regions().iter().filter(|r| **r == 9).count(), cube.model().tetrahedron_count() / 2);
    let nowhere = world.write_vtu(folder.join("no/such/folder.vtu")).unwrap_err();
    assert!(nowhere.to_string().contains("folder.vtu"));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn surfaces_are_objects_of_one_file() {
    let (mut physics, mut world) = scene();
    (0..30).for_each(|_| world.step(&mut physics));
    let path = folder("obj").join("scene.obj");
    world.write_obj(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text.lines().filter(|l| l.starts_with("o ")).count(), 4);
    let mesh = SurfaceMesh::read(&path).unwrap().repaired(&SurfaceRepair::default()).unwrap().0;
    let volumes: f64 = world.bodies.iter().map(|(_, b)| b.volume()).sum();
    // The cloth and the rope have a little.
    assert!((mesh.volume() / volumes - 1.0).abs() < 0.01, "{} {volumes}", mesh.volume());
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

/// Numbers of a vertex of a PLY file, eleven each, and corners of its faces.
fn ply(path: &Path) -> (Vec<[f32; 11]>, Vec<[u32; 3]>) {
    let bytes = std::fs::read(path).unwrap();
    let head = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let text = std::str::from_utf8(&bytes[..head]).unwrap();
    assert!(text.contains("format binary_little_endian 1.0"), "{text}");
    let count = |name: &str| text.split(name).nth(1).unwrap().split_whitespace().next().unwrap().parse();
    let (vertices, faces): (usize, usize) =
        (count("element vertex").unwrap(), count("element face").unwrap());
    assert_eq!(bytes.len() - head, 44 * vertices + 13 * faces);
    let (vertices, faces) = bytes[head..].split_at(44 * vertices);
    let words =
        |bytes: &[u8]| bytes.as_chunks::<4>().0.iter().map(|w| u32::from_le_bytes(*w)).collect::<Vec<_>>();
    let vertices = vertices.chunks(44).map(|v| {
        let words = words(v);
        std::array::from_fn(|k| if k < 10 { f32::from_bits(words[k]) } else { words[k] as f32 })
    });
    let faces = faces.chunks(13).map(|face| {
        assert_eq!(face[0], 3);
        words(&face[1..]).try_into().unwrap()
    });
    (vertices.collect(), faces.collect())
}

#[test]
fn sequences_keep_the_order_of_vertices_and_tell_velocity_and_stress() {
    let (mut physics, mut world) = scene();
    let folder = folder("sequence");
    let mut objects = SurfaceSequence::new(folder.join("run.obj")).unwrap();
    let mut points = SurfaceSequence::new(folder.join("run.PLY")).unwrap();
    let mut files = Vec::new();
    for step in 0..40 {
        world.step(&mut physics);
        if step % 10 == 9 {
            files.push((objects.push(&world).unwrap(), points.push(&world).unwrap()));
        }
    }
    assert_eq!((points.len(), files[3].1.file_name().unwrap().to_str()), (4, Some("run_00003.PLY")));
    let (_, first) = ply(&files[0].1);
    for (obj, own) in &files {
        let (vertices, faces) = ply(own);
        assert!(faces == first);
        // As text and as bits, one number.
        let text = std::fs::read_to_string(obj).unwrap();
        let numbers =
            |l: &str, by: char| l.split([' ', by]).skip(1).flat_map(str::parse::<f32>).collect::<Vec<_>>();
        let of = |kind: &'static str| text.lines().filter(move |l| l.starts_with(kind));
        assert!(of("v ").zip(&vertices).all(|(line, v)| numbers(line, ' ') == v[..3]));
        let corner = |line: &str, k: usize| numbers(line, '/')[2 * k] as u32 - 1;
        assert!(of("f ").zip(&faces).all(|(line, face)| [0, 1, 2].map(|k| corner(line, k)) == *face));
        assert_eq!([of("v ").count(), of("f ").count()], [vertices.len(), faces.len()]);
    }
    let (vertices, _) = ply(&files[3].1);
    for (k, (_, body)) in world.bodies.iter().enumerate() {
        let stresses = body.vertex_stresses();
        let of_body: Vec<_> = vertices.iter().filter(|v| v[10] == k as f32).collect();
        assert!(!of_body.is_empty());
        for v in of_body.iter().filter(|_| k == 0) {
            let near = |n: &usize| {
                (Vector::from(body.position(*n).unwrap().map(|c| c as f32)) - Vector::new(v[0], v[1], v[2]))
                    .length()
                    < 1e-6
            };
            let vertex = (0..body.vertex_count()).find(near).unwrap();
            let velocity = body.velocity(vertex).unwrap();
            (0..3).for_each(|axis| assert_eq!(v[6 + axis], velocity[axis] as f32));
            assert_eq!(v[9], stresses[vertex].von_mises() as f32);
        }
        assert_eq!(of_body.iter().all(|v| v[9].is_nan()), k > 1, "ropes and networks have none");
    }
    assert!(SurfaceSequence::new("run.fbx").unwrap_err().to_string().contains("`fbx`"));
    std::fs::remove_dir_all(folder).unwrap();
}

/// Written by this crate, read by meshio, which python3 has to find.
#[test]
#[ignore = "slow: needs python with meshio"]
fn an_independent_reader_agrees() {
    let (mut physics, mut world) = scene();
    (0..60).for_each(|_| world.step(&mut physics));
    let path = folder("meshio").join("scene.vtu");
    world.write_vtu(&path).unwrap();
    let [ply, obj] = ["scene.ply", "scene.obj"].map(|name| path.with_file_name(name));
    world.write_ply(&ply).unwrap();
    world.write_obj(&obj).unwrap();
    let script = "import meshio, sys; p = meshio.read(sys.argv[2]); o = meshio.read(sys.argv[3]); \
        assert abs(p.points - o.points).max() < 1e-6; assert (p.cells_dict['triangle'] == o.cells_dict['triangle']).all(); \
        assert p.point_data['von_mises'][:50].min() > 0 and abs(p.point_data['vy']).max() > 0; m = meshio.read(sys.argv[1]); \
        assert len(p.points) > 200; import sys; m = meshio.read(sys.argv[1]); \
        print(len(m.points), *(len(c.data) for c in m.cells), m.points[7][1], \
        float(m.cell_data['von_mises'][0][3]), float(m.point_data['velocity'][7][1]), m.cell_data['cauchy_stress'][0].shape[1])";
    let answer = std::process::Command::new("python3")
        .args(["-c", script])
        .args([&path, &ply, &obj])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&answer.stdout).into_owned();
    assert!(answer.status.success(), "{said} {}", String::from_utf8_lossy(&answer.stderr));
    let words: Vec<f64> = said.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let (_, cube) = world.bodies.iter().next().unwrap();
    let points: usize = world.bodies.iter().map(|(_, b)| b.vertex_count()).sum();
    assert_eq!(words[0], points as f64);
    // Cells in runs of one kind: cube, cloth, rope, network.
    assert_eq!(words[1..5], [cube.model().tetrahedron_count() as f64, 78.0, 2.0, 5.0]);
    assert_eq!(words[5], cube.position(7).unwrap()[1]);
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs();
    assert!(near(words[6], cube.stresses()[3].von_mises()), "{said}");
    assert!(near(words[7], cube.velocity(7).unwrap()[1]) && words[8] == 9.0, "{said}");
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}
