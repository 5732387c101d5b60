//! Gmsh files of every format that is read: some by Gmsh itself (`tests/meshes`: a box of 1 × 0.8 × 0.6 m, node tags shuffled,
//! in version 4, with points, lines, triangles and a physical group), others by a writer here, whole and damaged.
use foible3d::{MeshError, TetMesh};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use std::path::{Path, PathBuf};

const FILES: [&str; 6] = ["2.2", "2.2_parametric", "2.2_binary", "4.0", "4.1", "4.1_binary"];

fn path_of(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/meshes/box_{name}.msh"))
}

/// Reads a file of these bytes.
fn read(name: &str, bytes: &[u8]) -> Result<TetMesh, MeshError> {
    let path = std::env::temp_dir().join(format!("foible3d-gmsh-{}-{name}.msh", std::process::id()));
    std::fs::write(&path, bytes).unwrap();
    let mesh = TetMesh::read_gmsh(&path);
    std::fs::remove_file(path).unwrap();
    mesh
}

/// Corners of all tetrahedra, each ascending, in ascending order.
fn corners(mesh: &TetMesh) -> Vec<[[u64; 3]; 4]> {
    let bits = |i: u32| mesh.vertices()[i as usize].map(|c| (c + 0.0).to_bits());
    let mut all: Vec<_> = mesh.tetrahedra().iter().map(|t| t.map(bits)).collect();
    all.iter_mut().for_each(|t| t.sort_unstable());
    all.sort_unstable();
    all
}

#[test]
fn files_of_gmsh_hold_the_same_box() {
    let first = corners(&TetMesh::read_gmsh(path_of("4.1_binary")).unwrap());
    for name in FILES {
        let mesh = TetMesh::read_gmsh(path_of(name)).unwrap();
        assert_eq!((mesh.vertices().len(), mesh.tetrahedra().len()), (30, 59), "{name}");
        assert!((mesh.volume() - 0.48).abs() < 1e-12, "{name}: {}", mesh.volume());
        // Gmsh writes no groups to version 2 when it is told to save all.
        let group = if name.starts_with('4') { 7 } else { 0 };
        assert!(mesh.regions().iter().all(|region| *region == group), "{name}");
        assert_eq!(mesh.region_named("the volume"), Some(7), "{name}");
        // Text has 16 digits.
        let apart = corners(&mesh)
            .iter()
            .flatten()
            .flatten()
            .zip(first.iter().flatten().flatten())
            .any(|(a, b)| (f64::from_bits(*a) - f64::from_bits(*b)).abs() > 1e-15);
        assert!(!apart, "{name}");
    }
}

/// A format that the writer here writes.
#[derive(Clone, Copy, Debug)]
struct Format {
    version: &'static str,
    is_binary: bool,
    big_endian: bool,
    size: usize,
}

const FORMATS: [Format; 8] = {
    const fn format(version: &'static str, is_binary: bool, big_endian: bool, size: usize) -> Format {
        Format { version, is_binary, big_endian, size }
    }
    [
        format("2.2", false, false, 8),
        format("2.2", true, false, 8),
        format("2.2", true, true, 8),
        format("4.0", false, false, 8),
        format("4.0", true, false, 8),
        format("4.1", false, false, 8),
        format("4.1", true, true, 8),
        format("4.1", true, false, 4),
    ]
};

/// Writes numbers as a format has them.
struct Writer {
    format: Format,
    bytes: Vec<u8>,
}

impl Writer {
    fn text(&mut self, text: &str) {
        self.bytes.extend(text.as_bytes());
    }

    fn int(&mut self, i: i64) {
        match self.format {
            Format { is_binary: false, .. } => self.text(&format!("{i} ")),
            Format { big_endian: true, .. } => self.bytes.extend((i as i32).to_be_bytes()),
            _ => self.bytes.extend((i as i32).to_le_bytes()),
        }
    }

    fn size(&mut self, i: i64) {
        match self.format {
            Format { is_binary: true, size: 8, big_endian: true, .. } => self.bytes.extend(i.to_be_bytes()),
            Format { is_binary: true, size: 8, .. } => self.bytes.extend(i.to_le_bytes()),
            _ => self.int(i),
        }
    }

    fn real(&mut self, x: f64) {
        match self.format {
            Format { is_binary: false, .. } => self.text(&format!("{x:e} ")),
            Format { big_endian: true, .. } => self.bytes.extend(x.to_be_bytes()),
            _ => self.bytes.extend(x.to_le_bytes()),
        }
    }

    /// Ends a line of text.
    fn line(&mut self) {
        if !self.format.is_binary {
            self.text("\n");
        }
    }

    /// A tag of version 4: 4.1 has sizes.
    fn tag(&mut self, i: i64) {
        if self.format.version == "4.1" { self.size(i) } else { self.int(i) }
    }

    fn entity(&mut self, dimension: i64, tag: i64) {
        let [first, second] = if self.format.version == "4.1" { [dimension, tag] } else { [tag, dimension] };
        self.int(first);
        self.int(second);
    }
}

/// Tetrahedra in the physical group 3; the others are in none.
fn grouped(mesh: &TetMesh) -> usize {
    mesh.tetrahedra().len() / 3
}

/// A file of a mesh whose vertices have these tags, with a triangle before its tetrahedra.
fn written(mesh: &TetMesh, tags: &[i64], format: Format) -> Vec<u8> {
    let mut w = Writer { format, bytes: Vec::new() };
    w.text(&format!("$MeshFormat\n{} {} {}\n", format.version, u8::from(format.is_binary), format.size));
    if format.is_binary {
        w.int(1);
        w.text("\n");
    }
    w.text("$EndMeshFormat\n$PhysicalNames\n2\n2 3 \"skin\"\n3 3 \"a stiff back\"\n$EndPhysicalNames\n");
    if format.version != "2.2" {
        write_entities(&mut w);
    }
    w.text("$Nodes\n");
    if format.version == "2.2" {
        w.text(&format!("{}\n", tags.len()));
        for (tag, x) in tags.iter().zip(mesh.vertices()) {
            w.int(*tag);
            x.iter().for_each(|c| w.real(*c));
            w.line();
        }
    } else {
        write_node_blocks(&mut w, mesh, tags);
    }
    w.text("\n$EndNodes\n$Elements\n");
    let tag_of = |i: u32| tags[i as usize];
    let count = mesh.tetrahedra().len() as i64;
    if format.version == "2.2" {
        w.text(&format!("{}\n", count + 1));
        write_elements(&mut w, 2, (7, 1), &[vec![tag_of(0), tag_of(1), tag_of(2)]]);
        let tets: Vec<_> = mesh.tetrahedra().iter().map(|t| t.map(tag_of).to_vec()).collect();
        let (first, second) = tets.split_at(grouped(mesh));
        write_elements(&mut w, 4, (-3, 2), first);
        write_elements(&mut w, 4, (0, 2 + first.len() as i64), second);
    } else {
        write_element_blocks(&mut w, mesh, tag_of);
    }
    w.text("\n$EndElements\n");
    w.bytes
}

/// Half of the nodes on a surface, with parameters, the others in a volume.
fn write_node_blocks(w: &mut Writer, mesh: &TetMesh, tags: &[i64]) {
    let half = tags.len() / 2;
    w.size(2);
    w.size(tags.len() as i64);
    if w.format.version == "4.1" {
        w.size(*tags.iter().min().unwrap());
        w.size(*tags.iter().max().unwrap());
    }
    w.line();
    for (dimension, part) in [(2, 0..half), (3, half..tags.len())] {
        w.entity(dimension, 5);
        w.int(i64::from(dimension == 2));
        w.size(part.len() as i64);
        w.line();
        if w.format.version == "4.1" {
            tags[part.clone()].iter().for_each(|t| w.size(*t));
            w.line();
        }
        for k in part {
            if w.format.version != "4.1" {
                w.int(tags[k]);
            }
            mesh.vertices()[k].iter().for_each(|c| w.real(*c));
            if dimension == 2 {
                w.real(0.25);
                w.real(0.75);
            }
            w.line();
        }
    }
}

/// A point, a curve, a surface in a group, and two volumes, the first in a group.
fn write_entities(w: &mut Writer) {
    w.text("$Entities\n");
    [1, 1, 1, 2].iter().for_each(|count| w.size(*count));
    w.line();
    for (dimension, tag, group) in
        [(0, 1, None), (1, 1, None), (2, 5, Some(8)), (3, 5, Some(-3)), (3, 6, None)]
    {
        w.int(tag);
        let numbers = if dimension == 0 && w.format.version == "4.1" { 3 } else { 6 };
        (0..numbers).for_each(|_| w.real(0.5));
        w.size(i64::from(group.is_some()));
        group.iter().for_each(|group| w.int(*group));
        if dimension > 0 {
            w.size(2);
            [1, -1].iter().for_each(|end| w.int(*end));
        }
        w.line();
    }
    w.text("\n$EndEntities\n");
}

/// Elements of version 2 of one type in a physical group, numbered from a first.
fn write_elements(w: &mut Writer, kind: i64, (group, first): (i64, i64), elements: &[Vec<i64>]) {
    if w.format.is_binary {
        [kind, elements.len() as i64, 2].iter().for_each(|i| w.int(*i));
    }
    for (k, nodes) in elements.iter().enumerate() {
        w.int(first + k as i64);
        if !w.format.is_binary {
            w.int(kind);
            w.int(2);
        }
        [group, 5].iter().chain(nodes).for_each(|i| w.int(*i));
        w.line();
    }
}

fn write_element_blocks(w: &mut Writer, mesh: &TetMesh, tag_of: impl Fn(u32) -> i64) {
    let count = mesh.tetrahedra().len() as i64;
    w.size(3);
    w.size(count + 1);
    if w.format.version == "4.1" {
        w.size(1);
        w.size(count + 1);
    }
    w.line();
    let tets: Vec<Vec<i64>> = mesh.tetrahedra().iter().map(|t| t.map(&tag_of).to_vec()).collect();
    let (first, second) = tets.split_at(grouped(mesh));
    let triangle = [vec![tag_of(0), tag_of(1), tag_of(2)]];
    for (dimension, entity, kind, elements) in [(2, 5, 2, &triangle[..]), (3, 5, 4, first), (3, 6, 4, second)]
    {
        w.entity(dimension, entity);
        w.int(kind);
        w.size(elements.len() as i64);
        w.line();
        for (k, nodes) in elements.iter().enumerate() {
            w.tag(k as i64 + 1);
            nodes.iter().for_each(|i| w.tag(*i));
            w.line();
        }
    }
}

fn block() -> TetMesh {
    TetMesh::cuboid([0.3, 0.2, 0.1], [3, 2, 1]).unwrap()
}

proptest! {
    #[test]
    fn any_tags_in_any_order_give_the_mesh_back(
        shuffled in Just((1..25).collect::<Vec<i64>>()).prop_shuffle(),
        gap in prop_oneof![Just(1i64), 2i64..1000],
    ) {
        let mesh = block();
        prop_assert_eq!(mesh.vertices().len(), shuffled.len());
        let tags: Vec<i64> = shuffled.iter().map(|t| t * gap).collect();
        for (k, format) in FORMATS.into_iter().enumerate() {
            let found = read(&format!("tags-{k}"), &written(&mesh, &tags, format)).unwrap();
            prop_assert_eq!(corners(&found), corners(&mesh), "{:?}", format);
            let (first, second) = found.regions().split_at(grouped(&mesh));
            prop_assert!(first.iter().all(|r| *r == 3) && second.iter().all(|r| *r == 0), "{:?}", format);
            prop_assert_eq!(found.region_named("a stiff back"), Some(3));
        }
    }
}

/// Ten thousand of each format.
#[test]
fn damaged_files_are_errors_or_meshes() {
    for format in FORMATS {
        let whole = written(&block(), &(1..25).collect::<Vec<i64>>(), format);
        let mut runner = TestRunner::new(Config { failure_persistence: None, ..Config::with_cases(10_000) });
        let result = runner.run(&(0.0..1.0f64, any::<u8>(), any::<bool>()), |(at, byte, cut)| {
            let mut bytes = whole.clone();
            let at = (at * bytes.len() as f64) as usize;
            if cut {
                bytes.truncate(at)
            } else {
                bytes[at] = byte
            }
            if let Err(error) = read("damaged", &bytes) {
                prop_assert!(!error.to_string().is_empty());
            }
            Ok(())
        });
        result.unwrap_or_else(|error| panic!("{format:?}: {error}"));
    }
}

#[test]
fn cut_files_name_the_place_and_the_section() {
    for format in FORMATS {
        let whole = written(&block(), &(1..25).collect::<Vec<i64>>(), format);
        let find = |what: &str| whole.windows(what.len()).position(|w| w == what.as_bytes()).unwrap();
        for (section, end) in [("$Nodes", "$EndNodes"), ("$Elements", "$EndElements")] {
            let mut middle = (find(section) + find(end)) / 2;
            // Text between its words.
            while !format.is_binary && !whole[middle].is_ascii_whitespace() {
                middle -= 1;
            }
            let error = read("cut", &whole[..middle]).unwrap_err().to_string();
            let place = if format.is_binary { "byte " } else { "line " };
            assert!(error.contains(place) && error.contains(section), "{format:?}: {error}");
            assert!(error.contains("ends"), "{format:?}: {error}");
        }
    }
}

#[test]
fn what_is_wrong_is_said() {
    let text = String::from_utf8(std::fs::read(path_of("2.2")).unwrap()).unwrap();
    let two = |from: &str, to: &str| text.replacen(from, to, 1);
    let cases = [
        ("solid teapot".to_owned(), "line 1: `solid` where a section was expected"),
        (String::new(), "no $MeshFormat"),
        (two("2.2 0 8", "3.0 0 8"), "line 2, $MeshFormat: version 3.0; 2.0 to 2.2, 4.0 and 4.1 are read"),
        (two("2.2 0 8", "2.2 0 4"), "line 2, $MeshFormat: a data size of 4 bytes"),
        (two("2.2 0 8", "2.2 9 8"), "line 2, $MeshFormat: 9 is neither"),
        (two("$Nodes\n30", "$Nodes\n31"), "$Nodes: the section ends too early"),
        (two("$Nodes\n30", "$Nodes\n29"), "where $EndNodes was expected"),
        (two("$Nodes\n30", "$Nodes\n-3"), "`-3` is no such number"),
        (two("\n7 1 0.8 0.6", "\n6 1 0.8 0.6"), "node 6 is there twice"),
        (two("\n7 1 0.8 0.6", "\n700 1 0.8 0.6"), "refers to node 7, which is not there"),
        (two("\n7 1 0.8 0.6", "\n7 1 0,8 0.6"), "`0,8` is no such number"),
        (two("$Nodes", "$NOD"), "version 1"),
    ];
    for (k, (text, expected)) in cases.into_iter().enumerate() {
        let error = read(&format!("wrong-{k}"), text.as_bytes()).unwrap_err();
        assert!(matches!(error, MeshError::File { .. }), "{error}");
        assert!(error.to_string().contains(expected), "{expected}: {error}");
    }
    let kept = two("\n143\n", "\n84\n");
    let kept = kept.lines().filter(|line| line.split(' ').nth(1) != Some("4") || line.split(' ').count() < 6);
    let without: String = kept.map(|line| format!("{line}\n")).collect();
    let error = read("no-tets", without.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("no linear tetrahedra") && error.contains("8 of type 15"), "{error}");
    let missing = TetMesh::read_gmsh("no/such/file.msh").unwrap_err().to_string();
    assert!(missing.contains("no/such/file.msh"), "{missing}");
    let not_a_number = read("nan", two("\n7 1 0.8 0.6", "\n7 nan 0.8 0.6").as_bytes()).unwrap_err();
    assert!(matches!(not_a_number, MeshError::NotFinite { .. }), "{not_a_number}");
}
