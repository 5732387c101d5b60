//! OBJ, STL, PLY and glTF files, written here and read back; damaged ones answer with an error.

use foible3d::prelude::*;
use proptest::prelude::*;
use rapier3d::prelude::*;
use std::fmt::Write;

fn surface() -> SurfaceMesh {
    let (vertices, triangles) = Ball::new(0.25).to_trimesh(12, 8);
    SurfaceMesh { vertices, triangles }
}

fn floats(mesh: &SurfaceMesh) -> impl Iterator<Item = f32> + '_ {
    mesh.vertices.iter().flat_map(|v| v.to_array())
}

fn obj(mesh: &SurfaceMesh) -> Vec<u8> {
    let mut text = String::from("# a ball\no ball\n");
    mesh.vertices.iter().for_each(|v| writeln!(text, "v {} {} {}", v.x, v.y, v.z).unwrap());
    mesh.triangles.iter().for_each(|t| writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).unwrap());
    text.into_bytes()
}

fn stl_text(mesh: &SurfaceMesh) -> Vec<u8> {
    let mut text = String::from("solid ball\n");
    for triangle in &mesh.triangles {
        writeln!(text, "facet normal 0 0 1\nouter loop").unwrap();
        for v in triangle.map(|v| mesh.vertices[v as usize]) {
            writeln!(text, "vertex {} {} {}", v.x, v.y, v.z).unwrap();
        }
        writeln!(text, "endloop\nendfacet").unwrap();
    }
    writeln!(text, "endsolid ball").unwrap();
    text.into_bytes()
}

fn stl_binary(mesh: &SurfaceMesh) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        bytes.extend([0u8; 12]);
        let corners = triangle.iter().flat_map(|v| mesh.vertices[*v as usize].to_array());
        bytes.extend(corners.flat_map(f32::to_le_bytes));
        bytes.extend([0u8; 2]);
    }
    bytes
}

fn ply(mesh: &SurfaceMesh, format: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    if format == "ascii" {
        let mut text = String::new();
        mesh.vertices.iter().for_each(|v| writeln!(text, "{} {} {}", v.x, v.y, v.z).unwrap());
        mesh.triangles.iter().for_each(|t| writeln!(text, "3 {} {} {}", t[0], t[1], t[2]).unwrap());
        bytes.extend(text.into_bytes());
        return bytes;
    }
    let is_little = format == "binary_little_endian";
    let four = |bits: u32| if is_little { bits.to_le_bytes() } else { bits.to_be_bytes() };
    bytes.extend(floats(mesh).flat_map(|x| four(x.to_bits())));
    for triangle in &mesh.triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|v| four(*v)));
    }
    bytes
}

fn gltf_json(mesh: &SurfaceMesh, uri: &str) -> String {
    let (vertices, corners) = (mesh.vertices.len(), 3 * mesh.triangles.len());
    let (first, second) = (12 * vertices, 4 * corners);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"translation":[1,2,3],"children":[1]}},{{"mesh":0,"scale":[2,2,2]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "buffers":[{{"byteLength":{}{uri}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{first}}},{{"buffer":0,"byteOffset":{first},"byteLength":{second}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3","min":[-1,-1,-1],"max":[1,1,1]}},
        {{"bufferView":1,"componentType":5125,"count":{corners},"type":"SCALAR"}}]}}"#,
        first + second
    )
}

fn gltf_buffer(mesh: &SurfaceMesh) -> Vec<u8> {
    let indices = mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes());
    floats(mesh).flat_map(f32::to_le_bytes).chain(indices).collect()
}

fn glb(mesh: &SurfaceMesh) -> Vec<u8> {
    let mut json = gltf_json(mesh, "").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let buffer = gltf_buffer(mesh);
    let mut bytes = b"glTF".to_vec();
    for word in [2, (28 + json.len() + buffer.len()) as u32, json.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((buffer.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(buffer);
    bytes
}

fn gltf(mesh: &SurfaceMesh) -> Vec<u8> {
    use base64::Engine;
    let data = base64::engine::general_purpose::STANDARD.encode(gltf_buffer(mesh));
    gltf_json(mesh, &format!(r#","uri":"data:application/octet-stream;base64,{data}""#)).into_bytes()
}

/// Every format: its extension, a file in it, and whether it shares vertices and moves them by the nodes above.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let mesh = surface();
    vec![
        ("obj", obj(&mesh)),
        ("stl", stl_text(&mesh)),
        ("stl", stl_binary(&mesh)),
        ("ply", ply(&mesh, "ascii")),
        ("ply", ply(&mesh, "binary_little_endian")),
        ("ply", ply(&mesh, "binary_big_endian")),
        ("glb", glb(&mesh)),
        ("gltf", gltf(&mesh)),
    ]
}

/// Welded, sound, and filled: its creases are kept, its holes stay round.
#[test]
fn a_bracket_from_an_stl_file_is_filled() {
    let (vertices, triangles) = crate::surfaces::bracket();
    let round = 0.5 * 32.0 * 0.15f64.powi(2) * (std::f64::consts::TAU / 32.0).sin();
    let volume = (0.2 + 0.2 * 0.6) * 0.6 - 2.0 * 0.2 * round;
    let read = SurfaceMesh::read_bytes("stl", &stl_binary(&SurfaceMesh { vertices, triangles })).unwrap();
    let (read, _) = read.repaired(&SurfaceRepair::default()).unwrap();
    assert!(read.report().is_sound(), "{:?}", read.report());
    assert!((read.report().volume / volume - 1.0).abs() < 1e-6);
    for (cell, bound) in [(0.1, 0.0095), (0.05, 0.0024)] {
        let mesh = read.filled(cell).unwrap();
        let off = mesh.volume() / volume - 1.0;
        let angles = mesh.dihedral_angles().fold([180.0, 0.0f64], |[l, m], a| [a.min(l), m.max(a)]);
        println!(
            "cells of {cell} m: {} tetrahedra, volume {off:+.1e}, {angles:.1?}°",
            mesh.tetrahedra().len()
        );
        assert!(off.abs() < bound, "{off:e}");
        assert!(angles[0] > 10.0 && angles[1] < 160.0, "{angles:?}");
    }
}

#[test]
fn every_format_is_read_back() {
    let mesh = surface();
    for (format, bytes) in files() {
        let read = SurfaceMesh::read_bytes(format, &bytes).unwrap();
        let back =
            |v: Vector| if format.starts_with("gl") { (v - Vector::new(1.0, 2.0, 3.0)) / 2.0 } else { v };
        assert_eq!(read.triangles.len(), mesh.triangles.len(), "{format}");
        for (own, other) in mesh.triangles.iter().zip(&read.triangles) {
            for (a, b) in own.iter().zip(other) {
                let off = (mesh.vertices[*a as usize] - back(read.vertices[*b as usize])).length();
                assert!(off < 1e-6, "{format}: {off}");
            }
        }
        assert!(read.report().is_sound(), "{format}: {}", read.report());
    }
}

#[test]
fn polygons_are_cut_and_negative_indices_count_from_the_end() {
    let text = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf -4//1 -3//1 -2//1 -1//1\n";
    let read = SurfaceMesh::read_bytes("obj", text).unwrap();
    assert_eq!(read.triangles.len(), 2);
    let area: f32 = read
        .triangles
        .iter()
        .map(|t| t.map(|v| read.vertices[v as usize]))
        .map(|[a, b, c]| (b - a).cross(c - a).z / 2.0)
        .sum();
    assert!((area - 1.0).abs() < 1e-6);
}

#[test]
fn files_on_disk_are_read_by_their_extension() {
    let folder = std::env::temp_dir().join(format!("foible3d-import-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mesh = surface();
    // Its buffer is a file beside it.
    std::fs::write(folder.join("ball.gltf"), gltf_json(&mesh, r#","uri":"ball.bin""#)).unwrap();
    std::fs::write(folder.join("ball.bin"), gltf_buffer(&mesh)).unwrap();
    std::fs::write(folder.join("ball.STL"), stl_binary(&mesh)).unwrap();
    std::fs::write(folder.join("ball.step"), "").unwrap();
    let read = ["ball.gltf", "ball.STL"].map(|name| SurfaceMesh::read(folder.join(name)).unwrap());
    assert!((read[0].volume() / 8.0 - read[1].volume()).abs() < 1e-4 * read[1].volume());
    for (name, said) in [("ball.step", "none of the formats"), ("none.obj", "none.obj")] {
        let error = SurfaceMesh::read(folder.join(name)).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_is_wrong_with_a_file_is_said() {
    let cut = &stl_binary(&surface())[..1000];
    let files: [(&str, &[u8], &str); 6] = [
        ("stl", cut, "bytes, the file has 1000"),
        ("obj", b"v 0 0 0\n", "no faces"),
        ("obj", b"v 0 0 zero\nf 1 1 1\n", ""),
        (
            "ply",
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n",
            "no x, y and z",
        ),
        ("glb", b"glTF", ""),
        ("gltf", b"{}", ""),
    ];
    for (format, bytes, said) in files {
        let error = SurfaceMesh::read_bytes(format, bytes).unwrap_err().to_string();
        assert!(error.contains(said) && error.contains(format), "{error}");
    }
}

/// Bytes turned, cut out and put in, so many cases of each format; what is read then is reported and repaired, without a panic.
fn damage(cases: u32) {
    files().iter().for_each(|(format, bytes)| damage_file(format, bytes, cases));
}

fn damage_file(format: &str, bytes: &[u8], cases: u32) {
    let config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    let changes = proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..3), 1..8);
    let mut runner = proptest::test_runner::TestRunner::new(config);
    let result = runner.run(&changes, |changes| {
        let mut bytes = bytes.to_vec();
        for (at, byte, what) in changes {
            let at = at.index(bytes.len());
            match what {
                0 => bytes[at] = byte,
                1 => bytes.truncate(at.max(1)),
                _ => bytes.insert(at, byte),
            }
        }
        if let Ok(read) = SurfaceMesh::read_bytes(format, &bytes) {
            prop_assert!(read.vertices.len() <= 2 * bytes.len());
            let _ = read.report().to_string();
            let _ = read.repaired(&SurfaceRepair::default());
        }
        Ok(())
    });
    result.unwrap_or_else(|error| panic!("{format}: {error}"));
}

#[test]
fn damaged_files_are_refused_or_read() {
    damage(100);
}

#[test]
#[ignore = "slow tier"]
fn many_damaged_files_are_refused_or_read() {
    damage(10_000);
}
