//! Wavefront OBJ.

use crate::mesh::repair::SurfaceMesh;

/// Materials and texture coordinates are left out: what is in one place is one vertex, as the file has it.
pub(super) fn parse(mut bytes: &[u8]) -> Result<SurfaceMesh, String> {
    let options = tobj::LoadOptions { triangulate: false, single_index: false, ..Default::default() };
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let (models, _) =
        tobj::load_obj_buf(&mut bytes, &options, no_materials).map_err(|error| error.to_string())?;
    let mut mesh = SurfaceMesh::default();
    for model in models {
        let first = mesh.vertices.len() as u32;
        for place in model.mesh.positions.as_chunks::<3>().0 {
            mesh.push_vertex(*place);
        }
        let corners: Vec<u32> = model.mesh.indices.iter().map(|v| first + v).collect();
        // Files of triangles alone have no list of how many corners a face has.
        if model.mesh.face_arities.is_empty() {
            mesh.triangles.extend(corners.as_chunks::<3>().0);
            continue;
        }
        let mut rest = &corners[..];
        for arity in model.mesh.face_arities {
            let (face, others) = rest.split_at_checked(arity as usize).ok_or("a face has too few corners")?;
            mesh.push_polygon(face);
            rest = others;
        }
    }
    if mesh.triangles.is_empty() { Err("there are no faces in it".into()) } else { Ok(mesh) }
}
