//! `graspforce._core.ProductBound`: upper bounds of epsilon over products of cells.

use std::sync::{Mutex, MutexGuard};

use graspforce::{CellTree, ContactForce, ContactMap, Criterion, ForceSet, Goal, ProductBound};
use nalgebra::SVector;
use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{contents, float_array, float_vector, matrix, shaped, vector, vectors};
use crate::convert::dimension::{Dimension, Dimensional, by_dimension, map_dimension};
use crate::convert::errors::{busy, invalid_input, to_python};
use crate::convert::scalars::{choice, whole};
use crate::runtime::interrupt::on_all_cores;
use crate::runtime::thread_pool::lock;

type NumbersAndRows<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

type AnyBound = Dimensional<ProductBound<3>, ProductBound<6>>;

/// Upper bounds of epsilon over products of cells, one cell for each group of contacts.
///
/// Wrenches are in coordinates where their norm is Euclidean. Long calls release the interpreter lock and run on all
/// cores.
///
/// Parameters
/// ----------
/// dim : int
///     2 for planar contacts, 3 for spatial ones.
/// criterion : {"max", "sum"}
///     As for `Grasp.quality`.
/// forces : list of list of array_like
///     For each contact of each group (E, k) extreme forces, or (3,) limit, friction and torsion of a true cone.
/// external_wrench : array_like, optional
///     (d,).
///
/// Examples
/// --------
/// Two fingers without friction that press against each other resist no force across.
///
/// >>> from graspforce._core import ProductBound
/// >>> bound = ProductBound(2, "max", [[[(1, 0)]], [[(1, 0)]]])
/// >>> for group, push in enumerate([1, -1]):
/// ...     bound.plant(group, [-1], [0, 1], [0], [0], [[[(push, 0), (0, 0), (0, 0)]]])
/// >>> bound.learn([(0, 1, 0)])
/// 1
/// >>> bound.descend(0.5, 1000, 1.0)
/// >>> len(bound), bound.top
/// (0, 0.0)
#[pyclass(name = "ProductBound", module = "graspforce._core", frozen)]
pub struct PyProductBound {
    inner: Mutex<AnyBound>,
}

#[pymethods]
impl PyProductBound {
    #[new]
    #[pyo3(signature = (dim, criterion, forces, external_wrench=None))]
    fn new(
        py: Python<'_>,
        dim: &Bound<'_, PyAny>,
        criterion: &Bound<'_, PyAny>,
        forces: Vec<Vec<Bound<'_, PyAny>>>,
        external_wrench: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let wrong = |message: String| invalid_input(py, message);
        let dim = whole("dim", dim, 2..=3).map_err(wrong)?;
        let criterion = match choice("criterion", criterion, &["max", "sum"]).map_err(wrong)? {
            "sum" => Criterion::Sum,
            _ => Criterion::Max,
        };
        let forces: Result<Vec<_>, String> =
            forces.iter().map(|group| group.iter().map(force_set).collect()).collect();
        let forces = forces.map_err(wrong)?;
        let inner = map_dimension!(Dimension::of(dim).map_err(wrong)?, () => {
            let center = external_wrench.map(wrench).transpose().map_err(wrong)?;
            ProductBound::new(criterion, center, forces).map_err(|error| to_python(py, &error))?
        });
        Ok(Self { inner: Mutex::new(inner) })
    }

    /// Leaves out contacts further apart than `max_distance`; interchangeable groups are looked at in one order.
    fn restrict(&self, py: Python<'_>, max_distance: f64, interchangeable: bool) -> PyResult<()> {
        by_dimension!(&mut *self.take(py)?, bound => bound.restrict(max_distance, interchangeable));
        Ok(())
    }

    /// Gives a group these cells.
    ///
    /// Parameters
    /// ----------
    /// group : int
    /// children : array_like
    ///     (N,) first of the two children of each cell, or -1.
    /// corner_starts, corners : array_like
    ///     (N + 1,) and (C,): the vertices of cell i are ``corners[corner_starts[i]:corner_starts[i + 1]]``.
    /// slacks : array_like
    ///     (N,) how far supports within a cell exceed those at its corners.
    /// maps : array_like
    ///     (V, contacts, d, k) wrenches of unit forces in the contact frames at the vertices.
    /// positions : array_like, optional
    ///     (V, 3) the vertices, if all cells are triangles with one contact and one frame.
    #[pyo3(signature = (group, children, corner_starts, corners, slacks, maps, positions=None))]
    #[allow(clippy::too_many_arguments, reason = "the contract with Python")]
    fn plant(
        &self,
        py: Python<'_>,
        group: usize,
        children: &Bound<'_, PyAny>,
        corner_starts: &Bound<'_, PyAny>,
        corners: &Bound<'_, PyAny>,
        slacks: &Bound<'_, PyAny>,
        maps: &Bound<'_, PyAny>,
        positions: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let wrong = |message: String| invalid_input(py, message);
        let numbers = |name: &'static str, value| numbers(name, value).map_err(wrong);
        let places = positions.map(|value| float_array("positions", value)).transpose().map_err(wrong)?;
        let positions =
            places.map(|places| vectors::<3>("positions", &places)).transpose()?.unwrap_or_default();
        let (children, corner_starts) =
            (numbers("children", children)?, numbers("corner_starts", corner_starts)?);
        let corners = numbers("corners", corners)?;
        let slacks = contents(&float_array("slacks", slacks).map_err(wrong)?).to_vec();
        let mut inner = self.take(py)?;
        let result = by_dimension!(&mut *inner, bound => {
            let maps = contact_maps(maps).map_err(wrong)?;
            let tree = CellTree { children, corner_starts, corners, slacks, maps, positions };
            on_all_cores(py, || bound.plant(group, tree))?
        });
        result.map_err(|error| to_python(py, &error))
    }

    /// Adds unit directions (Z, d) and returns how many were new.
    fn learn(&self, py: Python<'_>, directions: &Bound<'_, PyAny>) -> PyResult<usize> {
        let array = float_array("directions", directions).map_err(|message| invalid_input(py, message))?;
        let mut inner = self.take(py)?;
        let result = by_dimension!(&mut *inner, bound => {
            let directions = vectors("directions", &array)?;
            on_all_cores(py, || bound.learn(&directions))?
        });
        result.map_err(|error| to_python(py, &error))
    }

    /// Divides products down to cells without children, and drops those whose bound is at most `enough`.
    ///
    /// It stops after `seconds`, or when `most` products are left.
    fn descend(&self, py: Python<'_>, enough: f64, most: usize, seconds: f64) -> PyResult<()> {
        let mut inner = self.take(py)?;
        let result = by_dimension!(&mut *inner, bound => {
            on_all_cores(py, || bound.descend(enough, most, seconds))?
        });
        result.map_err(|error| to_python(py, &error))
    }

    /// Bounds some products along their own worst directions, and drops those whose bound is at most `enough`.
    ///
    /// Returns directions (Z, d). With `mix` several directions are mixed for each product, which takes longer and bounds
    /// it more closely.
    fn ask<'py>(
        &self,
        py: Python<'py>,
        rows: Vec<usize>,
        enough: f64,
        mix: bool,
        seconds: f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut inner = self.take(py)?;
        by_dimension!(&mut *inner, bound => {
            if let Some(row) = rows.iter().find(|&&row| row >= bound.len()) {
                return Err(invalid_input(py, format!("rows: {row}, but {} products are left", bound.len())));
            }
            let found = on_all_cores(py, || bound.ask(&rows, enough, mix, seconds))?;
            let found = found.map_err(|error| to_python(py, &error))?;
            let dim = found.first().map_or(0, nalgebra::Matrix::len);
            matrix(py, found.len(), dim, found.iter().flat_map(|z| z.iter().copied()))
        })
    }

    /// Divides triangles for so many seconds; returns epsilon (K,) and places (K, groups * 3) of the best grasps met.
    ///
    /// Parameters
    /// ----------
    /// best : float
    ///     Epsilon of the best grasp known.
    /// factor, least : float
    ///     Bounds up to ``best * factor``, or up to `least`, are low enough.
    /// adopt : bool
    ///     True: grasps met on the way count as known.
    /// seconds : float
    fn divide<'py>(
        &self,
        py: Python<'py>,
        best: f64,
        factor: f64,
        least: f64,
        adopt: bool,
        seconds: f64,
    ) -> PyResult<NumbersAndRows<'py>> {
        let goal = Goal { best, factor, least, adopt };
        let mut inner = self.take(py)?;
        by_dimension!(&mut *inner, bound => {
            let found = on_all_cores(py, || bound.divide(&goal, seconds))?;
            let found = found.map_err(|error| to_python(py, &error))?;
            let width = found.first().map_or(0, |(_, places)| 3 * places.len());
            let places = found.iter().flat_map(|(_, places)| places.iter().flat_map(|p| p.iter().copied()));
            let epsilons = vector(py, "result", found.len(), found.iter().map(|(epsilon, _)| *epsilon))?;
            Ok((epsilons, matrix(py, found.len(), width, places)?))
        })
    }

    /// Starts again with the whole product of the groups; the directions learnt stay.
    fn restart(&self, py: Python<'_>) -> PyResult<()> {
        by_dimension!(&mut *self.take(py)?, bound => bound.restart());
        Ok(())
    }

    /// Drops the cells that no product uses; the numbers of those kept, for each group.
    fn compact<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray1<i64>>>> {
        let kept = by_dimension!(&mut *self.take(py)?, bound => bound.compact());
        kept.into_iter()
            .map(|cells| vector(py, "cells", cells.len(), cells.iter().map(|&cell| i64::from(cell))))
            .collect()
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(by_dimension!(&*self.take(py)?, bound => bound.len()))
    }

    /// Parts left of products whose triangles were divided.
    #[getter]
    fn pieces(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(by_dimension!(&*self.take(py)?, bound => bound.num_pieces()))
    }

    /// No grasp within the cells is better.
    #[getter]
    fn top(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(by_dimension!(&*self.take(py)?, bound => bound.top()))
    }

    /// The largest bound of the products that were dropped.
    #[getter]
    fn discarded(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(by_dimension!(&*self.take(py)?, bound => bound.discarded()))
    }

    /// The rows of the `count` products with the largest bounds.
    fn worst(&self, py: Python<'_>, count: usize) -> PyResult<Vec<usize>> {
        Ok(by_dimension!(&*self.take(py)?, bound => bound.worst(count)))
    }

    /// The bounds (R,) and cells (R, groups) of some products.
    fn products<'py>(&self, py: Python<'py>, rows: Vec<usize>) -> PyResult<NumbersAndRows<'py>> {
        by_dimension!(&*self.take(py)?, bound => {
            if let Some(row) = rows.iter().find(|&&row| row >= bound.len()) {
                return Err(invalid_input(py, format!("rows: {row}, but {} products are left", bound.len())));
            }
            let bounds = rows.iter().map(|&row| f64::from(bound.bounds()[row]));
            let cells = rows.iter().flat_map(|&row| bound.product(row).iter().map(|&cell| f64::from(cell)));
            let width = rows.first().map_or(0, |&row| bound.product(row).len());
            Ok((vector(py, "bounds", rows.len(), bounds)?, matrix(py, rows.len(), width, cells)?))
        })
    }
}

impl PyProductBound {
    fn take(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, AnyBound>> {
        lock(&self.inner).ok_or_else(|| busy(py))
    }
}

fn wrench<const D: usize>(value: &Bound<'_, PyAny>) -> Result<SVector<f64, D>, String> {
    Ok(SVector::from_column_slice(&float_vector("external_wrench", value, D)?))
}

fn force_set(value: &Bound<'_, PyAny>) -> Result<ForceSet, String> {
    let array = float_array("forces", value)?;
    let numbers = contents(&array);
    match *array.shape() {
        [3] => Ok(ForceSet::Cone { limit: numbers[0], mu: numbers[1], gamma: numbers[2] }),
        [count, width @ 2..=4] if count > 0 => {
            let force = |row: &[f64]| ContactForce::from_fn(|at, _| row.get(at).copied().unwrap_or(0.0));
            Ok(ForceSet::Finite(numbers.chunks_exact(width).map(force).collect()))
        }
        ref shape => Err(format!("forces: shape {}, expected (E, 2 to 4) or (3,)", shaped(shape))),
    }
}

/// Whole numbers; -1 becomes the largest.
fn numbers(argument: &'static str, value: &Bound<'_, PyAny>) -> Result<Vec<u32>, String> {
    let array = float_array(argument, value)?;
    let number = |&x: &f64| -> Result<u32, String> {
        let fits = x.fract() == 0.0 && (-1.0..f64::from(u32::MAX)).contains(&x);
        if !fits {
            return Err(format!("{argument}: {x} is no number of a cell"));
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked above")]
        Ok(if x < 0.0 { u32::MAX } else { x as u32 })
    };
    contents(&array).iter().map(number).collect()
}

fn contact_maps<const D: usize>(value: &Bound<'_, PyAny>) -> Result<Vec<ContactMap<D>>, String> {
    let array = float_array("maps", value)?;
    let [_, _, rows, columns @ 1..=4] = *array.shape() else {
        return Err(format!("maps: shape {}, expected (V, contacts, {D}, k)", shaped(array.shape())));
    };
    if rows != D {
        return Err(format!("maps: shape {}, expected (V, contacts, {D}, k)", shaped(array.shape())));
    }
    let map = |numbers: &[f64]| {
        ContactMap::from_fn(
            |row, column| if column < columns { numbers[row * columns + column] } else { 0.0 },
        )
    };
    Ok(contents(&array).chunks_exact(rows * columns).map(map).collect())
}
