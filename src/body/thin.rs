//! Sheets, rods, springs and fibres: their elements, made of a structure, and their energy and forces.

use super::elastic::Elements;
use super::elements::{Stencil, TriangleElement};
use crate::energy::membrane::{Membrane, polar_factor};
use crate::energy::stencil::{Keeper, StencilKind};
use crate::material::DeformableMaterial;
use crate::math::{Mat2, Vec3};
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

/// Stiffness damping of thin elements over one step: how they were stretched at its start.
#[derive(Clone, Debug, Default)]
pub(crate) struct ThinDamping {
    stretches: Vec<Mat2>,
    lengths: Vec<f64>,
}

impl ThinDamping {
    /// At `x`, or what that and `before` amount to in a step of the second order.
    pub fn begin(
        &mut self,
        triangles: &[TriangleElement],
        stencils: &[Stencil],
        beta: f64,
        x: &[Vec3],
        before: Option<&[Vec3]>,
    ) {
        self.stretches.clear();
        self.lengths.clear();
        if beta > 0.0 {
            let stretch = |t: &TriangleElement, x: &[Vec3]| {
                let F = t.deformation_gradient(x);
                let S = polar_factor(&F).tr_mul(&F);
                (S + S.transpose()) * 0.5
            };
            self.stretches.extend(triangles.iter().map(|t| {
                let now = stretch(t, x);
                before.map_or(now, |before| now + (now - stretch(t, before)) / 3.0)
            }));
            self.lengths.extend(stencils.iter().map(|s| {
                let now = s.vector(x).norm();
                before.map_or(now, |before| now + (now - s.vector(before).norm()) / 3.0)
            }));
        }
    }
}

/// What keeps the length of a stencil of a body.
pub(super) fn keeper(stencil: &Stencil, material: &DeformableMaterial, activation: f64) -> Keeper {
    let weight = stencil.weight * stencil.kind.modulus(material);
    let is_stretch = stencil.kind == StencilKind::Stretch;
    let limits = material
        .strain_limits
        .filter(|_| is_stretch)
        .map(|limits| (limits.map(|l| l * stencil.length), stencil.weight * material.limit_weight()));
    let length = if stencil.kind == StencilKind::Fibre { activation } else { stencil.length };
    Keeper { length, weight, limits }
}

/// Adds the forces \[N\] of a body's thin elements at positions `x`; returns their energy \[J\]. `ratio` is β/h.
pub(super) fn add_forces(
    elements: &Elements<'_>,
    damping: &ThinDamping,
    ratio: f64,
    x: &[Vec3],
    force: &mut [Vec3],
) -> f64 {
    let Elements { model, material, activation } = elements;
    let sheet = Membrane::new(material);
    let lame = material.lame();
    let mut energy = 0.0;
    for (k, triangle) in model.triangles.iter().enumerate() {
        let F = triangle.deformation_gradient(x);
        let response = sheet.evaluate(&F);
        let (mut density, mut stress) = (response.density, response.stress);
        if let Some(S) = damping.stretches.get(k) {
            // As of tetrahedra: towards the last stretch, turned as the triangle is now.
            let deviation = F - polar_factor(&(F * S)) * S;
            density += ratio * lame.mu * deviation.norm_squared();
            stress += deviation * (2.0 * ratio * lame.mu);
        }
        energy += triangle.volume * density;
        for (&n, g) in triangle.nodes.iter().zip(&triangle.gradients) {
            force[n as usize] -= stress * g * triangle.volume;
        }
    }
    for (k, stencil) in model.stencils.iter().enumerate() {
        let keeper = keeper(stencil, material, *activation);
        let b = stencil.vector(x);
        let (mut own, mut pull) = keeper.response(&b);
        if let Some(&length) = damping.lengths.get(k) {
            let damper = Keeper { length, weight: ratio * keeper.weight, limits: None };
            let (damped, drag) = damper.response(&b);
            (own, pull) = (own + damped, pull + drag);
        }
        energy += own;
        for (n, c) in stencil.terms() {
            force[n] -= pull * c;
        }
    }
    energy
}
