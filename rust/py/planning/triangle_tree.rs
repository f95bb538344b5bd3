//! `graspforce._core.TriangleTree`: nearest points of a mesh.

use graspforce::{ClosestPoint, QUERIES_PER_TASK, TriangleTree, room};
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{self, float_array, matrix, shaped, vector};
use crate::convert::errors::{invalid_input, to_python};
use crate::runtime::interrupt::{detached, on_all_cores};

type Nearest<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>);

/// A triangle mesh, ready to be asked for nearest points.
///
/// Parameters
/// ----------
/// vertices : array_like
///     (V, 3) corners.
/// faces : array_like
///     (F, 3) whole numbers: the corners of each triangle.
///
/// Examples
/// --------
/// >>> from graspforce._core import TriangleTree
/// >>> tree = TriangleTree([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
/// >>> points, faces, weights = tree.closest([(0.25, 0.25, 3.0)])
/// >>> points.tolist(), faces.tolist(), weights.tolist()
/// ([[0.25, 0.25, 0.0]], [0], [[0.5, 0.25, 0.25]])
#[pyclass(name = "TriangleTree", module = "graspforce._core", frozen)]
pub struct PyTriangleTree {
    inner: TriangleTree,
}

#[pymethods]
impl PyTriangleTree {
    #[new]
    fn new(py: Python<'_>, vertices: &Bound<'_, PyAny>, faces: &Bound<'_, PyAny>) -> PyResult<Self> {
        let vertices = vectors(py, "vertices", vertices)?;
        let corners = vectors(py, "faces", faces)?;
        if let Some(row) = corners.iter().position(|face| face.iter().any(|&x| x < 0.0 || x.fract() != 0.0)) {
            let message =
                format!("faces, row {row}: {:?} are not numbers of corners", corners[row].as_slice());
            return Err(invalid_input(py, message));
        }
        let mut faces = room("faces", corners.len()).map_err(|error| to_python(py, &error))?;
        faces.extend(corners.iter().map(|face| std::array::from_fn(|corner| face[corner] as usize)));
        drop(corners);
        let inner = detached(py, || TriangleTree::new(&vertices, &faces))?;
        Ok(Self { inner: inner.map_err(|error| to_python(py, &error))? })
    }

    /// The nearest points of (B, 3) points, the triangles they are on (B,), and the weights of its corners (B, 3).
    fn closest<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Nearest<'py>> {
        let points = vectors(py, "points", points)?;
        let closest = || self.inner.closest_many(&points);
        // Few are found sooner than another thread wakes.
        let found = if points.len() <= QUERIES_PER_TASK {
            detached(py, closest)?
        } else {
            on_all_cores(py, closest)?
        };
        let found: Vec<ClosestPoint> = found.map_err(|error| to_python(py, &error))?;
        let places = matrix(py, found.len(), 3, found.iter().flat_map(|c| c.point.iter().copied()))?;
        let faces = vector(py, "faces", found.len(), found.iter().map(|c| c.face as i64))?;
        Ok((places, faces, matrix(py, found.len(), 3, found.iter().flat_map(|c| c.weights))?))
    }
}

fn vectors(py: Python<'_>, argument: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Vector3<f64>>> {
    let array = float_array(argument, value).map_err(|message| invalid_input(py, message))?;
    if array.ndim() != 2 || array.shape()[1] != 3 {
        let message = format!("{argument}: shape {}, expected (n, 3)", shaped(array.shape()));
        return Err(invalid_input(py, message));
    }
    arrays::vectors::<3>(argument, &array)
}
