//! The options of quality queries.

use graspforce::{Criterion, Metric, QualityOptions, Wrench};
use nalgebra::SMatrix;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use crate::convert::arrays::{contents, float_array, float_vector, shaped};
use crate::convert::dimension::{Dimensional, by_dimension};

/// The options of a quality query in either dimension, kept for its gradient.
pub type AnyAsked = Dimensional<Asked<3>, Asked<6>>;

/// Tolerance, external wrench, metric and largest number of facets, to pickle.
pub type Numbers = (Option<f64>, Option<Vec<f64>>, Option<Vec<Vec<f64>>>, Option<usize>);

/// The options of a query, and the metric as Python passed it, which its factor does not give back to the last bit.
pub struct Asked<const D: usize> {
    pub options: QualityOptions<D>,
    metric: Option<SMatrix<f64, D, D>>,
}

impl<const D: usize> Asked<D> {
    /// The query, or what is wrong with it.
    pub fn parse(
        criterion: &str,
        rtol: Option<f64>,
        external_wrench: Option<&Bound<'_, PyAny>>,
        metric: Option<&Bound<'_, PyAny>>,
        max_facets: Option<usize>,
    ) -> Result<Self, String> {
        let criterion = parse_criterion("criterion", criterion)?;
        let external_wrench =
            external_wrench.map(|value| float_vector("external_wrench", value, D)).transpose()?;
        let matrix = metric.map(parse_metric).transpose()?;
        let metric = matrix.as_ref().map(Metric::from_matrix).transpose();
        let metric = metric.map_err(|error| error.to_string())?;
        let external_wrench = external_wrench.map(Wrench::from_vec);
        let options =
            QualityOptions { rtol, external_wrench, metric, max_facets, ..QualityOptions::new(criterion) };
        Ok(Self { options, metric: matrix })
    }

    fn numbers(&self) -> Numbers {
        let external_wrench =
            self.options.external_wrench.map(|external_wrench| external_wrench.as_slice().to_vec());
        let rows = |matrix: &SMatrix<f64, D, D>| {
            matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
        };
        (self.options.rtol, external_wrench, self.metric.as_ref().map(rows), self.options.max_facets)
    }
}

impl AnyAsked {
    /// Tolerance, external wrench, metric and largest number of facets in numbers, to pickle.
    pub fn numbers(&self) -> Numbers {
        by_dimension!(self, asked => asked.numbers())
    }

    /// Whether the norm is that of the grasp's length scale.
    pub fn by_length_scale(&self) -> bool {
        by_dimension!(self, asked => asked.metric.is_none())
    }

    pub fn criterion(&self) -> Criterion {
        by_dimension!(self, asked => asked.options.criterion)
    }
}

/// The options of a quality query, or what is wrong with them.
pub fn quality_options<const D: usize>(
    criterion: &str,
    rtol: Option<f64>,
    external_wrench: Option<&Bound<'_, PyAny>>,
    metric: Option<&Bound<'_, PyAny>>,
    max_facets: Option<usize>,
) -> Result<QualityOptions<D>, String> {
    Asked::parse(criterion, rtol, external_wrench, metric, max_facets).map(|asked| asked.options)
}

/// The word for a criterion.
pub fn criterion_name(criterion: Criterion) -> &'static str {
    match criterion {
        Criterion::Max => "max",
        Criterion::Sum => "sum",
    }
}

/// "max" or "sum".
pub fn parse_criterion(argument: &str, criterion: &str) -> Result<Criterion, String> {
    match criterion {
        "max" => Ok(Criterion::Max),
        "sum" => Ok(Criterion::Sum),
        other => Err(format!("{argument}: {other:?} is neither \"max\" nor \"sum\"")),
    }
}

/// A matrix of d rows and columns.
pub fn parse_metric<const D: usize>(value: &Bound<'_, PyAny>) -> Result<SMatrix<f64, D, D>, String> {
    let array = float_array("metric", value)?;
    if array.shape() != [D, D] {
        return Err(format!("metric: shape {}, expected ({D}, {D})", shaped(array.shape())));
    }
    Ok(SMatrix::from_row_slice(contents(&array)))
}
