//! Numbers and vectors that all contacts share, or that each has for itself.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use crate::convert::arrays::{copied, float_array, shaped};

/// Numbers given once, per contact, or per grasp and contact.
pub struct Broadcast {
    pub values: Vec<f64>,
    per_grasp: usize,
    per_contact: usize,
}

impl Broadcast {
    pub fn constant(value: f64) -> Self {
        Self { values: vec![value], per_grasp: 0, per_contact: 0 }
    }

    pub fn parse(
        name: &'static str,
        value: &Bound<'_, PyAny>,
        shape: &[usize; 2],
        batched: bool,
    ) -> Result<Self, String> {
        let array = float_array(name, value)?;
        let [_, contacts] = *shape;
        let (per_grasp, per_contact) = match array.shape() {
            [] => (0, 0),
            [m] if *m == contacts => (0, 1),
            given if batched && given == shape => (contacts, 1),
            given => {
                let batch = if batched { format!(" or {}", shaped(shape)) } else { String::new() };
                return Err(format!(
                    "{name}: shape {}, expected a number or ({contacts},){batch}",
                    shaped(given)
                ));
            }
        };
        Ok(Self { values: copied(name, &array)?, per_grasp, per_contact })
    }

    pub fn parse_vectors(
        name: &'static str,
        value: &Bound<'_, PyAny>,
        batch: usize,
        contacts: usize,
        batched: bool,
    ) -> Result<Self, String> {
        let array = float_array(name, value)?;
        let per_grasp = match array.shape() {
            [m, 3] if *m == contacts => 0,
            [b, m, 3] if batched && *b == batch && *m == contacts => 3 * contacts,
            given => {
                let each = if batched { format!(" or ({batch}, {contacts}, 3)") } else { String::new() };
                return Err(format!("{name}: shape {}, expected ({contacts}, 3){each}", shaped(given)));
            }
        };
        Ok(Self { values: copied(name, &array)?, per_grasp, per_contact: 3 })
    }

    pub fn at(&self, grasp: usize, contact: usize) -> f64 {
        self.values[grasp * self.per_grasp + contact * self.per_contact]
    }

    pub fn row(&self, grasp: usize, contact: usize, length: usize) -> &[f64] {
        let start = grasp * self.per_grasp + contact * self.per_contact;
        &self.values[start..start + length]
    }
}
