//! Nodes and tetrahedra of Gmsh files by their tags: formats 2.0 to 2.2, 4.0 and 4.1, as text and binary
//! [Geuzaine Remacle 2009].

use super::groups::{read_entities, read_names, region_of};
use super::source::{Encoding, Source};
use crate::mesh::volumes::grid::Grid;

/// Gmsh's number of tetrahedra of four nodes.
const TETRAHEDRON: i64 = 4;

/// Nodes of each element type from 1 on, as far as Gmsh numbers them in a row: what is passed over in a binary file has to be
/// counted.
const NODES_OF_TYPE: [usize; 31] = [
    2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5, 6, 20, 35,
    56,
];

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Version {
    /// 2.0 to 2.2: no blocks; how many there are is text.
    Two,
    /// Coordinates follow each node's tag.
    Four,
    /// Coordinates follow the tags of a block.
    FourOne,
}

/// Reads what a file holds.
///
/// # Errors
/// Line or byte, section and reason.
pub(super) fn read(bytes: &[u8]) -> Result<Grid, String> {
    let mut source = Source::new(bytes);
    let mut version = None;
    let mut grid = Grid::default();
    while let Some(section) = source.next_section()? {
        match (&*section, version) {
            ("MeshFormat", _) => version = Some(read_format(&mut source)?),
            ("NOD" | "NOE" | "ELM", _) => return Err(source.fail("version 1 of the format is not read")),
            ("PhysicalNames", _) => read_names(&mut source, &mut grid)?,
            ("Entities", Some(version @ (Version::Four | Version::FourOne))) => {
                read_entities(&mut source, &mut grid, version)?;
            }
            ("Nodes", Some(Version::Two)) => read_nodes(&mut source, &mut grid, false)?,
            ("ParametricNodes", Some(Version::Two)) => read_nodes(&mut source, &mut grid, true)?,
            ("Nodes", Some(version)) => read_node_blocks(&mut source, &mut grid, version)?,
            ("Elements", Some(Version::Two)) => read_elements(&mut source, &mut grid)?,
            ("Elements", Some(version)) => read_element_blocks(&mut source, &mut grid, version)?,
            ("Nodes" | "ParametricNodes" | "Elements", None) => {
                return Err(source.fail("there is no $MeshFormat before it"));
            }
            _ => {
                source.skip_section()?;
                continue;
            }
        }
        source.end_section()?;
    }
    if version.is_none() {
        return Err("there is no $MeshFormat section: not a Gmsh file".into());
    }
    Ok(grid)
}

fn read_format(source: &mut Source<'_>) -> Result<Version, String> {
    let word = source.word()?;
    let version = match &*word {
        "2" | "2.0" | "2.1" | "2.2" => Version::Two,
        "4" | "4.0" => Version::Four,
        "4.1" => Version::FourOne,
        _ => return Err(source.fail(&format!("version {word}; 2.0 to 2.2, 4.0 and 4.1 are read"))),
    };
    let is_binary = source.number_in_text::<u8>()?;
    let size = source.number_in_text::<usize>()?;
    if !(size == 8 || size == 4 && version == Version::FourOne) {
        return Err(source.fail(&format!("a data size of {size} bytes is not read")));
    }
    match is_binary {
        0 => return Ok(version),
        1 => source.skip_line(),
        other => return Err(source.fail(&format!("{other} is neither 0, text, nor 1, binary"))),
    }
    let big_endian = match source.array()? {
        [1, 0, 0, 0] => false,
        [0, 0, 0, 1] => true,
        _ => return Err(source.fail("the binary one that tells the order of bytes is not there")),
    };
    source.encoding = Encoding::Binary { big_endian, size };
    Ok(version)
}

fn read_nodes(source: &mut Source<'_>, grid: &mut Grid, are_parametric: bool) -> Result<(), String> {
    for _ in 0..count_in_text(source)? {
        let tag = source.int()?;
        let position = read_position(source)?;
        if are_parametric {
            let dimension = source.int()?;
            source.int()?;
            skip_parameters(source, if dimension < 3 { dimension } else { 0 })?;
        }
        insert(source, grid, tag, position)?;
    }
    Ok(())
}

fn read_node_blocks(source: &mut Source<'_>, grid: &mut Grid, version: Version) -> Result<(), String> {
    for _ in 0..read_block_count(source, version)? {
        let (dimension, _) = read_entity(source, version)?;
        let parameters = if source.int()? == 0 { 0 } else { dimension };
        let count = source.count()?;
        let mut tags = Vec::new();
        if version == Version::FourOne {
            for _ in 0..count {
                tags.push(source.size()?);
            }
        }
        for k in 0..count {
            let tag = if version == Version::FourOne { tags[k as usize] } else { source.int()? };
            let position = read_position(source)?;
            skip_parameters(source, parameters)?;
            insert(source, grid, tag, position)?;
        }
    }
    Ok(())
}

fn read_elements(source: &mut Source<'_>, grid: &mut Grid) -> Result<(), String> {
    let count = count_in_text(source)?;
    let is_text = source.encoding == Encoding::Text;
    let mut read = 0;
    while read < count {
        if is_text {
            let tag = source.int()?;
            let kind = source.int()?;
            let tags = source.int()?;
            read_element(source, grid, (kind, tag), tags)?;
            read += 1;
            continue;
        }
        let [kind, following, tags] = [source.int()?, source.int()?, source.int()?];
        if following < 1 {
            return Err(source.fail(&format!("{following} elements follow")));
        }
        for _ in 0..following {
            let tag = source.int()?;
            read_element(source, grid, (kind, tag), tags)?;
        }
        read += following;
    }
    Ok(())
}

fn read_element_blocks(source: &mut Source<'_>, grid: &mut Grid, version: Version) -> Result<(), String> {
    for _ in 0..read_block_count(source, version)? {
        let (_, entity) = read_entity(source, version)?;
        let region = grid.regions_of_volumes.get(&entity).copied().unwrap_or(0);
        let kind = source.int()?;
        for _ in 0..source.count()? {
            let mut tag = || if version == Version::FourOne { source.size() } else { source.int() };
            let own = tag()?;
            if kind == TETRAHEDRON {
                let nodes = [tag()?, tag()?, tag()?, tag()?];
                grid.tetrahedra.push((own, nodes, region));
            } else {
                let width = if version == Version::FourOne { Width::Size } else { Width::Int };
                pass_over(source, grid, kind, width)?;
            }
        }
    }
    Ok(())
}

/// An element of version 2 behind its tag and type.
fn read_element(
    source: &mut Source<'_>,
    grid: &mut Grid,
    (kind, own): (i64, i64),
    tags: i64,
) -> Result<(), String> {
    if kind != TETRAHEDRON && source.encoding == Encoding::Text {
        return pass_over(source, grid, kind, Width::Int);
    }
    let mut region = 0;
    for k in 0..tags {
        let tag = source.int()?;
        if k == 0 && kind == TETRAHEDRON {
            region = region_of(source, tag)?;
        }
    }
    if kind != TETRAHEDRON {
        return pass_over(source, grid, kind, Width::Int);
    }
    let nodes = [source.int()?, source.int()?, source.int()?, source.int()?];
    grid.tetrahedra.push((own, nodes, region));
    Ok(())
}

#[derive(Clone, Copy)]
enum Width {
    Int,
    Size,
}

/// The nodes of an element of another type; in text, the rest of its line.
fn pass_over(source: &mut Source<'_>, grid: &mut Grid, kind: i64, width: Width) -> Result<(), String> {
    *grid.others.entry(kind).or_default() += 1;
    if source.encoding == Encoding::Text {
        source.skip_line();
        return Ok(());
    }
    let nodes = usize::try_from(kind - 1).ok().and_then(|k| NODES_OF_TYPE.get(k));
    let nodes =
        nodes.ok_or_else(|| source.fail(&format!("elements of type {kind} cannot be passed over")))?;
    for _ in 0..*nodes {
        match width {
            Width::Int => source.int()?,
            Width::Size => source.size()?,
        };
    }
    Ok(())
}

/// How many blocks follow; of how many nodes or elements, and with which tags, is passed over.
fn read_block_count(source: &mut Source<'_>, version: Version) -> Result<i64, String> {
    let blocks = source.count()?;
    source.count()?;
    if version == Version::FourOne {
        source.size()?;
        source.size()?;
    }
    Ok(blocks)
}

/// Dimension and tag of the entity that a block belongs to.
fn read_entity(source: &mut Source<'_>, version: Version) -> Result<(i64, i64), String> {
    let [first, second] = [source.int()?, source.int()?];
    Ok(if version == Version::FourOne { (first, second) } else { (second, first) })
}

pub(super) fn count_in_text(source: &mut Source<'_>) -> Result<i64, String> {
    let count = source.number_in_text::<u32>()?;
    source.skip_line();
    Ok(count.into())
}

fn read_position(source: &mut Source<'_>) -> Result<[f64; 3], String> {
    Ok([source.real()?, source.real()?, source.real()?])
}

fn skip_parameters(source: &mut Source<'_>, count: i64) -> Result<(), String> {
    (0..count.clamp(0, 3)).try_for_each(|_| source.real().map(drop))
}

fn insert(source: &Source<'_>, grid: &mut Grid, tag: i64, position: [f64; 3]) -> Result<(), String> {
    match grid.positions.insert(tag, position) {
        Some(_) => Err(source.fail(&format!("node {tag} is there twice"))),
        None => Ok(()),
    }
}
