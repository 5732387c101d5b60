//! Which points of a flexible body are pinned, by MuJoCo's numbers for them.

use super::flexcomp::{Flexcomp, Kind};
use crate::error::RobotError;
use std::collections::BTreeSet;

/// Numbers of the pinned points, of `points` there are.
pub(super) fn pinned(flexcomp: &Flexcomp, points: usize) -> Result<BTreeSet<usize>, RobotError> {
    let bad = |key: &str, value: String, range| RobotError::Value {
        place: flexcomp.place.clone(),
        element: format!("flexcomp `{}`", flexcomp.name),
        key: format!("pin {key}"),
        value,
        range,
    };
    let pins = &flexcomp.pins;
    let mut all = BTreeSet::new();
    if flexcomp.rigid {
        all.extend(0..points);
        return Ok(all);
    }
    let number = |key, id: usize| match id < points {
        true => Ok(id),
        false => Err(bad(key, format!("{id}"), "the number of a point")),
    };
    for id in &pins.ids {
        all.insert(number("id", *id)?);
    }
    if !pins.ranges.len().is_multiple_of(2) {
        return Err(bad("range", format!("{:?}", pins.ranges), "pairs of numbers"));
    }
    for ends in pins.ranges.chunks_exact(2) {
        all.extend(number("range", ends[0])?..=number("range", ends[1])?);
    }
    let has_grid = flexcomp.kind == Kind::Grid && flexcomp.dim > 1;
    let names_places = !(pins.grid.is_empty() && pins.grid_ranges.is_empty());
    if names_places && !has_grid {
        return Err(bad("grid", "there".to_string(), "left out but of grids with dim 2 or 3"));
    }
    let dim = flexcomp.dim;
    for (key, of, numbers) in [("grid", dim, &pins.grid), ("gridrange", 2 * dim, &pins.grid_ranges)] {
        let is_in = |(i, n): (usize, &usize)| *n < flexcomp.count[i % dim];
        if !numbers.len().is_multiple_of(of) || !numbers.iter().enumerate().all(is_in) {
            return Err(bad(key, format!("{numbers:?}"), "places in the grid"));
        }
        for place in numbers.chunks_exact(of) {
            let axis = |i: usize| match i < dim {
                true => place[i]..=place[of - dim + i],
                false => 0..=0,
            };
            for x in axis(0) {
                for y in axis(1) {
                    for z in axis(2) {
                        all.insert(grid_number(flexcomp, [x, y, z]));
                    }
                }
            }
        }
    }
    Ok(all)
}

/// MuJoCo's number of a place in the grid.
pub(super) fn grid_number(flexcomp: &Flexcomp, [x, y, z]: [usize; 3]) -> usize {
    let [_, across, deep] = flexcomp.count;
    if flexcomp.dim == 2 { x * across + y } else { (x * across + y) * deep + z }
}
