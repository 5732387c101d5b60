//! The elements of a body at rest: tetrahedra in blocks, and triangles of sheets.

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
