//! `graspforce._core.CandidateSearch`: one iteration of the pattern search in one call.

use std::sync::Mutex;

use graspforce::{CandidateSearch, Error, Grasp, Winner};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::convert::dimension::{Dimension, Dimensional, map_dimension};
use crate::convert::errors::{busy, in_row, invalid_grasp, invalid_input, to_python};
use crate::convert::grasp_arguments::Arguments;
use crate::convert::quality_options::{RawOptions, quality_options};
use crate::convert::raw_arguments::Raw;
use crate::convert::scalars::{Given, flag, whole};
use crate::runtime::interrupt::on_all_cores;
use crate::runtime::memory::check_kept_rows;
use crate::runtime::thread_pool::lock;

type Search = Dimensional<CandidateSearch<3>, CandidateSearch<6>>;

/// Chooses the best of many candidate grasps, again and again, and remembers where grasps were weak.
///
/// Parameters
/// ----------
/// dim : int
///     2 for planar contacts, 3 for spatial ones.
/// criterion, rtol, external_wrench, metric : optional
///     As for `Grasp.quality`.
/// prune : bool
///     Reject candidates by directions in which others were weak, and stop a polytope once it falls behind. The
///     winner is the same without; every candidate is then measured to the end.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from graspforce._core import CandidateSearch
/// >>> angles = np.array([[0.0, 2.0], [0.0, 2.5], [0.0, 3.0]])
/// >>> outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
/// >>> winner = CandidateSearch(2).best(outward, -outward, center_index=0)
/// >>> winner.get('index')
/// 2
#[pyclass(name = "CandidateSearch", module = "graspforce._core", frozen)]
pub struct PyCandidateSearch {
    inner: Mutex<Search>,
}

#[pymethods]
impl PyCandidateSearch {
    #[new]
    #[pyo3(
        signature = (dim, criterion=Given::default(), rtol=None, external_wrench=None, metric=None, *,
            prune=Given::default()),
        text_signature = "(dim, criterion='max', rtol=None, external_wrench=None, metric=None, *, prune=True)"
    )]
    fn new(
        py: Python<'_>,
        dim: &Bound<'_, PyAny>,
        criterion: Given<'_>,
        rtol: Option<&Bound<'_, PyAny>>,
        external_wrench: Option<&Bound<'_, PyAny>>,
        metric: Option<&Bound<'_, PyAny>>,
        prune: Given<'_>,
    ) -> PyResult<Self> {
        let wrong = |message: String| invalid_input(py, message);
        let given = RawOptions { rtol, external_wrench, metric, max_facets: None };
        let prune = prune.or(true, |value| flag("prune", value)).map_err(wrong)?;
        let dim = whole("dim", dim, 2..=3).map_err(wrong)?;
        let inner = map_dimension!(Dimension::of(dim).map_err(wrong)?, ()  => {
            let options = quality_options(&criterion, given).map_err(wrong)?;
            CandidateSearch::new(options, prune).map_err(|error| to_python(py, &error))?
        });
        Ok(Self { inner: Mutex::new(inner) })
    }

    /// The best candidate, by the tie rule of `graspforce.plan`.
    ///
    /// The interpreter lock is released while candidates are measured.
    ///
    /// Parameters
    /// ----------
    /// positions, normals : array_like
    ///     (B, m, dim), and all other arguments of a grasp as for `graspforce.quality_many`.
    /// center_index : int
    ///     The candidate that wins ties.
    /// center_rho : float, optional
    ///     Its quality, where it is known already.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``index`` and ``rho`` of the winner, ``center_rho``, and the numbers of ``candidates``, of those
    ///     ``rejected`` by known directions, of ``polytopes`` run and of those that ``converged``.
    ///
    /// Raises
    /// ------
    /// InvalidGraspError
    ///     A candidate is no grasp; the attribute ``row`` says which.
    #[pyo3(signature = (*arguments, center_index=0, center_rho=None, **options))]
    fn best<'py>(
        &self,
        py: Python<'py>,
        arguments: &Bound<'py, PyTuple>,
        center_index: usize,
        center_rho: Option<f64>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let raw = Raw::new("best", arguments, options)?;
        let arguments = Arguments::parse(&raw, true).map_err(|message| invalid_grasp(py, message))?;
        arguments.options.check().map_err(|error| to_python(py, &error))?;
        check_kept_rows(py, &arguments)?;
        let mut search = lock(&self.inner).ok_or_else(|| busy(py))?;
        let search = &mut *search;
        let winner = on_all_cores(py, || match (search, arguments.dim) {
            (Search::Planar(search), 2) => best_of(search, &arguments, center_index, center_rho),
            (Search::Spatial(search), 3) => best_of(search, &arguments, center_index, center_rho),
            _ => Err((0, None)),
        })?;
        match winner {
            Ok(winner) => summary(py, &winner),
            Err((_, None)) => Err(invalid_grasp(py, "positions: not of the search's dimension")),
            Err((row, Some(error))) => Err(in_row(py, row, &error)),
        }
    }
}

fn best_of<const D: usize>(
    search: &mut CandidateSearch<D>,
    arguments: &Arguments<'_>,
    center: usize,
    known: Option<f64>,
) -> Result<Winner, (usize, Option<Error>)> {
    let grasp = |row| Grasp::<D>::with_options(&arguments.contacts_of(row)?, arguments.options_of(row));
    search.best(arguments.batch, center, known, grasp).map_err(|(row, error)| (row, Some(error)))
}

fn summary<'py>(py: Python<'py>, winner: &Winner) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("index", winner.index)?;
    result.set_item("rho", winner.rho)?;
    result.set_item("center_rho", winner.center_rho)?;
    result.set_item("candidates", winner.counts.candidates)?;
    result.set_item("rejected", winner.counts.rejected)?;
    result.set_item("polytopes", winner.counts.polytopes)?;
    result.set_item("converged", winner.counts.converged)?;
    Ok(result)
}
