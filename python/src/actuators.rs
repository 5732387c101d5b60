//! Signals of a world.

use crate::arrays::{Array1, Array2, rows};
use crate::errors::{bad_signal, bad_value};
use crate::signals::{PyActuator, range_of, start_of};
use crate::world::World;
use foible3d::{ActuatorError, ActuatorSignal, DeformableActuators};
use numpy::PyArray1;
use pyo3::prelude::*;

/// A signal as it was when it was asked for.
#[pyclass(frozen, name = "ActuatorSignal", module = "foible3d")]
pub struct PySignal(ActuatorSignal);

#[pymethods]
impl PySignal {
    /// What it drives.
    #[getter]
    fn actuator(&self) -> PyActuator {
        PyActuator(self.0.actuator())
    }

    /// Least and largest value.
    #[getter]
    fn range(&self) -> (f64, f64) {
        self.0.range().into()
    }

    /// Largest change per second.
    #[getter]
    fn rate(&self) -> f64 {
        self.0.rate()
    }

    /// What was asked for last, within the range.
    #[getter]
    fn command(&self) -> f64 {
        self.0.command()
    }

    /// What it is at, on its way there.
    #[getter]
    fn value(&self) -> f64 {
        self.0.value()
    }

    /// Whether what it drives was not there in the last step.
    #[getter]
    fn is_missing(&self) -> bool {
        self.0.is_missing()
    }

    fn __repr__(&self) -> String {
        format!("<ActuatorSignal at {} on its way to {}>", self.0.value(), self.0.command())
    }
}

/// The signals of a world, by name: what drives it, each within a range and at no more than a rate. Every step leads each towards
/// what was asked for last.
#[pyclass(frozen, name = "ActuatorSet", module = "foible3d")]
pub struct ActuatorSet(pub Py<World>);

impl ActuatorSet {
    fn with<R>(&self, py: Python<'_>, work: impl FnOnce(&mut DeformableActuators) -> R) -> PyResult<R> {
        self.0.get().with(py, |inner| work(&mut inner.deformables.actuators))
    }

    fn of_each<R>(&self, py: Python<'_>, of: impl Fn(&str, &ActuatorSignal) -> R) -> PyResult<Vec<R>> {
        self.with(py, |all| all.iter().map(|(name, signal)| of(name, signal)).collect())
    }
}

fn unknown(name: &str) -> PyErr {
    bad_signal(&ActuatorError::Unknown { name: name.to_string() })
}

#[pymethods]
impl ActuatorSet {
    /// Adds a signal of this name.
    ///
    /// ``range`` is its least and largest value, ``rate`` the largest change per second (infinite: at once), in the units of what it
    /// drives. It is at ``start``: zero, or what is next to zero in the range, unless told.
    #[pyo3(signature = (name, actuator, range, rate = f64::INFINITY, start = None))]
    fn insert(
        &self,
        py: Python<'_>,
        name: &str,
        actuator: PyActuator,
        range: (f64, f64),
        rate: f64,
        start: Option<f64>,
    ) -> PyResult<()> {
        let start = start_of(range, start)?;
        let inserted = self.with(py, |all| all.insert(name, actuator.0, range_of(range), rate, start))?;
        inserted.map_err(|error| bad_signal(&error))
    }

    /// Asks a signal for a value, which is brought into its range.
    fn command(&self, py: Python<'_>, name: &str, value: f64) -> PyResult<()> {
        self.with(py, |all| all.command(name, value))?.map_err(|error| bad_signal(&error))
    }

    /// Asks all signals for values, in the order of ``names``: an array of shape (n,). All or none are taken.
    fn command_all(&self, py: Python<'_>, values: Vec<f64>) -> PyResult<()> {
        let names = self.names(py)?;
        if names.len() != values.len() {
            return Err(bad_value(format!("values: {} for {} signals", values.len(), names.len())));
        }
        if let Some(place) = values.iter().position(|value| !value.is_finite()) {
            return Err(bad_value(format!("values[{place}] is not finite: {}", values[place])));
        }
        let pairs = names.iter().zip(values);
        self.with(py, |all| pairs.into_iter().try_for_each(|(name, value)| all.command(name, value)))?
            .map_err(|error| bad_signal(&error))
    }

    /// The signal of a name, or None.
    fn get(&self, py: Python<'_>, name: &str) -> PyResult<Option<PySignal>> {
        self.with(py, |all| all.get(name).copied().map(PySignal))
    }

    /// Takes a signal away; what it drove stays as it is.
    fn remove(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.with(py, |all| all.remove(name))?.map(drop).ok_or_else(|| unknown(name))
    }

    /// Names of all signals, sorted.
    fn names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.of_each(py, |name, _| name.to_string())
    }

    /// What the signals are at, in the order of ``names``: an array of shape (n,).
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py>> {
        Ok(PyArray1::from_vec(py, self.of_each(py, |_, signal| signal.value())?))
    }

    /// Least and largest values, in the order of ``names``: an array of shape (n, 2).
    fn ranges<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        rows(py, self.of_each(py, |_, signal| signal.range())?)
    }

    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<PySignal> {
        self.get(py, name)?.ok_or_else(|| unknown(name))
    }

    fn __contains__(&self, py: Python<'_>, name: &str) -> PyResult<bool> {
        self.with(py, |all| all.get(name).is_some())
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.names(py)?.into_pyobject(py)?.try_iter()?.into_any())
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |all| all.iter().count())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<ActuatorSet of {:?}>", self.names(py)?))
    }
}
