//! `graspforce.MinkowskiSum`.

use std::iter::repeat_n;

use graspforce::{Grasp, MinkowskiSum};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::convert::arrays::{as_array, matrix, read_only, vector};
use crate::convert::errors::invalid_input;
use crate::convert::restored::{Checked, copied, expect, finite, within};

/// The explicit Minkowski sum of the contacts' wrenches, in the order of Algorithm 1.
///
/// Made by `Grasp.minkowski_sum`. Point j is the sum of the primitive wrenches of its entries
/// ``starts[j]:ends[j]`` (Eq. 30). It is immutable and may be shared between threads, copied and pickled;
/// `numpy.asarray` gives its wrenches.
#[pyclass(name = "MinkowskiSum", module = "graspforce", frozen)]
pub struct PyMinkowskiSum {
    /// (n, d) points ``w_j``, columns of the paper's P, in N and N m; read-only.
    #[pyo3(get)]
    wrenches: Py<PyArray2<f64>>,
    /// (n,) int32, the paper's A from 0: where the entries of each point start; read-only.
    #[pyo3(get)]
    starts: Py<PyArray1<i32>>,
    /// (n,) int32: where they end, exclusive; read-only.
    #[pyo3(get)]
    ends: Py<PyArray1<i32>>,
    /// int32, the paper's B from 0: contact i of each entry; read-only.
    #[pyo3(get)]
    contacts: Py<PyArray1<i32>>,
    /// int32: extreme force h of each entry. Extreme forces of zero that were given are not counted; read-only.
    #[pyo3(get)]
    edges: Py<PyArray1<i32>>,
    /// Rows of W before each contact's first.
    offsets: Vec<i32>,
    rows: usize,
    points: usize,
}

#[pymethods]
impl PyMinkowskiSum {
    /// The sparse matrix Q with ``wrenches == Q.T @ grasp.primitive_wrenches``.
    ///
    /// Returns
    /// -------
    /// scipy.sparse.csc_array
    ///     (sum l_i, n), zeros and ones. Needs SciPy.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)])
    /// >>> ms = grasp.minkowski_sum()
    /// >>> np.array_equal(ms.to_scipy().T @ grasp.primitive_wrenches, ms.wrenches)
    /// True
    fn to_scipy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (starts, ends) = (self.starts.bind(py).try_readonly()?, self.ends.bind(py).try_readonly()?);
        let (contacts, edges) = (self.contacts.bind(py).try_readonly()?, self.edges.bind(py).try_readonly()?);
        let pairs = contacts.as_slice()?.iter().zip(edges.as_slice()?);
        // Whoever made the arrays writable again may have written anything.
        let row = |(&contact, &edge): (&i32, &i32)| {
            let offset = usize::try_from(contact).ok().and_then(|contact| self.offsets.get(contact));
            offset.and_then(|offset| offset.checked_add(edge))
        };
        if pairs.clone().any(|entry| row(entry).is_none()) {
            return Err(invalid_input(py, "contacts: an entry was overwritten"));
        }
        let rows = vector(py, "rows", contacts.len(), pairs.filter_map(row))?;
        let pointers = starts.as_slice()?.iter().chain(ends.as_slice()?.last()).copied();
        let ones = vector(py, "ones", contacts.len(), repeat_n(1.0_f64, contacts.len()))?;
        let options = PyDict::new(py);
        options.set_item("shape", (self.rows, self.points))?;
        let parts = (ones, rows, vector(py, "pointers", starts.len() + 1, pointers)?);
        py.import("scipy.sparse")?.call_method("csc_array", (parts,), Some(&options))
    }

    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        as_array(self.wrenches.bind(py).as_any(), dtype, copy)
    }

    /// Everything as plain Python numbers and lists, ready for JSON.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("minkowski_dict", (slf,))
    }

    #[staticmethod]
    fn _restore(
        wrenches: Bound<'_, PyArray2<f64>>,
        indices: [Bound<'_, PyArray1<i32>>; 4],
        offsets: Vec<i32>,
        rows: usize,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let (numbers, wrenches) = copied(&wrenches)?;
        let [starts, ends, contacts, edges] = &indices;
        let ((first, starts), (last, ends)) = (copied(starts)?, copied(ends)?);
        let ((owners, contacts), (forces, edges)) = (copied(contacts)?, copied(edges)?);
        let (points, columns) = (wrenches.shape()[0], wrenches.shape()[1]);
        let check = || -> Checked {
            expect(columns == 3 || columns == 6, "columns of wrenches", columns, "3 or 6")?;
            finite("wrenches", &numbers)?;
            check_entries(points, [&first, &last, &owners, &forces], &offsets, rows)
        };
        check().map_err(|message| invalid_input(py, message))?;
        Ok(Self {
            wrenches: wrenches.unbind(),
            starts: starts.unbind(),
            ends: ends.unbind(),
            contacts: contacts.unbind(),
            edges: edges.unbind(),
            offsets,
            rows,
            points,
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let copies = [&this.starts, &this.ends, &this.contacts, &this.edges].map(|array| array.clone_ref(py));
        let state = (this.wrenches.clone_ref(py), copies, this.offsets.clone(), this.rows);
        Ok((py.get_type::<Self>().getattr("_restore")?, state.into_pyobject(py)?))
    }

    fn __len__(&self) -> usize {
        self.points
    }

    fn __repr__(&self) -> String {
        format!("MinkowskiSum({} points of {} primitive wrenches)", self.points, self.rows)
    }
}

impl PyMinkowskiSum {
    /// Hands the enumeration over to NumPy.
    pub fn new<const D: usize>(py: Python<'_>, grasp: &Grasp<D>, sum: &MinkowskiSum<D>) -> PyResult<Self> {
        let offsets = (0..grasp.num_contacts()).map(|i| grasp.edges(i).map_or(0, |range| range.start as i32));
        let indices = |values: &[u32]| {
            vector(py, "points", values.len(), values.iter().map(|&x| x as i32)).map(Bound::unbind)
        };
        let points = sum.len();
        let wrenches = matrix(py, points, D, sum.wrenches().iter().flat_map(|w| w.iter().copied()))?;
        Ok(Self {
            wrenches: read_only(wrenches).unbind(),
            starts: indices(sum.starts())?,
            ends: indices(sum.ends())?,
            contacts: indices(sum.contacts())?,
            edges: indices(sum.edges())?,
            offsets: offsets.collect(),
            rows: grasp.primitive_wrenches().map_or(0, <[_]>::len),
            points,
        })
    }
}

/// Refuses entries that are not those of consecutive points, or not of extreme forces that exist.
fn check_entries(points: usize, indices: [&[i32]; 4], offsets: &[i32], rows: usize) -> Checked {
    let [starts, ends, contacts, edges] = indices;
    let counted = starts.len() == points && ends.len() == points && contacts.len() == edges.len();
    expect(counted, "indices", points, "one start and end for each point, one edge for each contact")?;
    let count = i32::try_from(contacts.len()).map_err(|_| "state: too many entries".to_string())?;
    let consecutive = starts.iter().zip(ends).all(|(start, end)| start <= end)
        && starts.iter().copied().eq([0].into_iter().chain(ends.iter().copied()).take(points))
        && ends.last().copied().unwrap_or(0) == count;
    expect(consecutive, "starts and ends", points, "consecutive entries")?;
    let rows = i32::try_from(rows).map_err(|_| format!("state: {rows} rows are too many"))?;
    let bounds: Vec<i32> = offsets.iter().copied().chain([rows]).collect();
    let ordered = bounds[0] == 0 && bounds.is_sorted();
    expect(ordered, "offsets", format!("{offsets:?}"), "ascending rows from 0")?;
    contacts.iter().zip(edges).try_for_each(|(&contact, &edge)| {
        let known = usize::try_from(contact).ok().filter(|&contact| contact < offsets.len());
        let contact = known.ok_or_else(|| format!("state: contact {contact}, expected one that exists"))?;
        within("edge", edge, 0..=bounds[contact + 1] - bounds[contact] - 1)
    })
}
