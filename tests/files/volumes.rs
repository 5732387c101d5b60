//! Tetrahedra from TetGen, MEDIT and VTK files: written here, read back, damaged. Gmsh's have a test of their own.
use foible3d::{MeshError, TetMesh};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use std::fmt::Write;
use std::path::PathBuf;

const FORMATS: &[&str] = &[
    "tetgen",
    "medit",
    #[cfg(feature = "import")]
    "vtk",
    #[cfg(feature = "import")]
    "vtk_binary",
    #[cfg(feature = "import")]
    "vtu",
];

fn block() -> TetMesh {
    TetMesh::cuboid([0.3, 0.2, 0.1], [3, 2, 1]).unwrap().painted(|[x, _, _]| 3 * u32::from(x > 0.0))
}

/// The files of a mesh in a format, by their extensions.
fn written(mesh: &TetMesh, format: &str) -> Vec<(&'static str, Vec<u8>)> {
    match format {
        "tetgen" => {
            let mut nodes = format!("# points\n{} 3 1 1\n", mesh.vertices().len());
            for (k, [x, y, z]) in mesh.vertices().iter().enumerate() {
                writeln!(nodes, "{k} {x:e} {y} {z} 0.5 1 # a comment").unwrap();
            }
            let mut elements = format!("{} 4 1\n", mesh.tetrahedra().len());
            for (k, ([a, b, c, d], region)) in mesh.tetrahedra().iter().zip(mesh.regions()).enumerate() {
                writeln!(elements, "{k} {a} {b} {c} {d} {region}").unwrap();
            }
            vec![("node", nodes.into()), ("ele", elements.into())]
        }
        "medit" => {
            let mut text = String::from("MeshVersionFormatted 2\n\nDimension\n3\nVertices\n");
            writeln!(text, "{}", mesh.vertices().len()).unwrap();
            mesh.vertices().iter().for_each(|[x, y, z]| writeln!(text, "{x:e} {y} {z} 0").unwrap());
            text += "Triangles\n1\n1 2 3 8\nCorners 2 1 2\n";
            writeln!(text, "Tetrahedra\n{}", mesh.tetrahedra().len()).unwrap();
            for (tet, region) in mesh.tetrahedra().iter().zip(mesh.regions()) {
                let [a, b, c, d] = tet.map(|v| v + 1);
                // Turned the other way round: readers turn it back.
                writeln!(text, "{a} {b} {d} {c} {region}").unwrap();
            }
            vec![("mesh", (text + "End\n").into())]
        }
        #[cfg(feature = "import")]
        _ => vtk(mesh, format),
        #[cfg(not(feature = "import"))]
        _ => unreachable!(),
    }
}

/// With a triangle before the tetrahedra.
#[cfg(feature = "import")]
fn vtk(mesh: &TetMesh, format: &str) -> Vec<(&'static str, Vec<u8>)> {
    use vtkio::model::*;
    let corners = mesh.tetrahedra().iter().flatten().map(|v| u64::from(*v));
    let count = mesh.tetrahedra().len();
    let mut types = vec![CellType::Tetra; count + 1];
    types[0] = CellType::Triangle;
    let regions: Vec<i32> = std::iter::once(7).chain(mesh.regions().iter().map(|r| *r as i32)).collect();
    let piece = UnstructuredGridPiece {
        points: mesh.vertices().iter().flatten().copied().collect::<Vec<f64>>().into(),
        cells: Cells {
            cell_verts: VertexNumbers::XML {
                connectivity: [0, 1, 2].into_iter().chain(corners).collect(),
                offsets: (0..=count as u64).map(|k| 3 + 4 * k).collect(),
            },
            types,
        },
        data: Attributes {
            point: Vec::new(),
            cell: vec![Attribute::DataArray(DataArray::scalars("MaterialIds", 1).with_vec(regions))],
        },
    };
    let xml = format == "vtu";
    let file = Vtk {
        version: if xml { Version::new_xml(1, 0) } else { Version::new_legacy(4, 2) },
        title: "block".into(),
        byte_order: if xml { ByteOrder::LittleEndian } else { ByteOrder::BigEndian },
        data: DataSet::inline(piece),
        file_path: None,
    };
    let mut bytes = Vec::new();
    match format {
        "vtu" => file.write_xml(&mut bytes).unwrap(),
        "vtk_binary" => file.write_legacy(&mut bytes).unwrap(),
        _ => {
            let mut text = String::new();
            file.write_legacy_ascii(&mut text).unwrap();
            bytes = text.into();
        }
    }
    vec![(if xml { "vtu" } else { "vtk" }, bytes)]
}

/// Reads files of these bytes.
fn read(name: &str, files: &[(&'static str, Vec<u8>)]) -> Result<TetMesh, MeshError> {
    let stem = std::env::temp_dir().join(format!("foible3d-volumes-{}-{name}", std::process::id()));
    let paths: Vec<PathBuf> = files.iter().map(|(extension, _)| stem.with_extension(extension)).collect();
    paths.iter().zip(files).for_each(|(path, (_, bytes))| std::fs::write(path, bytes).unwrap());
    let mesh = TetMesh::read(paths.last().unwrap());
    paths.iter().for_each(|path| std::fs::remove_file(path).unwrap());
    mesh
}

/// Corners of all tetrahedra, each ascending, with their regions, in ascending order.
fn corners(mesh: &TetMesh) -> Vec<([[u64; 3]; 4], u32)> {
    let bits = |i: u32| mesh.vertices()[i as usize].map(|c| (c + 0.0).to_bits());
    let mut all: Vec<_> =
        mesh.tetrahedra().iter().map(|t| t.map(bits)).zip(mesh.regions().to_vec()).collect();
    all.iter_mut().for_each(|(t, _)| t.sort_unstable());
    all.sort_unstable();
    all
}

#[test]
fn every_format_gives_the_mesh_and_its_regions_back() {
    for format in FORMATS {
        let found = read(format, &written(&block(), format)).unwrap();
        assert_eq!(corners(&found), corners(&block()), "{format}");
    }
}

fn damage(k: usize, (file, at, byte, cut): (usize, f64, u8, bool)) -> Result<TetMesh, MeshError> {
    let mut files = written(&block(), FORMATS[k]);
    let count = files.len();
    let bytes = &mut files[file % count].1;
    let at = (at * bytes.len() as f64) as usize;
    if cut {
        bytes.truncate(at)
    } else {
        bytes[at] = byte
    }
    read(&format!("damaged-{k}"), &files)
}

/// Ten thousand of each format.
#[test]
fn damaged_files_are_errors_or_meshes() {
    for k in 0..FORMATS.len() {
        let how = (0usize..2, 0.0..1.0f64, any::<u8>(), any::<bool>());
        let mut runner = TestRunner::new(Config { failure_persistence: None, ..Config::with_cases(10_000) });
        let result = runner.run(&how, |how| {
            if let Err(error) = damage(k, how) {
                prop_assert!(!error.to_string().is_empty());
            }
            Ok(())
        });
        result.unwrap_or_else(|error| panic!("{}: {error}", FORMATS[k]));
    }
}

#[test]
fn what_is_wrong_is_said() {
    let medit = |from: &str, to: &str| {
        let text = String::from_utf8(written(&block(), "medit").remove(0).1).unwrap();
        read("wrong", &[("mesh", text.replacen(from, to, 1).into())]).unwrap_err().to_string()
    };
    assert!(medit("Dimension\n3", "Dimension\n2").ends_with("line 4: dimension 2; 3 is read"));
    assert!(medit("Vertices\n24", "Vertices\nmany").ends_with("line 6: `many` is no such number"));
    assert!(medit("Vertices\n24", "Vertices\n4000000000").contains("is no such number"));
    assert!(medit("Triangles", "Triads").contains("`Triads` where a section was expected"));
    let tetgen = |place: usize, from: &str, to: &str| {
        let mut files = written(&block(), "tetgen");
        files[place].1 = String::from_utf8(files[place].1.clone()).unwrap().replacen(from, to, 1).into();
        read("wrong", &files).unwrap_err().to_string()
    };
    assert!(tetgen(0, " 3 1 1", " 2 1 1").contains(".node: line 2: dimension 2; 3 is read"));
    assert!(tetgen(0, "24 3", "25 3").contains("the file ends too early"));
    assert!(tetgen(0, "\n5 ", "\n6 ").contains("node 6 is there twice"));
    assert!(
        tetgen(1, " 4 1\n", " 6 1\n").contains(".ele: line 1: 6 nodes per tetrahedron; 4 and 10 are read")
    );
    assert!(tetgen(1, "\n0 ", "\n0 99 ").contains("refers to node 99, which is not there"));
    let other = TetMesh::read("thing.step").unwrap_err().to_string();
    assert!(other.contains("`step` is none of the formats"), "{other}");
    assert!(TetMesh::read("nowhere.ele").unwrap_err().to_string().contains("nowhere.node"));
    assert!(block().scaled(f64::NAN).is_err() && block().scaled(1e-9).is_err());
    let scaled = block().scaled(10.0).unwrap();
    assert!((scaled.volume() / block().volume() - 1e3).abs() < 1e-9 && scaled.regions() == block().regions());
}
