//! Sheets, rods, springs and hinges of a structure as elements.

use super::elements::{Stencil, TriangleElement};
use super::regions::VolumeShares;
use crate::math::Vec3;
use crate::mesh::{Rod, Structure};
use std::collections::BTreeMap;

/// What a structure has besides tetrahedra, in nodes.
pub(super) struct ThinElements {
    pub triangles: Vec<TriangleElement>,
    pub stencils: Vec<Stencil>,
    /// Of rods.
    pub segments: Vec<[u32; 2]>,
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
            stencils: Vec::new(),
            segments: Vec::new(),
            half_thickness: vec![0.0; rest.len()],
        };
        // Hinges by their edge: the opposite corners, thicknesses and regions of one or two triangles.
        let mut hinges: BTreeMap<[u32; 2], Vec<(u32, f64, u32)>> = BTreeMap::new();
        for sheet in &structure.sheets {
            let (nodes, region) = (sheet.corners.map(&node), shares.place(sheet.region));
            let mut triangle = TriangleElement::new(nodes, sheet.thickness, rest);
            if let Some(warp) = sheet.warp {
                triangle = triangle.woven(&warp.into(), rest);
            }
            shares.add(region, &nodes, triangle.volume);
            thin.thicken(&nodes, sheet.thickness / 2.0);
            thin.triangles.push(TriangleElement { region, ..triangle });
            for k in 0..3 {
                let (a, b) = (nodes[(k + 1) % 3], nodes[(k + 2) % 3]);
                hinges.entry([a.min(b), a.max(b)]).or_default().push((nodes[k], sheet.thickness, region));
            }
        }
        for (edge, sides) in &hinges {
            if let [(a, t, r), (b, u, s)] = sides[..] {
                let hinge = Stencil::hinge(*edge, [a, b], 0.5 * (t + u), rest);
                thin.stencils.push(Stencil { regions: [r, s], ..hinge });
            }
        }
        thin.triangles.sort_by_key(|triangle| triangle.region);
        for rod in &structure.rods {
            thin.add_rod(rod, &node, rest, shares);
        }
        for spring in &structure.springs {
            let bar = Stencil::bar(spring.ends.map(&node), spring.area, rest);
            thin.stencils.push(Stencil { regions: [shares.place(spring.region); 2], ..bar });
        }
        if structure.is_network {
            thin.add_network(tetrahedra, rest);
        }
        thin
    }

    fn add_rod(&mut self, rod: &Rod, node: impl Fn(u32) -> u32, rest: &[Vec3], shares: &mut VolumeShares) {
        let points: Vec<u32> = rod.points.iter().map(|&v| node(v)).collect();
        let regions: Vec<u32> = rod.regions.iter().map(|tag| shares.place(*tag)).collect();
        let area = std::f64::consts::PI * rod.radius * rod.radius;
        for (ends, &region) in points.windows(2).zip(&regions) {
            let ends = [ends[0], ends[1]];
            let bar = Stencil::bar(ends, area, rest);
            shares.add(region, &ends, bar.length * area);
            self.thicken(&ends, rod.radius);
            self.stencils.push(Stencil { regions: [region; 2], ..bar });
            self.segments.push(ends);
        }
        let (mut bends, mut sides) = (points.clone(), regions);
        if points.len() > 3 && points.first() == points.last() {
            // A ring bends where it closes too.
            bends.push(points[1]);
            sides.push(sides[0]);
        }
        for (bend, sides) in bends.windows(3).zip(sides.windows(2)).filter(|(p, _)| p[0] != p[2]) {
            let stencil = Stencil::rod_bend([bend[0], bend[1], bend[2]], rod.radius, rest);
            self.stencils.push(Stencil { regions: [sides[0], sides[1]], ..stencil });
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
            let bar = Stencil::bar(ends, volume / (b - a).norm(), rest);
            self.stencils.push(Stencil { regions: [region; 2], ..bar });
        }
    }
}
