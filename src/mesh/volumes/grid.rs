//! Nodes and tetrahedra of a file by the numbers that it gives them, and the mesh that they are.

use crate::mesh::{MeshError, TetMesh, signed_volume};
use std::collections::{BTreeMap, HashMap};

/// What is in a file.
#[derive(Default)]
pub(super) struct Grid {
    pub positions: HashMap<i64, [f64; 3]>,
    /// Numbers of tetrahedra, and of their nodes, and their regions, 0 for none.
    pub tetrahedra: Vec<(i64, [i64; 4], u32)>,
    /// Regions that have names.
    pub names: Vec<(u32, String)>,
    /// The region of each entity of three dimensions that is in one, of files that have such.
    pub regions_of_volumes: HashMap<i64, u32>,
    /// How many elements of other types there are.
    pub others: BTreeMap<i64, usize>,
}

impl Grid {
    /// Without the nodes that no tetrahedron has; vertices are in the order in which tetrahedra first name them, and negatively
    /// oriented ones are turned round.
    ///
    /// # Errors
    /// A node that is not there, as text; else what is wrong with the mesh.
    pub fn into_mesh(self, fail: impl Fn(String) -> MeshError) -> Result<TetMesh, MeshError> {
        let mut vertices = Vec::new();
        let mut index_of = HashMap::new();
        let mut tetrahedra = Vec::with_capacity(self.tetrahedra.len());
        for (element, nodes, _) in &self.tetrahedra {
            let mut tet = [0; 4];
            for (corner, node) in tet.iter_mut().zip(nodes) {
                let Some(position) = self.positions.get(node) else {
                    return Err(fail(format!("element {element} refers to node {node}, which is not there")));
                };
                *corner = *index_of.entry(*node).or_insert_with(|| {
                    vertices.push(*position);
                    vertices.len() as u32 - 1
                });
            }
            tetrahedra.push(positively_oriented(tet, &vertices));
        }
        let regions = self.tetrahedra.iter().map(|(_, _, region)| *region).collect();
        Ok(TetMesh::new(vertices, tetrahedra)?.with_regions(regions)?.with_names(self.names))
    }
}

fn positively_oriented(mut tet: [u32; 4], vertices: &[[f64; 3]]) -> [u32; 4] {
    if signed_volume(&tet.map(|i| vertices[i as usize].into())) < 0.0 {
        tet.swap(2, 3);
    }
    tet
}
