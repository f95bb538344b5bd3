//! The options of quality queries.

use graspforce::{Criterion, Metric, QualityOptions, Wrench};
use nalgebra::SMatrix;
use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{contents, float_array, float_vector, matrix, shaped, vector};
use crate::convert::dimension::{Dimensional, by_dimension};
use crate::convert::scalars::{Given, choice, number, whole};

/// The options of a quality query in either dimension, kept with its result.
pub type AnyQuery = Dimensional<Query<3>, Query<6>>;

/// The options of a query, and the metric as Python passed it, which its factor does not give back to the last bit.
pub struct Query<const D: usize> {
    pub options: QualityOptions<D>,
    metric: Option<SMatrix<f64, D, D>>,
}

/// What the caller passed beside the criterion, not yet looked at.
#[derive(Clone, Copy, Default)]
pub struct RawOptions<'a, 'py> {
    pub rtol: Option<&'a Bound<'py, PyAny>>,
    pub external_wrench: Option<&'a Bound<'py, PyAny>>,
    pub metric: Option<&'a Bound<'py, PyAny>>,
    pub max_facets: Option<&'a Bound<'py, PyAny>>,
}

impl<const D: usize> Query<D> {
    /// The query, or what is wrong with it.
    pub fn parse(criterion: &Given<'_>, given: RawOptions<'_, '_>) -> Result<Self, String> {
        let criterion = parse_criterion("criterion", criterion)?;
        let rtol = given.rtol.map(|value| number("rtol", value)).transpose()?;
        let external_wrench = given.external_wrench.map(|value| float_vector("external_wrench", value, D));
        let external_wrench = external_wrench.transpose()?.map(Wrench::from_vec);
        let matrix = given.metric.map(parse_metric).transpose()?;
        let metric = matrix.as_ref().map(Metric::from_matrix).transpose();
        let metric = metric.map_err(|error| error.to_string())?;
        let max_facets = given.max_facets.map(|value| whole("max_facets", value, FACETS)).transpose()?;
        let options =
            QualityOptions { rtol, external_wrench, metric, max_facets, ..QualityOptions::new(criterion) };
        Ok(Self { options, metric: matrix })
    }
}

/// As the core allows them.
const FACETS: std::ops::RangeInclusive<usize> = 100..=100_000_000;

impl AnyQuery {
    pub fn criterion(&self) -> Criterion {
        by_dimension!(self, query => query.options.criterion)
    }

    /// Relative width of the bracket that was asked for.
    pub fn rtol(&self) -> Option<f64> {
        by_dimension!(self, query => query.options.rtol)
    }

    pub fn max_facets(&self) -> Option<usize> {
        by_dimension!(self, query => query.options.max_facets)
    }

    /// (d,) the external wrench that was given.
    pub fn external_wrench<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        by_dimension!(self, query => {
            let given = query.options.external_wrench;
            given.map(|wrench| vector(py, "external_wrench", wrench.len(), wrench.iter().copied())).transpose()
        })
    }

    /// (d, d) the metric that was given, row by row; without one the norm is that of the grasp's length scale.
    pub fn metric<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        by_dimension!(self, query => {
            let transposed = query.metric.map(|given| given.transpose());
            transposed.map(|of| matrix(py, of.ncols(), of.nrows(), of.iter().copied())).transpose()
        })
    }

    /// Whether the norm is that of the grasp's length scale.
    pub fn by_length_scale(&self) -> bool {
        by_dimension!(self, query => query.metric.is_none())
    }
}

/// The options of a quality query, or what is wrong with them.
pub fn quality_options<const D: usize>(
    criterion: &Given<'_>,
    given: RawOptions<'_, '_>,
) -> Result<QualityOptions<D>, String> {
    Query::parse(criterion, given).map(|query| query.options)
}

/// The word for a criterion.
pub fn criterion_name(criterion: Criterion) -> &'static str {
    match criterion {
        Criterion::Max => "max",
        Criterion::Sum => "sum",
    }
}

/// "max" or "sum"; "max" where nothing was given.
pub fn parse_criterion(argument: &str, given: &Given<'_>) -> Result<Criterion, String> {
    let word = given.or("max", |given| choice(argument, given, &["max", "sum"]))?;
    Ok(if word == "max" { Criterion::Max } else { Criterion::Sum })
}

/// A matrix of d rows and columns.
pub fn parse_metric<const D: usize>(value: &Bound<'_, PyAny>) -> Result<SMatrix<f64, D, D>, String> {
    let array = float_array("metric", value)?;
    if array.shape() != [D, D] {
        return Err(format!("metric: shape {}, expected ({D}, {D})", shaped(array.shape())));
    }
    Ok(SMatrix::from_row_slice(contents(&array)))
}
