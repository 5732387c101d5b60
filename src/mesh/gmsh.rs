//! Gmsh 4.1 `.msh` files.

use super::mesh_error::MeshError;
use super::tet_mesh::TetMesh;
use mshio::mshfile::{ElementType, MshFile};
use std::collections::HashMap;
use std::path::Path;

impl TetMesh {
    /// Reads the linear tetrahedra of a Gmsh `.msh` file, format 4.1, ASCII or binary. Elements of
    /// other kinds are passed over; coordinates are taken as metres. Negatively oriented tetrahedra
    /// are turned round, which Gmsh leaves to its readers.
    ///
    /// # Errors
    /// [`MeshError::File`] when the file cannot be read or parsed, else as [`TetMesh::new`].
    pub fn read_gmsh(path: impl AsRef<Path>) -> Result<Self, MeshError> {
        let path = path.as_ref();
        let fail = |reason: String| MeshError::File { path: path.display().to_string(), reason };
        let bytes = std::fs::read(path).map_err(|e| fail(e.to_string()))?;
        if let Some(version) = version_of(&bytes).filter(|version| version != "4.1") {
            let advice = "only 4.1 is read, as `gmsh -save -format msh41` writes it";
            return Err(fail(format!("line 2, $MeshFormat: version {version}; {advice}")));
        }
        // The parser's message spans several lines and quotes the file; its first says what failed.
        let file = mshio::parse_msh_bytes(&bytes)
            .map_err(|e| fail(format!("not a Gmsh 4.1 mesh: {}", first_line(&e.to_string()))))?;
        let (vertices, tetrahedra) = tetrahedra_of(&file).map_err(fail)?;
        TetMesh::new(vertices, tetrahedra)
    }
}

/// The version that the header of a file names, if it has one.
fn version_of(bytes: &[u8]) -> Option<String> {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(64)]);
    let mut lines = head.lines().map(str::trim);
    let version = lines.next().filter(|first| *first == "$MeshFormat").and_then(|_| lines.next())?;
    version.split_whitespace().next().map(str::to_owned)
}

fn first_line(message: &str) -> &str {
    message.lines().find(|l| !l.trim().is_empty()).unwrap_or("unreadable")
}

type Geometry = (Vec<[f64; 3]>, Vec<[u32; 4]>);

fn tetrahedra_of(file: &MshFile<u64, i32, f64>) -> Result<Geometry, String> {
    let mut position_of_tag = HashMap::new();
    if let Some(nodes) = &file.data.nodes {
        // Blocks without explicit tags number their nodes in the file's order.
        let mut next = nodes.min_node_tag;
        for block in &nodes.node_blocks {
            let place = |n: &mshio::mshfile::Node<f64>| [n.x, n.y, n.z];
            match &block.node_tags {
                Some(tags) => {
                    position_of_tag.extend(tags.iter().map(|(&tag, &k)| (tag, place(&block.nodes[k]))))
                }
                None => position_of_tag.extend((next..).zip(block.nodes.iter().map(place))),
            }
            next += block.nodes.len() as u64;
        }
    }
    let mut vertices = Vec::new();
    let mut index_of_tag = HashMap::new();
    let mut tetrahedra = Vec::new();
    for block in file.data.elements.iter().flat_map(|e| &e.element_blocks) {
        if block.element_type != ElementType::Tet4 {
            continue;
        }
        for element in &block.elements {
            let mut tet = [0; 4];
            for (corner, tag) in tet.iter_mut().zip(&element.nodes) {
                let position = position_of_tag.get(tag).ok_or_else(|| {
                    format!("element {} refers to node {tag}, which is not there", element.element_tag)
                })?;
                *corner = *index_of_tag.entry(*tag).or_insert_with(|| {
                    vertices.push(*position);
                    vertices.len() as u32 - 1
                });
            }
            tetrahedra.push(positively_oriented(tet, &vertices));
        }
    }
    if tetrahedra.is_empty() {
        return Err("no linear tetrahedra (element type 4) in the file".into());
    }
    Ok((vertices, tetrahedra))
}

fn positively_oriented(mut tet: [u32; 4], vertices: &[[f64; 3]]) -> [u32; 4] {
    let corners = tet.map(|i| vertices[i as usize].into());
    if super::tet_mesh::signed_volume(&corners) < 0.0 {
        tet.swap(2, 3);
    }
    tet
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNER: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n1 1 1 1\n3 1 4 1\n1 1 3 2 4\n$EndElements\n";

    fn written(name: &str, text: &str) -> std::path::PathBuf {
        let path = std::env::temp_dir().join(format!("foible3d-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        path
    }

    #[test]
    fn a_corner_tetrahedron_is_read_and_turned_round() {
        let path = written("corner.msh", CORNER);
        let mesh = TetMesh::read_gmsh(&path).unwrap();
        assert_eq!(mesh.tetrahedra().len(), 1);
        assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-15);
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn other_versions_are_named() {
        for version in ["2.2", "4", "4.0"] {
            let path =
                written(&format!("{version}.msh"), &CORNER.replace("4.1 0 8", &format!("{version} 0 8")));
            let error = TetMesh::read_gmsh(&path).unwrap_err().to_string();
            assert!(error.contains(&format!("version {version}")) && error.contains("line 2"), "{error}");
            std::fs::remove_file(path).unwrap();
        }
    }

    #[test]
    fn missing_garbled_and_empty_files_are_named() {
        let missing = TetMesh::read_gmsh("no/such/file.msh").unwrap_err();
        assert!(missing.to_string().contains("no/such/file.msh"), "{missing}");
        for (name, text) in [
            ("garbled.msh", "solid teapot".to_string()),
            ("no_tets.msh", CORNER.replace("3 1 4 1\n1 1 3 2 4", "2 1 2 1\n1 1 3 2")),
        ] {
            let path = written(name, &text);
            let error = TetMesh::read_gmsh(&path).unwrap_err();
            assert!(matches!(&error, MeshError::File { .. }), "{error}");
            std::fs::remove_file(path).unwrap();
        }
    }
}
