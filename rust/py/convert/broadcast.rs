//! Numbers and vectors that all contacts share, or that each has for itself.

use std::borrow::Cow;

use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{contents, large, shaped};

/// Numbers given once, per contact, or per grasp and contact.
pub struct Broadcast<'a> {
    pub values: Cow<'a, [f64]>,
    per_grasp: usize,
    per_contact: usize,
}

impl<'a> Broadcast<'a> {
    pub fn constant(value: f64) -> Self {
        Self { values: vec![value].into(), per_grasp: 0, per_contact: 0 }
    }

    pub fn parse(
        name: &'static str,
        array: &'a PyReadonlyArrayDyn<'_, f64>,
        shape: &[usize; 2],
        batched: bool,
    ) -> Result<Self, String> {
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
        Ok(Self { values: contents(array).into(), per_grasp, per_contact })
    }

    pub fn parse_vectors(
        name: &'static str,
        array: &'a PyReadonlyArrayDyn<'_, f64>,
        [batch, contacts]: [usize; 2],
        batched: bool,
    ) -> Result<Self, String> {
        let per_grasp = match array.shape() {
            [m, 3] if *m == contacts => 0,
            [b, m, 3] if batched && *b == batch && *m == contacts => 3 * contacts,
            given => {
                let each = if batched { format!(" or ({batch}, {contacts}, 3)") } else { String::new() };
                return Err(format!("{name}: shape {}, expected ({contacts}, 3){each}", shaped(given)));
            }
        };
        Ok(Self { values: contents(array).into(), per_grasp, per_contact: 3 })
    }

    /// The same numbers in memory of their own.
    pub fn kept(self, name: &'static str, py: Python<'_>) -> Result<Broadcast<'static>, String> {
        let Self { values, per_grasp, per_contact } = self;
        Ok(Broadcast { values: kept(name, values, py)?, per_grasp, per_contact })
    }

    pub fn at(&self, grasp: usize, contact: usize) -> f64 {
        self.values[grasp * self.per_grasp + contact * self.per_contact]
    }

    pub fn row(&self, grasp: usize, contact: usize, length: usize) -> &[f64] {
        let start = grasp * self.per_grasp + contact * self.per_contact;
        &self.values[start..start + length]
    }
}

/// The same numbers in memory of their own; where that is short, it is raised in place of the message.
pub fn kept(
    name: &'static str,
    values: Cow<'_, [f64]>,
    py: Python<'_>,
) -> Result<Cow<'static, [f64]>, String> {
    Ok(Cow::Owned(match values {
        Cow::Owned(values) => values,
        Cow::Borrowed(values) => {
            let mut copy = large(name, py, values.len())?;
            copy.extend_from_slice(values);
            copy
        }
    }))
}
