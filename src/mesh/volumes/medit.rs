//! MEDIT `.mesh` files as text: sections by name, numbers from one, a reference behind each entity [Frey 2001].

use super::grid::Grid;
use super::words::Words;

/// Entities that are passed over, and their numbers without the reference.
const OTHERS: [(&str, usize); 13] = [
    ("Edges", 2),
    ("Triangles", 3),
    ("Quadrilaterals", 4),
    ("Hexahedra", 8),
    ("Hexaedra", 8),
    ("Prisms", 6),
    ("Pyramids", 5),
    ("Corners", 0),
    ("Ridges", 0),
    ("RequiredVertices", 0),
    ("RequiredEdges", 0),
    ("Normals", 2),
    ("Tangents", 2),
];

pub(super) fn parse(bytes: &[u8]) -> Result<Grid, String> {
    let mut words = Words::new(bytes)?;
    let mut grid = Grid::default();
    while let Some(section) = words.next() {
        match section {
            "MeshVersionFormatted" => drop(words.number::<u32>()?),
            "Dimension" => match words.number::<u32>()? {
                3 => (),
                other => return Err(words.fail(&format!("dimension {other}; 3 is read"))),
            },
            "Vertices" => {
                for node in 1..=words.number::<u32>()? {
                    let position = words.numbers()?;
                    words.number::<f64>()?;
                    grid.positions.insert(i64::from(node), position);
                }
            }
            "Tetrahedra" => {
                for element in 1..=words.number::<u32>()? {
                    let nodes = words.numbers()?;
                    let reference: i64 = words.number()?;
                    let region = u32::try_from(reference)
                        .map_err(|_| words.fail(&format!("the reference {reference} is no region")))?;
                    grid.tetrahedra.push((i64::from(element), nodes, region));
                }
            }
            "End" => break,
            other => {
                let Some((_, numbers)) = OTHERS.iter().find(|(name, _)| *name == other) else {
                    let shown: String = other.chars().take(20).collect();
                    return Err(words.fail(&format!("`{shown}` where a section was expected")));
                };
                for _ in 0..words.number::<u32>()? {
                    (0..=*numbers).try_for_each(|_| words.number::<f64>().map(drop))?;
                }
            }
        }
    }
    if grid.tetrahedra.is_empty() { Err("there are no tetrahedra in it".into()) } else { Ok(grid) }
}
