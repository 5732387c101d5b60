//! Numbers from Python and back: vectors, poses, arrays of points and of indices, each checked and named.

use crate::errors::bad_value;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use rapier3d::math::{Pose, Rotation, Vector};

/// A one-dimensional array of Python's.
pub type Array1<'py> = Bound<'py, PyArray1<f64>>;
/// A two-dimensional array of Python's.
pub type Array2<'py> = Bound<'py, PyArray2<f64>>;

/// Three numbers: a tuple, list or array.
#[derive(Clone, Copy)]
pub struct Triple(pub [f64; 3]);

impl<'py> FromPyObject<'_, 'py> for Triple {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        object.extract::<[f64; 3]>().map(Self).map_err(|_| {
            let shown = object.repr().map_or_else(|_| "what was given".into(), |text| text.to_string());
            PyTypeError::new_err(format!("expected three numbers (x, y, z), got {shown}"))
        })
    }
}

impl Triple {
    /// In rapier's precision. Not checked: the crate does so itself where it takes vectors.
    pub fn real(self) -> Vector {
        Vector::from(self.0.map(|c| c as f32))
    }

    /// In rapier's precision, finite.
    pub fn finite(self, name: &str) -> PyResult<Vector> {
        let real = self.real();
        match real.is_finite() {
            true => Ok(real),
            false => Err(bad_value(format!("{name} is not finite: {:?}", self.0))),
        }
    }
}

/// A pose: a translation, and a rotation as the quaternion (x, y, z, w).
#[derive(Clone, Copy, FromPyObject)]
pub struct Placed(Triple, Quaternion);

/// A quaternion (x, y, z, w).
#[derive(Clone, Copy)]
pub struct Quaternion([f64; 4]);

impl<'py> FromPyObject<'_, 'py> for Quaternion {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        object.extract::<[f64; 4]>().map(Self).map_err(|_| {
            let shown = object.repr().map_or_else(|_| "what was given".into(), |text| text.to_string());
            PyTypeError::new_err(format!("expected a quaternion (x, y, z, w), got {shown}"))
        })
    }
}

impl Quaternion {
    /// As a rotation: of unit length to a thousandth, the rest is normalised away.
    pub fn rotation(self, name: &str) -> PyResult<Rotation> {
        let length = self.0.iter().map(|c| c * c).sum::<f64>().sqrt();
        // Also false of NaN.
        match (length - 1.0).abs() < 1.0e-3 {
            true => Ok(Rotation::from_array(self.0.map(|c| (c / length) as f32))),
            false => Err(bad_value(format!(
                "{name} is no rotation: the quaternion {:?} is not of unit length",
                self.0
            ))),
        }
    }
}

impl Placed {
    /// As rapier's pose.
    pub fn pose(self, name: &str) -> PyResult<Pose> {
        Ok(Pose::from_parts(self.0.finite(name)?, self.1.rotation(name)?))
    }
}

/// A pose for Python: the translation, and the quaternion (x, y, z, w).
pub fn place<'py>(py: Python<'py>, pose: &Pose) -> (Array1<'py>, Array1<'py>) {
    (vector(py, pose.translation), quaternion(py, pose.rotation))
}

/// A rotation for Python.
pub fn quaternion(py: Python<'_>, rotation: Rotation) -> Array1<'_> {
    PyArray1::from_slice(py, &rotation.to_array().map(f64::from))
}

/// A vector of rapier's for Python.
pub fn vector(py: Python<'_>, vector: Vector) -> Array1<'_> {
    triple(py, vector.to_array().map(f64::from))
}

/// A vector for Python.
pub fn triple(py: Python<'_>, vector: [f64; 3]) -> Array1<'_> {
    PyArray1::from_slice(py, &vector)
}

/// Rows for Python.
pub fn rows<'py, T: numpy::Element, const N: usize>(
    py: Python<'py>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_iter().flatten().collect()).reshape([count, N])
}

/// A grid for Python: an array of shape (rows, columns, `N`), of numbers row by row.
pub fn grid<'py, const N: usize>(
    py: Python<'py>,
    [rows, columns]: [usize; 2],
    values: &[[f64; N]],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    PyArray1::from_slice(py, values.as_flattened()).reshape([rows, columns, N])
}

/// An image for Python: an array of shape (rows, columns), of numbers row by row.
pub fn image<'py>(py: Python<'py>, [rows, columns]: [usize; 2], values: Vec<f64>) -> PyResult<Array2<'py>> {
    PyArray1::from_vec(py, values).reshape([rows, columns])
}

/// A number that is finite and, if it is to be, positive.
pub fn number(name: &str, value: f64, positive: bool) -> PyResult<f32> {
    let real = value as f32;
    match real.is_finite() && (!positive || real > 0.0) {
        true => Ok(real),
        false if positive => Err(bad_value(format!("{name} is {value}, but must be positive and finite"))),
        false => Err(bad_value(format!("{name} is not finite: {value}"))),
    }
}

/// Metres beyond which shapes are nothing that single precision can collide: parry panics at some of them. The crate has the
/// same limit for its meshes.
const LARGEST: f32 = 1.0e6;

/// A size [m]: positive, and not beyond what can be simulated.
pub fn size(name: &str, value: f64) -> PyResult<f32> {
    match number(name, value, true)? {
        real if real <= LARGEST => Ok(real),
        _ => Err(bad_value(format!("{name} is {value:?}, but must be at most {LARGEST:e} m"))),
    }
}

/// A number of things: zero or positive.
pub fn count(name: &str, value: i64) -> PyResult<usize> {
    usize::try_from(value).map_err(|_| bad_value(format!("{name} is {value}, but must be zero or positive")))
}

/// A number that is zero or positive.
pub fn not_negative(name: &str, value: f64) -> PyResult<f32> {
    match number(name, value, false)? {
        real if real >= 0.0 => Ok(real),
        _ => Err(bad_value(format!("{name} is {value}, but must be zero or positive, and finite"))),
    }
}

/// Whatever numpy makes an array of, in C order and of the type `to`; its kind of numbers has to be among `kinds`.
fn array<'py>(
    object: &Bound<'py, PyAny>,
    name: &str,
    (kinds, wanted): (&str, &str),
    to: &str,
) -> PyResult<Bound<'py, PyUntypedArray>> {
    let numpy = object.py().import("numpy")?;
    let given = numpy.call_method1("asarray", (object,)).map_err(|error| {
        PyTypeError::new_err(format!("{name}: expected an array of {wanted}: {}", error.value(object.py())))
    })?;
    let kind: String = given.getattr("dtype")?.getattr("kind")?.extract()?;
    let is_empty = given.getattr("size")?.extract::<usize>()? == 0;
    if !kinds.contains(&kind) && !is_empty {
        let dtype = given.getattr("dtype")?;
        return Err(PyTypeError::new_err(format!("{name}: expected an array of {wanted}, got {dtype}")));
    }
    let kept = numpy.call_method1("ascontiguousarray", (given, to))?;
    Ok(kept.cast_into::<PyUntypedArray>()?)
}

fn check_shape(array: &Bound<'_, PyUntypedArray>, name: &str, columns: usize) -> PyResult<()> {
    // An empty list has the shape (0,).
    if array.shape() == [0] || array.ndim() == 2 && array.shape()[1] == columns {
        return Ok(());
    }
    let shape = array.shape().iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    Err(bad_value(format!("{name}: expected the shape (n, {columns}), got ({shape})")))
}

const REALS: (&str, &str) = ("fiu", "numbers");
const WHOLES: (&str, &str) = ("iu", "integers");

/// Points: an array of shape (n, 3). Whether they are finite is for the crate to say.
pub fn points(object: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<[f64; 3]>> {
    let array = array(object, name, REALS, "float64")?;
    check_shape(&array, name, 3)?;
    let flat = array.call_method0("ravel")?.cast_into::<PyArray1<f64>>()?;
    let flat = flat.readonly();
    Ok(flat.as_slice()?.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
}

/// Points in rapier's precision, finite.
pub fn real_points(object: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<Vector>> {
    let points = points(object, name)?;
    let real = |(place, point): (usize, &[f64; 3])| {
        let real = Triple(*point).real();
        match real.is_finite() {
            true if real.abs().max_element() <= LARGEST => Ok(real),
            true => Err(bad_value(format!("{name}[{place}] is beyond {LARGEST:e} m: {point:?}"))),
            false => Err(bad_value(format!("{name}[{place}] is not finite: {point:?}"))),
        }
    };
    points.iter().enumerate().map(real).collect()
}

/// Rows of indices: an array of shape (n, `N`).
pub fn indices<const N: usize>(object: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<[u32; N]>> {
    let array = array(object, name, WHOLES, "int64")?;
    check_shape(&array, name, N)?;
    let flat = array.call_method0("ravel")?.cast_into::<PyArray1<i64>>()?;
    let flat = flat.readonly();
    let rows = flat.as_slice()?.chunks_exact(N).enumerate();
    let row = |(place, row): (usize, &[i64])| {
        let mut indices = [0; N];
        for (column, value) in row.iter().enumerate() {
            indices[column] = u32::try_from(*value).map_err(|_| {
                bad_value(format!("{name}[{place}, {column}] is {value}, but indices are zero or positive"))
            })?;
        }
        Ok(indices)
    };
    rows.map(row).collect()
}

/// Whole numbers, zero or positive: an array of shape (n,), or a mask of truth values.
pub fn list<T: TryFrom<i64>>(object: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<T>> {
    let array = array(object, name, ("iub", "integers or truth values"), "int64")?;
    if array.ndim() != 1 {
        let shape = format!("{:?}", array.shape()).replace('[', "(").replace(']', ")");
        return Err(bad_value(format!("{name}: expected the shape (n,), got {shape}")));
    }
    let flat = array.cast_into::<PyArray1<i64>>()?;
    let flat = flat.readonly();
    let value = |(place, value): (usize, &i64)| {
        T::try_from(*value)
            .map_err(|_| bad_value(format!("{name}[{place}] is {value}, which is out of range")))
    };
    flat.as_slice()?.iter().enumerate().map(value).collect()
}

/// Vertices of a body: their numbers, or a mask with a truth value for each of `count`.
pub fn vertices(object: &Bound<'_, PyAny>, name: &str, count: usize) -> PyResult<Vec<usize>> {
    let given = object.py().import("numpy")?.call_method1("asarray", (object,))?;
    let kind: String = given.getattr("dtype")?.getattr("kind")?.extract()?;
    if kind != "b" {
        return list(object, name);
    }
    let mask: Vec<u8> = list(object, name)?;
    if mask.len() != count {
        return Err(bad_value(format!("{name}: a mask of {} truth values for {count} vertices", mask.len())));
    }
    Ok((0..count).filter(|&vertex| mask[vertex] != 0).collect())
}

/// A grid of heights: an array of shape (rows, columns), each at least two.
pub fn heights(object: &Bound<'_, PyAny>) -> PyResult<rapier3d::parry::utils::Array2<f32>> {
    let array = array(object, "heights", REALS, "float64")?;
    let shape = array.shape().to_vec();
    let &[rows, columns] = &shape[..] else {
        return Err(bad_value(format!("heights: expected two dimensions, got {}", shape.len())));
    };
    if rows < 2 || columns < 2 {
        return Err(bad_value(format!("heights: expected at least (2, 2), got ({rows}, {columns})")));
    }
    let grid = array.cast_into::<PyArray2<f64>>()?;
    let grid = grid.readonly();
    let values = grid.as_slice()?;
    // Column by column, as parry keeps them.
    let mut real = Vec::with_capacity(values.len());
    for column in 0..columns {
        for row in 0..rows {
            let value = values[row * columns + column];
            let height = number(&format!("heights[{row}, {column}]"), value, false)?;
            if height.abs() > LARGEST {
                return Err(bad_value(format!("heights[{row}, {column}] is beyond {LARGEST:e} m: {value}")));
            }
            real.push(height);
        }
    }
    Ok(rapier3d::parry::utils::Array2::new(rows, columns, real))
}

/// The user's array to be filled, checked, or a new one.
fn filled<'py, D: numpy::ndarray::Dimension>(
    out: &Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<Bound<'py, numpy::PyArray<f64, D>>> {
    let untyped = out.cast::<PyUntypedArray>().map_err(|_| {
        PyTypeError::new_err(format!("out: expected an array of float64, got {}", out.get_type()))
    })?;
    let Ok(array) = out.cast::<numpy::PyArray<f64, D>>() else {
        return Err(match untyped.ndim() == shape.len() {
            true => {
                let dtype = untyped.getattr("dtype")?;
                PyTypeError::new_err(format!("out: expected an array of float64, got one of {dtype}"))
            }
            false => wrong_shape(untyped, shape),
        });
    };
    if untyped.shape() != shape {
        return Err(wrong_shape(untyped, shape));
    }
    if !untyped.is_c_contiguous() {
        return Err(bad_value("out: the array is not C-contiguous".into()));
    }
    if !out.getattr("flags")?.getattr("writeable")?.is_truthy()? {
        return Err(bad_value("out: the array is read-only".into()));
    }
    Ok(array.clone())
}

fn wrong_shape(array: &Bound<'_, PyUntypedArray>, wanted: &[usize]) -> PyErr {
    let told = |shape: &[usize]| format!("{shape:?}").replace('[', "(").replace(']', ")");
    bad_value(format!("out: expected the shape {}, got {}", told(wanted), told(array.shape())))
}

/// An array of shape (n,) to be filled.
pub fn filled1<'py>(py: Python<'py>, out: Option<&Bound<'py, PyAny>>, count: usize) -> PyResult<Array1<'py>> {
    out.map_or_else(|| Ok(PyArray1::zeros(py, count, false)), |out| filled(out, &[count]))
}

/// An array of shape (n, k) to be filled.
pub fn filled2<'py>(
    py: Python<'py>,
    out: Option<&Bound<'py, PyAny>>,
    shape: [usize; 2],
) -> PyResult<Array2<'py>> {
    out.map_or_else(|| Ok(PyArray2::zeros(py, shape, false)), |out| filled(out, &shape))
}
