//! Physical groups of volumes: their names, and the entities that are in them.

use super::sections::{Version, count_in_text};
use super::source::Source;
use crate::mesh::volumes::grid::Grid;

/// Dimension of volumes.
const VOLUME: i64 = 3;

/// The section of names, which is text in every file.
pub(super) fn read_names(source: &mut Source<'_>, grid: &mut Grid) -> Result<(), String> {
    for _ in 0..count_in_text(source)? {
        let [dimension, tag] = [source.number_in_text::<i64>()?, source.number_in_text()?];
        let name = source.rest_of_line();
        if dimension == VOLUME {
            let name = name.trim().trim_matches('"').to_owned();
            grid.names.push((region_of(source, tag)?, name));
        }
    }
    Ok(())
}

/// The section of entities of version 4: a volume may be in a group.
pub(super) fn read_entities(
    source: &mut Source<'_>,
    grid: &mut Grid,
    version: Version,
) -> Result<(), String> {
    let counts = [source.count()?, source.count()?, source.count()?, source.count()?];
    for (dimension, count) in (0..).zip(counts) {
        for _ in 0..count {
            let tag = source.int()?;
            // A point, or the corners of a box.
            let numbers = if dimension == 0 && version == Version::FourOne { 3 } else { 6 };
            (0..numbers).try_for_each(|_| source.real().map(drop))?;
            for k in 0..source.count()? {
                let group = source.int()?;
                if dimension == VOLUME && k == 0 {
                    let region = region_of(source, group)?;
                    grid.regions_of_volumes.insert(tag, region);
                }
            }
            if dimension > 0 {
                for _ in 0..source.count()? {
                    source.int()?;
                }
            }
        }
    }
    Ok(())
}

/// The region of a group, whose sign is its orientation.
pub(super) fn region_of(source: &Source<'_>, group: i64) -> Result<u32, String> {
    let region = group.checked_abs().and_then(|group| u32::try_from(group).ok());
    region.ok_or_else(|| source.fail(&format!("{group} is no number of a physical group")))
}
