//! Fills seven surfaces, prints what their tetrahedra are like and draws it: `cargo run --release --example mesh_quality`.
//!
//! Writes `docs/meshes.svg`, or the path it is given.

mod plot;
#[path = "../../tests/common/surfaces.rs"]
mod surfaces;

use foible3d::TetMesh;
use rapier3d::parry::shape::{Ball, Capsule, Cylinder};
use std::error::Error;
use std::f64::consts::PI;
use std::time::Instant;
use surfaces::{Triangles, bracket, enclosed, hull, lump, torus};

/// Cells over a metre.
const CELLS: f32 = 8.0;

/// A filled surface.
struct Filled {
    name: &'static str,
    mesh: TetMesh,
    /// Of the surface \[m³\].
    volume: f64,
    /// It took \[ms\].
    ms: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let timed = |name, volume: f64, fill: &dyn Fn() -> Result<TetMesh, foible3d::MeshError>| {
        let start = Instant::now();
        let mesh = fill()?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        Ok::<_, foible3d::MeshError>(Filled { name, mesh, volume, ms })
    };
    let cell = 1.0 / CELLS;
    let surface = |name, s: Triangles| timed(name, enclosed(&s), &|| TetMesh::fill_surface(&s.0, &s.1, cell));
    let all = [
        timed("ball", PI / 6.0, &|| TetMesh::fill_shape(&Ball::new(0.5), cell))?,
        timed("capsule", PI * (0.2 + 1.0 / 6.0), &|| TetMesh::fill_shape(&Capsule::new_y(0.4, 0.5), cell))?,
        timed("cylinder", PI * 0.2, &|| TetMesh::fill_shape(&Cylinder::new(0.4, 0.5), cell))?,
        surface("hull of 20 points", hull())?,
        surface("torus", torus())?,
        surface("scanned lump", lump())?,
        surface("bracket with holes", bracket())?,
    ];
    println!(
        "| surface | tetrahedra | volume | dihedral angles | time | per 1000 |\n|---|---:|---:|---:|---:|---:|"
    );
    for Filled { name, mesh, volume, ms } in &all {
        let [least, most] = mesh.dihedral_angles().fold([180f64, 0.0], |[l, m], a| [l.min(a), m.max(a)]);
        let off = 100.0 * (mesh.volume() / volume - 1.0);
        let tetrahedra = mesh.tetrahedra().len();
        let per_thousand = 1e3 * ms / tetrahedra as f64;
        println!(
            "| {name} | {tetrahedra} | {off:+.2} % | {least:.0}° to {most:.0}° | {ms:.0} ms | {per_thousand:.1} ms |"
        );
    }
    let path = std::env::args().nth(1).unwrap_or_else(|| "docs/meshes.svg".into());
    plot::draw(&all, path.as_ref())
}
