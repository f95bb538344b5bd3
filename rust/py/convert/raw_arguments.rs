//! The arguments that describe a grasp, by name: wherever a grasp, or many, can be given.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// The arguments of `Grasp(...)`, in its order.
pub const NAMES: [&str; 11] = [
    "positions",
    "normals",
    "friction",
    "max_normal_force",
    "edges",
    "torsion",
    "tangents",
    "origin",
    "length_scale",
    "friction_margin",
    "extreme_forces",
];

/// Those of them without which there is no grasp.
const REQUIRED: usize = 2;

/// What the caller passed, not yet looked at.
pub struct Raw<'py> {
    pub positions: Bound<'py, PyAny>,
    pub normals: Bound<'py, PyAny>,
    others: [Option<Bound<'py, PyAny>>; NAMES.len()],
}

impl<'py> Raw<'py> {
    /// Takes arguments by place and by name, and refuses them in Python's words.
    pub fn new(
        function: &str,
        given: &Bound<'py, PyTuple>,
        named: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Self> {
        let refused = |message: String| PyTypeError::new_err(format!("{function}() {message}"));
        if given.len() > NAMES.len() {
            let (most, count) = (NAMES.len(), given.len());
            return Err(refused(format!(
                "takes {REQUIRED} to {most} positional arguments but {count} were given"
            )));
        }
        let mut values: [Option<Bound<'py, PyAny>>; NAMES.len()] = Default::default();
        for (value, given) in values.iter_mut().zip(given) {
            *value = Some(given);
        }
        for (name, given) in named.into_iter().flatten() {
            let name: String = name.extract()?;
            let Some(at) = NAMES.iter().position(|known| *known == name) else {
                return Err(refused(format!("got an unexpected keyword argument '{name}'")));
            };
            if values[at].replace(given).is_some() {
                return Err(refused(format!("got multiple values for argument '{name}'")));
            }
        }
        let missing = |at: usize| refused(format!("missing a required argument: '{}'", NAMES[at]));
        let positions = values[0].take().ok_or_else(|| missing(0))?;
        let normals = values[1].take().ok_or_else(|| missing(1))?;
        Ok(Self { positions, normals, others: values })
    }

    /// What was passed for this name, if anything was.
    pub fn given(&self, name: &str) -> Option<&Bound<'py, PyAny>> {
        let at = NAMES.iter().position(|known| *known == name)?;
        self.others[at].as_ref()
    }

    /// The same, for an argument whose None means that it was not given.
    pub fn optional(&self, name: &str) -> Option<&Bound<'py, PyAny>> {
        self.given(name).filter(|value| !value.is_none())
    }
}
