//! PLY, text and binary.

use crate::mesh::repair::SurfaceMesh;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

pub(super) fn parse(mut bytes: &[u8]) -> Result<SurfaceMesh, String> {
    let file = Parser::<DefaultElement>::new().read_ply(&mut bytes).map_err(|error| error.to_string())?;
    let list = |name: &str| file.payload.get(name).ok_or_else(|| format!("there is no element `{name}`"));
    let mut mesh = SurfaceMesh::default();
    for vertex in list("vertex")? {
        let place = ["x", "y", "z"].map(|name| vertex.get(name).and_then(number));
        let [Some(x), Some(y), Some(z)] = place else { return Err("a vertex has no x, y and z".into()) };
        mesh.push_vertex([x, y, z]);
    }
    for face in list("face")? {
        let corners =
            ["vertex_indices", "vertex_index"].iter().find_map(|name| face.get(*name)).and_then(indices);
        let corners = corners.ok_or("a face has no list `vertex_indices` of its corners")?;
        mesh.push_polygon(&corners);
    }
    if mesh.triangles.is_empty() { Err("there are no faces in it".into()) } else { Ok(mesh) }
}

fn number(property: &Property) -> Option<f32> {
    match property {
        Property::Float(x) => Some(*x),
        Property::Double(x) => Some(*x as f32),
        Property::Char(x) => Some(f32::from(*x)),
        Property::UChar(x) => Some(f32::from(*x)),
        Property::Short(x) => Some(f32::from(*x)),
        Property::UShort(x) => Some(f32::from(*x)),
        Property::Int(x) => Some(*x as f32),
        Property::UInt(x) => Some(*x as f32),
        _ => None,
    }
}

/// Nothing if one of them is negative.
fn indices(property: &Property) -> Option<Vec<u32>> {
    fn all<T: Copy + TryInto<u32>>(list: &[T]) -> Option<Vec<u32>> {
        list.iter().map(|v| (*v).try_into().ok()).collect()
    }
    match property {
        Property::ListInt(list) => all(list),
        Property::ListUInt(list) => all(list),
        Property::ListShort(list) => all(list),
        Property::ListUShort(list) => all(list),
        Property::ListChar(list) => all(list),
        Property::ListUChar(list) => all(list),
        _ => None,
    }
}
