//! Exceptions, and what becomes one.

use foible3d::{ActuatorError, DeformableBodyError, HandleError};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The exceptions. Defined in Python, as a `KeyError` made here would quote its message.
pub mod exceptions {
    pyo3::import_exception!(foible3d._errors, DeformableBodyError);
    pyo3::import_exception!(foible3d._errors, InvalidHandle);
    pyo3::import_exception!(foible3d._errors, SnapshotError);
    pyo3::import_exception!(foible3d._errors, UnknownSignal);
}

/// An error of the crate on its way to Python: what names no body becomes an `InvalidHandle`, all else a
/// `DeformableBodyError`, with the crate's own text.
pub struct Failure(DeformableBodyError);

impl<E: Into<DeformableBodyError>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(error.into())
    }
}

impl From<Failure> for PyErr {
    fn from(Failure(error): Failure) -> Self {
        match error {
            DeformableBodyError::Handle(
                error @ (HandleError::NoSuchBody { .. } | HandleError::NoSuchRigidBody { .. }),
            ) => exceptions::InvalidHandle::new_err(error.to_string()),
            other => exceptions::DeformableBodyError::new_err(other.to_string()),
        }
    }
}

/// Turns any of the crate's errors into an exception.
pub fn raised(error: impl Into<DeformableBodyError>) -> PyErr {
    Failure(error.into()).into()
}

/// Turns an error of a signal into an exception: `UnknownSignal`, or a `DeformableBodyError`.
pub fn bad_signal(error: &ActuatorError) -> PyErr {
    match error {
        ActuatorError::Unknown { .. } => exceptions::UnknownSignal::new_err(error.to_string()),
        _ => bad_value(error.to_string()),
    }
}

/// What a handle that names nothing raises, in the words of the crate.
pub fn no_such(kind: &str, (index, generation): (u32, u32)) -> PyErr {
    exceptions::InvalidHandle::new_err(format!("no {kind} at slot {index} of generation {generation}"))
}

/// A value that is out of its range.
pub fn bad_value(text: String) -> PyErr {
    exceptions::DeformableBodyError::new_err(text)
}

/// Runs `work`; a panic, which is a fault of a library below, becomes a `RuntimeError` and ends nothing.
pub fn without_panic<R>(work: impl FnOnce() -> R) -> PyResult<R> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|cause| {
        let text = cause.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| cause.downcast_ref::<&str>().copied()).unwrap_or("of unknown cause");
        PyRuntimeError::new_err(format!("internal error: {text}"))
    })
}
