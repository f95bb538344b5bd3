//! `graspforce._core.BoxBound`: upper bounds of epsilon over boxes of parameters.

use std::sync::Mutex;

use graspforce::{BoxBound, Error, Grasp, Stencil};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::convert::arrays::{contents, float_array};
use crate::convert::dimension::{Dimension, Dimensional, map_dimension};
use crate::convert::errors::{busy, in_row, invalid_grasp, invalid_input, to_python};
use crate::convert::grasp_arguments::Arguments;
use crate::convert::quality_options::{RawOptions, quality_options};
use crate::convert::raw_arguments::Raw;
use crate::convert::scalars::{Given, whole};
use crate::runtime::interrupt::on_all_cores;
use crate::runtime::memory::{Work, check_rows};
use crate::runtime::thread_pool::lock;

type AnyBound = Dimensional<BoxBound<3>, BoxBound<6>>;

/// Upper bounds of epsilon over boxes of parameters, and a memory of where grasps are weak.
///
/// Parameters
/// ----------
/// dim : int
///     2 for planar contacts, 3 for spatial ones.
/// criterion, external_wrench, metric : optional
///     As for `Grasp.quality`.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> from graspforce._core import BoxBound
/// >>> angles = np.array([[0.0, 2.8], [0.0, 3.0]])
/// >>> outward = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
/// >>> BoxBound(2).over([0.01], outward, -outward).shape
/// (1,)
#[pyclass(name = "BoxBound", module = "graspforce._core", frozen)]
pub struct PyBoxBound {
    inner: Mutex<AnyBound>,
}

#[pymethods]
impl PyBoxBound {
    #[new]
    #[pyo3(
        signature = (dim, criterion=Given::default(), external_wrench=None, metric=None),
        text_signature = "(dim, criterion='max', external_wrench=None, metric=None)"
    )]
    fn new(
        py: Python<'_>,
        dim: &Bound<'_, PyAny>,
        criterion: Given<'_>,
        external_wrench: Option<&Bound<'_, PyAny>>,
        metric: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let wrong = |message: String| invalid_input(py, message);
        let given = RawOptions { external_wrench, metric, ..RawOptions::default() };
        let dim = whole("dim", dim, 2..=3).map_err(wrong)?;
        let inner = map_dimension!(Dimension::of(dim).map_err(wrong)?, () => {
            let options = quality_options(&criterion, given).map_err(wrong)?;
            BoxBound::new(options).map_err(|error| to_python(py, &error))?
        });
        Ok(Self { inner: Mutex::new(inner) })
    }

    /// Bounds (N,) of the boxes whose slacks are given; B = N V grasps, V vertices of each box in turn.
    ///
    /// The interpreter lock is released meanwhile.
    ///
    /// Parameters
    /// ----------
    /// slacks : array_like
    ///     (N,) what the interpolation between vertices leaves open.
    /// positions, normals : array_like
    ///     (N V, m, dim), and all other arguments of a grasp as for `graspforce.quality_many`.
    /// enough : float
    ///     A bound below this is not refined further.
    /// axes : int, optional
    ///     Number p of parameters: after its 2^p vertices each box then has its centre and, axis by axis, the places
    ///     at -1, -1/2, 1/2 and 1 half-widths from it. Second differences along these axes, times ``safety``,
    ///     estimate the slack, which is used where it is below the one given.
    #[pyo3(signature = (slacks, *arguments, enough=0.0, axes=None, safety=1.5, **options))]
    #[allow(clippy::too_many_arguments, reason = "the contract with Python")]
    fn over<'py>(
        &self,
        py: Python<'py>,
        slacks: &Bound<'py, PyAny>,
        arguments: &Bound<'py, PyTuple>,
        enough: f64,
        axes: Option<usize>,
        safety: f64,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let raw = Raw::new("over", arguments, options)?;
        let arguments = Arguments::parse(&raw, true).map_err(|message| invalid_grasp(py, message))?;
        let slacks = float_array("slacks", slacks).map_err(|message| invalid_input(py, message))?;
        // A copy: they are read without the interpreter lock.
        let slacks = contents(&slacks).to_vec();
        if slacks.is_empty() || arguments.batch % slacks.len() != 0 {
            let message = format!("slacks: {} boxes for {} vertices", slacks.len(), arguments.batch);
            return Err(invalid_input(py, message));
        }
        arguments.options.check().map_err(|error| to_python(py, &error))?;
        let stencil = axes.map(|axes| Stencil { axes, safety });
        check_rows(py, &arguments, 1, Work::Quality)?;
        let mut inner = lock(&self.inner).ok_or_else(|| busy(py))?;
        let inner = &mut *inner;
        let bounds = on_all_cores(py, || match (inner, arguments.dim) {
            (AnyBound::Planar(bound), 2) => over(bound, &arguments, &slacks, stencil, enough),
            (AnyBound::Spatial(bound), 3) => over(bound, &arguments, &slacks, stencil, enough),
            _ => Err(None),
        })?;
        match bounds {
            Ok(bounds) => Ok(PyArray1::from_vec(py, bounds)),
            Err(None) => Err(invalid_grasp(py, "positions: not of the bound's dimension")),
            Err(Some((row, error))) => Err(in_row(py, row, &error)),
        }
    }
}

fn over<const D: usize>(
    bound: &mut BoxBound<D>,
    arguments: &Arguments<'_>,
    slacks: &[f64],
    stencil: Option<Stencil>,
    enough: f64,
) -> Result<Vec<f64>, Option<(usize, Error)>> {
    let each = arguments.batch / slacks.len();
    let grasp = |row| Grasp::<D>::with_options(&arguments.contacts_of(row)?, arguments.options_of(row));
    bound.over(slacks, stencil, enough, |index| index * each..(index + 1) * each, grasp).map_err(Some)
}
