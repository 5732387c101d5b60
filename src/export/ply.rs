//! PLY, binary little endian: the surfaces of bodies with what their vertices carry.

use super::drawn::Drawn;
use super::write;
use crate::body::{DeformableBody, DeformableStress};
use crate::mesh::MeshError;
use crate::pipeline::DeformableWorld;
use ply_rs_bw::ply::{ElementDef, Encoding, Ply, PropertyAccess, PropertyDef, PropertyType, ScalarType};
use ply_rs_bw::writer::Writer;
use std::path::Path;

/// Properties of a vertex, in the order of the file.
const NUMBERS: [&str; 10] = ["x", "y", "z", "nx", "ny", "nz", "vx", "vy", "vz", "von_mises"];

impl DeformableWorld {
    /// Writes what all bodies look like ([`DeformableSurfaceMesh`](crate::DeformableSurfaceMesh)) to a `.ply` file, binary and
    /// little endian. Feature `export`.
    ///
    /// | property of vertices | |
    /// |---|---|
    /// | `x`, `y`, `z` | \[m\] |
    /// | `nx`, `ny`, `nz` | unit normal |
    /// | `vx`, `vy`, `vz` | velocity of the body's vertex there [m/s] |
    /// | `von_mises` | mean of the tetrahedra around it by volume, on sheets of their triangles \[Pa\]; of rods and networks NaN |
    /// | `body` | its place in the set, counted from nought |
    ///
    /// The order of vertices does not change from frame to frame.
    ///
    /// # Errors
    /// [`MeshError::File`] when it cannot be written.
    pub fn write_ply(&self, path: impl AsRef<Path>) -> Result<(), MeshError> {
        let path = path.as_ref();
        let mut file = PlyDraft::default();
        for (k, (_, body)) in self.bodies.iter().enumerate() {
            // A body's own surface is bound to it.
            let drawn = Drawn::of(body).and_then(|mut drawn| drawn.follow(body).map(|()| drawn));
            file.add(k, body, &drawn.map_err(|error| MeshError::file(path, error))?);
        }
        file.write(path)
    }
}

/// A vertex or a face.
#[derive(Clone, Debug, Default)]
struct Element {
    numbers: [f32; NUMBERS.len()],
    body: i32,
    corners: [i32; 3],
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        NUMBERS.iter().position(|own| *own == name).map(|k| self.numbers[k])
    }

    fn get_int(&self, _name: &str) -> Option<i32> {
        Some(self.body)
    }

    fn get_list_int(&self, _name: &str) -> Option<&[i32]> {
        Some(&self.corners)
    }
}

/// A file while it is put together.
#[derive(Default)]
pub(super) struct PlyDraft {
    vertices: Vec<Element>,
    faces: Vec<Element>,
}

impl PlyDraft {
    /// Adds the `k`-th body.
    pub fn add(&mut self, k: usize, body: &DeformableBody, drawn: &Drawn) {
        let first = self.vertices.len() as i32;
        let von_mises = von_mises(body);
        for ((place, normal), node) in drawn.positions.iter().zip(&drawn.normals).zip(&drawn.nodes) {
            let v = &body.state().v[*node as usize];
            let mut numbers = [0.0; NUMBERS.len()];
            numbers[..3].copy_from_slice(&place.to_array());
            numbers[3..6].copy_from_slice(&normal.to_array());
            numbers[6..9].copy_from_slice(&[v.x, v.y, v.z].map(|c| c as f32));
            numbers[9] = von_mises[body.model().vertex(*node as usize)];
            self.vertices.push(Element { numbers, body: k as i32, ..Element::default() });
        }
        let corners = drawn.triangles.iter().map(|t| t.map(|v| first + v as i32));
        self.faces.extend(corners.map(|corners| Element { corners, ..Element::default() }));
    }

    pub fn write(self, path: &Path) -> Result<(), MeshError> {
        let mut file = Ply::new();
        file.header.encoding = Encoding::BinaryLittleEndian;
        let mut define = |name: &str, properties: Vec<(&str, PropertyType)>, elements: Vec<Element>| {
            let mut element = ElementDef::new(name.into());
            for (name, kind) in properties {
                element.properties.insert(name.into(), PropertyDef::new(name.into(), kind));
            }
            file.header.elements.insert(name.into(), element);
            file.payload.insert(name.into(), elements);
        };
        let numbers = NUMBERS.iter().map(|name| (*name, PropertyType::Scalar(ScalarType::Float)));
        let of_vertex = numbers.chain([("body", PropertyType::Scalar(ScalarType::Int))]).collect();
        define("vertex", of_vertex, self.vertices);
        let list = PropertyType::List(ScalarType::UChar, ScalarType::Int);
        define("face", vec![("vertex_indices", list)], self.faces);
        let mut bytes = Vec::new();
        let written = Writer::new().write_ply(&mut bytes, &mut file);
        written.map_err(|error| MeshError::file(path, error))?;
        write(path, &bytes)
    }
}

/// At each vertex of a body \[Pa\]: of its tetrahedra, else of its sheets, else NaN.
fn von_mises(body: &DeformableBody) -> Vec<f32> {
    let mut values = vec![f32::NAN; body.vertex_count()];
    let mut sums = vec![([[0.0; 3]; 3], 0.0); body.vertex_count()];
    for ((corners, _), stress) in body.model().sheet_triangles().zip(body.sheet_stresses()) {
        for vertex in corners {
            let (sum, count) = &mut sums[vertex as usize];
            sum.as_flattened_mut().iter_mut().zip(stress.cauchy.as_flattened()).for_each(|(s, c)| *s += c);
            *count += 1.0;
        }
    }
    for (value, (sum, count)) in values.iter_mut().zip(sums) {
        if count > 0.0 {
            let cauchy = sum.map(|row| row.map(|c| c / count));
            *value = DeformableStress { cauchy }.von_mises() as f32;
        }
    }
    // A spring network has no stress.
    if !body.stresses().is_empty() {
        let stresses = body.vertex_stresses();
        for vertex in body.model().tetrahedra().flatten() {
            values[vertex as usize] = stresses[vertex as usize].von_mises() as f32;
        }
    }
    values
}
