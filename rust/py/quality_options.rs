//! The options of quality queries.

use graspforce::{Criterion, Metric, QualityOptions, Wrench};
use nalgebra::SMatrix;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use crate::arrays::{contents, float_array, float_vector};

/// What a quality was asked with, to ask for its gradient later.
pub enum AnyOptions {
    Planar(QualityOptions<3>),
    Spatial(QualityOptions<6>),
}

/// The same in numbers as Python passed them, to pickle.
pub struct Asked {
    pub rtol: Option<f64>,
    pub center: Option<Vec<f64>>,
    pub metric: Option<Vec<Vec<f64>>>,
}

impl Asked {
    /// What `quality_options` accepted.
    pub fn new(
        rtol: Option<f64>,
        center: Option<&Bound<'_, PyAny>>,
        metric: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self, String> {
        let center = center.map(|value| float_array("center", value)).transpose()?;
        let metric = metric.map(|value| float_array("metric", value)).transpose()?;
        let rows = |metric: &[f64]| {
            let size = metric.len().isqrt().max(1);
            metric.chunks(size).map(<[f64]>::to_vec).collect()
        };
        Ok(Self {
            rtol,
            center: center.map(|center| contents(&center).to_vec()),
            metric: metric.map(|metric| rows(contents(&metric))),
        })
    }
}

/// The options of a quality query, or what is wrong with them.
pub fn quality_options<const D: usize>(
    criterion: &str,
    rtol: Option<f64>,
    center: Option<&Bound<'_, PyAny>>,
    metric: Option<&Bound<'_, PyAny>>,
) -> Result<QualityOptions<D>, String> {
    let criterion = parse_criterion("criterion", criterion)?;
    let center = center.map(|value| float_vector("center", value, D)).transpose()?;
    let metric = metric.map(parse_metric).transpose()?;
    let center = center.map(Wrench::from_vec);
    Ok(QualityOptions { rtol, center, metric, ..QualityOptions::new(criterion) })
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

fn parse_metric<const D: usize>(value: &Bound<'_, PyAny>) -> Result<Metric<D>, String> {
    let array = float_array("metric", value)?;
    if array.shape() != [D, D] {
        return Err(format!("metric: shape {:?}, expected ({D}, {D})", array.shape()));
    }
    Metric::from_matrix(&SMatrix::from_row_slice(contents(&array))).map_err(|error| error.to_string())
}
