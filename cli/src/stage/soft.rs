//! Soft bodies of a scene.

use super::pose;
use super::shapes::{simple_shape, surface};
use crate::scene::{self, Body};
use foible3d::prelude::*;
use rapier3d::prelude::*;
use std::path::Path;

/// Cells across the largest side of a surface that is filled, where no size is given.
const CELLS_ACROSS: f32 = 12.0;

/// A polyline cut into segments of equal length.
fn polyline(points: &[[f32; 3]], segments: usize) -> Vec<Vector> {
    let points: Vec<Vector> = points.iter().map(|&p| p.into()).collect();
    let lengths: Vec<f32> = points.windows(2).map(|p| (p[1] - p[0]).length()).collect();
    let total: f32 = lengths.iter().sum();
    let at = |mut along: f32| {
        for (ends, length) in points.windows(2).zip(&lengths) {
            if along <= *length {
                return ends[0] + (ends[1] - ends[0]) * (along / length);
            }
            along -= length;
        }
        points.last().copied().unwrap_or_default()
    };
    (0..=segments).map(|k| at(total * k as f32 / segments.max(1) as f32)).collect()
}

/// The shape of a deformable, and the numbers that its regions have in a file.
fn mesh(body: &scene::Deformable, folder: &Path) -> Result<(DeformableBodyBuilder, Vec<u32>), String> {
    let builder = match body.body.as_ref() {
        Body::Lattice { half_extents, cells, hollows } if hollows.is_empty() => {
            DeformableBodyBuilder::cuboid((*half_extents).into(), *cells)
        }
        Body::Lattice { half_extents, cells, hollows } => {
            let whole = TetMesh::cuboid(half_extents.map(f64::from), *cells).map_err(|e| e.to_string())?;
            let hollow = whole.without(|x| hollows.iter().any(|hollow| is_within(hollow, x)));
            DeformableBodyBuilder::mesh(&hollow.map_err(|e| format!("`hollows`: {e}"))?)
        }
        Body::Filled { shape, cell_size } => DeformableBodyBuilder::filled(
            &*simple_shape(shape).ok_or("`filled` fills simple shapes")?,
            *cell_size,
        ),
        Body::Mesh { path, cell_size, scale, z_up } => {
            let tets = tetrahedra(&folder.join(path), *cell_size, *scale, *z_up)?;
            let builder = DeformableBodyBuilder::mesh(&tets);
            let numbers = group_numbers(&tets, &body.regions)?;
            return Ok((with_groups(builder, &numbers, &body.regions), numbers));
        }
        Body::Cloth { half_extents, cells, thickness } => {
            DeformableBodyBuilder::cloth(*half_extents, *cells, *thickness)
        }
        Body::Rope { points, segments, radius } => {
            DeformableBodyBuilder::rope(&polyline(points, *segments), *radius)
        }
        Body::Network { half_extents, cells } => {
            let mesh = TetMesh::cuboid(half_extents.map(f64::from), *cells).map_err(|e| e.to_string())?;
            DeformableBodyBuilder::spring_network(&mesh)
        }
    };
    Ok((builder, Vec::new()))
}

type Regions = [toml::Spanned<scene::RegionMaterial>];

/// Numbers of the physical groups of a file; none where regions are boxes.
fn group_numbers(mesh: &TetMesh, regions: &Regions) -> Result<Vec<u32>, String> {
    let groups = regions.iter().filter_map(|region| region.as_ref().group.as_ref());
    let number =
        |group: &String| mesh.region_named(group).ok_or_else(|| format!("its mesh has no group \"{group}\""));
    groups.map(number).collect()
}

/// Materials of the physical groups of a file.
fn with_groups(builder: DeformableBodyBuilder, numbers: &[u32], regions: &Regions) -> DeformableBodyBuilder {
    numbers.iter().zip(regions).fold(builder, |builder, (number, region)| {
        builder.region_material(*number, region.as_ref().material.to_material())
    })
}

fn is_within(region: &scene::Region, x: [f64; 3]) -> bool {
    (0..3).all(|k| (f64::from(region.min[k])..=f64::from(region.max[k])).contains(&x[k]))
}

/// What fills the cavities of a body; their volumes are those of the shape at rest.
fn filled(builder: DeformableBodyBuilder, body: &scene::Deformable) -> Result<DeformableBodyBuilder, String> {
    if body.cavities.is_empty() {
        return Ok(builder);
    }
    let built = builder.build().map_err(|e| e.to_string())?;
    let rooms: Vec<f64> = built.model().cavities().map(|cavity| cavity.volume).collect();
    if body.cavities.len() > rooms.len() {
        let (asked, found) = (body.cavities.len(), rooms.len());
        return Err(format!("`cavities` fills {asked} closed rooms, but there are {found}"));
    }
    let filling =
        |(filling, volume): (&toml::Spanned<scene::Filling>, &f64)| filling.as_ref().at_rest(*volume);
    let fillings = body.cavities.iter().zip(&rooms).map(filling).enumerate();
    Ok(fillings.fold(builder, |builder, (cavity, filling)| builder.fill_cavity(cavity, filling)))
}

/// Materials and warps of boxes; later ones over earlier ones. Region 0 is what is in none.
fn with_boxes(builder: DeformableBodyBuilder, body: &scene::Deformable) -> DeformableBodyBuilder {
    let regions: &Regions = &body.regions;
    let boxes: Vec<scene::Region> = regions.iter().filter_map(|region| region.as_ref().within).collect();
    let warp = |x| {
        let place = boxes.iter().rposition(|region| is_within(region, x));
        let own = place.and_then(|k| regions[k].as_ref().warp);
        own.or(body.warp).unwrap_or_default().map(f64::from)
    };
    let is_woven = body.warp.is_some() || regions.iter().any(|region| region.as_ref().warp.is_some());
    let builder = if is_woven { builder.warp(warp) } else { builder };
    if boxes.is_empty() {
        return builder;
    }
    let builder = builder
        .regions(|x| boxes.iter().rposition(|region| is_within(region, x)).map_or(0, |k| k as u32 + 1));
    let numbered = regions.iter().enumerate();
    numbered.fold(builder, |builder, (k, region)| {
        builder.region_material(k as u32 + 1, region.as_ref().material.to_material())
    })
}

/// The tetrahedra of a file, or those that its surface is filled with.
fn tetrahedra(path: &Path, cell_size: Option<f32>, scale: f32, z_up: bool) -> Result<TetMesh, String> {
    let extension = path.extension().map_or(String::new(), |e| e.to_string_lossy().to_lowercase());
    if !["obj", "stl", "ply", "gltf", "glb"].contains(&extension.as_str()) {
        let mesh = TetMesh::read(path).map_err(|e| e.to_string())?;
        return mesh.scaled(f64::from(scale)).map_err(|e| e.to_string());
    }
    let surface = surface(path, scale, z_up)?;
    let (surface, _) =
        surface.repaired(&SurfaceRepair::default()).map_err(|e| format!("{}: {e}", path.display()))?;
    let whole = Aabb::from_points(surface.vertices.iter().copied());
    let size = cell_size.unwrap_or(2.0 * whole.half_extents().max_element() / CELLS_ACROSS);
    surface.filled(size).map_err(|e| format!("{}: {e}", path.display()))
}

/// The preset of a body, changed by the other keys of its solver.
fn solved_by(builder: DeformableBodyBuilder, asked: &scene::Solver) -> DeformableBodyBuilder {
    let builder = match asked.fidelity {
        Some(scene::Fidelity::Preview) => builder.fidelity(Fidelity::Preview),
        Some(scene::Fidelity::Game) => builder.fidelity(Fidelity::Game),
        Some(scene::Fidelity::Engineering) => builder.fidelity(Fidelity::Engineering),
        Some(scene::Fidelity::Reference) => builder.fidelity(Fidelity::Reference),
        None => builder,
    };
    builder.tune(|settings| {
        if let Some(kind) = asked.kind {
            settings.solver = match kind {
                scene::SolverKind::Projective => Solver::Projective,
                scene::SolverKind::ConjugateGradients => Solver::ConjugateGradients,
                scene::SolverKind::GaussSeidel => Solver::GaussSeidel,
                scene::SolverKind::Xpbd => Solver::Xpbd,
                scene::SolverKind::Jacobi => Solver::Jacobi,
                scene::SolverKind::Newton => Solver::Newton,
                scene::SolverKind::Automatic => Solver::Automatic,
            };
        }
        if let Some(system) = asked.system {
            settings.system = match system {
                scene::System::Laplacian => SystemMatrix::Laplacian,
                scene::System::RestStiffness => SystemMatrix::RestStiffness,
            };
        }
        if let Some(frames) = asked.frames {
            settings.frames = match frames {
                scene::Frames::Floating => Frames::Floating,
                scene::Frames::PerNode => Frames::PerNode,
                scene::Frames::Automatic => Frames::Automatic,
            };
        }
        if let Some(integrator) = asked.integrator {
            settings.integrator = match integrator {
                scene::Integrator::ImplicitEuler => Integrator::ImplicitEuler,
                scene::Integrator::Bdf2 => Integrator::Bdf2,
            };
        }
        settings.max_iterations = asked.max_iterations.unwrap_or(settings.max_iterations);
        settings.tolerance = asked.tolerance.unwrap_or(settings.tolerance);
        settings.contact_tolerance = asked.contact_tolerance.unwrap_or(settings.contact_tolerance);
        settings.acceleration = match asked.lbfgs {
            Some(0) => Acceleration::None,
            Some(window) => Acceleration::Lbfgs { window },
            None => settings.acceleration,
        };
    })
}

/// A body as its file describes it, and the numbers of its regions.
pub(super) fn deformable(
    body: &scene::Deformable,
    folder: &Path,
) -> Result<(DeformableBodyBuilder, Vec<u32>), String> {
    let (shape, groups) = mesh(body, folder)?;
    let numbers = if groups.is_empty() { (1..=body.regions.len() as u32).collect() } else { groups };
    let builder = solved_by(with_boxes(shape, body), &body.solver);
    let builder = builder
        .pose(pose(body.translation, body.rotation))
        .linvel(body.linvel.into())
        .angvel(body.angvel.into())
        .material(body.material.as_ref().to_material())
        // What a scene expects of rest is to be found awake.
        .can_sleep(false);
    let builder = filled(builder.self_contact(body.self_contact), body)?;
    let builder = match body.pinned.clone() {
        Some(regions) => builder.pinned(move |x| {
            let within = |r: &scene::Region| x.cmpge(r.min.into()).all() && x.cmple(r.max.into()).all();
            regions.all().iter().any(within)
        }),
        None => builder,
    };
    Ok((builder, numbers))
}
