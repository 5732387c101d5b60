//! What a loss of a tape depends on, as Python gives it: dicts by steps and handles.

use crate::arrays::{Triple, points};
use crate::errors::{Failure, bad_value};
use crate::handles::{PyCableHandle, PyColliderHandle, PyDeformableHandle, PyRigidBodyHandle};
use foible3d::{BodyError, DeformableLoss, DeformableTape};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A step, by Python's number, and a body, which a tape of one need not be told.
#[derive(FromPyObject)]
enum OfStep {
    Named(isize, PyDeformableHandle),
    Alone(isize),
}

/// A step, the handle of a collider or a cable, and the body that it touches or runs through.
#[derive(FromPyObject)]
enum Of<H> {
    Named(isize, H, PyDeformableHandle),
    Alone(isize, H),
}

impl<H> Of<H> {
    fn parts(self) -> (isize, H, Option<PyDeformableHandle>) {
        match self {
            Self::Named(step, of, body) => (step, of, Some(body)),
            Self::Alone(step, of) => (step, of, None),
        }
    }
}

/// A step, a body, and another one that touches it.
#[derive(FromPyObject)]
struct OfPair(isize, PyDeformableHandle, PyDeformableHandle);

/// A step, and a rigid body.
#[derive(FromPyObject)]
struct OfRigid(isize, PyRigidBodyHandle);

/// What a loss may look at of a rigid body, by the names of the dict's keys.
#[derive(Clone, Copy)]
enum RigidPart {
    Position,
    Rotation,
    Linvel,
    Angvel,
}

const RIGID_PARTS: [(&str, RigidPart); 4] = [
    ("position", RigidPart::Position),
    ("rotation", RigidPart::Rotation),
    ("linvel", RigidPart::Linvel),
    ("angvel", RigidPart::Angvel),
];

/// The bodies of a tape, and its number of steps.
pub struct Recorded<'a> {
    pub bodies: &'a [PyDeformableHandle],
    pub rigid_bodies: &'a [PyRigidBodyHandle],
    pub vertices: &'a [usize],
    pub steps: usize,
}

impl Recorded<'_> {
    /// A step by Python's numbers: from the end if negative.
    pub fn step(&self, step: isize) -> PyResult<usize> {
        let steps = self.steps;
        let place = if step < 0 { steps.checked_add_signed(step) } else { Some(step as usize) };
        place
            .filter(|place| *place < steps)
            .ok_or_else(|| bad_value(format!("step {step} is not among the {steps} of the tape")))
    }

    /// The place of a body; a tape of one need not be told.
    pub fn place(&self, body: Option<PyDeformableHandle>, of: &str) -> PyResult<usize> {
        match body {
            None if self.bodies.len() > 1 => {
                Err(bad_value(format!("{of}: the tape is of several bodies, and this names none of them")))
            }
            None => Ok(0),
            Some(body) => self.bodies.iter().position(|own| *own == body).ok_or_else(|| {
                let (index, generation) = body.parts();
                bad_value(format!(
                    "{of}: the body at slot {index} of generation {generation} is not on the tape"
                ))
            }),
        }
    }

    /// Whether two bodies of the tape are not one.
    pub fn other(&self, body: PyDeformableHandle, other: PyDeformableHandle, of: &str) -> PyResult<()> {
        if self.place(Some(body), of)? == self.place(Some(other), of)? {
            return Err(bad_value(format!("{of}: a body has no force on itself")));
        }
        Ok(())
    }

    fn step_and_place(
        &self,
        step: isize,
        body: Option<PyDeformableHandle>,
        of: &str,
    ) -> PyResult<[usize; 2]> {
        Ok([self.step(step)?, self.place(body, of)?])
    }
}

/// Derivatives by step and place of a body.
#[derive(Default)]
pub struct Seeds {
    positions: Vec<([usize; 2], Vec<[f64; 3]>)>,
    velocities: Vec<([usize; 2], Vec<[f64; 3]>)>,
    contact_forces: Vec<([usize; 2], PyColliderHandle, [f64; 3])>,
    body_forces: Vec<([usize; 2], PyDeformableHandle, [f64; 3])>,
    tensions: Vec<([usize; 2], PyCableHandle, f64)>,
    rigid_bodies: Vec<(usize, PyRigidBodyHandle, RigidPart, [f64; 3])>,
}

impl Seeds {
    /// Rows of derivatives with respect to the places of vertices, and to their velocities.
    pub fn of_vertices(
        recorded: &Recorded<'_>,
        positions: Option<&Bound<'_, PyDict>>,
        velocities: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let (positions, velocities) =
            (by_step(recorded, positions, "positions")?, by_step(recorded, velocities, "velocities")?);
        Ok(Self { positions, velocities, ..Self::default() })
    }

    /// Derivatives with respect to forces of colliders and of other bodies, and to tensions.
    pub fn add_forces(
        &mut self,
        recorded: &Recorded<'_>,
        [contact_forces, body_forces, tensions]: &[Option<Bound<'_, PyDict>>; 3],
    ) -> PyResult<()> {
        for (key, of) in pairs(contact_forces.as_ref(), "contact_forces")? {
            let keys = "(step, collider) or (step, collider, body)";
            let (step, collider, body) =
                key_of::<Of<PyColliderHandle>>(&key, "contact_forces", keys)?.parts();
            let at = recorded.step_and_place(step, body, "contact_forces")?;
            self.contact_forces.push((at, collider, value_of::<Triple>(&of, "contact_forces")?.0));
        }
        for (key, of) in pairs(body_forces.as_ref(), "body_forces")? {
            let OfPair(step, body, other) = key_of(&key, "body_forces", "(step, body, other)")?;
            let at = recorded.step_and_place(step, Some(body), "body_forces")?;
            recorded.other(body, other, "body_forces")?;
            self.body_forces.push((at, other, value_of::<Triple>(&of, "body_forces")?.0));
        }
        for (key, of) in pairs(tensions.as_ref(), "tensions")? {
            let keys = "(step, cable) or (step, cable, body)";
            let (step, cable, body) = key_of::<Of<PyCableHandle>>(&key, "tensions", keys)?.parts();
            let at = recorded.step_and_place(step, body, "tensions")?;
            self.tensions.push((at, cable, value_of(&of, "tensions")?));
        }
        Ok(())
    }

    /// Derivatives with respect to rigid bodies: dicts by what they are of.
    pub fn add_rigid_bodies(
        &mut self,
        recorded: &Recorded<'_>,
        given: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        for (key, parts) in pairs(given, "rigid_bodies")? {
            let OfRigid(step, body) = key_of(&key, "rigid_bodies", "(step, rigid body)")?;
            let step = recorded.step(step)?;
            if !recorded.rigid_bodies.contains(&body) {
                return Err(bad_value("rigid_bodies: one of them is not on the tape".into()));
            }
            let form = "a dict with 'position', 'rotation', 'linvel' or 'angvel'";
            let parts = parts.cast_into::<PyDict>();
            let parts = parts.map_err(|_| PyTypeError::new_err(format!("rigid_bodies: expected {form}")))?;
            for (name, of) in pairs(Some(&parts), "rigid_bodies")? {
                let name: String = key_of(&name, "rigid_bodies", form)?;
                let part = RIGID_PARTS.iter().find(|(own, _)| *own == name);
                let (_, part) =
                    part.ok_or_else(|| bad_value(format!("rigid_bodies: '{name}' is none of {form}")))?;
                self.rigid_bodies.push((step, body, *part, value_of::<Triple>(&of, "rigid_bodies")?.0));
            }
        }
        Ok(())
    }

    /// The losses of a tape's bodies.
    pub fn losses(&self, tape: &DeformableTape) -> Result<Vec<DeformableLoss>, Failure> {
        let mut losses = tape.losses();
        for ([step, place], rows) in &self.positions {
            each(rows, |vertex, row| losses[*place].add_position(*step, vertex, row))?;
        }
        for ([step, place], rows) in &self.velocities {
            each(rows, |vertex, row| losses[*place].add_velocity(*step, vertex, row))?;
        }
        for ([step, place], collider, of) in &self.contact_forces {
            losses[*place].add_contact_force(*step, collider.0, *of)?;
        }
        for ([step, place], other, of) in &self.body_forces {
            losses[*place].add_body_force(*step, other.0, *of)?;
        }
        for ([step, place], cable, of) in &self.tensions {
            losses[*place].add_tension(*step, cable.0, *of)?;
        }
        for (step, body, part, of) in &self.rigid_bodies {
            let (loss, body) = (&mut losses[0], body.0);
            match part {
                RigidPart::Position => loss.add_rigid_position(*step, body, *of)?,
                RigidPart::Rotation => loss.add_rigid_rotation(*step, body, *of)?,
                RigidPart::Linvel => loss.add_rigid_linvel(*step, body, *of)?,
                RigidPart::Angvel => loss.add_rigid_angvel(*step, body, *of)?,
            }
        }
        Ok(losses)
    }
}

/// What a dict holds, by itself: reading a value may run code of the user's, which may change the dict.
fn pairs<'py>(
    given: Option<&Bound<'py, PyDict>>,
    name: &str,
) -> PyResult<Vec<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
    let items = given.map(|given| given.items());
    items.iter().flatten().map(|item| item.extract().map_err(|error| told(error, name))).collect()
}

/// A key of a dict, of this form.
fn key_of<'py, K: for<'a> FromPyObject<'a, 'py>>(
    key: &Bound<'py, PyAny>,
    name: &str,
    form: &str,
) -> PyResult<K> {
    key.extract().map_err(|_| PyTypeError::new_err(format!("{name}: expected {form}, got {key:?}")))
}

fn value_of<'py, V>(value: &Bound<'py, PyAny>, name: &str) -> PyResult<V>
where
    V: for<'a> FromPyObject<'a, 'py, Error = PyErr>,
{
    value.extract().map_err(|error| told(error, name))
}

/// An error that says in which argument.
fn told(error: PyErr, name: &str) -> PyErr {
    Python::attach(|py| PyTypeError::new_err(format!("{name}: {}", error.value(py))))
}

/// Rows of derivatives by steps and bodies.
fn by_step(
    recorded: &Recorded<'_>,
    given: Option<&Bound<'_, PyDict>>,
    name: &str,
) -> PyResult<Vec<([usize; 2], Vec<[f64; 3]>)>> {
    let mut found: Vec<([usize; 2], Vec<[f64; 3]>)> = Vec::new();
    for (key, rows) in pairs(given, name)? {
        let (step, body) = match key_of(&key, name, "a step or (step, body)")? {
            OfStep::Named(step, body) => (step, Some(body)),
            OfStep::Alone(step) => (step, None),
        };
        let at = recorded.step_and_place(step, body, name)?;
        let rows = points(&rows, name)?;
        let (count, vertices) = (rows.len(), recorded.vertices[at[1]]);
        if count != vertices {
            return Err(bad_value(format!(
                "{name} of step {step} has {count} rows, but the body {vertices} vertices"
            )));
        }
        if found.iter().any(|(other, _)| *other == at) {
            return Err(bad_value(format!("{name} name step {} twice", at[0])));
        }
        found.push((at, rows));
    }
    Ok(found)
}

/// Adds rows that say anything to a loss.
fn each(
    rows: &[[f64; 3]],
    mut add: impl FnMut(usize, [f64; 3]) -> Result<(), BodyError>,
) -> Result<(), Failure> {
    let mut said = rows.iter().enumerate().filter(|(_, row)| **row != [0.0; 3]);
    said.try_for_each(|(vertex, row)| add(vertex, *row)).map_err(Failure::from)
}
