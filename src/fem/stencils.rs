//! Weighted sums of nodes that keep a length: springs, rods, bends of rods and sheets, muscle fibres.

use crate::energy::stencil::StencilKind;
use crate::math::Vec3;

/// Nodes with weights whose sum `b = Σ cᵢ xᵢ` keeps a length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stencil<'a> {
    pub nodes: &'a [u32],
    pub coefficients: &'a [f64],
    /// Of b at rest.
    pub length: f64,
    /// Weight w of `w/2·(‖b‖ − l)²` per pascal of its modulus.
    pub weight: f64,
    pub kind: StencilKind,
    /// Places of the regions of what it spans, each as often as its share in four; of one region four times the same.
    pub regions: [u32; 4],
}

/// The stencils of a body, in one piece of memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stencils {
    kept: Vec<Kept>,
    /// The nodes of each one end here.
    ends: Vec<usize>,
    nodes: Vec<u32>,
    coefficients: Vec<f64>,
}

/// What a stencil keeps, as in [`Stencil`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    pub length: f64,
    pub weight: f64,
    pub kind: StencilKind,
    pub regions: [u32; 4],
}

/// A bend at rest below this \[rad per element\] counts as none: it would have no direction to keep.
const STRAIGHT: f64 = 1.0e-9;

impl Stencils {
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Stencil<'_>> + Clone {
        (0..self.len()).map(|k| self.get(k))
    }

    pub fn get(&self, k: usize) -> Stencil<'_> {
        let own = if k == 0 { 0 } else { self.ends[k - 1] }..self.ends[k];
        let Kept { length, weight, kind, regions } = self.kept[k];
        let (nodes, coefficients) = (&self.nodes[own.clone()], &self.coefficients[own]);
        Stencil { nodes, coefficients, length, weight, kind, regions }
    }

    pub fn len(&self) -> usize {
        self.kept.len()
    }

    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.kept[..])
            + size_of_val(&self.ends[..])
            + size_of_val(&self.nodes[..])
            + size_of_val(&self.coefficients[..])
    }

    pub(super) fn add(&mut self, terms: impl IntoIterator<Item = (u32, f64)>, kept: Kept) {
        for (node, coefficient) in terms {
            self.nodes.push(node);
            self.coefficients.push(coefficient);
        }
        self.ends.push(self.nodes.len());
        self.kept.push(kept);
    }

    /// A bar of `area` \[m²\], or a spring that is as stiff: `E A/l`. Returns its length \[m\].
    pub(super) fn add_bar(&mut self, ends: [u32; 2], area: f64, rest: &[Vec3], region: u32) -> f64 {
        let length = (rest[ends[1] as usize] - rest[ends[0] as usize]).norm();
        let kept = Kept { length, weight: area / length, kind: StencilKind::Stretch, regions: [region; 4] };
        self.add([(ends[0], -1.0), (ends[1], 1.0)], kept);
        length
    }

    /// A bend of a rod of `radius` \[m\] at the middle one of three nodes: `E I/2·κ²` over the mean of the two
    /// lengths, I = π r⁴/4.
    pub(super) fn add_rod_bend(&mut self, nodes: [u32; 3], radius: f64, rest: &[Vec3], sides: [u32; 2]) {
        let [a, b, c] = nodes.map(|n| rest[n as usize]);
        let (before, after) = (1.0 / (b - a).norm(), 1.0 / (c - b).norm());
        let bend = ((c - b) * after - (b - a) * before).norm();
        let inertia = std::f64::consts::FRAC_PI_4 * radius.powi(4);
        let kept = Kept {
            length: if bend > STRAIGHT { bend } else { 0.0 },
            weight: 2.0 * inertia / (1.0 / before + 1.0 / after),
            kind: StencilKind::RodBending,
            regions: [sides[0], sides[0], sides[1], sides[1]],
        };
        self.add([(nodes[0], before), (nodes[1], -before - after), (nodes[2], after)], kept);
    }

    /// A muscle fibre in a tetrahedron along the unit vector `direction`; its length is the activation.
    pub(super) fn add_fibre(
        &mut self,
        nodes: [u32; 4],
        gradients: &[Vec3; 4],
        volume: f64,
        direction: &Vec3,
        region: u32,
    ) {
        let kept = Kept { length: 1.0, weight: volume, kind: StencilKind::Fibre, regions: [region; 4] };
        let terms = nodes.into_iter().zip(gradients.map(|g| g.dot(direction)));
        self.add(terms.filter(|(_, c)| *c != 0.0), kept);
    }
}

impl Stencil<'_> {
    /// `b = Σ cᵢ xᵢ`.
    pub fn vector(&self, x: &[Vec3]) -> Vec3 {
        self.terms().fold(Vec3::zeros(), |sum, (n, c)| sum + x[n] * c)
    }

    /// Nodes with their coefficients.
    pub fn terms(&self) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        self.nodes.iter().map(|&n| n as usize).zip(self.coefficients.iter().copied())
    }

    /// Of what its regions have, as much as each one's share.
    pub fn mean(&self, of_region: impl Fn(u32) -> f64) -> f64 {
        0.25 * self.regions.iter().map(|region| of_region(*region)).sum::<f64>()
    }
}
