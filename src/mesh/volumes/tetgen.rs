//! TetGen: `.node` with the points and `.ele` with the tetrahedra, of four nodes or ten, numbered from nought or one [Si 2015].

use super::contents;
use super::grid::Grid;
use super::words::Words;
use crate::mesh::{MeshError, TetMesh};
use std::path::Path;

/// Of one of the two files; the other is beside it.
pub(super) fn read(path: &Path) -> Result<TetMesh, MeshError> {
    let [nodes, elements] = ["node", "ele"].map(|extension| path.with_extension(extension));
    let mut grid = Grid::default();
    read_nodes(&contents(&nodes)?, &mut grid).map_err(|reason| MeshError::file(&nodes, reason))?;
    let fail = |reason| MeshError::file(&elements, reason);
    read_elements(&contents(&elements)?, &mut grid).map_err(fail)?;
    grid.into_mesh(fail)
}

fn read_nodes(bytes: &[u8], grid: &mut Grid) -> Result<(), String> {
    let mut words = Words::new(bytes)?;
    let [count, dimension, attributes, markers] = words.numbers::<u32, 4>()?;
    if dimension != 3 {
        return Err(words.fail(&format!("dimension {dimension}; 3 is read")));
    }
    for _ in 0..count {
        let node: i64 = words.number()?;
        if grid.positions.insert(node, words.numbers()?).is_some() {
            return Err(words.fail(&format!("node {node} is there twice")));
        }
        (0..u64::from(attributes) + u64::from(markers)).try_for_each(|_| words.number::<f64>().map(drop))?;
    }
    Ok(())
}

fn read_elements(bytes: &[u8], grid: &mut Grid) -> Result<(), String> {
    let mut words = Words::new(bytes)?;
    let [count, corners, attributes] = words.numbers::<u32, 3>()?;
    if !(corners == 4 || corners == 10) {
        return Err(words.fail(&format!("{corners} nodes per tetrahedron; 4 and 10 are read")));
    }
    for _ in 0..count {
        let element = words.number()?;
        let nodes = words.numbers()?;
        (4..corners).try_for_each(|_| words.number::<i64>().map(drop))?;
        let mut region = 0;
        for k in 0..attributes {
            let attribute: f64 = words.number()?;
            if k == 0 {
                let is_region = attribute.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&attribute);
                region = match is_region {
                    true => attribute as u32,
                    false => return Err(words.fail(&format!("the attribute {attribute} is no region"))),
                };
            }
        }
        grid.tetrahedra.push((element, nodes, region));
    }
    if grid.tetrahedra.is_empty() { Err("there are no tetrahedra in it".into()) } else { Ok(()) }
}
