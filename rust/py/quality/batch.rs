//! `graspforce.quality_many`: a batch of grasps on all cores.

use std::num::NonZero;
use std::ops::Range;
use std::thread::available_parallelism;
use std::time::{Duration, Instant};

use graspforce::{BatchItem, Closure, Error, Grasp, QualityOptions, Status, check_room, quality_batch, room};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::convert::arrays::{as_array, vector};
use crate::convert::errors::{invalid_grasp, invalid_input, to_python};
use crate::convert::grasp_arguments::Arguments;
use crate::convert::quality_options::{RawOptions, quality_options};
use crate::convert::raw_arguments::Raw;
use crate::convert::restored::{self, Checked, expect, within};
use crate::convert::scalars::{Given, flag, shown};
use crate::convert::views::{Layout, Views};
use crate::quality::gradient_batch::{Derivatives, gradient_batch_class};
use crate::runtime::interrupt::on_all_cores;
use crate::runtime::memory::{Work, check_rows};

/// What a chunk of rows between two reports of progress should take: long enough that waiting for the last core
/// does not count, on a busy machine either. One grasp takes from microseconds to a second.
const CHUNK_TIME: Range<Duration> = Duration::from_millis(250)..Duration::from_secs(1);

/// Rows of the first chunk for each core, before any time is known.
const FIRST_ROWS: usize = 32;

/// What a row of a chunk may take in small pieces while it is measured, with the reason why it is no grasp.
const ROW_BYTES: usize = 1024;

/// What Python takes for a row of a dictionary, or of a pickle, beside its text.
const PYTHON_ROW_BYTES: usize = 384;

/// Qualities of a batch of grasps, as arrays with one entry for each.
///
/// It is immutable and may be shared between threads, copied and pickled; `numpy.asarray` gives its epsilon.
///
/// Attributes
/// ----------
/// rho, epsilon, epsilon_lower, epsilon_upper, lower, upper : numpy.ndarray
///     (B,) as in `Quality`; NaN where the status is 2.
/// closure : numpy.ndarray
///     (B,) int8: 1 force closure, 0 partial closure, -1 none; -2 where the status is 2.
/// status : numpy.ndarray
///     (B,) int8 of `Status`: ``SOLVED`` (0), ``INVALID`` (2, not a grasp, see ``errors``) or ``NOT_CONVERGED`` (3, a
///     proven bracket wider than asked for).
/// errors : dict of int to str
///     What is wrong with the rows of status 2.
/// gradient : GradientBatch or None
///     How epsilon changes with the contacts, where it was asked for.
#[pyclass(name = "QualityBatch", module = "graspforce", frozen)]
pub struct PyQualityBatch {
    items: Vec<Row>,
    /// A `GradientBatch`, or None where no gradients were asked for.
    #[pyo3(get)]
    gradient: Option<Py<PyAny>>,
}

/// One row as Python sees it; the reason of status 2 is text by then.
struct Row {
    rho: f64,
    lower: f64,
    upper: f64,
    closure: i8,
    status: i8,
    error: Option<String>,
}

impl Row {
    /// Refuses a record whose parts do not belong together.
    fn check(&self) -> Checked {
        expect(matches!(self.status, 0 | 2 | 3), "status", self.status, "0, 2 or 3")?;
        let failed = self.status == Status::Invalid as i8;
        expect(failed == self.error.is_some(), "error", self.status, "a reason where the status is 2")?;
        if failed {
            let empty = [self.rho, self.lower, self.upper].iter().all(|x| x.is_nan());
            expect(empty, "bracket", self.rho, "NaN where the status is 2")?;
            return within("closure", self.closure, -2..=-2);
        }
        within("closure", self.closure, -1..=1)?;
        restored::bracket(self.rho, self.lower, self.upper)
    }
}

impl From<BatchItem> for Row {
    fn from(item: BatchItem) -> Self {
        let closure = match item.closure {
            Some(Closure::Force) => 1,
            Some(Closure::Partial) => 0,
            Some(Closure::None) => -1,
            None => -2,
        };
        let status = item.status() as i8;
        let error = item.error.map(|error| error.to_string());
        Self { rho: item.rho, lower: item.lower, upper: item.upper, closure, status, error }
    }
}

#[pymethods]
impl PyQualityBatch {
    /// (B,) ``-epsilon``; NaN where the status is 2.
    #[getter]
    fn rho<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.column(py, |item| item.rho)
    }

    /// (B,) the field's quality number, as far as it is proven.
    #[getter]
    fn epsilon<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.column(py, |item| 0.0 - item.rho)
    }

    /// (B,) proven: ``epsilon_lower`` is at most the exact epsilon.
    #[getter]
    fn epsilon_lower<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.column(py, |item| 0.0 - item.upper)
    }

    /// (B,) proven: the exact epsilon is at most ``epsilon_upper``.
    #[getter]
    fn epsilon_upper<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.column(py, |item| 0.0 - item.lower)
    }

    /// (B,) proven: ``lower <= rho``.
    #[getter]
    fn lower<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.column(py, |item| item.lower)
    }

    /// (B,) proven: ``rho <= upper``.
    #[getter]
    fn upper<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.column(py, |item| item.upper)
    }

    /// (B,) int8: 1 force closure, 0 partial closure, -1 none; -2 where the status is 2.
    #[getter]
    fn closure<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i8>>> {
        self.column(py, |item| item.closure)
    }

    /// (B,) int8 of `Status`: 0 solved, 2 not a grasp, 3 bracket wider than asked for.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i8>>> {
        self.column(py, |item| item.status)
    }

    /// What is wrong with the rows of status 2, by row.
    #[getter]
    fn errors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.python_room(py, "errors", self.items.iter().filter(|item| item.error.is_some()).count())?;
        let errors = PyDict::new(py);
        for (row, item) in self.items.iter().enumerate() {
            if let Some(error) = &item.error {
                errors.set_item(row, error)?;
            }
        }
        Ok(errors)
    }

    /// Everything as plain Python numbers and lists, ready for JSON.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("batch_dict", (slf,))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.html")?.call_method1("batch_html", (slf,))
    }

    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        as_array(self.epsilon(py)?.as_any(), dtype, copy)
    }

    #[staticmethod]
    #[pyo3(signature = (rows, gradient=None))]
    fn _restore(
        rows: &Bound<'_, PyList>,
        gradient: Option<Bound<'_, PyAny>>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        check_room("rows", rows.len(), ROW_BYTES).map_err(|error| to_python(py, &error))?;
        let mut items = room("rows", rows.len()).map_err(|error| to_python(py, &error))?;
        for row in rows {
            let (rho, lower, upper, closure, status, error) = row.extract()?;
            items.push(Row { rho, lower, upper, closure, status, error });
        }
        items.iter().try_for_each(Row::check).map_err(|message| invalid_input(py, message))?;
        if let Some(gradient) = &gradient {
            let known: Vec<bool> = items.iter().map(|row| row.error.is_none()).collect();
            gradient_batch_class(py)?.call_method1("_check_rows", (gradient, known))?;
        }
        Ok(Self { items, gradient: gradient.map(Bound::unbind) })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        slf.get().python_room(slf.py(), "rows", slf.get().items.len())?;
        let rows = slf
            .get()
            .items
            .iter()
            .map(|row| (row.rho, row.lower, row.upper, row.closure, row.status, row.error.as_deref()));
        let rows = PyList::new(slf.py(), rows.collect::<Vec<_>>())?.into_any();
        let gradient = slf.get().gradient.as_ref().map(|gradient| gradient.bind(slf.py()).clone());
        let state: Vec<_> = std::iter::once(rows).chain(gradient).collect();
        let state = PyTuple::new(slf.py(), state)?;
        Ok((slf.py().get_type::<Self>().getattr("_restore")?, state))
    }

    fn __len__(&self) -> usize {
        self.items.len()
    }

    fn __repr__(&self) -> String {
        let failed = self.items.iter().filter(|item| item.error.is_some()).count();
        let closed = self.items.iter().filter(|item| item.closure == 1).count();
        format!("QualityBatch({} grasps, {closed} force closure, {failed} failed)", self.items.len())
    }
}

impl PyQualityBatch {
    fn column<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        value: impl Fn(&Row) -> T,
    ) -> PyResult<Bound<'py, PyArray1<T>>> {
        vector(py, "rows", self.items.len(), self.items.iter().map(value))
    }

    /// Refuses to begin with what Python would not have room for.
    fn python_room(&self, py: Python<'_>, what: &'static str, rows: usize) -> PyResult<()> {
        let text: usize = self.items.iter().filter_map(|item| item.error.as_ref()).map(String::len).sum();
        let each = PYTHON_ROW_BYTES + text / rows.max(1);
        check_room(what, rows, each).map_err(|error| to_python(py, &error))
    }
}

#[doc = include_str!("quality_many.rst")]
#[pyfunction]
#[pyo3(
    signature = (*arguments, criterion=Given::default(), rtol=None, external_wrench=None, metric=None, max_facets=None,
        progress=None, gradient=None, offsets=None, **options),
    text_signature = "(positions, normals, friction=0.5, max_normal_force=1.0, edges=8, torsion=None, \
        tangents=None, origin=None, length_scale=1.0, friction_margin=1.0, extreme_forces=None, *, \
        criterion='max', rtol=None, external_wrench=None, metric=None, max_facets=None, progress=None, gradient=False, offsets=None)"
)]
#[allow(clippy::too_many_arguments, reason = "the arguments of a query are the contract")]
pub fn quality_many<'py>(
    py: Python<'py>,
    arguments: &Bound<'py, PyTuple>,
    criterion: Given<'py>,
    rtol: Option<&Bound<'py, PyAny>>,
    external_wrench: Option<&Bound<'py, PyAny>>,
    metric: Option<&Bound<'py, PyAny>>,
    max_facets: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
    gradient: Option<&Bound<'py, PyAny>>,
    offsets: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<PyQualityBatch> {
    let raw = Raw::new("quality_many", arguments, options)?;
    let views = Views::of(&raw).map_err(|message| invalid_grasp(py, message))?;
    let layout = offsets.map_or(Ok(Layout::Batch), |offsets| Layout::ragged(offsets, views.rows()));
    let layout = layout.map_err(|message| invalid_input(py, message))?;
    let arguments = Arguments::of(&raw, &views, layout).map_err(|message| invalid_grasp(py, message))?;
    let wrong = |message: String| invalid_input(py, message);
    let given = RawOptions { rtol, external_wrench, metric, max_facets };
    if let Some(progress) = progress.filter(|progress| !progress.is_callable()) {
        return Err(wrong(format!("progress: {} is not callable", shown(progress))));
    }
    let gradient = gradient.map_or(Ok(false), |asked| flag("gradient", asked)).map_err(wrong)?;
    macro_rules! run {
        ($d:literal) => {{
            let options = quality_options::<$d>(&criterion, given).map_err(wrong)?;
            run(py, &arguments, &options, gradient, progress)
        }};
    }
    if arguments.dim == 2 { run!(3) } else { run!(6) }
}

/// That a row was not measured because memory is short.
fn out_of_memory(item: &BatchItem) -> Option<&Error> {
    item.error.as_ref().filter(|error| matches!(error, Error::OutOfMemory { .. }))
}

fn run<const D: usize>(
    py: Python<'_>,
    arguments: &Arguments<'_>,
    options: &QualityOptions<D>,
    gradient: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PyQualityBatch> {
    options.check().and_then(|()| arguments.options.check()).map_err(|error| to_python(py, &error))?;
    let mut items = room("positions", arguments.batch).map_err(|error| to_python(py, &error))?;
    let cores = available_parallelism().map_or(1, NonZero::get);
    let work = if gradient { Work::Gradient } else { Work::Quality };
    check_rows(py, arguments, cores, work)?;
    let mut derivatives = if gradient { Some(Derivatives::of(py, arguments)?) } else { None };
    let mut chunk = FIRST_ROWS * cores;
    while items.len() < arguments.batch {
        let rows = items.len()..arguments.batch.min(items.len() + chunk);
        let start = Instant::now();
        let grasp = |row| Grasp::<D>::with_options(&arguments.contacts_of(row)?, arguments.options_of(row));
        check_room("positions", rows.len(), ROW_BYTES).map_err(|error| to_python(py, &error))?;
        let measured = on_all_cores(py, || quality_batch(rows, grasp, options, gradient))?;
        if let Some(short) = measured.iter().find_map(out_of_memory) {
            return Err(to_python(py, short));
        }
        for item in measured {
            if let Some(derivatives) = &mut derivatives {
                derivatives.push(item.gradient.as_ref(), arguments.contacts_in(items.len()));
            }
            items.push(Row::from(item));
        }
        let elapsed = start.elapsed();
        if elapsed < CHUNK_TIME.start {
            chunk *= 2;
        } else if elapsed > CHUNK_TIME.end {
            chunk = cores.max(chunk / 2);
        }
        if let Some(progress) = progress {
            progress.call1((items.len(), arguments.batch))?;
        }
    }
    let gradient = derivatives.map(|derivatives| derivatives.into_python(py, arguments)).transpose()?;
    Ok(PyQualityBatch { items, gradient })
}
