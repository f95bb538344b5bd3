//! Arrays from whatever a NumPy user passes: lists, integers, float32, strides.

use graspforce::room;
use nalgebra::SVector;
use numpy::{
    Element, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyReadwriteArray2,
    PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::convert::errors::to_python;
pub use crate::convert::read_only::read_only;
use crate::convert::scalars::{number, shown};
use crate::runtime::interrupt::{keep, reason};

/// Numbers in one argument: a gibibyte. Far more grasps or wrenches than one call should hold.
const MAX_NUMBERS: usize = 1 << 27;

/// A C-contiguous, aligned float64 view of `value`, copied only where it is not one already.
pub fn float_array<'py>(
    argument: &str,
    value: &Bound<'py, PyAny>,
) -> Result<PyReadonlyArrayDyn<'py, f64>, String> {
    if let Ok(array) = value.cast_exact::<PyArrayDyn<f64>>()
        && array.is_c_contiguous()
        && array.is_aligned()
        && array.len() <= MAX_NUMBERS
        && let Ok(view) = array.try_readonly()
    {
        return Ok(view);
    }
    let converted = || -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let numpy = value.py().import(intern!(value.py(), "numpy"))?;
        if value.cast::<PyUntypedArray>().is_ok()
            && numpy.getattr("ma")?.call_method1("is_masked", (value,))?.is_truthy()?
        {
            return Err(PyValueError::new_err("some of its entries are masked"));
        }
        let array = numpy.call_method1(intern!(value.py(), "asarray"), (value,));
        let array = array.map_err(|error| ragged(argument, value, &numpy).unwrap_or(error))?;
        let dtype = array.getattr("dtype")?;
        let kind: String = dtype.getattr("kind")?.extract()?;
        if !matches!(kind.as_str(), "i" | "u" | "f") {
            let message = match not_a_number(value) {
                Some((at, text)) => format!("entry {at}: {text} is not a real number"),
                None => format!("dtype {dtype} does not hold real numbers"),
            };
            return Err(PyTypeError::new_err(message));
        }
        // A view that repeats itself may claim to be larger than memory.
        let size: usize = array.getattr("size")?.extract()?;
        if size > MAX_NUMBERS {
            let message = format!("{size} numbers, more than the {MAX_NUMBERS} of one call");
            return Err(PyValueError::new_err(message));
        }
        let options = PyDict::new(value.py());
        options.set_item("dtype", "float64")?;
        options.set_item("order", "C")?;
        // A copy of our own: nothing can hold a writable view of it.
        options.set_item("copy", true)?;
        // Numbers beyond float64 become infinite, and are then refused by name, not warned of.
        let quiet = PyDict::new(value.py());
        quiet.set_item("over", "ignore")?;
        let quiet = numpy.call_method("errstate", (), Some(&quiet))?;
        quiet.call_method0("__enter__")?;
        let copy = numpy.call_method("array", (array,), Some(&options));
        quiet.call_method1("__exit__", (value.py().None(), value.py().None(), value.py().None()))?;
        Ok(copy?.cast_into()?)
    };
    let array = converted().map_err(|error| {
        let reason = reason(value.py(), error);
        // A place comes before the colon: "positions, contact 1: ...".
        let placed = ["row ", "contact ", "entry "].iter().any(|place| reason.starts_with(place));
        format!("{argument}{} {reason}", if placed { "," } else { ":" })
    })?;
    array.try_readonly().map_err(|error| format!("{argument}: {error}"))
}

/// Arguments whose innermost rows belong to contacts.
const OF_CONTACTS: [&str; 3] = ["positions", "normals", "tangents"];

/// The first item of nested lists whose shape is not that of the items before it, as an error; `None` where all agree.
fn ragged(argument: &str, value: &Bound<'_, PyAny>, numpy: &Bound<'_, PyModule>) -> Option<PyErr> {
    let shape_of = |item: &Bound<'_, PyAny>| -> Option<Vec<usize>> {
        numpy.call_method1("shape", (item,)).ok()?.extract().ok()
    };
    if !value.is_instance_of::<PyList>() && !value.is_instance_of::<PyTuple>() {
        return None;
    }
    let mut first = None;
    for (row, item) in value.try_iter().ok()?.enumerate() {
        let item = item.ok()?;
        let Some(shape) = shape_of(&item) else {
            let inner = ragged(argument, &item, numpy)?;
            return Some(PyValueError::new_err(format!("row {row}, {}", inner.value(value.py()))));
        };
        let expected = first.get_or_insert_with(|| shape.clone());
        if *expected != shape {
            let one = expected.len().max(shape.len()) < 2;
            let what = if one && OF_CONTACTS.contains(&argument) { "contact" } else { "row" };
            let (shape, expected) = (shaped(&shape), shaped(expected));
            let message = format!("{what} {row}: shape {shape}, but {what} 0 has {expected}");
            return Some(PyValueError::new_err(message));
        }
    }
    None
}

/// The first entry of nested lists that is no real number: its place and its text.
fn not_a_number(value: &Bound<'_, PyAny>) -> Option<(String, String)> {
    fn find(value: &Bound<'_, PyAny>, at: &mut Vec<usize>) -> Option<String> {
        if !value.is_instance_of::<PyList>() && !value.is_instance_of::<PyTuple>() {
            let real = number("", value).is_ok() || value.cast::<PyUntypedArray>().is_ok();
            return (!real).then(|| shown(value));
        }
        for (index, item) in value.try_iter().ok()?.enumerate() {
            at.push(index);
            if let Some(text) = find(&item.ok()?, at) {
                return Some(text);
            }
            at.pop();
        }
        None
    }
    let mut at = Vec::new();
    let text = find(value, &mut at)?;
    match at[..] {
        [] => None,
        [one] => Some((one.to_string(), text)),
        _ => Some((shaped(&at), text)),
    }
}

/// Refuses an entry that is not finite, by its place.
pub fn refuse_not_finite(argument: &str, array: &PyReadonlyArrayDyn<'_, f64>) -> Result<(), String> {
    let Some(index) = contents(array).iter().position(|x| !x.is_finite()) else { return Ok(()) };
    let mut rest = index;
    let mut at: Vec<usize> = array.shape().iter().rev().map(|n| (rest % n, rest /= n).0).collect();
    at.reverse();
    let at = if let [one] = at[..] {
        format!(", entry {one}")
    } else if at.is_empty() {
        String::new()
    } else {
        format!(", entry {}", shaped(&at))
    };
    Err(format!("{argument}{at}: {} is not finite", contents(array)[index]))
}

/// The same for a vector of known length.
pub fn float_vector(argument: &str, value: &Bound<'_, PyAny>, length: usize) -> Result<Vec<f64>, String> {
    let array = float_array(argument, value)?;
    if array.shape() != [length] {
        return Err(format!("{argument}: shape {}, expected ({length},)", shaped(array.shape())));
    }
    Ok(contents(&array).to_vec())
}

/// A shape as NumPy prints it.
pub fn shaped(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// A copy of all numbers of an argument; where memory is short, that is raised in place of the message.
pub fn copied(argument: &'static str, array: &PyReadonlyArrayDyn<'_, f64>) -> Result<Vec<f64>, String> {
    let values = contents(array);
    let mut copy = large(argument, array.py(), values.len())?;
    copy.extend_from_slice(values);
    Ok(copy)
}

/// Room for `count` entries of an argument; where memory is short, that is raised in place of the message.
pub fn large<T>(argument: &'static str, py: Python<'_>, count: usize) -> Result<Vec<T>, String> {
    room(argument, count).map_err(|error| {
        keep(to_python(py, &error));
        error.to_string()
    })
}

/// The rows of a C-contiguous (n, D) array.
pub fn vectors<const D: usize>(
    argument: &'static str,
    array: &PyReadonlyArrayDyn<'_, f64>,
) -> PyResult<Vec<SVector<f64, D>>> {
    let rows = contents(array).chunks_exact(D);
    let mut vectors = room(argument, rows.len()).map_err(|error| to_python(array.py(), &error))?;
    vectors.extend(rows.map(SVector::from_column_slice));
    Ok(vectors)
}

/// A new read-only array of `count` values.
pub fn vector<'py, T: Element>(
    py: Python<'py>,
    what: &'static str,
    count: usize,
    values: impl IntoIterator<Item = T>,
) -> PyResult<Bound<'py, PyArray1<T>>> {
    let mut vector = room(what, count).map_err(|error| to_python(py, &error))?;
    vector.extend(values);
    Ok(read_only(PyArray1::from_vec(py, vector)))
}

/// The numbers of a C-contiguous array in order.
pub fn contents<'a>(array: &'a PyReadonlyArrayDyn<'_, f64>) -> &'a [f64] {
    array.as_slice().unwrap_or(&[])
}

/// A new (rows, columns) array, row by row.
pub fn matrix(
    py: Python<'_>,
    rows: usize,
    columns: usize,
    values: impl IntoIterator<Item = f64>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let flat = vector(py, "result", rows.saturating_mul(columns), values)?;
    flat.reshape([rows, columns]).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// The caller's array for contact forces, (m, k).
pub fn output_array<'py>(
    forces: &Bound<'py, PyAny>,
    m: usize,
    k: usize,
) -> Result<PyReadwriteArray2<'py, f64>, String> {
    let Ok(array) = forces.cast::<PyArray2<f64>>() else {
        let given = match forces.cast::<PyUntypedArray>() {
            Ok(array) => format!("dtype {} and shape {}", array.dtype(), shaped(array.shape())),
            Err(_) => shown(forces),
        };
        return Err(format!("forces: {given}, expected a float64 array of shape ({m}, {k})"));
    };
    if array.shape() != [m, k] {
        return Err(format!("forces: shape {}, expected ({m}, {k})", shaped(array.shape())));
    }
    // numpy's slices take Fortran order, too, and would fill it transposed.
    if !array.is_c_contiguous() {
        return Err("forces: not C-contiguous".into());
    }
    array.try_readwrite().map_err(|_| "forces: not writable, or in use elsewhere".into())
}

/// What `__array__` answers for an array that is there already.
pub fn as_array<'py>(
    array: &Bound<'py, PyAny>,
    dtype: Option<Bound<'py, PyAny>>,
    copy: Option<bool>,
) -> PyResult<Bound<'py, PyAny>> {
    let own = array.getattr("dtype")?;
    let dtype = dtype.unwrap_or_else(|| own.clone());
    let converts = !dtype.eq(&own)?;
    match (converts, copy) {
        (true, Some(false)) => Err(PyValueError::new_err(format!("no array of {dtype} without a copy"))),
        (false, None | Some(false)) => Ok(array.clone()),
        _ => array.call_method1("astype", (dtype,)),
    }
}
