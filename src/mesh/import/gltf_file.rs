//! glTF, text and binary: the triangles of all nodes of the scene, where these put them.

use crate::mesh::repair::SurfaceMesh;
use base64::Engine;
use gltf::mesh::Mode;
use gltf::{Gltf, Node, buffer};
use nalgebra::{Matrix4, Point3};
use std::path::Path;

/// Nodes on the way from the root: deeper than any scene, and no more than a stack takes.
const DEPTH: usize = 256;

pub(super) fn parse(bytes: &[u8], folder: Option<&Path>) -> Result<SurfaceMesh, String> {
    // The library (1.4.1) panics on indices of accessors that are not there, where it should refuse them.
    std::panic::catch_unwind(|| read(bytes, folder))
        .unwrap_or_else(|_| Err("it refers to what is not there".into()))
}

fn read(bytes: &[u8], folder: Option<&Path>) -> Result<SurfaceMesh, String> {
    let Gltf { document, blob } = Gltf::from_slice(bytes).map_err(|error| error.to_string())?;
    let mut blob = blob;
    let buffers = document.buffers().map(|own| read_buffer(&own, &mut blob, folder));
    let buffers: Vec<Vec<u8>> = buffers.collect::<Result<_, String>>()?;
    let mut mesh = SurfaceMesh::default();
    let scene = document.default_scene().or_else(|| document.scenes().next());
    match scene {
        Some(scene) => {
            for node in scene.nodes() {
                add_node(&node, &Matrix4::identity(), &buffers, 0, &mut mesh)?;
            }
        }
        None => {
            for own in document.meshes() {
                add_mesh(&own, &Matrix4::identity(), &buffers, &mut mesh)?;
            }
        }
    }
    if mesh.triangles.is_empty() { Err("there are no triangles in it".into()) } else { Ok(mesh) }
}

fn read_buffer(
    own: &buffer::Buffer<'_>,
    blob: &mut Option<Vec<u8>>,
    folder: Option<&Path>,
) -> Result<Vec<u8>, String> {
    let bytes = match own.source() {
        buffer::Source::Bin => blob.take().ok_or("its binary chunk is missing")?,
        buffer::Source::Uri(uri) => match (uri.split_once(";base64,"), folder) {
            (Some((kind, data)), _) if kind.starts_with("data:") => {
                let decoded = base64::engine::general_purpose::STANDARD.decode(data);
                decoded.map_err(|error| format!("buffer {}: {error}", own.index()))?
            }
            (_, Some(folder)) => {
                std::fs::read(folder.join(uri)).map_err(|error| format!("buffer `{uri}`: {error}"))?
            }
            (_, None) => return Err(format!("buffer `{uri}` is a file of its own")),
        },
    };
    if bytes.len() < own.length() {
        return Err(format!("buffer {} has {} bytes of {}", own.index(), bytes.len(), own.length()));
    }
    Ok(bytes)
}

fn add_node(
    node: &Node<'_>,
    parent: &Matrix4<f32>,
    buffers: &[Vec<u8>],
    depth: usize,
    mesh: &mut SurfaceMesh,
) -> Result<(), String> {
    if depth > DEPTH {
        return Err(format!("its nodes are more than {DEPTH} deep"));
    }
    let own = parent * Matrix4::from(node.transform().matrix());
    if let Some(of_node) = node.mesh() {
        add_mesh(&of_node, &own, buffers, mesh)?;
    }
    node.children().try_for_each(|child| add_node(&child, &own, buffers, depth + 1, mesh))
}

fn add_mesh(
    own: &gltf::Mesh<'_>,
    to: &Matrix4<f32>,
    buffers: &[Vec<u8>],
    mesh: &mut SurfaceMesh,
) -> Result<(), String> {
    for primitive in own.primitives().filter(|primitive| primitive.mode() == Mode::Triangles) {
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(|bytes| &bytes[..]));
        let first = mesh.vertices.len() as u32;
        let places =
            reader.read_positions().ok_or_else(|| format!("mesh {} has no positions", own.index()))?;
        for place in places {
            let [x, y, z] = place;
            mesh.push_vertex(to.transform_point(&Point3::new(x, y, z)).coords.into());
        }
        let count = mesh.vertices.len() as u32 - first;
        let corners: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().map(|v| first.saturating_add(v)).collect(),
            None => (first..first + count).collect(),
        };
        let mirrored = to.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for [a, b, c] in corners.as_chunks::<3>().0 {
            mesh.triangles.push(if mirrored { [*a, *c, *b] } else { [*a, *b, *c] });
        }
    }
    Ok(())
}
