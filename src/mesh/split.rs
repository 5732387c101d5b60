//! Taking regions out of a structure.

use super::mesh_error::MeshError;
use super::structure::{SheetTriangle, Spring, Structure};
use super::tet_mesh::check_surface;

/// A structure without the tetrahedra of some regions.
pub(crate) struct Split {
    /// What is left, its vertices in their order.
    pub rest: Structure,
    /// By vertex of the whole: its number in what is left.
    pub kept: Vec<Option<u32>>,
    /// Of each region: its tetrahedra, over the vertices of the whole.
    pub taken: Vec<Vec<[u32; 4]>>,
}

impl Structure {
    /// Takes the tetrahedra of regions out.
    ///
    /// # Errors
    /// [`MeshError::RegionNotSolid`] for a region without tetrahedra or with other elements, [`MeshError::RegionsTouch`],
    /// [`MeshError::Empty`] if nothing is left, and what is wrong with the surface of what is.
    pub(crate) fn split(&self, regions: &[u32]) -> Result<Split, MeshError> {
        let thin = self.rods.iter().flat_map(|rod| rod.regions.iter().copied());
        let thin = thin.chain(self.sheets.iter().map(|sheet| sheet.region));
        let mut thin = thin.chain(self.springs.iter().map(|spring| spring.region));
        if let Some(region) = thin.find(|region| regions.contains(region)) {
            return Err(MeshError::RegionNotSolid { region });
        }
        let mut taken = vec![Vec::new(); regions.len()];
        let mut rest = Self { tetrahedra: Vec::new(), regions: Vec::new(), ..self.clone() };
        for (tet, region) in self.tetrahedra.iter().zip(&self.regions) {
            if let Some(place) = regions.iter().position(|own| own == region) {
                taken[place].push(*tet);
            } else {
                rest.tetrahedra.push(*tet);
                rest.regions.push(*region);
            }
        }
        if let Some(place) = taken.iter().position(Vec::is_empty) {
            return Err(MeshError::RegionNotSolid { region: regions[place] });
        }
        self.check_apart(regions, &taken)?;
        let kept = rest.drop_unused();
        if rest.vertices.is_empty() {
            return Err(MeshError::Empty);
        }
        check_surface(&rest.tetrahedra)?;
        Ok(Split { rest, kept, taken })
    }

    /// Regions that are taken out must not meet: what is attached to one cannot be attached to another.
    fn check_apart(&self, regions: &[u32], taken: &[Vec<[u32; 4]>]) -> Result<(), MeshError> {
        let mut owner = vec![usize::MAX; self.vertices.len()];
        for (place, tets) in taken.iter().enumerate() {
            for &vertex in tets.iter().flatten() {
                let own = &mut owner[vertex as usize];
                if *own != usize::MAX && *own != place {
                    let regions = [regions[*own], regions[place]];
                    return Err(MeshError::RegionsTouch { regions, vertex: vertex as usize });
                }
                *own = place;
            }
        }
        Ok(())
    }

    /// Drops vertices that no element has; by vertex, its new number.
    fn drop_unused(&mut self) -> Vec<Option<u32>> {
        let mut is_used = vec![false; self.vertices.len()];
        let tets = self.tetrahedra.iter().flatten();
        let sheets = self.sheets.iter().flat_map(|sheet| &sheet.corners);
        let springs = self.springs.iter().flat_map(|spring| &spring.ends);
        let rods = self.rods.iter().flat_map(|rod| &rod.points);
        tets.chain(sheets).chain(springs).chain(rods).for_each(|v| is_used[*v as usize] = true);
        let mut numbers = 0..;
        let kept: Vec<Option<u32>> =
            is_used.iter().map(|used| used.then(|| numbers.next()).flatten()).collect();
        let rename = |v: &mut u32| *v = kept[*v as usize].unwrap_or(u32::MAX);
        self.tetrahedra.iter_mut().flatten().for_each(rename);
        self.sheets.iter_mut().flat_map(|SheetTriangle { corners, .. }| corners).for_each(rename);
        self.springs.iter_mut().flat_map(|Spring { ends, .. }| ends).for_each(rename);
        self.rods.iter_mut().flat_map(|rod| &mut rod.points).for_each(rename);
        let mut is_used = is_used.into_iter();
        self.vertices.retain(|_| is_used.next() == Some(true));
        kept
    }
}
