//! Orientations as MJCF writes them.

use crate::error::RobotError;
use crate::xml::Element;
use rapier3d::math::{Mat3, Pose, Rotation, Vector};
use rapier3d_mjcf::mjcf_rs::compiler::Compiler;

/// Shorter vectors have no direction.
const SHORT: f32 = 1.0e-10;

/// `pos` and any of the ways to give an orientation.
pub(super) fn pose(element: &Element<'_, '_>, compiler: &Compiler) -> Result<Pose, RobotError> {
    let at = element.array("pos", [0.0; 3])?;
    Ok(Pose::from_parts(vector(at), rotation(element, compiler)?))
}

fn vector(x: [f64; 3]) -> Vector {
    Vector::from_array(x.map(|c| c as f32))
}

fn rotation(element: &Element<'_, '_>, compiler: &Compiler) -> Result<Rotation, RobotError> {
    let unit = if compiler.angle_is_degree { std::f64::consts::PI / 180.0 } else { 1.0 };
    let none = |key: &str| element.bad(key, element.attribute(key).unwrap_or_default(), "a direction");
    let direction = |key, x: [f64; 3]| {
        let x = vector(x);
        if x.length() > SHORT { Ok(x.normalize()) } else { Err(none(key)) }
    };
    if element.attribute("quat").is_some() {
        let [w, x, y, z] = element.array("quat", [1.0, 0.0, 0.0, 0.0])?.map(|c| c as f32);
        let quaternion = Rotation::from_xyzw(x, y, z, w);
        return if quaternion.length() > SHORT { Ok(quaternion.normalize()) } else { Err(none("quat")) };
    }
    if element.attribute("axisangle").is_some() {
        let [x, y, z, angle] = element.array("axisangle", [0.0; 4])?;
        return Ok(Rotation::from_axis_angle(direction("axisangle", [x, y, z])?, (angle * unit) as f32));
    }
    if element.attribute("zaxis").is_some() {
        let to = direction("zaxis", element.array("zaxis", [0.0; 3])?)?;
        return Ok(Rotation::from_rotation_arc(Vector::Z, to));
    }
    if element.attribute("xyaxes").is_some() {
        let [a, b, c, d, e, f] = element.array("xyaxes", [0.0; 6])?;
        let x = direction("xyaxes", [a, b, c])?;
        let y = vector([d, e, f]);
        let y = y - x * x.dot(y);
        if !(y.length() > SHORT) {
            return Err(none("xyaxes"));
        }
        let y = y.normalize();
        return Ok(Rotation::from_mat3(&Mat3::from_cols(x, y, x.cross(y))));
    }
    let angles = element.array("euler", [0.0; 3])?;
    let mut turned = Rotation::IDENTITY;
    for (letter, angle) in compiler.eulerseq.chars().zip(angles) {
        let axis = match letter.to_ascii_lowercase() {
            'x' => Vector::X,
            'y' => Vector::Y,
            _ => Vector::Z,
        };
        let turn = Rotation::from_axis_angle(axis, (angle * unit) as f32);
        turned = if letter.is_ascii_lowercase() { turned * turn } else { turn * turned };
    }
    Ok(turned)
}
