//! Meshes of flexible bodies, and MuJoCo's points on them.
//!
//! Grids have MuJoCo's points. Boxes, cylinders and ellipsoids are shells around one point there; here they are filled.

use super::Settings;
use super::flexcomp::{Flexcomp, Kind};
use super::pins::grid_number;
use foible3d::{DeformableBodyBuilder, MeshError, Structure, SurfaceMesh, TetMesh};
use rapier3d::parry::shape::{Ball, Cylinder};

/// What a flexible body is made of, in its own frame.
pub(super) struct FlexMesh {
    pub builder: DeformableBodyBuilder,
    /// MuJoCo's points \[m\], by their numbers.
    pub points: Vec<[f64; 3]>,
    /// How far the body's vertices may be from these points \[m\].
    pub reach: f64,
}

/// Why there is none.
pub(super) enum Fault {
    Mesh(MeshError),
    Unsupported(String),
}

impl From<MeshError> for Fault {
    fn from(error: MeshError) -> Self {
        Self::Mesh(error)
    }
}

pub(super) fn mesh(flexcomp: &Flexcomp, settings: &Settings<'_>) -> Result<FlexMesh, Fault> {
    match flexcomp.kind {
        Kind::Grid if flexcomp.dim == 1 => rod(flexcomp),
        Kind::Grid | Kind::Square | Kind::Disc if flexcomp.dim == 2 => sheet_grid(flexcomp),
        Kind::Grid => solid_grid(flexcomp),
        Kind::Box | Kind::Cylinder | Kind::Ellipsoid => filled(flexcomp),
        Kind::Mesh | Kind::Gmsh => from_file(flexcomp, settings),
        Kind::Square | Kind::Disc | Kind::Direct => direct(flexcomp),
    }
}

fn least(lengths: [f64; 3]) -> f64 {
    lengths.into_iter().fold(f64::INFINITY, f64::min)
}

/// Where a point of the grid is along an axis.
fn along(flexcomp: &Flexcomp, axis: usize, number: usize) -> f64 {
    flexcomp.spacing[axis] * (number as f64 - 0.5 * (flexcomp.count[axis] - 1) as f64)
}

/// Half the sizes of the whole.
fn half_size(flexcomp: &Flexcomp) -> [f64; 3] {
    std::array::from_fn(|axis| 0.5 * flexcomp.spacing[axis] * (flexcomp.count[axis] - 1) as f64)
}

fn rod(flexcomp: &Flexcomp) -> Result<FlexMesh, Fault> {
    let points: Vec<[f64; 3]> = (0..flexcomp.count[0]).map(|i| [along(flexcomp, 0, i), 0.0, 0.0]).collect();
    let builder = DeformableBodyBuilder::structure(&Structure::rod(&points, flexcomp.radius)?);
    Ok(FlexMesh { builder, points, reach: 0.1 * flexcomp.spacing[0] })
}

/// Thickness of a sheet \[m\].
pub(super) fn thickness(flexcomp: &Flexcomp) -> f64 {
    flexcomp.stiffness.thickness.unwrap_or(2.0 * flexcomp.radius)
}

fn sheet_grid(flexcomp: &Flexcomp) -> Result<FlexMesh, Fault> {
    let [wide, long, _] = flexcomp.count;
    if wide < 2 || long < 2 {
        return Err(Fault::Unsupported(format!("count {wide} by {long} leaves no triangles")));
    }
    let half = half_size(flexcomp);
    let mut points = Vec::with_capacity(wide * long);
    let mut triangles = Vec::new();
    for i in 0..wide {
        for j in 0..long {
            let mut at = [along(flexcomp, 0, i), along(flexcomp, 1, j), 0.0];
            if flexcomp.kind == Kind::Disc {
                // Squares around the middle become circles.
                let unit = [at[0] / half[0], at[1] / half[1]];
                let (ring, length) = (unit[0].abs().max(unit[1].abs()), unit[0].hypot(unit[1]));
                if length > 0.0 {
                    at = [at[0] * ring / length, at[1] * ring / length, 0.0];
                }
            }
            points.push(at);
            if i + 1 < wide && j + 1 < long {
                let id = |i, j| (i * long + j) as u32;
                let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
                // On a disc along the radii, else by turns, so that it bends alike both ways.
                let is_falling = match flexcomp.kind {
                    Kind::Disc => (2 * i + 1 < wide) != (2 * j + 1 < long),
                    _ => (i + j) % 2 == 1,
                };
                let pair = if is_falling { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] };
                triangles.extend(pair);
            }
        }
    }
    let structure = Structure::sheet(points.clone(), &triangles, thickness(flexcomp))?;
    let reach = 0.1 * flexcomp.spacing[0].min(flexcomp.spacing[1]);
    Ok(FlexMesh { builder: DeformableBodyBuilder::structure(&structure), points, reach })
}

fn cells(flexcomp: &Flexcomp) -> Result<[usize; 3], Fault> {
    let cells = flexcomp.count.map(|c| c - 1);
    match cells.contains(&0) {
        true => Err(Fault::Unsupported(format!("count {:?} leaves no tetrahedra", flexcomp.count))),
        false => Ok(cells),
    }
}

fn solid_grid(flexcomp: &Flexcomp) -> Result<FlexMesh, Fault> {
    let mesh = TetMesh::cuboid(half_size(flexcomp), cells(flexcomp)?)?;
    let [wide, long, high] = flexcomp.count;
    let mut points = vec![[0.0; 3]; wide * long * high];
    for i in 0..wide {
        for j in 0..long {
            for k in 0..high {
                let at = [along(flexcomp, 0, i), along(flexcomp, 1, j), along(flexcomp, 2, k)];
                points[grid_number(flexcomp, [i, j, k])] = at;
            }
        }
    }
    let reach = 0.1 * least(flexcomp.spacing);
    Ok(FlexMesh { builder: DeformableBodyBuilder::mesh(&mesh), points, reach })
}

fn filled(flexcomp: &Flexcomp) -> Result<FlexMesh, Fault> {
    let cells = cells(flexcomp)?;
    let half = half_size(flexcomp);
    // As fine as the finest side of the shell.
    let part = 2.0 / cells.into_iter().max().unwrap_or(1) as f64;
    let mesh = match flexcomp.kind {
        Kind::Cylinder => {
            let unit = TetMesh::fill_shape(&Cylinder::new(1.0, 1.0), part as f32)?;
            let place = |[x, y, z]: &[f64; 3]| [x * half[0], -z * half[1], y * half[2]];
            TetMesh::new(unit.vertices().iter().map(place).collect(), unit.tetrahedra().to_vec())?
        }
        Kind::Ellipsoid => {
            let unit = TetMesh::fill_shape(&Ball::new(1.0), part as f32)?;
            let place = |x: &[f64; 3]| std::array::from_fn(|axis| x[axis] * half[axis]);
            TetMesh::new(unit.vertices().iter().map(place).collect(), unit.tetrahedra().to_vec())?
        }
        _ => TetMesh::cuboid(half, cells)?,
    };
    let largest = (0..3).map(|a| 2.0 * half[a] / cells[a] as f64).fold(0.0, f64::max);
    let reach = if flexcomp.kind == Kind::Box { 0.1 * least(flexcomp.spacing) } else { largest };
    Ok(FlexMesh { builder: DeformableBodyBuilder::mesh(&mesh), points: shell(flexcomp, half), reach })
}

/// The middle and the shell in MuJoCo's order: ends along z, then sides across y, then across x.
fn shell(flexcomp: &Flexcomp, half: [f64; 3]) -> Vec<[f64; 3]> {
    let count = flexcomp.count;
    let at = |place: [usize; 3]| {
        let mut x: [f64; 3] =
            std::array::from_fn(|axis| 2.0 * place[axis] as f64 / (count[axis] - 1) as f64 - 1.0);
        match flexcomp.kind {
            Kind::Cylinder => {
                let (ring, length) = (x[0].abs().max(x[1].abs()), x[0].hypot(x[1]));
                let to = if length > 0.0 { ring / length } else { 0.0 };
                x = [x[0] * to, x[1] * to, x[2]];
            }
            Kind::Ellipsoid => {
                let length = x.iter().map(|c| c * c).sum::<f64>().sqrt();
                x = x.map(|c| if length > 0.0 { c / length } else { 0.0 });
            }
            _ => {}
        }
        std::array::from_fn(|axis| x[axis] * half[axis])
    };
    let ends = |axis: usize| [0, count[axis] - 1];
    let mut points = vec![[0.0; 3]];
    for z in ends(2) {
        for x in 0..count[0] {
            points.extend((0..count[1]).map(|y| at([x, y, z])));
        }
    }
    for y in ends(1) {
        for x in 0..count[0] {
            points.extend((1..count[2] - 1).map(|z| at([x, y, z])));
        }
    }
    for x in ends(0) {
        for y in 1..count[1] - 1 {
            points.extend((1..count[2] - 1).map(|z| at([x, y, z])));
        }
    }
    points
}

fn scaled(flexcomp: &Flexcomp, points: impl Iterator<Item = [f64; 3]>) -> Vec<[f64; 3]> {
    points.map(|x| std::array::from_fn(|axis| x[axis] * flexcomp.scale[axis])).collect()
}

fn from_file(flexcomp: &Flexcomp, settings: &Settings<'_>) -> Result<FlexMesh, Fault> {
    if flexcomp.file.is_empty() {
        return Err(Fault::Unsupported("names no file".to_string()));
    }
    let file = settings.mesh_file(&flexcomp.file);
    if flexcomp.kind == Kind::Gmsh {
        let read = TetMesh::read_gmsh(file)?;
        let points = scaled(flexcomp, read.vertices().iter().copied());
        return solid(points, read.tetrahedra().to_vec());
    }
    let surface = SurfaceMesh::read(file)?;
    let points = scaled(flexcomp, surface.vertices.iter().map(|x| x.to_array().map(f64::from)));
    match flexcomp.dim {
        2 => sheet(flexcomp, points, &surface.triangles),
        3 => {
            let vertices: Vec<rapier3d::math::Vector> =
                points.iter().map(|x| rapier3d::math::Vector::from_array(x.map(|c| c as f32))).collect();
            let cell = mean_edge(&points, &surface.triangles);
            let mesh = TetMesh::fill_surface(&vertices, &surface.triangles, cell as f32)?;
            Ok(FlexMesh { builder: DeformableBodyBuilder::mesh(&mesh), points, reach: cell })
        }
        dim => Err(Fault::Unsupported(format!("dim {dim} of a mesh file is not offered"))),
    }
}

fn direct(flexcomp: &Flexcomp) -> Result<FlexMesh, Fault> {
    if !flexcomp.points.len().is_multiple_of(3) {
        let count = flexcomp.points.len();
        return Err(Fault::Unsupported(format!("{count} numbers are no points: each has three")));
    }
    let points = scaled(flexcomp, flexcomp.points.chunks_exact(3).map(|x| [x[0], x[1], x[2]]));
    // Those beyond 32 bits are out of range too, which the mesh finds.
    let id = |index: usize| u32::try_from(flexcomp.elements[index]).unwrap_or(u32::MAX);
    let (count, corners) = (flexcomp.elements.len(), flexcomp.dim + 1);
    if !count.is_multiple_of(corners) {
        return Err(Fault::Unsupported(format!("{count} numbers are no elements of {corners} points")));
    }
    match flexcomp.dim {
        2 => {
            let triangles: Vec<[u32; 3]> = (0..count / 3).map(|e| [0, 1, 2].map(|c| id(3 * e + c))).collect();
            sheet(flexcomp, points, &triangles)
        }
        3 => {
            let corners = (0..count / 4).map(|e| [0, 1, 2, 3].map(|c| id(4 * e + c)));
            let turned = corners.map(|corners| outward(&points, corners)).collect();
            solid(points, turned)
        }
        _ => chain(flexcomp, points),
    }
}

/// MuJoCo numbers the corners of tetrahedra either way around.
fn outward(points: &[[f64; 3]], corners: [u32; 4]) -> [u32; 4] {
    let [a, b, c, d] = corners;
    let at = |corner: u32| points.get(corner as usize);
    let (Some(a_at), Some(b_at), Some(c_at), Some(d_at)) = (at(a), at(b), at(c), at(d)) else {
        return corners;
    };
    let [u, v, w] = [b_at, c_at, d_at].map(|x| [0, 1, 2].map(|k| x[k] - a_at[k]));
    let volume = u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0]);
    if volume < 0.0 { [a, b, d, c] } else { corners }
}

/// Edges from each point to the next.
fn chain(flexcomp: &Flexcomp, points: Vec<[f64; 3]>) -> Result<FlexMesh, Fault> {
    let follows = |(place, ends): (usize, &[usize])| ends == [place, place + 1];
    let edges = flexcomp.elements.chunks_exact(2);
    if edges.len() + 1 != points.len() || !edges.enumerate().all(follows) {
        let what = "of dim 1 are offered those whose edges lead from each vertex to the next";
        return Err(Fault::Unsupported(what.to_string()));
    }
    let reach = 0.1 * flexcomp.spacing[0];
    let builder = DeformableBodyBuilder::structure(&Structure::rod(&points, flexcomp.radius)?);
    Ok(FlexMesh { builder, points, reach })
}

fn sheet(flexcomp: &Flexcomp, points: Vec<[f64; 3]>, triangles: &[[u32; 3]]) -> Result<FlexMesh, Fault> {
    let reach = 0.1 * mean_edge(&points, triangles);
    let structure = Structure::sheet(points.clone(), triangles, thickness(flexcomp))?;
    Ok(FlexMesh { builder: DeformableBodyBuilder::structure(&structure), points, reach })
}

fn solid(points: Vec<[f64; 3]>, tetrahedra: Vec<[u32; 4]>) -> Result<FlexMesh, Fault> {
    let faces: Vec<[u32; 3]> = tetrahedra.iter().map(|t| [t[0], t[1], t[2]]).collect();
    let reach = 0.1 * mean_edge(&points, &faces);
    let mesh = TetMesh::new(points.clone(), tetrahedra)?;
    Ok(FlexMesh { builder: DeformableBodyBuilder::mesh(&mesh), points, reach })
}

/// Mean length of the triangles' first edges \[m\]; those to nowhere do not count.
fn mean_edge(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let length = |t: &[u32; 3]| {
        let (a, b) = (points.get(t[0] as usize)?, points.get(t[1] as usize)?);
        Some((0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt())
    };
    let lengths: Vec<f64> = triangles.iter().filter_map(length).collect();
    lengths.iter().sum::<f64>() / lengths.len().max(1) as f64
}
