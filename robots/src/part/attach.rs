//! Which vertices of a soft part a link leads.

use super::file::Attach;
use super::shape::Fault;
use rapier3d::math::{Pose, Vector};
use rapier3d::prelude::SharedShape;

/// Those of `candidates` that are to be attached, and the words for the condition. `place` is where a vertex is in the link's
/// frame, `shapes` are the link's.
pub(super) fn chosen(
    attach: &Attach,
    candidates: &[usize],
    place: impl Fn(usize) -> [f64; 3],
    shapes: &[(Pose, SharedShape)],
) -> Result<(Vec<usize>, String), Fault> {
    let those = |is_in: &dyn Fn([f64; 3]) -> bool| {
        candidates.iter().copied().filter(|v| is_in(place(*v))).collect::<Vec<usize>>()
    };
    match attach {
        Attach::Inside(inside) => {
            let (center, size) = (inside.center, inside.size);
            not_negative("size", &size)?;
            let is_in = |x: [f64; 3]| (0..3).all(|i| 2.0 * (x[i] - center[i]).abs() <= size[i]);
            Ok((those(&is_in), format!("is inside the box of size {size:?} around {center:?}")))
        }
        Attach::Plane(plane) => {
            not_negative("within", &[plane.within])?;
            let length = plane.normal.iter().map(|n| n * n).sum::<f64>().sqrt();
            if !(length > 1.0e-9 && length.is_finite()) {
                return Err(Fault::Value("normal", format!("{:?}", plane.normal), "a direction"));
            }
            let (point, normal, within) = (plane.point, plane.normal, plane.within);
            let is_in = |x: [f64; 3]| {
                let height: f64 = (0..3).map(|i| (x[i] - point[i]) * normal[i] / length).sum();
                height.abs() <= within
            };
            Ok((those(&is_in), format!("is within {within} m of the plane through {point:?}")))
        }
        Attach::Nearest(nearest) => {
            not_negative("within", &[nearest.within])?;
            let distance = |x: [f64; 3]| {
                let x = Vector::from_array(x.map(|c| c as f32));
                let to = shapes.iter().map(|(pose, shape)| shape.distance_to_point(pose, x, true));
                to.fold(f32::INFINITY, f32::min)
            };
            let least = candidates.iter().map(|v| distance(place(*v))).fold(f32::INFINITY, f32::min);
            if !least.is_finite() {
                let (value, range) = ("without shapes".to_string(), "a link that has shapes");
                return Err(Fault::Value("nearest", value, range));
            }
            let reach = least + nearest.within as f32;
            let is_in = |x: [f64; 3]| distance(x) <= reach;
            Ok((those(&is_in), format!("is within {reach} m of the link's shapes")))
        }
    }
}

fn not_negative(key: &'static str, numbers: &[f64]) -> Result<(), Fault> {
    match numbers.iter().all(|x| x.is_finite() && *x >= 0.0) {
        true => Ok(()),
        false => Err(Fault::Value(key, format!("{numbers:?}"), "zero or positive, and finite")),
    }
}
