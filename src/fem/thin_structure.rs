//! Sheets, rods and springs of a structure as elements.

use super::elements::TriangleElement;
use super::regions::VolumeShares;
use super::sheet_bending::{SheetPiece, add_sheet_bends};
use super::stencils::Stencils;
use crate::math::Vec3;
use crate::mesh::{Rod, Structure, node_adjacency};
use std::collections::BTreeMap;

/// What a structure has besides tetrahedra, in nodes.
pub(super) struct ThinElements {
    pub triangles: Vec<TriangleElement>,
    pub stencils: Stencils,
    /// Of rods.
    pub segments: Vec<[u32; 2]>,
    /// Corners of triangles opposite of each edge that two share.
    pub across_edges: Vec<[u32; 2]>,
    pub half_thickness: Vec<f64>,
}

impl ThinElements {
    /// Adds its volume to `shares`. `tetrahedra` are those of the structure, in nodes, with the places of their regions.
    pub fn new(
        structure: &Structure,
        node: impl Fn(u32) -> u32,
        tetrahedra: &[(u32, [u32; 4])],
        rest: &[Vec3],
        shares: &mut VolumeShares,
    ) -> Self {
        let mut thin = Self {
            triangles: Vec::new(),
            stencils: Stencils::default(),
            segments: Vec::new(),
            across_edges: Vec::new(),
            half_thickness: vec![0.0; rest.len()],
        };
        let mut pieces = Vec::with_capacity(structure.sheets.len());
        for sheet in &structure.sheets {
            let (nodes, region) = (sheet.corners.map(&node), shares.place(sheet.region));
            let mut triangle = TriangleElement::new(nodes, sheet.thickness, rest);
            if let Some(warp) = sheet.warp {
                triangle = triangle.woven(&warp.into(), rest);
            }
            shares.add(region, &nodes, triangle.volume);
            thin.thicken(&nodes, sheet.thickness / 2.0);
            thin.triangles.push(TriangleElement { region, ..triangle });
            pieces.push(SheetPiece { nodes, thickness: sheet.thickness, region });
        }
        thin.across_edges = add_sheet_bends(&mut thin.stencils, &pieces, rest);
        thin.triangles.sort_by_key(|triangle| triangle.region);
        for rod in &structure.rods {
            thin.add_rod(rod, &node, rest, shares);
        }
        for spring in &structure.springs {
            thin.stencils.add_bar(spring.ends.map(&node), spring.area, rest, shares.place(spring.region));
        }
        if structure.is_network {
            thin.add_network(tetrahedra, rest);
        }
        thin
    }

    /// Nodes that share an element with each of `nodes`; and those that it has a block of the matrix with. Sheets bend over patches of
    /// triangles: what is as far apart as those may touch.
    pub fn adjacencies(&self, tetrahedra: &[[u32; 4]], nodes: usize) -> [Vec<Vec<u32>>; 2] {
        let triangles = self.triangles.iter().map(|t| &t.nodes[..]);
        let elements = tetrahedra.iter().map(|t| &t[..]).chain(triangles);
        let near = self.stencils.iter().filter(|s| !s.kind.is_of_sheets()).map(|s| s.nodes);
        let near = near.chain(self.across_edges.iter().map(|pair| &pair[..]));
        let all = self.stencils.iter().map(|s| s.nodes);
        [node_adjacency(elements.clone().chain(near), nodes), node_adjacency(elements.chain(all), nodes)]
    }

    fn add_rod(&mut self, rod: &Rod, node: impl Fn(u32) -> u32, rest: &[Vec3], shares: &mut VolumeShares) {
        let points: Vec<u32> = rod.points.iter().map(|&v| node(v)).collect();
        let regions: Vec<u32> = rod.regions.iter().map(|tag| shares.place(*tag)).collect();
        let area = std::f64::consts::PI * rod.radius * rod.radius;
        for (ends, &region) in points.windows(2).zip(&regions) {
            let ends = [ends[0], ends[1]];
            let length = self.stencils.add_bar(ends, area, rest, region);
            shares.add(region, &ends, length * area);
            self.thicken(&ends, rod.radius);
            self.segments.push(ends);
        }
        let (mut bends, mut sides) = (points.clone(), regions);
        if points.len() > 3 && points.first() == points.last() {
            // A ring bends where it closes too.
            bends.push(points[1]);
            sides.push(sides[0]);
        }
        for (bend, sides) in bends.windows(3).zip(sides.windows(2)).filter(|(p, _)| p[0] != p[2]) {
            self.stencils.add_rod_bend([bend[0], bend[1], bend[2]], rod.radius, rest, [sides[0], sides[1]]);
        }
    }

    fn thicken(&mut self, nodes: &[u32], half_thickness: f64) {
        for &n in nodes {
            let own = &mut self.half_thickness[n as usize];
            *own = own.max(half_thickness);
        }
    }

    /// The edges of tetrahedra as springs: `E V/l²`, see [`Structure::spring_network`].
    fn add_network(&mut self, tetrahedra: &[(u32, [u32; 4])], rest: &[Vec3]) {
        let mut around: BTreeMap<(u32, [u32; 2]), f64> = BTreeMap::new();
        for (region, tet) in tetrahedra {
            let volume = crate::mesh::signed_volume(&tet.map(|n| rest[n as usize]));
            for i in 0..4 {
                for j in 0..i {
                    let (a, b) = (tet[i].min(tet[j]), tet[i].max(tet[j]));
                    *around.entry((*region, [a, b])).or_default() += volume;
                }
            }
        }
        for ((region, ends), volume) in around {
            let [a, b] = ends.map(|n| rest[n as usize]);
            self.stencils.add_bar(ends, volume / (b - a).norm(), rest, region);
        }
    }
}
