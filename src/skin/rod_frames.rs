//! Frames along rods: carried from segment to segment without turning about them.

use crate::math::{Vec3, tangents};

/// Two directions across each segment of a polyline, and one along it.
pub(super) type Frame = [Vec3; 3];

/// Frames along `points`, the first of which is nearest to `first`.
pub(super) fn frames(points: impl Iterator<Item = Vec3>, first: Option<&Frame>, out: &mut Vec<Frame>) {
    out.clear();
    let mut last: Option<Vec3> = None;
    let mut frame = first.copied();
    for point in points {
        if let Some(last) = last {
            let along = (point - last).try_normalize(0.0);
            let along = along.or(frame.map(|frame| frame[2])).unwrap_or_else(Vec3::x);
            let next = frame.map_or_else(|| start(&along), |frame| carried(&frame, &along));
            frame = Some(next);
            out.push(next);
        }
        last = Some(point);
    }
}

fn start(along: &Vec3) -> Frame {
    let [a, b] = tangents(along);
    [a, b, *along]
}

/// The frame turned the shortest way to a direction.
fn carried([a, _, old]: &Frame, along: &Vec3) -> Frame {
    let axis = old.cross(along);
    let cosine = old.dot(along);
    // Half a turn has no shortest way.
    let turned = if cosine > -1.0 + 1.0e-12 {
        a * cosine + axis.cross(a) + axis * (axis.dot(a) / (1.0 + cosine))
    } else {
        *a
    };
    let across =
        (turned - along * along.dot(&turned)).try_normalize(0.0).unwrap_or_else(|| tangents(along)[0]);
    [across, along.cross(&across), *along]
}
