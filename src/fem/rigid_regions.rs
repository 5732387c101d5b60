//! Regions of a body that are rigid: taken out of its elements, with what a rigid body of them needs.

use super::model::DeformableModel;
use crate::math::{Mat3, Vec3};
use crate::mesh::{MeshError, signed_volume, sorted_face, sorted_faces};
use std::collections::{BTreeSet, HashMap, HashSet};

/// A region that was taken out of a body to be rigid: a bone, an insert of metal. Its frame is that of the rest shape.
#[derive(Clone, Debug)]
pub struct RigidRegion {
    region: u32,
    vertices: Vec<usize>,
    volume: f64,
    centre: Vec3,
    /// Second moments about the centre, by volume \[m⁵\].
    moments: Mat3,
    skin: (Vec<[f64; 3]>, Vec<[u32; 3]>),
}

impl RigidRegion {
    /// Its user's number.
    pub fn region(&self) -> u32 {
        self.region
    }

    /// Vertices that it shares with what is left of the body, by their numbers there, ascending: to be attached to the rigid body.
    pub fn vertices(&self) -> &[usize] {
        &self.vertices
    }

    /// \[m³\]
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Centre of mass in the rest shape \[m\].
    pub fn centre(&self) -> [f64; 3] {
        self.centre.into()
    }

    /// Inertia about the centre \[kg m²\] at a density [kg/m³], along the axes of the rest shape: that of the solid itself, row by row.
    pub fn inertia(&self, density: f64) -> [[f64; 3]; 3] {
        let inertia = (Mat3::identity() * self.moments.trace() - self.moments) * density;
        [0, 1, 2].map(|r| [0, 1, 2].map(|c| inertia[(r, c)]))
    }

    /// What it has of the body's surface: points \[m\] and triangles wound outward. Empty if it is inside altogether.
    pub fn surface(&self) -> (&[[f64; 3]], &[[u32; 3]]) {
        (&self.skin.0, &self.skin.1)
    }
}

impl DeformableModel {
    /// The same without the tetrahedra of some regions, and each of those to be made a rigid body of; the vertices that are left keep
    /// their order. [`DeformableWorld::insert_with_rigid_regions`](crate::DeformableWorld::insert_with_rigid_regions) does all of it.
    ///
    /// # Errors
    /// [`MeshError::RegionNotSolid`], [`MeshError::RegionsTouch`]; [`MeshError::Empty`] if nothing is left; [`MeshError::NonManifoldEdge`] if what is
    /// left hangs together by an edge.
    pub fn without_regions(&self, regions: &[u32]) -> Result<(Self, Vec<RigidRegion>), MeshError> {
        let split = self.structure.split(regions)?;
        let points: Vec<Vec3> = self.structure.vertices().iter().map(|v| (*v).into()).collect();
        let region_of = |(region, tets): (&u32, &Vec<[u32; 4]>)| {
            let used: BTreeSet<u32> = tets.iter().flatten().copied().collect();
            let shared = used.iter().filter_map(|v| split.kept[*v as usize]);
            let (volume, centre, moments) = moments(tets, &points);
            let skin = skin(tets, &points, self.surface_triangles());
            let vertices = shared.map(|v| v as usize).collect();
            RigidRegion { region: *region, vertices, volume, centre, moments, skin }
        };
        let rigid = regions.iter().zip(&split.taken).map(region_of).collect();
        let rest = self.remade(split.rest, |vertex| split.kept[vertex as usize]);
        Ok((rest, rigid))
    }
}

/// Volume \[m³\], centre \[m\] and second moments about it \[m⁵\] of tetrahedra.
fn moments(tets: &[[u32; 4]], points: &[Vec3]) -> (f64, Vec3, Mat3) {
    let corners = || tets.iter().map(|tet| tet.map(|v| points[v as usize]));
    let volume: f64 = corners().map(|c| signed_volume(&c)).sum();
    let first = corners().map(|c| c.iter().sum::<Vec3>() * (signed_volume(&c) / 4.0));
    let centre = first.sum::<Vec3>() / volume;
    // ∫ x xᵀ over a tetrahedron is V/20 (Σ xᵢ xᵢᵀ + Σ xᵢ Σ xⱼᵀ).
    let second = corners().map(|c| {
        let own = c.map(|x| x - centre);
        let sum: Vec3 = own.iter().sum();
        let squares = own.iter().map(|x| x * x.transpose()).sum::<Mat3>();
        (squares + sum * sum.transpose()) * (signed_volume(&c) / 20.0)
    });
    (volume, centre, second.sum())
}

/// The triangles of a surface that are faces of tetrahedra.
fn skin(
    tets: &[[u32; 4]],
    points: &[Vec3],
    surface: impl Iterator<Item = [u32; 3]>,
) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let own: HashSet<[u32; 3]> = tets.iter().flat_map(sorted_faces).collect();
    let faces: Vec<[u32; 3]> = surface.filter(|face| own.contains(&sorted_face(*face))).collect();
    let used: BTreeSet<u32> = faces.iter().flatten().copied().collect();
    let numbers: HashMap<u32, u32> = used.iter().copied().zip(0..).collect();
    let triangles = faces.iter().map(|face| face.map(|v| numbers[&v])).collect();
    (used.iter().map(|v| points[*v as usize].into()).collect(), triangles)
}
