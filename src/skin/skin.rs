//! The skin of a body.

use super::binding::{Binding, Motion, bind_to_segment, bind_to_solid, bind_to_triangle, single};
use super::rod_frames::{Frame, frames};
use super::tet_grid::TetGrid;
use crate::body::DeformableBody;
use crate::contact::NearestFacet;
use crate::error::BodyError;
use crate::fem::DeformableModel;
use crate::math::{Vec3, from_real};
use crate::mesh::point_normals;
use crate::threads::for_each_pair;
use rapier3d::math::Vector;

/// A mesh of any resolution that follows a body: each of its vertices is bound to the tetrahedron that holds it, else
/// to the nearest triangle of a sheet, tetrahedron or segment of a rod. Its order of vertices, triangles and texture
/// coordinates stay the caller's.
///
/// ```
/// use foible3d::prelude::*;
/// use rapier3d::prelude::*;
/// let mut body = DeformableBodyBuilder::filled(&Ball::new(0.5), 0.25).build()?;
/// // What is drawn: a finer ball.
/// let (vertices, _triangles) = Ball::new(0.5).to_trimesh(40, 40);
/// let normals: Vec<Vector> = vertices.iter().map(|v| v.normalize()).collect();
/// let skin = DeformableSkin::bind(body.model(), &vertices, &normals)?;
/// // Each frame:
/// body.teleport(Pose::from_translation(Vector::Y))?;
/// let (mut positions, mut turned) = (vertices.clone(), normals.clone());
/// skin.update(&body, &mut positions, &mut turned)?;
/// assert!((positions[7] - (vertices[7] + Vector::Y)).length() < 1.0e-6);
/// # Ok::<(), DeformableBodyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DeformableSkin {
    bindings: Vec<Binding>,
    /// Nodes of the model, as a check.
    nodes: usize,
    uses_sheets: bool,
    /// Nodes along the rods, and the rest frames of their first segments.
    rods: Vec<(Vec<u32>, Frame)>,
}

/// Vertices that a thread takes at a time.
const CHUNK: usize = 1024;

impl DeformableSkin {
    /// Binds `vertices` \[m\] with unit `normals`, in the frame of the rest shape. A vertex whose normal is zero gets none.
    /// Takes some µs per vertex.
    ///
    /// # Errors
    /// [`BodyError::WrongSize`] if there are not as many normals as vertices, [`BodyError::NotFinite`].
    pub fn bind(model: &DeformableModel, vertices: &[Vector], normals: &[Vector]) -> Result<Self, BodyError> {
        if vertices.len() != normals.len() {
            return Err(BodyError::WrongSize { vertices: normals.len(), expected: vertices.len() });
        }
        let bad = vertices.iter().chain(normals).find(|v| !v.is_finite());
        if let Some(value) = bad {
            return Err(BodyError::NotFinite { quantity: "vertex or normal of a skin", value: *value });
        }
        let mut skin =
            Self { bindings: Vec::new(), nodes: model.vertex_count(), uses_sheets: false, rods: Vec::new() };
        let mut rest_frames = Vec::new();
        let mut segments: Vec<([u32; 2], u32, Frame)> = Vec::new();
        for nodes in model.rods() {
            frames(nodes.iter().map(|n| model.rest[*n as usize]), None, &mut rest_frames);
            let first = segments.len() as u32;
            let ends = nodes.windows(2).map(|ends| [ends[0], ends[1]]);
            segments.extend(ends.zip(&rest_frames).zip(first..).map(|((ends, frame), i)| (ends, i, *frame)));
            skin.rods.extend(rest_frames.first().map(|frame| (nodes.to_vec(), *frame)));
        }
        let sheets = &model.surface.triangles[model.surface.closed..];
        let normals_at_rest = point_normals(sheets, &model.rest);
        let grid = (!model.tetrahedra.is_empty()).then(|| TetGrid::new(model));
        let ends = segments.iter().map(|(ends, ..)| *ends).collect();
        let nearest = NearestFacet::new(&model.rest, sheets, ends);
        for (p, normal) in vertices.iter().zip(normals) {
            let (p, normal) = (from_real(*p), from_real(*normal));
            let solid = grid.as_ref().and_then(|grid| grid.nearest(&p));
            let sheet = nearest.triangle(&p);
            let sheet = sheet.map(|(t, _)| bind_to_triangle(model, sheets[t], &normals_at_rest, &p, &normal));
            let rod = nearest.segment(&p).map(|i| segments[i]);
            let rod = rod.map(|(ends, i, frame)| bind_to_segment(model, (ends, i, &frame), &p, &normal));
            let thin = sheet.into_iter().chain(rod).min_by(|a, b| a.0.total_cmp(&b.0));
            // What is in a solid belongs to it; beside one with thin parts the nearest does.
            let binding = match (thin, solid, &grid) {
                (Some((away, thin)), solid, _) if solid.is_none_or(|(outside, _)| outside > away) => {
                    Some(thin)
                }
                (_, Some((_, tet)), Some(grid)) => Some(bind_to_solid(grid, tet, &p, &normal)),
                (thin, ..) => thin.map(|(_, thin)| thin),
            };
            skin.uses_sheets |= matches!(binding, Some(Binding::Sheet { .. }));
            skin.bindings.extend(binding);
        }
        Ok(skin)
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.bindings.len()
    }

    /// Writes where the vertices are \[m\] and their unit normals; on several threads if there are many.
    ///
    /// # Errors
    /// [`BodyError::WrongSize`] for a body of another number of vertices, or buffers of another length.
    pub fn update(
        &self,
        body: &DeformableBody,
        positions: &mut [Vector],
        normals: &mut [Vector],
    ) -> Result<(), BodyError> {
        self.write(body, &body.state.x, positions, normals)
    }

    /// As [`DeformableSkin::update`], between the last two steps: at `t` 0 where the last one began, at 1 where it ended. For
    /// frames that are not steps.
    ///
    /// # Errors
    /// As [`DeformableSkin::update`].
    pub fn update_interpolated(
        &self,
        body: &DeformableBody,
        t: f32,
        positions: &mut [Vector],
        normals: &mut [Vector],
    ) -> Result<(), BodyError> {
        self.write(body, &body.nodes_between(t), positions, normals)
    }

    fn write(
        &self,
        body: &DeformableBody,
        x: &[Vec3],
        positions: &mut [Vector],
        normals: &mut [Vector],
    ) -> Result<(), BodyError> {
        let count = self.bindings.len();
        for (vertices, expected) in [(x.len(), self.nodes), (positions.len(), count), (normals.len(), count)]
        {
            if vertices != expected {
                return Err(BodyError::WrongSize { vertices, expected });
            }
        }
        // What `f32` cannot tell of a place far away is the same for all vertices.
        let origin = x[0];
        let mut motion = Motion { origin: single(&origin), ..Motion::default() };
        motion.x.extend(x.iter().map(|x| single(&(x - origin))));
        if self.uses_sheets {
            let surface = &body.model.surface;
            motion.normals.extend(point_normals(&surface.triangles[surface.closed..], x).iter().map(single));
        }
        let mut own = Vec::new();
        for (nodes, first) in &self.rods {
            frames(nodes.iter().map(|n| x[*n as usize]), Some(first), &mut own);
            motion.frames.extend(own.iter().map(|frame| frame.each_ref().map(single)));
        }
        let chunks = self.bindings.chunks(CHUNK).zip(positions.chunks_mut(CHUNK));
        let mut chunks: Vec<_> = chunks.collect();
        let mut normals: Vec<_> = normals.chunks_mut(CHUNK).collect();
        for_each_pair(&mut chunks, &mut normals, true, |_, (bindings, positions), normals| {
            for ((binding, position), normal) in
                bindings.iter().zip(positions.iter_mut()).zip(normals.iter_mut())
            {
                (*position, *normal) = binding.read(&motion);
            }
        });
        Ok(())
    }
}
