//! Sheets, rods, springs and hinges of a structure as elements.

use super::elements::{Stencil, TriangleElement};
use crate::math::Vec3;
use crate::mesh::Structure;
use std::collections::BTreeMap;

/// What a structure has besides tetrahedra, in nodes.
pub(super) struct ThinElements {
    pub triangles: Vec<TriangleElement>,
    pub stencils: Vec<Stencil>,
    /// Of rods.
    pub segments: Vec<[u32; 2]>,
    pub half_thickness: Vec<f64>,
    /// \[m³\].
    pub volume: f64,
}

impl ThinElements {
    /// Adds the nodes' shares to `node_volumes`. `tetrahedra` are those of the structure, in nodes.
    pub fn new(
        structure: &Structure,
        node: impl Fn(u32) -> u32,
        tetrahedra: &[[u32; 4]],
        rest: &[Vec3],
        node_volumes: &mut [f64],
    ) -> Self {
        let mut thin = Self {
            triangles: Vec::new(),
            stencils: Vec::new(),
            segments: Vec::new(),
            half_thickness: vec![0.0; rest.len()],
            volume: 0.0,
        };
        // Hinges by their edge: the opposite corners and thicknesses of one or two triangles.
        let mut hinges: BTreeMap<[u32; 2], Vec<(u32, f64)>> = BTreeMap::new();
        for sheet in &structure.sheets {
            let nodes = sheet.corners.map(&node);
            let triangle = TriangleElement::new(nodes, sheet.thickness, rest);
            thin.add_mass(&nodes, triangle.volume, sheet.thickness / 2.0, node_volumes);
            thin.triangles.push(triangle);
            for k in 0..3 {
                let (a, b) = (nodes[(k + 1) % 3], nodes[(k + 2) % 3]);
                hinges.entry([a.min(b), a.max(b)]).or_default().push((nodes[k], sheet.thickness));
            }
        }
        for (edge, sides) in &hinges {
            if let [(a, t), (b, u)] = sides[..] {
                thin.stencils.push(Stencil::hinge(*edge, [a, b], 0.5 * (t + u), rest));
            }
        }
        for rod in &structure.rods {
            let points: Vec<u32> = rod.points.iter().map(|&v| node(v)).collect();
            let area = std::f64::consts::PI * rod.radius * rod.radius;
            for ends in points.windows(2) {
                let ends = [ends[0], ends[1]];
                let bar = Stencil::bar(ends, area, rest);
                thin.add_mass(&ends, bar.length * area, rod.radius, node_volumes);
                thin.stencils.push(bar);
                thin.segments.push(ends);
            }
            let mut bends = points.clone();
            if points.len() > 3 && points.first() == points.last() {
                // A ring bends where it closes too.
                bends.push(points[1]);
            }
            for bend in bends.windows(3).filter(|p| p[0] != p[2]) {
                thin.stencils.push(Stencil::rod_bend([bend[0], bend[1], bend[2]], rod.radius, rest));
            }
        }
        for spring in &structure.springs {
            thin.stencils.push(Stencil::bar(spring.ends.map(&node), spring.area, rest));
        }
        if structure.is_network {
            thin.add_network(tetrahedra, rest);
        }
        thin
    }

    fn add_mass(&mut self, nodes: &[u32], volume: f64, half_thickness: f64, node_volumes: &mut [f64]) {
        self.volume += volume;
        for &n in nodes {
            node_volumes[n as usize] += volume / nodes.len() as f64;
            let own = &mut self.half_thickness[n as usize];
            *own = own.max(half_thickness);
        }
    }

    /// The edges of tetrahedra as springs: `E V/l²`, see [`Structure::spring_network`].
    fn add_network(&mut self, tetrahedra: &[[u32; 4]], rest: &[Vec3]) {
        let mut around: BTreeMap<[u32; 2], f64> = BTreeMap::new();
        for tet in tetrahedra {
            let volume = crate::mesh::signed_volume(&tet.map(|n| rest[n as usize]));
            for i in 0..4 {
                for j in 0..i {
                    let (a, b) = (tet[i].min(tet[j]), tet[i].max(tet[j]));
                    *around.entry([a, b]).or_default() += volume;
                }
            }
        }
        for (ends, volume) in around {
            let [a, b] = ends.map(|n| rest[n as usize]);
            self.stencils.push(Stencil::bar(ends, volume / (b - a).norm(), rest));
        }
    }
}
