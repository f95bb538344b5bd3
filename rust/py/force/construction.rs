//! A distributor out of its options.

use graspforce::{Criterion, DEFAULT_MAX_POINTS, DistributionOptions, ForceDistributor, Grasp, Method};
use pyo3::prelude::*;

use crate::force::squares_arguments::SquaresArguments;
use crate::grasp::PyGrasp;
use crate::runtime::memory::{Work, check_points, check_work};

/// A distributor of either kind.
pub fn distributor<const D: usize>(
    grasp: &Grasp<D>,
    criterion: Option<Criterion>,
    options: DistributionOptions,
    squares: &SquaresArguments,
) -> graspforce::Result<ForceDistributor<D>> {
    match criterion {
        Some(criterion) => ForceDistributor::with_options(grasp, criterion, options),
        None => ForceDistributor::squares(grasp, squares.options(grasp, options.min_normal, options.rtol)?),
    }
}

/// Bytes for a point of an enumeration and for one of its entries, with the solver's copies.
const LISTED: (usize, usize) = (208, 8);

/// Refuses a distributor that memory would not hold.
pub fn check_distributor<const D: usize>(py: Python<'_>, grasp: &Grasp<D>, method: Method) -> PyResult<()> {
    check_work(py, grasp, Work::Distributor)?;
    if method == Method::Implicit { Ok(()) } else { check_points(py, grasp, DEFAULT_MAX_POINTS, LISTED) }
}

/// Refuses options that least squares have no use for.
pub fn refuse_beside_squares(options: &DistributionOptions) -> Result<(), String> {
    let excluded = [
        ("method", options.method != Method::Implicit),
        ("weight", options.weight != 0.0),
        ("samples", !options.samples.is_empty()),
    ];
    match excluded.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((name, _)) => Err(format!("{name}: the objective \"squares\" does not take it")),
    }
}

/// What is wrong with a grasp that `update` cannot take.
pub fn other_dimension(grasp: &PyGrasp) -> String {
    let [given, own] = match grasp.inner.wrench_dim() {
        3 => ["planar (wrenches of 3)", "spatial (6)"],
        _ => ["spatial (wrenches of 6)", "planar (3)"],
    };
    format!("grasp: {given}, the distributor's is {own}")
}

/// Nothing, one number for all contacts, or a list.
pub fn one_or_each<'py>(py: Python<'py>, values: &[f64]) -> PyResult<Option<Bound<'py, PyAny>>> {
    Ok(match values {
        [] => None,
        [all] => Some(all.into_pyobject(py)?.into_any()),
        each => Some(each.into_pyobject(py)?.into_any()),
    })
}
