//! Large arguments where they lie, and how contacts belong to grasps.

use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{contents, float_array, large, shaped};
use crate::convert::raw_arguments::Raw;

/// Views of the arguments that may be large: C-contiguous float64 arrays as they are, all others converted.
pub struct Views<'py> {
    pub positions: PyReadonlyArrayDyn<'py, f64>,
    pub normals: PyReadonlyArrayDyn<'py, f64>,
    pub tangents: Option<PyReadonlyArrayDyn<'py, f64>>,
    pub friction: Option<PyReadonlyArrayDyn<'py, f64>>,
    pub max_normal_force: Option<PyReadonlyArrayDyn<'py, f64>>,
    pub torsion: Option<PyReadonlyArrayDyn<'py, f64>>,
}

impl<'py> Views<'py> {
    pub fn of(raw: &Raw<'py>) -> Result<Self, String> {
        let view = |name, value: Option<&Bound<'py, PyAny>>| value.map(|x| float_array(name, x)).transpose();
        Ok(Self {
            positions: float_array("positions", &raw.positions)?,
            normals: float_array("normals", &raw.normals)?,
            tangents: view("tangents", raw.optional("tangents"))?,
            friction: view("friction", raw.given("friction"))?,
            max_normal_force: view("max_normal_force", raw.given("max_normal_force"))?,
            torsion: view("torsion", raw.optional("torsion"))?,
        })
    }

    /// The length of the first axis of `positions`.
    pub fn rows(&self) -> usize {
        self.positions.shape().first().copied().unwrap_or(0)
    }
}

/// How contacts belong to grasps.
pub enum Layout {
    /// One grasp.
    One,
    /// A leading axis over grasps of as many contacts each.
    Batch,
    /// One list of all contacts; grasp `b` has those from entry `b` of these offsets to the next entry.
    Ragged(Vec<usize>),
}

impl Layout {
    /// A ragged batch of `contacts` in all, by its offsets.
    pub fn ragged(offsets: &Bound<'_, PyAny>, contacts: usize) -> Result<Self, String> {
        let array = float_array("offsets", offsets)?;
        if array.shape().len() != 1 || array.shape()[0] == 0 {
            return Err(format!("offsets: shape {}, expected (B + 1,)", shaped(array.shape())));
        }
        let mut entries: Vec<usize> = large("offsets", offsets.py(), array.shape()[0])?;
        for (entry, &offset) in contents(&array).iter().enumerate() {
            let before = entries.last().copied();
            let wrong =
                |expected: &str| Err(format!("offsets, entry {entry}: {offset}, expected {expected}"));
            if offset.fract() != 0.0 || !offset.is_finite() {
                return wrong("a whole number");
            }
            match before {
                None if offset != 0.0 => return wrong("0"),
                Some(before) if offset < before as f64 => {
                    return wrong(&format!("at least {before}, the entry before it"));
                }
                _ if offset > contacts as f64 => {
                    return wrong(&format!("at most {contacts}, the number of contacts"));
                }
                _ => entries.push(offset as usize),
            }
        }
        let (last, entry) = (entries.last().copied().unwrap_or(0), entries.len() - 1);
        if last != contacts {
            let expected = format!("{contacts}, the number of contacts");
            return Err(format!("offsets, entry {entry}: {last}, expected {expected}"));
        }
        Ok(Self::Ragged(entries))
    }
}
