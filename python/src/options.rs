//! Keyword arguments of builders: each is the call of the method of its name.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// Calls a method of `builder` for every option. Those in `spread` take several arguments: a tuple of them.
pub fn apply<'py, T: pyo3::PyTypeInfo>(
    builder: Bound<'py, T>,
    options: Option<&Bound<'py, PyDict>>,
    spread: &[&str],
) -> PyResult<Bound<'py, T>> {
    let mut builder = builder.into_any();
    for (name, value) in options.into_iter().flat_map(|options| options.iter()) {
        let name: String = name.extract()?;
        let unknown = || {
            let class = builder.get_type().name().map_or_else(|_| String::new(), |name| name.to_string());
            PyTypeError::new_err(format!("unknown option of {class}: '{name}'"))
        };
        if name.starts_with('_') || name == "build" {
            return Err(unknown());
        }
        let method = builder.getattr(&*name).map_err(|_| unknown())?;
        builder = match value.cast::<PyTuple>() {
            Ok(arguments) if spread.contains(&&*name) => method.call1(arguments)?,
            _ => method.call1((value,))?,
        };
    }
    Ok(builder.cast_into::<T>()?)
}
