//! The constant part of a body: rest mesh, element gradients, surface, node order.

use crate::math::lanes::{LANES, Lane};
use crate::math::{Mat3, Vec3};
use crate::mesh::{Surface, TetMesh, node_adjacency, sweep_order};
use std::sync::atomic::{AtomicU64, Ordering};

/// Everything about a body that its motion and its material do not change. Made once per mesh and
/// shared by all bodies of that shape through an [`Arc`](std::sync::Arc): they also share factors.
#[derive(Debug)]
pub struct DeformableModel {
    /// Names the model in caches.
    pub(crate) id: u64,
    /// Rest positions \[m\].
    pub(crate) rest: Vec<Vec3>,
    /// Nodes of each tetrahedron, in the order of `blocks`.
    pub(crate) tetrahedra: Vec<[u32; 4]>,
    /// The tetrahedra again, four at a time, as the element loops want them.
    pub(crate) blocks: Vec<ElementBlock>,
    /// A quarter of the volume of the tetrahedra around each node \[m³\].
    pub(crate) node_volumes: Vec<f64>,
    /// Nodes that share a tetrahedron with each node, ascending, itself left out.
    pub(crate) adjacency: Vec<Vec<u32>>,
    /// The boundary.
    pub(crate) surface: Surface,
    /// Extent of the rest shape: diagonal of its bounding box \[m\].
    pub(crate) size: f64,
    /// Volume at rest \[m³\].
    pub(crate) volume: f64,
    node_of_vertex: Vec<u32>,
    vertex_of_node: Vec<u32>,
}

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

static NEXT_ID: AtomicU64 = AtomicU64::new(1);

impl DeformableModel {
    /// Prepares a mesh for simulation.
    pub fn new(mesh: &TetMesh) -> Self {
        let at_rest: Vec<Vec3> = mesh.vertices().iter().map(|&v| v.into()).collect();
        let vertex_of_node = sweep_order(&at_rest);
        let mut node_of_vertex = vec![0; at_rest.len()];
        for (node, &vertex) in vertex_of_node.iter().enumerate() {
            node_of_vertex[vertex as usize] = node as u32;
        }
        let rest: Vec<Vec3> = vertex_of_node.iter().map(|&v| at_rest[v as usize]).collect();
        let mut tetrahedra: Vec<[u32; 4]> =
            mesh.tetrahedra().iter().map(|t| t.map(|v| node_of_vertex[v as usize])).collect();
        // Neighbouring elements touch neighbouring memory.
        tetrahedra.sort_by_key(|t| t.iter().sum::<u32>());
        let mut node_volumes = vec![0.0; rest.len()];
        for tet in &tetrahedra {
            let volume = crate::mesh::signed_volume(&tet.map(|n| rest[n as usize]));
            tet.iter().for_each(|&n| node_volumes[n as usize] += volume / 4.0);
        }
        let surface = Surface::new(&tetrahedra, &rest);
        let low = rest.iter().fold(rest[0], |a, b| a.inf(b));
        let high = rest.iter().fold(rest[0], |a, b| a.sup(b));
        Self {
            id: NEXT_ID.fetch_add(1, Ordering::Relaxed),
            blocks: tetrahedra.chunks(LANES).map(|c| ElementBlock::new(c, &rest)).collect(),
            adjacency: node_adjacency(&tetrahedra, rest.len()),
            volume: mesh.volume(),
            size: (high - low).norm(),
            rest,
            tetrahedra,
            node_volumes,
            surface,
            node_of_vertex,
            vertex_of_node,
        }
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.rest.len()
    }

    /// Number of tetrahedra.
    pub fn tetrahedron_count(&self) -> usize {
        self.tetrahedra.len()
    }

    /// Rest position of a vertex \[m\].
    ///
    /// # Panics
    /// If there is no such vertex.
    pub fn rest_position(&self, vertex: usize) -> [f64; 3] {
        self.rest[self.node_of_vertex[vertex] as usize].into()
    }

    /// Volume at rest \[m³\].
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Vertices of the boundary triangles, wound outward.
    pub fn surface_triangles(&self) -> impl ExactSizeIterator<Item = [u32; 3]> + '_ {
        let vertex = |n: u32| self.vertex_of_node[n as usize];
        self.surface.triangles.iter().map(move |t| t.map(vertex))
    }

    /// Bytes of the constant data: mesh, gradients, surface, orders.
    pub fn memory(&self) -> usize {
        use std::mem::size_of_val;
        size_of_val(&self.rest[..])
            + size_of_val(&self.tetrahedra[..])
            + size_of_val(&self.blocks[..])
            + size_of_val(&self.node_volumes[..])
            + self.adjacency.iter().map(|a| 24 + 4 * a.len()).sum::<usize>()
            + size_of_val(&self.surface.triangles[..]) * 2
            + size_of_val(&self.surface.edges[..])
            + 12 * self.rest.len()
    }

    /// The node of a vertex, if there is such a vertex.
    pub(crate) fn node(&self, vertex: usize) -> Option<usize> {
        self.node_of_vertex.get(vertex).map(|&n| n as usize)
    }

    /// The vertex of a node.
    pub(crate) fn vertex(&self, node: usize) -> usize {
        self.vertex_of_node[node] as usize
    }

    /// Nodes in the order of the user's vertices.
    pub(crate) fn nodes_by_vertex(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.node_of_vertex.iter().map(|&n| n as usize)
    }
}

impl ElementBlock {
    fn new(tetrahedra: &[[u32; 4]], rest: &[Vec3]) -> Self {
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
