//! Soft parts: made and checked before anything is put into a world.

mod attach;
mod file;
mod plan;
mod shape;

pub(crate) use plan::plan;
pub(crate) use shape::most_cells;

use crate::error::Place;
use foible3d::DeformableBody;

/// A soft part in its place, ready to be put in.
pub(crate) struct PlannedPart {
    pub name: String,
    /// Where it stands in its file.
    pub place: Place,
    pub body: DeformableBody,
    /// Number of the link that carries it; the world if there is none.
    pub link: Option<usize>,
    /// Vertices of its surface that the link leads.
    pub attached: Vec<usize>,
    /// Numbers of the links that it does not touch.
    pub ignored: Vec<usize>,
}

/// Vertices of a body's surface, in order: only those can be attached.
pub(crate) fn surface_vertices(body: &DeformableBody) -> Vec<usize> {
    let areas = body.vertex_areas();
    let model = body.model();
    // Rods have no area; all of their vertices are on the surface.
    if model.surface_triangles().len() == 0 {
        return (0..areas.len()).collect();
    }
    (0..areas.len()).filter(|v| areas[*v] > 0.0).collect()
}
