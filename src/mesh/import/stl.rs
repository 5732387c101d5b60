//! STL, text and binary.

use crate::mesh::repair::SurfaceMesh;
use std::io::Cursor;

/// Bytes before the triangles of a binary file, and of each of them.
const HEADER: u64 = 84;
const TRIANGLE: u64 = 50;

pub(super) fn parse(bytes: &[u8]) -> Result<SurfaceMesh, String> {
    let read = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|error| explain(bytes, &error))?;
    let mut mesh = SurfaceMesh::default();
    read.vertices.iter().for_each(|vertex| mesh.push_vertex(vertex.0));
    mesh.triangles = read.faces.iter().map(|face| face.vertices.map(|v| v as u32)).collect();
    if mesh.triangles.is_empty() { Err("there are no triangles in it".into()) } else { Ok(mesh) }
}

/// What the library says, and what the length does.
fn explain(bytes: &[u8], error: &std::io::Error) -> String {
    let count = bytes.get(80..84).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    match count {
        Some(count) if !bytes.starts_with(b"solid") => {
            let wanted = HEADER + TRIANGLE * u64::from(count);
            format!("{error}: {count} triangles take {wanted} bytes, the file has {}", bytes.len())
        }
        _ => error.to_string(),
    }
}
