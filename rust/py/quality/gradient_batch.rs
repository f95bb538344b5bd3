//! The derivatives of a batch, collected row by row, and `graspforce.GradientBatch` of them.

use graspforce::{Error, Gradient, check_room, room};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert::arrays::read_only;
use crate::convert::errors::to_python;
use crate::convert::grasp_arguments::Arguments;

/// Derivatives of epsilon, contact after contact: NaN where a row has none.
pub struct Derivatives {
    dim: usize,
    positions: Vec<f64>,
    normals: Vec<f64>,
    spins: Vec<f64>,
    friction: Vec<f64>,
    max_normal_force: Vec<f64>,
    unique: Vec<bool>,
}

impl Derivatives {
    /// None yet, with room for those of all rows.
    pub fn of(py: Python<'_>, arguments: &Arguments<'_>) -> PyResult<Self> {
        let dim = arguments.dim;
        let all = || -> Result<Self, Error> {
            let rows = if arguments.is_ragged() { 1 } else { arguments.batch };
            let contacts = rows.saturating_mul(arguments.contacts);
            check_room("gradient", contacts, (2 * dim + 3) * size_of::<f64>())?;
            let vectors = || room("gradient", contacts.saturating_mul(dim));
            let numbers = || room("gradient", contacts);
            Ok(Self {
                dim,
                positions: vectors()?,
                normals: vectors()?,
                spins: numbers()?,
                friction: numbers()?,
                max_normal_force: numbers()?,
                unique: room("gradient", arguments.batch)?,
            })
        };
        all().map_err(|error| to_python(py, &error))
    }

    /// Adds those of the next row, which has this many contacts.
    pub fn push(&mut self, gradient: Option<&Gradient>, contacts: usize) {
        let dim = self.dim;
        self.unique.push(gradient.is_some_and(|gradient| gradient.unique));
        let Some(gradient) = gradient else {
            for vectors in [&mut self.positions, &mut self.normals] {
                vectors.extend(std::iter::repeat_n(f64::NAN, contacts * dim));
            }
            for numbers in [&mut self.spins, &mut self.friction, &mut self.max_normal_force] {
                numbers.extend(std::iter::repeat_n(f64::NAN, contacts));
            }
            return;
        };
        self.positions.extend(gradient.positions.iter().flat_map(|by| by.iter().take(dim)));
        self.normals.extend(gradient.normals.iter().flat_map(|by| by.iter().take(dim)));
        self.spins.extend(&gradient.spins);
        self.friction.extend(&gradient.friction);
        self.max_normal_force.extend(&gradient.max_normal_force);
    }

    /// A `GradientBatch` of read-only arrays, (B, m, ...) or (N, ...).
    pub fn into_python(self, py: Python<'_>, arguments: &Arguments<'_>) -> PyResult<Py<PyAny>> {
        let (batch, contacts, dim) = (arguments.batch, arguments.contacts, self.dim);
        let leading = if arguments.is_ragged() { vec![contacts] } else { vec![batch, contacts] };
        let array = |values: Vec<f64>, columns: Option<usize>| {
            let shape: Vec<usize> = leading.iter().copied().chain(columns).collect();
            PyArray1::from_vec(py, values).reshape(shape).map(read_only)
        };
        let fields = PyDict::new(py);
        fields.set_item("positions", array(self.positions, Some(dim))?)?;
        fields.set_item("normals", array(self.normals, Some(dim))?)?;
        fields.set_item("spins", array(self.spins, None)?)?;
        fields.set_item("friction", array(self.friction, None)?)?;
        fields.set_item("max_normal_force", array(self.max_normal_force, None)?)?;
        fields.set_item("unique", read_only(PyArray1::from_vec(py, self.unique)))?;
        Ok(gradient_batch_class(py)?.call((), Some(&fields))?.unbind())
    }
}

/// The class `GradientBatch`.
pub fn gradient_batch_class(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    py.import("graspforce.gradients")?.getattr("GradientBatch")
}
