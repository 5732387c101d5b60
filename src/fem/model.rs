//! The constant part of a body: rest mesh, elements, surface, node order.

use super::cavities::{Cavity, DeformableCavity, cavities};
use super::elements::{ElementBlock, TriangleElement};
use super::flat_bends::FlatBends;
use super::regions::{Region, VolumeShares, blocks, set_ranges};
use super::smoothing::SmoothingDomains;
use super::stencils::Stencils;
use super::thin_structure::ThinElements;
use crate::material::DeformableMaterial;
use crate::math::Vec3;
use crate::mesh::{MeshError, Structure, Surface, TetMesh, sweep_order};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// Everything about a body that its motion and its material do not change. Made once per mesh and
/// shared by all bodies of that shape through an [`Arc`](std::sync::Arc): they also share factors.
#[derive(Clone, Debug)]
pub struct DeformableModel {
    /// Names the model in caches.
    pub(crate) id: u64,
    /// Rest positions \[m\].
    pub(crate) rest: Vec<Vec3>,
    /// What shares a material; one at least.
    pub(crate) regions: Vec<Region>,
    /// Nodes of each tetrahedron, region by region, in the order of `blocks`.
    pub(crate) tetrahedra: Vec<[u32; 4]>,
    /// The tetrahedra again, four of a region at a time, as the element loops want them.
    pub(crate) blocks: Vec<ElementBlock>,
    /// In the place of `blocks`, the domains of smoothed tetrahedra: around edges for the shape, patches for the volume.
    pub(crate) domains: SmoothingDomains,
    pub(crate) volume_domains: SmoothingDomains,
    /// Triangles of sheets, region by region.
    pub(crate) triangles: Vec<TriangleElement>,
    /// What keeps lengths: springs, rods, bends of sheets, muscle fibres.
    pub(crate) stencils: Stencils,
    /// Made when it is first asked for.
    flat_bends: OnceLock<FlatBends>,
    /// Distance of the surface from each node \[m\]: half the thickness of a sheet, the radius of a rod.
    pub(crate) half_thickness: Vec<f64>,
    /// Each node's share of the volume of the elements around it: a quarter of a tetrahedron's \[m³\].
    pub(crate) node_volumes: Vec<f64>,
    /// Nodes that share an element with each node, ascending, itself left out.
    pub(crate) adjacency: Vec<Vec<u32>>,
    /// Nodes that belong to no tetrahedron, each with the nearest one that does.
    pub(crate) frame_sources: Vec<(u32, u32)>,
    /// Nodes that each node has a block of the matrix with: as `adjacency`, but of sheets, which bend over patches, and smoothed.
    pub(crate) coupling: Vec<Vec<u32>>,
    /// The boundary.
    pub(crate) surface: Surface,
    /// Closed rooms, the largest first.
    pub(crate) cavities: Vec<Cavity>,
    /// Nodes along each rod.
    pub(super) rods: Vec<Vec<u32>>,
    /// Extent of the rest shape: diagonal of its bounding box \[m\].
    pub(crate) size: f64,
    /// Volume at rest \[m³\].
    pub(crate) volume: f64,
    node_of_vertex: Vec<u32>,
    pub(crate) vertex_of_node: Vec<u32>,
    /// What it was made of.
    pub(super) structure: Arc<Structure>,
    /// Tetrahedra with muscle fibres, and their unit directions.
    pub(super) fibres: Vec<(u32, Vec3)>,
}

/// What the elastic energy of a body is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elements<'a> {
    pub model: &'a DeformableModel,
    /// One per region.
    pub materials: &'a [DeformableMaterial],
    /// Stretch that the muscle fibres of each region want to have; one where none is given.
    pub activations: &'a [f64],
}

/// What a body is made of, as far as settings depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Build {
    /// Tetrahedra, with or without anything else.
    Solid,
    /// Sheets or springs.
    Sheet,
    /// Such of few vertices.
    SmallSheet,
    /// Nothing but rods.
    Rope,
}

/// Most vertices of a sheet that is solved by Newton's method if nothing else is asked for: it takes 1.6 to 2.2 times as long in
/// a strip of 205 vertices, a third in a cloth of 169 on a floor, four times as long in one of 441 that hangs, nine in one of 1681.
const SMALL_SHEET: usize = 256;

/// A name that no other model has.
pub(super) fn next_id() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

impl DeformableModel {
    /// Prepares a mesh for simulation.
    #[must_use]
    pub fn new(mesh: &TetMesh) -> Self {
        Self::of(Structure::solid(mesh))
    }

    /// Prepares a structure for simulation: tetrahedra, sheets, rods and springs in any mix.
    ///
    /// # Errors
    /// [`MeshError::UnusedVertex`] for a vertex without mass, [`MeshError::Empty`].
    pub fn from_structure(structure: &Structure) -> Result<Self, MeshError> {
        structure.check()?;
        Ok(Self::of(structure.clone()))
    }

    /// The same with muscle fibres in its tetrahedra: `direction` tells their direction at a point of the rest
    /// shape \[m\]; where that is zero or not finite there are none. See
    /// [`DeformableMaterial::fibre_modulus`](crate::DeformableMaterial::fibre_modulus).
    #[must_use]
    pub fn with_fibres(mut self, direction: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.id = next_id();
        let fibre = |(place, tet): (u32, &[u32; 4])| {
            let middle = tet.iter().map(|&n| self.rest[n as usize]).sum::<Vec3>() / 4.0;
            let along = Vec3::from(direction(middle.into())).try_normalize(0.0);
            along.filter(|along| along.iter().all(|c| c.is_finite())).map(|along| (place, along))
        };
        let fibres: Vec<(u32, Vec3)> = (0..).zip(&self.tetrahedra).filter_map(fibre).collect();
        self.add_fibres(&fibres);
        self
    }

    /// Adds muscle fibres to tetrahedra, by unit directions.
    pub(super) fn add_fibres(&mut self, fibres: &[(u32, Vec3)]) {
        for (place, along) in fibres {
            let tet = self.tetrahedra[*place as usize];
            let block = ElementBlock::new(&[tet], &self.rest);
            let volume = crate::mesh::signed_volume(&tet.map(|n| self.rest[n as usize]));
            let region = self.regions.partition_point(|region| region.tetrahedra.end <= *place as usize);
            self.stencils.add_fibre(tet, &block.shape_gradients(0), volume, along, region as u32);
        }
        self.fibres.extend_from_slice(fibres);
    }

    /// Of a structure in which every vertex has mass.
    pub(super) fn of(structure: Structure) -> Self {
        let structure = Arc::new(structure);
        let at_rest: Vec<Vec3> = structure.vertices.iter().map(|&v| v.into()).collect();
        let vertex_of_node = sweep_order(&at_rest);
        let mut node_of_vertex = vec![0; at_rest.len()];
        for (node, &vertex) in vertex_of_node.iter().enumerate() {
            node_of_vertex[vertex as usize] = node as u32;
        }
        let rest: Vec<Vec3> = vertex_of_node.iter().map(|&v| at_rest[v as usize]).collect();
        let node = |v: u32| node_of_vertex[v as usize];
        let mut shares = VolumeShares::new(structure.all_regions(), rest.len());
        let tagged = structure.tetrahedra.iter().zip(&structure.regions);
        let mut placed: Vec<(u32, [u32; 4])> =
            tagged.map(|(tet, tag)| (shares.place(*tag), tet.map(node))).collect();
        // Neighbouring elements touch neighbouring memory.
        placed.sort_by_key(|(region, tet)| (*region, tet.iter().sum::<u32>()));
        for (region, tet) in &placed {
            shares.add(*region, tet, crate::mesh::signed_volume(&tet.map(|n| rest[n as usize])));
        }
        let thin = ThinElements::new(&structure, node, &placed, &rest, &mut shares);
        let (mut regions, node_volumes) = shares.finish();
        set_ranges(&mut regions, placed.iter().map(|(region, _)| *region), |region| &mut region.tetrahedra);
        set_ranges(&mut regions, thin.triangles.iter().map(|t| t.region), |region| &mut region.triangles);
        let tetrahedra: Vec<[u32; 4]> = placed.into_iter().map(|(_, tet)| tet).collect();
        let solid: &[[u32; 4]] = if structure.is_network { &[] } else { &tetrahedra };
        let blocks = blocks(&mut regions, solid, &rest);
        let sheets: Vec<[u32; 3]> = thin.triangles.iter().map(|t| t.nodes).collect();
        let surface = Surface::new(&tetrahedra, &sheets, &thin.segments, &rest);
        let low = rest.iter().fold(rest[0], |a, b| a.inf(b));
        let high = rest.iter().fold(rest[0], |a, b| a.sup(b));
        let [adjacency, coupling] = thin.adjacencies(&tetrahedra, rest.len());
        let cavities = cavities(&surface, &rest);
        Self {
            id: next_id(),
            blocks,
            frame_sources: frame_sources(&adjacency, solid),
            coupling,
            adjacency,
            volume: regions.iter().map(|region| region.volume).sum(),
            regions,
            size: (high - low).norm(),
            rest,
            domains: SmoothingDomains::default(),
            volume_domains: SmoothingDomains::default(),
            triangles: thin.triangles,
            flat_bends: OnceLock::new(),
            stencils: thin.stencils,
            half_thickness: thin.half_thickness,
            tetrahedra,
            node_volumes,
            cavities,
            rods: structure.rods().map(|points| points.iter().map(|&v| node(v)).collect()).collect(),
            surface,
            node_of_vertex,
            vertex_of_node,
            structure,
            fibres: Vec::new(),
        }
    }

    /// Whether it is a solid, altogether or in part.
    pub fn is_solid(&self) -> bool {
        !self.blocks.is_empty()
    }

    /// Whether its tetrahedra are smoothed.
    pub fn is_smoothed(&self) -> bool {
        self.domains.count > 0
    }

    /// What it is made of.
    pub(crate) fn build(&self) -> Build {
        match (self.is_solid(), self.surface.triangles.is_empty()) {
            (true, _) => Build::Solid,
            (false, false) if self.vertex_count() <= SMALL_SHEET => Build::SmallSheet,
            (false, false) => Build::Sheet,
            (false, true) => Build::Rope,
        }
    }

    pub(crate) fn has_fibres(&self) -> bool {
        !self.fibres.is_empty()
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.rest.len()
    }

    /// Number of tetrahedra.
    pub fn tetrahedron_count(&self) -> usize {
        self.tetrahedra.len()
    }

    /// The largest distance of the surface from its nodes \[m\].
    pub(crate) fn skin(&self) -> f64 {
        self.half_thickness.iter().copied().fold(0.0, f64::max)
    }

    /// Volume at rest of a tetrahedron \[m³\].
    ///
    /// # Panics
    /// If there is no such tetrahedron.
    pub fn tetrahedron_volume(&self, tet: usize) -> f64 {
        crate::mesh::signed_volume(&self.tetrahedra[tet].map(|n| self.rest[n as usize]))
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

    /// Vertices of the triangles of the surface: those around tetrahedra first, wound outward, then those of sheets.
    pub fn surface_triangles(&self) -> impl ExactSizeIterator<Item = [u32; 3]> + '_ {
        let vertex = |n: u32| self.vertex_of_node[n as usize];
        self.surface.triangles.iter().map(move |t| t.map(vertex))
    }

    /// Vertices of the tetrahedra.
    pub fn tetrahedra(&self) -> impl ExactSizeIterator<Item = [u32; 4]> + '_ {
        self.tetrahedra.iter().map(|t| t.map(|n| self.vertex_of_node[n as usize]))
    }

    /// Closed rooms, the largest first: hollows within the tetrahedra, and what sheets close in that are wound one way.
    pub fn cavities(&self) -> impl ExactSizeIterator<Item = DeformableCavity> + '_ {
        self.cavities.iter().map(|cavity| cavity.describe(&self.rest))
    }

    /// The closed room that a place of the rest shape is in, by its place among [`DeformableModel::cavities`]; the smallest of several.
    /// It holds whatever the order of the rooms comes to, so it is how a room is named in code.
    ///
    /// ```
    /// use foible3d::{DeformableBodyBuilder, TetMesh};
    /// // Two chambers, each a cell of five.
    /// let finger = TetMesh::cuboid([0.5, 0.3, 0.3], [5, 3, 3])?;
    /// let in_chamber = |[x, y, z]: [f64; 3]| y.abs() < 0.1 && z.abs() < 0.1 && (x.abs() - 0.2).abs() < 0.1;
    /// let finger = DeformableBodyBuilder::mesh(&finger.without(in_chamber)?).build()?;
    /// let left = finger.model().cavity_at([-0.2, 0.0, 0.0]);
    /// assert!(left.is_some() && left != finger.model().cavity_at([0.2, 0.0, 0.0]));
    /// # Ok::<(), foible3d::DeformableBodyError>(())
    /// ```
    pub fn cavity_at(&self, place: [f64; 3]) -> Option<usize> {
        self.cavities.iter().rposition(|cavity| cavity.holds(&place.into(), &self.rest))
    }

    /// Nodes along each rod.
    pub(crate) fn rods(&self) -> impl ExactSizeIterator<Item = &[u32]> + '_ {
        self.rods.iter().map(|nodes| &nodes[..])
    }

    /// The bends of flat sheets, summed up.
    pub(super) fn flat_bends(&self) -> &FlatBends {
        self.flat_bends.get_or_init(|| FlatBends::new(&self.stencils, &self.coupling))
    }

    /// Number of rods.
    pub fn rod_count(&self) -> usize {
        self.rods.len()
    }

    /// Bytes of the constant data: mesh, gradients, surface, orders.
    pub fn memory(&self) -> usize {
        use std::mem::size_of_val;
        size_of_val(&self.rest[..])
            + size_of_val(&self.tetrahedra[..])
            + size_of_val(&self.blocks[..])
            + size_of_val(&self.triangles[..])
            + self.stencils.bytes()
            + self.flat_bends.get().map_or(0, FlatBends::bytes)
            + 2 * size_of_val(&self.node_volumes[..])
            + self.adjacency.iter().chain(&self.coupling).map(|a| 24 + 4 * a.len()).sum::<usize>()
            + self.domains.bytes()
            + self.volume_domains.bytes()
            + size_of_val(&self.surface.triangles[..]) * 2
            + size_of_val(&self.surface.edges[..])
            + self.cavities.iter().map(|cavity| size_of_val(&cavity.triangles[..])).sum::<usize>()
            + 12 * self.rest.len()
            + size_of_val(self.structure.vertices())
            + size_of_val(self.structure.tetrahedra())
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

/// Nodes without tetrahedra with the nearest, by edges, of those with some.
fn frame_sources(adjacency: &[Vec<u32>], tetrahedra: &[[u32; 4]]) -> Vec<(u32, u32)> {
    let mut source = vec![u32::MAX; adjacency.len()];
    tetrahedra.iter().flatten().for_each(|&n| source[n as usize] = n);
    let mut front: Vec<u32> = (0..source.len() as u32).filter(|&n| source[n as usize] == n).collect();
    let mut found = Vec::new();
    while !front.is_empty() {
        let mut next = Vec::new();
        for &n in &front {
            for &other in &adjacency[n as usize] {
                if source[other as usize] == u32::MAX {
                    source[other as usize] = source[n as usize];
                    found.push((other, source[n as usize]));
                    next.push(other);
                }
            }
        }
        front = next;
    }
    found
}
