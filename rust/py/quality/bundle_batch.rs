//! The critical directions of a batch, collected row by row, and `graspforce.BundleBatch` of them.

use graspforce::{CriticalDirection, Error, check_room, room};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::read_only;
use crate::convert::errors::to_python;
use crate::convert::grasp_arguments::Arguments;
use crate::quality::gradient_batch::{Derivatives, batch_class};

/// Up to `size` critical directions of each row. What a row lacks has the value infinity, and zeros besides.
pub struct Bundles {
    size: usize,
    /// Contact by contact where the batch is ragged, else direction by direction.
    ragged: bool,
    derivatives: Derivatives,
    directions: Vec<f64>,
    values: Vec<f64>,
    unique: Vec<bool>,
    count: Vec<i64>,
}

impl Bundles {
    /// None yet, with room for those of all rows.
    pub fn of(py: Python<'_>, arguments: &Arguments<'_>, size: usize) -> PyResult<Self> {
        let all = || -> Result<Self, Error> {
            let rows = arguments.batch.saturating_mul(size);
            let contacts = arguments.contacts_in_all().saturating_mul(size);
            let wrench_dim = if arguments.dim == 2 { 3 } else { 6 };
            check_room("bundle", rows, (wrench_dim + 1) * size_of::<f64>())?;
            Ok(Self {
                size,
                ragged: arguments.is_ragged(),
                derivatives: Derivatives::of("bundle", arguments.dim, contacts)?,
                directions: room("bundle", rows.saturating_mul(wrench_dim))?,
                values: room("bundle", rows)?,
                unique: room("bundle", rows)?,
                count: room("bundle", arguments.batch)?,
            })
        };
        all().map_err(|error| to_python(py, &error))
    }

    /// Adds those of the next row, which has this many contacts.
    pub fn push<const D: usize>(&mut self, bundle: &[CriticalDirection<D>], contacts: usize) {
        self.count.push(bundle.len() as i64);
        for k in 0..self.size {
            let critical = bundle.get(k);
            self.values.push(critical.map_or(f64::INFINITY, |critical| critical.value));
            self.unique.push(critical.is_some_and(|critical| critical.gradient.unique));
            self.directions.extend(critical.map_or([0.0; D], |critical| critical.direction.into()));
        }
        let gradient = |k: usize| bundle.get(k).map(|critical| &critical.gradient);
        let (size, derivatives) = (self.size, &mut self.derivatives);
        let mut push = |k, contact| derivatives.push(gradient(k), contact, 0.0);
        if self.ragged {
            (0..contacts).for_each(|contact| (0..size).for_each(|k| push(k, contact)));
        } else {
            (0..size).for_each(|k| (0..contacts).for_each(|contact| push(k, contact)));
        }
    }

    /// A `BundleBatch` of arrays (B, k, m, ...) or (N, k, ...).
    pub fn into_python(self, py: Python<'_>, arguments: &Arguments<'_>) -> PyResult<Py<PyAny>> {
        let (batch, contacts, size) = (arguments.batch, arguments.contacts, self.size);
        let leading: &[usize] = if self.ragged { &[contacts, size] } else { &[batch, size, contacts] };
        let fields = self.derivatives.into_fields(py, leading)?;
        let wrench_dim = if arguments.dim == 2 { 3 } else { 6 };
        let directions = PyArray1::from_vec(py, self.directions).reshape([batch, size, wrench_dim])?;
        fields.set_item("directions", read_only(directions))?;
        fields.set_item("values", read_only(PyArray1::from_vec(py, self.values).reshape([batch, size])?))?;
        fields.set_item("unique", read_only(PyArray1::from_vec(py, self.unique).reshape([batch, size])?))?;
        fields.set_item("count", read_only(PyArray1::from_vec(py, self.count)))?;
        Ok(batch_class(py, "BundleBatch")?.call((), Some(&fields))?.unbind())
    }
}
