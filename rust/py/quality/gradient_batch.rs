//! The derivatives of a batch, collected row by row, and `graspforce.GradientBatch` of them.

use graspforce::{Error, Gradient, check_room, room};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::convert::arrays::read_only;
use crate::convert::errors::to_python;
use crate::convert::grasp_arguments::Arguments;

/// Derivatives by what a contact is, contact after contact.
pub struct Derivatives {
    dim: usize,
    positions: Vec<f64>,
    normals: Vec<f64>,
    spins: Vec<f64>,
    friction: Vec<f64>,
    max_normal_force: Vec<f64>,
}

impl Derivatives {
    /// None yet, with room for those of so many contacts.
    pub fn of(argument: &'static str, dim: usize, contacts: usize) -> Result<Self, Error> {
        check_room(argument, contacts, (2 * dim + 3) * size_of::<f64>())?;
        let vectors = || room(argument, contacts.saturating_mul(dim));
        let numbers = || room(argument, contacts);
        Ok(Self {
            dim,
            positions: vectors()?,
            normals: vectors()?,
            spins: numbers()?,
            friction: numbers()?,
            max_normal_force: numbers()?,
        })
    }

    /// Adds those of one contact, or `otherwise` in place of each.
    pub fn push(&mut self, gradient: Option<&Gradient>, contact: usize, otherwise: f64) {
        let dim = self.dim;
        let Some(gradient) = gradient else {
            for vectors in [&mut self.positions, &mut self.normals] {
                vectors.extend(std::iter::repeat_n(otherwise, dim));
            }
            for numbers in [&mut self.spins, &mut self.friction, &mut self.max_normal_force] {
                numbers.push(otherwise);
            }
            return;
        };
        self.positions.extend(gradient.positions[contact].iter().take(dim));
        self.normals.extend(gradient.normals[contact].iter().take(dim));
        self.spins.push(gradient.spins[contact]);
        self.friction.push(gradient.friction[contact]);
        self.max_normal_force.push(gradient.max_normal_force[contact]);
    }

    /// Fields of a record: read-only arrays with these axes before their own.
    pub fn into_fields<'py>(self, py: Python<'py>, leading: &[usize]) -> PyResult<Bound<'py, PyDict>> {
        let array = |values: Vec<f64>, columns: Option<usize>| {
            let shape: Vec<usize> = leading.iter().copied().chain(columns).collect();
            PyArray1::from_vec(py, values).reshape(shape).map(read_only)
        };
        let fields = PyDict::new(py);
        fields.set_item("positions", array(self.positions, Some(self.dim))?)?;
        fields.set_item("normals", array(self.normals, Some(self.dim))?)?;
        fields.set_item("spins", array(self.spins, None)?)?;
        fields.set_item("friction", array(self.friction, None)?)?;
        fields.set_item("max_normal_force", array(self.max_normal_force, None)?)?;
        Ok(fields)
    }
}

/// The gradients of a batch: NaN where a row has none.
pub struct Gradients {
    derivatives: Derivatives,
    unique: Vec<bool>,
}

impl Gradients {
    /// None yet, with room for those of all rows.
    pub fn of(py: Python<'_>, arguments: &Arguments<'_>) -> PyResult<Self> {
        let all = || -> Result<Self, Error> {
            let derivatives = Derivatives::of("gradient", arguments.dim, arguments.contacts_in_all())?;
            Ok(Self { derivatives, unique: room("gradient", arguments.batch)? })
        };
        all().map_err(|error| to_python(py, &error))
    }

    /// Adds that of the next row, which has this many contacts.
    pub fn push(&mut self, gradient: Option<&Gradient>, contacts: usize) {
        self.unique.push(gradient.is_some_and(|gradient| gradient.unique));
        for contact in 0..contacts {
            self.derivatives.push(gradient, contact, f64::NAN);
        }
    }

    /// A `GradientBatch` of arrays (B, m, ...) or (N, ...).
    pub fn into_python(self, py: Python<'_>, arguments: &Arguments<'_>) -> PyResult<Py<PyAny>> {
        let (batch, contacts) = (arguments.batch, arguments.contacts);
        let leading: &[usize] = if arguments.is_ragged() { &[contacts] } else { &[batch, contacts] };
        let fields = self.derivatives.into_fields(py, leading)?;
        fields.set_item("unique", read_only(PyArray1::from_vec(py, self.unique)))?;
        Ok(batch_class(py, "GradientBatch")?.call((), Some(&fields))?.unbind())
    }
}

/// The class `GradientBatch` or `BundleBatch`.
pub fn batch_class<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("graspforce.gradients")?.getattr(name)
}
