//! Single values of arguments, refused by the argument's name with what was given and what would do.

use std::ops::RangeInclusive;

use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyString};
use pyo3::{Borrowed, PyTypeInfo};

use crate::runtime::interrupt::reason;

/// What a caller passed for an argument with a default: nothing, or a value, which None is, too.
#[derive(Default)]
pub struct Given<'py>(Option<Bound<'py, PyAny>>);

impl<'py> Given<'py> {
    /// The converted value, or the default.
    pub fn or<T>(
        &self,
        default: T,
        convert: impl FnOnce(&Bound<'py, PyAny>) -> Result<T, String>,
    ) -> Result<T, String> {
        self.0.as_ref().map_or(Ok(default), convert)
    }
}

impl<'py> FromPyObject<'_, 'py> for Given<'py> {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self(Some(value.to_owned())))
    }
}

/// Characters of a value that a message shows.
const MAX_SHOWN: usize = 60;

/// A value as Python prints it, cut where that is long.
pub fn shown(value: &Bound<'_, PyAny>) -> String {
    let text = match value.repr() {
        Ok(text) => text.to_string(),
        Err(error) => {
            // Ctrl-C stays what it is; an integer of thousands of digits has no text.
            let _ = reason(value.py(), error);
            return kind(value);
        }
    };
    match text.char_indices().nth(MAX_SHOWN) {
        None => text,
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}

/// The class of a value.
fn kind(value: &Bound<'_, PyAny>) -> String {
    value.get_type().name().map_or_else(|_| "an object".into(), |name| format!("a value of class {name}"))
}

/// A real number.
pub fn number(argument: &str, value: &Bound<'_, PyAny>) -> Result<f64, String> {
    match value.extract() {
        Ok(number) if !value.is_instance_of::<PyBool>() => Ok(number),
        Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => {
            Err(format!("{argument}: {} is beyond the numbers that float64 holds", shown(value)))
        }
        given => {
            // Ctrl-C stays what it is.
            let _ = given.map_err(|error| reason(value.py(), error));
            Err(format!("{argument}: {} is not a real number", shown(value)))
        }
    }
}

/// A whole number of a range.
pub fn whole(
    argument: &str,
    value: &Bound<'_, PyAny>,
    range: RangeInclusive<usize>,
) -> Result<usize, String> {
    // `__index__` tells integers of every kind from floats.
    let index = if value.is_instance_of::<PyBool>() { None } else { value.call_method0("__index__").ok() };
    let number = index.and_then(|index| index.extract::<usize>().ok());
    number.filter(|number| range.contains(number)).ok_or_else(|| {
        format!(
            "{argument}: {} is not a whole number from {} to {}",
            shown(value),
            range.start(),
            range.end()
        )
    })
}

/// True or False.
pub fn flag(argument: &str, value: &Bound<'_, PyAny>) -> Result<bool, String> {
    value.extract().map_err(|_| format!("{argument}: {} is neither True nor False", shown(value)))
}

/// One of several words.
pub fn choice(
    argument: &str,
    value: &Bound<'_, PyAny>,
    words: &[&'static str],
) -> Result<&'static str, String> {
    let given = value.cast::<PyString>().ok();
    let known = given.and_then(|given| words.iter().find(|word| given == **word));
    known.copied().ok_or_else(|| {
        let quoted: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
        let value = shown(value);
        match &quoted[..] {
            [one, other] => format!("{argument}: {value} is neither {one} nor {other}"),
            [others @ .., last] => format!("{argument}: {value} is none of {} and {last}", others.join(", ")),
            [] => format!("{argument}: {value}"),
        }
    })
}

/// An instance of one of our classes.
pub fn instance<'a, 'py, T: PyTypeInfo>(
    argument: &str,
    value: &'a Bound<'py, PyAny>,
) -> Result<&'a Bound<'py, T>, String> {
    value.cast::<T>().map_err(|_| {
        let class = T::type_object(value.py()).name().map_or_else(|_| String::new(), |name| name.to_string());
        format!("{argument}: {} is not a {class}", shown(value))
    })
}
