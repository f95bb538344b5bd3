//! How large a wrench a grasp resists along given directions.

use nalgebra::SVector;
use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{float_array, float_vector, shaped, vectors};
use crate::convert::dimension::{AnyGrasp, by_dimension};
use crate::convert::errors::{invalid_input, to_python};
use crate::convert::quality_options::parse_criterion;
use crate::convert::scalars::Given;
use crate::runtime::interrupt::detached;
use crate::runtime::memory::{Work, check_work};

/// The largest multiples of the directions that limited forces resist; a scalar array for a single direction.
pub fn resistance<'py>(
    py: Python<'py>,
    grasp: &AnyGrasp,
    directions: &Bound<'py, PyAny>,
    criterion: &Given<'py>,
    external_wrench: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let wrong = |message: String| invalid_input(py, message);
    let criterion = parse_criterion("criterion", criterion).map_err(wrong)?;
    let (d, array) = (grasp.wrench_dim(), float_array("directions", directions).map_err(wrong)?);
    let single = match *array.shape() {
        [columns] if columns == d => true,
        [_, columns] if columns == d => false,
        ref given => {
            return Err(wrong(format!("directions: shape {}, expected (B, {d}) or ({d},)", shaped(given))));
        }
    };
    let constant = external_wrench.map(|wrench| float_vector("external_wrench", wrench, d)).transpose();
    let constant = constant.map_err(wrong)?;
    let multiples = by_dimension!(grasp, of => {
        let rows = vectors("directions", &array)?;
        let constant = constant.as_deref().map(SVector::from_column_slice);
        check_work(py, of, Work::Distributor)?;
        detached(py, || of.resistance(&rows, criterion, constant.as_ref()))?
    });
    let multiples = PyArray1::from_vec(py, multiples.map_err(|error| to_python(py, &error))?);
    if single { multiples.get_item(0) } else { Ok(multiples.into_any()) }
}
