//! What is to be filled: a smooth shape, or triangles with creases.

use super::creases::Creases;
use super::lattice::Lattice;
use super::scan::scan;
use crate::math::{Vec3, from_real, to_real};
use parry3d::query::Ray;
use parry3d::shape::{Shape, TriMesh};

/// A closed domain and its surface.
pub(super) struct Domain<'a> {
    surface: &'a dyn Shape,
    facets: Option<Facets<'a>>,
    pub low: Vec3,
    pub high: Vec3,
    /// What it encloses \[m³\].
    pub volume: f64,
}

/// The surface as triangles, or triangles close to it.
struct Facets<'a> {
    mesh: &'a TriMesh,
    vertices: Vec<Vec3>,
    creases: Creases,
}

impl<'a> Domain<'a> {
    /// A shape without creases.
    pub fn smooth(shape: &'a dyn Shape) -> Self {
        let bounds = shape.compute_local_aabb();
        let (low, high) = (from_real(bounds.mins), from_real(bounds.maxs));
        let volume = shape.mass_properties(1.0).mass().into();
        Self { surface: shape, facets: None, low, high, volume }
    }

    /// Closed triangles.
    pub fn faceted(mesh: &'a TriMesh, volume: f64) -> Self {
        let vertices: Vec<Vec3> = mesh.vertices().iter().map(|v| from_real(*v)).collect();
        let (low, high) = vertices.iter().fold((vertices[0], vertices[0]), |(l, h), v| (l.inf(v), h.sup(v)));
        let creases = Creases::of(&vertices, mesh.indices());
        Self { surface: mesh, facets: Some(Facets { mesh, vertices, creases }), low, high, volume }
    }

    /// A curved shape and closed triangles that are close to it.
    pub fn curved(shape: &'a dyn Shape, mesh: &'a TriMesh) -> Self {
        let volume = shape.mass_properties(1.0).mass().into();
        Self { surface: shape, ..Self::faceted(mesh, volume) }
    }

    /// Creases, if there are any, and the triangles they are of.
    pub fn creases(&self) -> Option<(&Creases, &TriMesh)> {
        let facets = self.facets.as_ref().filter(|f| !f.creases.is_empty());
        facets.map(|f| (&f.creases, f.mesh))
    }

    /// Which lattice vertices are inside, and whether parts of the surface overlap.
    pub fn inside(&self, lattice: &Lattice) -> (Vec<bool>, bool) {
        match &self.facets {
            Some(facets) => {
                let scan = scan(lattice, &facets.vertices, facets.mesh.indices());
                (scan.is_inside, scan.overlaps)
            }
            None => {
                let holds = |v| self.surface.contains_local_point(to_real(&lattice.position(v)));
                ((0..lattice.vertices() as u32).map(holds).collect(), false)
            }
        }
    }

    /// Where the way from a point outside to one inside first meets the surface.
    pub fn crossing(&self, outside: &Vec3, inside: &Vec3) -> Vec3 {
        let ray = Ray::new(to_real(outside), to_real(&(inside - outside)));
        let t = self.surface.cast_local_ray(&ray, 1.0, false).map(f64::from);
        let t = t.unwrap_or_else(|| {
            // Rounding: one of the ends is on the surface.
            let distance = |x: &Vec3| (self.nearest(x) - x).norm();
            let (out, within) = (distance(outside), distance(inside));
            if out + within > 0.0 { out / (out + within) } else { 0.5 }
        });
        outside + (inside - outside) * t
    }

    /// The nearest point of the surface.
    pub fn nearest(&self, x: &Vec3) -> Vec3 {
        from_real(self.surface.project_local_point(to_real(x), false).point)
    }
}
