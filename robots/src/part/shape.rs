//! Shapes of soft parts, filled with tetrahedra.

use super::file::Shape;
use foible3d::{MeshError, SurfaceMesh, TetMesh};
use rapier3d::parry::shape::{Ball, Capsule, Cylinder, Shape as ParryShape};
use std::path::Path;

/// Most cells of a part. A misplaced decimal point shall be an error, and not an hour.
const MOST_CELLS: f64 = 100_000.0;

/// What is wrong with the numbers of a shape.
pub(super) enum Fault {
    /// Key, value, and what would be right.
    Value(&'static str, String, &'static str),
    Mesh(MeshError),
}

impl From<MeshError> for Fault {
    fn from(error: MeshError) -> Self {
        Self::Mesh(error)
    }
}

/// Whether a part may have so many cells.
pub(crate) fn most_cells(cells: f64) -> Option<&'static str> {
    (!(cells <= MOST_CELLS)).then_some("of at most 100000 cells")
}

/// The tetrahedra of a shape, in the part's frame. Files are looked for in `folder`.
pub(super) fn mesh(shape: &Shape, folder: &Path) -> Result<TetMesh, Fault> {
    match shape {
        Shape::Cuboid(cuboid) => {
            let cells = cuboid.cells.iter().map(|c| *c as f64).product::<f64>();
            if let Some(range) = most_cells(cells) {
                return Err(Fault::Value("cells", format!("{:?}", cuboid.cells), range));
            }
            positive("size", &cuboid.size)?;
            Ok(TetMesh::cuboid(cuboid.size.map(|s| 0.5 * s), cuboid.cells)?)
        }
        Shape::Ball(ball) => {
            positive("radius", &[ball.radius])?;
            filled(&Ball::new(ball.radius as f32), [2.0 * ball.radius; 3], ball.cell)
        }
        Shape::Capsule(round) => {
            positive("radius", &[round.radius])?;
            positive("length", &[round.length])?;
            let capsule = Capsule::new_y(0.5 * round.length as f32, round.radius as f32);
            let (wide, long) = (2.0 * round.radius, round.length + 2.0 * round.radius);
            upright(filled(&capsule, [wide, long, wide], round.cell)?)
        }
        Shape::Cylinder(round) => {
            positive("radius", &[round.radius])?;
            positive("length", &[round.length])?;
            let cylinder = Cylinder::new(0.5 * round.length as f32, round.radius as f32);
            let wide = 2.0 * round.radius;
            upright(filled(&cylinder, [wide, round.length, wide], round.cell)?)
        }
        Shape::Mesh(mesh) => {
            let scale = mesh.scale.unwrap_or(1.0);
            positive("scale", &[scale])?;
            read_mesh(&folder.join(&mesh.file), scale, mesh.cell)
        }
    }
}

/// Lengths in a hand's range: beyond, squares and cubes of them leave single precision.
fn positive(key: &'static str, lengths: &[f64]) -> Result<(), Fault> {
    match lengths.iter().all(|l| (1.0e-6..=1.0e6).contains(l)) {
        true => Ok(()),
        false => Err(Fault::Value(key, format!("{lengths:?}"), "from 1e-6 to 1e6")),
    }
}

fn filled(shape: &dyn ParryShape, size: [f64; 3], cell: f64) -> Result<TetMesh, Fault> {
    positive("cell", &[cell])?;
    check_cell(size, cell)?;
    Ok(TetMesh::fill_shape(shape, cell as f32)?)
}

fn check_cell(size: [f64; 3], cell: f64) -> Result<(), Fault> {
    let cells = size.map(|s| (s / cell).max(1.0)).iter().product();
    most_cells(cells).map_or(Ok(()), |range| Err(Fault::Value("cell", format!("{cell}"), range)))
}

/// Turned from along y, as parry has it, to along z.
fn upright(mesh: TetMesh) -> Result<TetMesh, Fault> {
    let vertices = mesh.vertices().iter().map(|[x, y, z]| [*x, -*z, *y]).collect();
    Ok(TetMesh::new(vertices, mesh.tetrahedra().to_vec())?)
}

fn read_mesh(file: &Path, scale: f64, cell: Option<f64>) -> Result<TetMesh, Fault> {
    let extension = file.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
    let is_surface = ["obj", "stl", "ply", "gltf", "glb"].contains(&&*extension);
    if !is_surface {
        return Ok(TetMesh::read(file)?.scaled(scale)?);
    }
    let surface = SurfaceMesh::read(file)?.scaled(scale as f32);
    let Some(cell) = cell else {
        return Err(Fault::Value("cell", "missing".to_string(), "there, as the file is a surface"));
    };
    positive("cell", &[cell])?;
    let mut size = [0.0; 3];
    for (axis, size) in size.iter_mut().enumerate() {
        let along = || surface.vertices.iter().map(|v| f64::from(v[axis]));
        *size = along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min);
    }
    check_cell(size, cell)?;
    Ok(surface.filled(cell as f32)?)
}
