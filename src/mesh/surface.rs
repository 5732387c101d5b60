//! The boundary surface of a tetrahedral mesh.

use crate::math::Vec3;
use std::collections::{HashMap, HashSet};

/// The faces of a positively oriented tetrahedron, wound so that normals point outward.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// No triangle.
pub(crate) const NONE: u32 = u32::MAX;

/// Triangles, edges and nodes on the boundary of a body: of its tetrahedra, and its sheets and rods.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// Mesh nodes of each triangle; of tetrahedra first, wound outward, then those of sheets.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles that bound a solid: they have an outside.
    pub closed: usize,
    /// Mesh nodes on the surface, ascending.
    pub nodes: Vec<u32>,
    /// Mesh nodes of each edge, ascending within the edge.
    pub edges: Vec<[u32; 2]>,
    /// Edges of each triangle, the k-th opposite corner k.
    pub triangle_edges: Vec<[u32; 3]>,
    /// The two triangles on each edge; [`NONE`] beyond the border of a sheet and along rods.
    pub edge_triangles: Vec<[u32; 2]>,
    /// Edges without triangles, of rods: with the triangles they are the facets of the surface.
    pub segments: Vec<u32>,
    /// A facet at each surface node: a triangle, or beyond their number a segment.
    pub node_facet: Vec<u32>,
    /// Whether each surface node is on sheets and rods only, which have no outside.
    pub is_thin: Vec<bool>,
    /// Index into `nodes` per mesh node; `u32::MAX` inside the body.
    pub index_of_node: Vec<u32>,
    /// Mean length of the edges at rest \[m\].
    pub mean_edge: f64,
    /// Volume over area of what is solid, at rest \[m\]: half the thickness of a wide plate; zero without solids.
    pub half_thickness: f64,
}

impl Surface {
    /// The surface of valid tetrahedra, `sheets` and `segments` of rods.
    pub fn new(tetrahedra: &[[u32; 4]], sheets: &[[u32; 3]], segments: &[[u32; 2]], rest: &[Vec3]) -> Self {
        let mut triangles = boundary_triangles(tetrahedra).unwrap_or_default();
        let closed = triangles.len();
        // A skin on a solid is the solid's surface.
        let known: HashSet<[u32; 3]> = triangles.iter().map(|t| sorted_face(*t)).collect();
        triangles.extend(sheets.iter().filter(|t| !known.contains(&sorted_face(**t))));
        let mut index_of_node = vec![u32::MAX; rest.len()];
        let on_surface = triangles.iter().flatten().chain(segments.iter().flatten());
        on_surface.for_each(|&n| index_of_node[n as usize] = 0);
        let nodes: Vec<u32> = (0..rest.len() as u32).filter(|&n| index_of_node[n as usize] == 0).collect();
        for (i, &n) in nodes.iter().enumerate() {
            index_of_node[n as usize] = i as u32;
        }
        let mut edges: Vec<[u32; 2]> = edge_uses(&triangles).into_iter().map(|u| u.edge).collect();
        edges.extend(segments.iter().map(|&[a, b]| [a.min(b), a.max(b)]));
        edges.sort_unstable();
        edges.dedup();
        let find = |a: u32, b: u32| edges.binary_search(&[a.min(b), a.max(b)]).unwrap_or(0) as u32;
        let triangle_edges: Vec<[u32; 3]> =
            triangles.iter().map(|&[a, b, c]| [find(b, c), find(c, a), find(a, b)]).collect();
        let mut edge_triangles = vec![[NONE; 2]; edges.len()];
        for (t, of_triangle) in triangle_edges.iter().enumerate() {
            for &e in of_triangle {
                let pair = &mut edge_triangles[e as usize];
                // Where a sheet is sewn to a solid, the solid's own two stay.
                if let Some(place) = pair.iter().position(|t| *t == NONE) {
                    pair[place] = t as u32;
                }
            }
        }
        let alone = (0..edges.len()).filter(|&e| edge_triangles[e][0] == NONE);
        let segments: Vec<u32> = alone.map(|e| e as u32).collect();
        let mut surface = Self {
            triangles,
            closed,
            node_facet: vec![NONE; nodes.len()],
            is_thin: vec![true; nodes.len()],
            nodes,
            edges,
            triangle_edges,
            edge_triangles,
            segments,
            index_of_node,
            mean_edge: 0.0,
            half_thickness: 0.0,
        };
        surface.describe_nodes();
        let length = |e: &[u32; 2]| (rest[e[0] as usize] - rest[e[1] as usize]).norm();
        surface.mean_edge = surface.edges.iter().map(length).sum::<f64>() / surface.edges.len().max(1) as f64;
        surface.half_thickness = surface.volume_over_area(rest);
        surface
    }

    fn volume_over_area(&self, rest: &[Vec3]) -> f64 {
        let (mut volume, mut area) = (0.0, 0.0);
        for triangle in &self.triangles[..self.closed] {
            let [a, b, c] = triangle.map(|n| rest[n as usize]);
            let normal = (b - a).cross(&(c - a));
            volume += normal.dot(&(a - rest[self.triangles[0][0] as usize])) / 6.0;
            area += 0.5 * normal.norm();
        }
        if area > 0.0 { volume / area } else { 0.0 }
    }

    /// Whether a node is there, and on the surface.
    pub fn has_node(&self, node: usize) -> bool {
        self.index_of_node.get(node).is_some_and(|index| *index != u32::MAX)
    }

    /// Finds a facet of every node, and which nodes no solid has.
    fn describe_nodes(&mut self) {
        let index = |n: u32| self.index_of_node[n as usize] as usize;
        for (s, &e) in self.segments.iter().enumerate() {
            let facet = (self.triangles.len() + s) as u32;
            self.edges[e as usize].iter().for_each(|&n| self.node_facet[index(n)] = facet);
        }
        for (t, triangle) in self.triangles.iter().enumerate() {
            triangle.iter().for_each(|&n| self.node_facet[index(n)] = t as u32);
        }
        let solid = self.triangles[..self.closed].iter().flatten();
        solid.for_each(|&n| self.is_thin[index(n)] = false);
    }

    /// Nodes of a facet.
    pub fn facet_nodes(&self, facet: usize) -> &[u32] {
        match self.triangles.get(facet) {
            Some(triangle) => triangle,
            None => &self.edges[self.segments[facet - self.triangles.len()] as usize],
        }
    }

    /// Edges of a facet.
    pub fn facet_edges(&self, facet: usize) -> &[u32] {
        match self.triangle_edges.get(facet) {
            Some(edges) => edges,
            None => std::slice::from_ref(&self.segments[facet - self.triangles.len()]),
        }
    }

    pub fn facet_count(&self) -> usize {
        self.triangles.len() + self.segments.len()
    }

    /// Whether an edge is of sheets and rods only.
    pub fn is_thin_edge(&self, edge: usize) -> bool {
        self.edge_triangles[edge].iter().all(|&t| t as usize >= self.closed)
    }

    /// Whether all of it bounds solids.
    pub fn is_closed(&self) -> bool {
        !self.is_thin.iter().any(|thin| *thin)
            && self.closed == self.triangles.len()
            && self.segments.is_empty()
    }
}

/// Faces that belong to one tetrahedron only, sorted by their first appearance; or a face that
/// more than two share, with their number.
pub(crate) fn boundary_triangles(tetrahedra: &[[u32; 4]]) -> Result<Vec<[u32; 3]>, ([u32; 3], usize)> {
    let faces = tetrahedra.iter().flat_map(|t| FACES.map(|f| f.map(|k| t[k])));
    let mut count: HashMap<[u32; 3], usize> = HashMap::with_capacity(2 * tetrahedra.len());
    for face in faces.clone() {
        *count.entry(sorted_face(face)).or_default() += 1;
    }
    if let Some((face, &n)) = count.iter().filter(|(_, n)| **n > 2).min() {
        return Err((*face, n));
    }
    Ok(faces.filter(|&f| count[&sorted_face(f)] == 1).collect())
}

/// An edge and the number of triangles on it.
pub(crate) struct EdgeUse {
    pub edge: [u32; 2],
    pub count: usize,
}

/// Edges of triangles in ascending order, with the number of triangles on each.
pub(crate) fn edge_uses(triangles: &[[u32; 3]]) -> Vec<EdgeUse> {
    let mut edges: Vec<[u32; 2]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).map(|run| EdgeUse { edge: run[0], count: run.len() }).collect()
}

/// The faces of a tetrahedron, each with its corners ascending.
pub(crate) fn sorted_faces(tet: &[u32; 4]) -> [[u32; 3]; 4] {
    FACES.map(|face| sorted_face(face.map(|k| tet[k])))
}

/// Unit normals at the points of triangles, by the areas of those around them; zero at other points.
pub(crate) fn point_normals(triangles: &[[u32; 3]], points: &[Vec3]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); points.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|n| points[n as usize]);
        let across = (b - a).cross(&(c - a));
        triangle.iter().for_each(|n| normals[*n as usize] += across);
    }
    normals.iter_mut().for_each(|n| *n = n.try_normalize(0.0).unwrap_or_default());
    normals
}

/// A face with its corners ascending.
pub(crate) fn sorted_face(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TetMesh;

    #[test]
    fn surface_of_a_cuboid_is_closed_and_encloses_its_volume() {
        let mesh = TetMesh::cuboid([0.5, 0.3, 0.2], [4, 3, 2]).unwrap();
        let rest: Vec<Vec3> = mesh.vertices().iter().map(|&v| v.into()).collect();
        let surface = Surface::new(mesh.tetrahedra(), &[], &[], &rest);
        assert_eq!(surface.triangles.len(), 2 * 2 * (4 * 3 + 3 * 2 + 4 * 2));
        // Euler: V − E + F = 2.
        let euler = surface.nodes.len() as i64 - surface.edges.len() as i64 + surface.triangles.len() as i64;
        assert_eq!(euler, 2);
        // Divergence theorem, 1e-15 roundings of O(1) terms.
        let volume: f64 = surface
            .triangles
            .iter()
            .map(|t| t.map(|i| rest[i as usize]))
            .map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0)
            .sum();
        assert!((volume - mesh.volume()).abs() < 1e-13);
    }
}
