//! What a grasp consists of, as arrays that nobody can write.

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{matrix, read_only, vector};
use crate::convert::dimension::{AnyGrasp, by_dimension};
use crate::convert::errors::to_python;

type Matrix<'py> = PyResult<Bound<'py, PyArray2<f64>>>;

pub fn positions<'py>(py: Python<'py>, grasp: &AnyGrasp) -> Matrix<'py> {
    by_dimension!(grasp, of => each(py, grasp, of.contacts().iter().map(|contact| contact.position)))
}

pub fn normals<'py>(py: Python<'py>, grasp: &AnyGrasp) -> Matrix<'py> {
    by_dimension!(grasp, of => each(py, grasp, of.contacts().iter().map(|contact| contact.normal)))
}

/// First tangents; `None` in the plane.
pub fn tangents<'py>(py: Python<'py>, grasp: &AnyGrasp) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
    let AnyGrasp::Spatial(of) = grasp else { return Ok(None) };
    each(py, grasp, of.frames().iter().map(|frame| frame.column(1).into())).map(Some)
}

/// Frames, row by row their axes.
pub fn frames<'py>(py: Python<'py>, grasp: &AnyGrasp) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let dim = coordinates(grasp);
    let axes: &[usize] = if dim == 2 { &[0, 2] } else { &[0, 1, 2] };
    by_dimension!(grasp, of => {
        let numbers = of.frames().iter().flat_map(|frame| {
            axes.iter().flat_map(move |&axis| (0..dim).map(move |row| frame[(row, axis)]))
        });
        let shape = [of.num_contacts(), dim, dim];
        Ok(read_only(vector(py, "result", shape.iter().product(), numbers)?.reshape(shape)?))
    })
}

pub fn grasp_matrix<'py>(py: Python<'py>, grasp: &AnyGrasp) -> Matrix<'py> {
    by_dimension!(grasp, of => {
        let (d, columns) = (grasp.wrench_dim(), of.force_components());
        let rows = (0..d).flat_map(|row| {
            of.maps().iter().flat_map(move |map| columns.iter().map(move |&column| map[(row, column)]))
        });
        matrix(py, d, of.num_contacts() * columns.len(), rows).map(read_only)
    })
}

pub fn primitive_wrenches<'py>(py: Python<'py>, grasp: &AnyGrasp) -> Matrix<'py> {
    by_dimension!(grasp, of => {
        let wrenches = of.primitive_wrenches().map_err(|error| to_python(py, &error))?;
        let rows = wrenches.iter().flat_map(|w| w.iter().copied());
        matrix(py, wrenches.len(), grasp.wrench_dim(), rows).map(read_only)
    })
}

pub fn extreme_forces<'py>(py: Python<'py>, grasp: &AnyGrasp) -> Matrix<'py> {
    by_dimension!(grasp, of => {
        let forces = of.extreme_forces().map_err(|error| to_python(py, &error))?;
        let columns = of.force_components();
        let rows = forces.iter().flat_map(|force| columns.iter().map(|&row| force[row]));
        matrix(py, forces.len(), columns.len(), rows).map(read_only)
    })
}

/// Numbers of extreme forces; 0 for a true cone.
pub fn num_edges<'py>(py: Python<'py>, grasp: &AnyGrasp) -> PyResult<Bound<'py, PyArray1<i64>>> {
    by_dimension!(grasp, of => {
        let contacts = of.num_contacts();
        let counts = (0..contacts).map(|i| of.edges(i).map_or(0, |range| range.len() as i64));
        vector(py, "result", contacts, counts)
    })
}

fn coordinates(grasp: &AnyGrasp) -> usize {
    if grasp.wrench_dim() == 3 { 2 } else { 3 }
}

/// One vector for each contact.
fn each<'py>(
    py: Python<'py>,
    grasp: &AnyGrasp,
    vectors: impl ExactSizeIterator<Item = Vector3<f64>>,
) -> Matrix<'py> {
    let (rows, dim) = (vectors.len(), coordinates(grasp));
    let numbers = vectors.flat_map(|v| <[f64; 3]>::from(v).into_iter().take(dim));
    matrix(py, rows, dim, numbers).map(read_only)
}
