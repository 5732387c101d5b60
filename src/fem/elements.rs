//! The elements of a body at rest: tetrahedra in blocks, triangles of sheets, and stencils of what keeps a
//! length.

use crate::energy::stencil::StencilKind;
use crate::math::lanes::{LANES, Lane};
use crate::math::{Mat3, Mat3x2, Vec3};
use nalgebra::Vector2;

/// Four tetrahedra side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElementBlock {
    /// `corners[a][i]`: node at corner a of tetrahedron i.
    pub corners: [[u32; LANES]; 4],
    /// `gradients[a]`: gradient of the shape function of corner a + 1 [1/m]; corner 0 has minus
    /// their sum. `F = Σ (x_a − x_0) gradients[a]ᵀ`.
    pub gradients: [[Lane; 3]; 3],
    /// Rest volumes \[m³\]; zero in the lanes that fill up the last block.
    pub volumes: Lane,
}

impl ElementBlock {
    pub fn new(tetrahedra: &[[u32; 4]], rest: &[Vec3]) -> Self {
        let mut block =
            Self { corners: [[0; LANES]; 4], gradients: [[Lane::default(); 3]; 3], volumes: Lane::default() };
        for i in 0..LANES {
            // The last block is filled up with copies of its last element, without volume.
            let tet = tetrahedra[i.min(tetrahedra.len() - 1)];
            let p = tet.map(|n| rest[n as usize]);
            let edges = Mat3::from_columns(&[p[1] - p[0], p[2] - p[0], p[3] - p[0]]);
            // A valid mesh has no flat elements.
            let inverse = edges.try_inverse().unwrap_or_else(Mat3::identity);
            for a in 0..4 {
                block.corners[a][i] = tet[a];
            }
            for a in 0..3 {
                for c in 0..3 {
                    block.gradients[a][c].0[i] = inverse[(a, c)];
                }
            }
            if i < tetrahedra.len() {
                block.volumes.0[i] = crate::mesh::signed_volume(&p);
            }
        }
        block
    }

    /// Shape function gradients of the four corners of element `i` [1/m].
    pub fn shape_gradients(&self, i: usize) -> [Vec3; 4] {
        let g = [0, 1, 2].map(|a| Vec3::from_fn(|c, _| self.gradients[a][c].0[i]));
        [-(g[0] + g[1] + g[2]), g[0], g[1], g[2]]
    }
}

/// A triangle of a sheet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleElement {
    pub nodes: [u32; 3],
    /// Place of its region.
    pub region: u32,
    /// Whether the first axis of its gradients is the warp's.
    pub is_woven: bool,
    /// Gradients of the corners' shape functions in the plane of the triangle [1/m]: `F = Σ x_a g_aᵀ`. The axes are those of warp
    /// and weft; without, the first is along its first edge.
    pub gradients: [Vector2<f64>; 3],
    /// Area times thickness \[m³\].
    pub volume: f64,
}

impl TriangleElement {
    pub fn new(nodes: [u32; 3], thickness: f64, rest: &[Vec3]) -> Self {
        let [a, b, c] = nodes.map(|n| rest[n as usize]);
        let along = (b - a).normalize();
        let across = c - a - along * along.dot(&(c - a));
        let height = across.norm();
        // Edges in the frame of `along` and `across`: (l, 0) and (s, height).
        let (l, s) = ((b - a).norm(), along.dot(&(c - a)));
        let gb = Vector2::new(1.0 / l, -s / (l * height));
        let gc = Vector2::new(0.0, 1.0 / height);
        let gradients = [-(gb + gc), gb, gc];
        Self { nodes, region: 0, is_woven: false, gradients, volume: 0.5 * l * height * thickness }
    }

    /// The same with the first axis along what `warp` is in its plane.
    pub fn woven(self, warp: &Vec3, rest: &[Vec3]) -> Self {
        let [a, b, c] = self.nodes.map(|n| rest[n as usize]);
        let along = (b - a).normalize();
        let across = (b - a).cross(&(c - a)).normalize().cross(&along);
        let first = Vector2::new(warp.dot(&along), warp.dot(&across)).normalize();
        let second = Vector2::new(-first.y, first.x);
        let gradients = self.gradients.map(|g| Vector2::new(first.dot(&g), second.dot(&g)));
        Self { gradients, is_woven: true, ..self }
    }

    pub fn deformation_gradient(&self, x: &[Vec3]) -> Mat3x2 {
        let [a, b, c] = self.nodes.map(|n| x[n as usize]);
        (b - a) * self.gradients[1].transpose() + (c - a) * self.gradients[2].transpose()
    }
}

/// Nodes with weights whose sum `b = Σ cᵢ xᵢ` keeps a length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stencil {
    pub nodes: [u32; 4],
    /// Zero for nodes that do not count.
    pub coefficients: [f64; 4],
    /// Of b at rest.
    pub length: f64,
    /// Weight w of `w/2·(‖b‖ − l)²` per pascal of its modulus.
    pub weight: f64,
    pub kind: StencilKind,
    /// Places of its regions: of what is on either side of a hinge or a bend, else the same twice.
    pub regions: [u32; 2],
}

/// A bend at rest below this counts as none: it would have no direction to keep.
const STRAIGHT: f64 = 1.0e-9;

impl Stencil {
    /// A bar of `area` \[m²\], or a spring that is as stiff: `E A/l`.
    pub fn bar(ends: [u32; 2], area: f64, rest: &[Vec3]) -> Self {
        let length = (rest[ends[1] as usize] - rest[ends[0] as usize]).norm();
        Self {
            nodes: [ends[0], ends[1], ends[0], ends[0]],
            coefficients: [-1.0, 1.0, 0.0, 0.0],
            length,
            weight: area / length,
            kind: StencilKind::Stretch,
            regions: [0; 2],
        }
    }

    /// A bend of a rod of `radius` \[m\] at the middle one of three nodes: `E I/2·κ²` over the mean of the two
    /// lengths, I = π r⁴/4.
    pub fn rod_bend(nodes: [u32; 3], radius: f64, rest: &[Vec3]) -> Self {
        let [a, b, c] = nodes.map(|n| rest[n as usize]);
        let (before, after) = (1.0 / (b - a).norm(), 1.0 / (c - b).norm());
        let bend = (c - b) * after - (b - a) * before;
        let inertia = std::f64::consts::FRAC_PI_4 * radius.powi(4);
        Self {
            nodes: [nodes[0], nodes[1], nodes[2], nodes[0]],
            coefficients: [before, -before - after, after, 0.0],
            length: kept_bend(bend.norm(), 1.0),
            weight: 2.0 * inertia / (1.0 / before + 1.0 / after),
            kind: StencilKind::RodBending,
            regions: [0; 2],
        }
    }

    /// A hinge of a sheet of `thickness` \[m\] over the edge `e`, with the corners opposite of it. Quadratic
    /// bending [Bergou et al. 2006], with the factor that makes a cylinder's energy that of a plate,
    /// `D/2·κ²` per area, on lattices of equilateral and of right triangles.
    pub fn hinge(e: [u32; 2], opposite: [u32; 2], thickness: f64, rest: &[Vec3]) -> Self {
        let [x0, x1] = e.map(|n| rest[n as usize]);
        let [x2, x3] = opposite.map(|n| rest[n as usize]);
        let cotangent = |u: Vec3, v: Vec3| u.dot(&v) / u.cross(&v).norm();
        let (c01, c02) = (cotangent(x1 - x0, x2 - x0), cotangent(x1 - x0, x3 - x0));
        let (c03, c04) = (cotangent(x0 - x1, x2 - x1), cotangent(x0 - x1, x3 - x1));
        let coefficients = [c03 + c04, c01 + c02, -c01 - c03, -c02 - c04];
        let edge = x1 - x0;
        let areas = 0.5 * (edge.cross(&(x2 - x0)).norm() + edge.cross(&(x3 - x0)).norm());
        let bend = [x0, x1, x2, x3].iter().zip(coefficients).map(|(x, c)| x * c).sum::<Vec3>().norm();
        Self {
            nodes: [e[0], e[1], opposite[0], opposite[1]],
            coefficients,
            length: kept_bend(bend, edge.norm()),
            weight: thickness.powi(3) / 12.0 / areas,
            kind: StencilKind::SheetBending,
            regions: [0; 2],
        }
    }

    /// A muscle fibre in a tetrahedron along the unit vector `direction`; its length is the activation.
    pub fn fibre(nodes: [u32; 4], gradients: &[Vec3; 4], volume: f64, direction: &Vec3) -> Self {
        Self {
            nodes,
            coefficients: gradients.map(|g| g.dot(direction)),
            length: 1.0,
            weight: volume,
            kind: StencilKind::Fibre,
            regions: [0; 2],
        }
    }

    /// `b = Σ cᵢ xᵢ`.
    pub fn vector(&self, x: &[Vec3]) -> Vec3 {
        let terms = self.nodes.iter().zip(self.coefficients);
        terms.fold(Vec3::zeros(), |sum, (&n, c)| if c == 0.0 { sum } else { sum + x[n as usize] * c })
    }

    /// Nodes that count, with their coefficients.
    pub fn terms(&self) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let terms = self.nodes.iter().map(|&n| n as usize).zip(self.coefficients);
        terms.filter(|(_, c)| *c != 0.0)
    }
}

fn kept_bend(bend: f64, scale: f64) -> f64 {
    if bend > STRAIGHT * scale { bend } else { 0.0 }
}
