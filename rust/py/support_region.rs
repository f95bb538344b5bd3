//! What `graspforce.support_region` asks of the core.

use graspforce::{HorizontalPoint, RegionShape, SupportOptions, SupportRegion, Wrench, polygon_margin};
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{float_array, float_vector, matrix, refuse_not_finite, shaped, vector, vectors};
use crate::convert::dimension::Dimensional;
use crate::convert::errors::{invalid_grasp, invalid_input, to_python};
use crate::convert::quality_options::parse_criterion;
use crate::convert::scalars::{Given, flag, instance, number, whole};
use crate::grasp::PyGrasp;
use crate::runtime::interrupt::detached;
use crate::runtime::memory::{Work, check_work};

type Polygon<'py> = Bound<'py, PyArray2<f64>>;

/// Shape; inner and outer vertices; their areas and the gap; resolution; whether it converged, directions; witness.
type Region<'py> = (
    &'static str,
    Polygon<'py>,
    Polygon<'py>,
    (f64, f64, f64),
    f64,
    (bool, usize),
    Option<Bound<'py, PyArray1<f64>>>,
);

/// As the core allows them.
const DIRECTIONS: std::ops::RangeInclusive<usize> = 4..=100_000;

/// The horizontal positions of the centre of mass at which contact forces hold a body.
#[pyfunction]
#[pyo3(signature = (grasp, weight, criterion, acceleration, height, limits, external_wrench, gap, gravity, max_directions))]
#[allow(clippy::too_many_arguments, reason = "the contract with Python")]
pub fn support_region<'py>(
    py: Python<'py>,
    grasp: &Bound<'py, PyAny>,
    weight: &Bound<'py, PyAny>,
    criterion: Given<'py>,
    acceleration: &Bound<'py, PyAny>,
    height: &Bound<'py, PyAny>,
    limits: &Bound<'py, PyAny>,
    external_wrench: &Bound<'py, PyAny>,
    gap: &Bound<'py, PyAny>,
    gravity: &Bound<'py, PyAny>,
    max_directions: &Bound<'py, PyAny>,
) -> PyResult<Region<'py>> {
    let wrong = |message: String| invalid_input(py, message);
    let grasp = instance::<PyGrasp>("grasp", grasp).map_err(wrong)?;
    let criterion = parse_criterion("criterion", &criterion).map_err(wrong)?;
    let parsed = || -> Result<SupportOptions, String> {
        Ok(SupportOptions {
            acceleration: Vector3::from_vec(float_vector("acceleration", acceleration, 3)?),
            gravity: number("gravity", gravity)?,
            height: number("height", height)?,
            limits: flag("limits", limits)?,
            external_wrench: Wrench::from_vec(float_vector("external_wrench", external_wrench, 6)?),
            gap: number("gap", gap)?,
            max_directions: whole("max_directions", max_directions, DIRECTIONS)?,
            ..SupportOptions::new(number("weight", weight)?)
        })
    };
    let options = parsed().map_err(wrong)?;
    let Dimensional::Spatial(of) = &grasp.get().inner else {
        return Err(invalid_grasp(
            py,
            "positions: planar contacts span no horizontal region; give them in space",
        ));
    };
    check_work(py, of, Work::Quality)?;
    let region = detached(py, || of.support_region(criterion, &options))?;
    let region = region.map_err(|error| to_python(py, &error))?;
    let SupportRegion { inner_area, outer_area, area_gap, .. } = region;
    Ok((
        shape_name(region.shape),
        polygon(py, &region.inner)?,
        polygon(py, &region.outer)?,
        (inner_area, outer_area, area_gap),
        region.resolution,
        (region.converged, region.directions),
        region.witness.map(|z| vector(py, "witness", 6, z.iter().copied())).transpose()?,
    ))
}

fn shape_name(shape: RegionShape) -> &'static str {
    match shape {
        RegionShape::Empty => "empty",
        RegionShape::Point => "point",
        RegionShape::Segment => "segment",
        RegionShape::Polygon => "polygon",
    }
}

fn polygon<'py>(py: Python<'py>, vertices: &[HorizontalPoint]) -> PyResult<Polygon<'py>> {
    matrix(py, vertices.len(), 2, vertices.iter().flat_map(|vertex| [vertex.x, vertex.y]))
}

/// How far points (N, 2) are inside a convex polygon (k, 2), counterclockwise; negative outside.
#[pyfunction]
pub fn polygon_margins<'py>(
    py: Python<'py>,
    vertices: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let [vertices, points] = [("vertices", vertices), ("points", points)].map(|(name, value)| {
        let array = float_array(name, value).map_err(|message| invalid_input(py, message))?;
        if array.ndim() != 2 || array.shape()[1] != 2 {
            let message = format!("{name}: shape {}, expected (n, 2) or (2,)", shaped(array.shape()));
            return Err(invalid_input(py, message));
        }
        refuse_not_finite(name, &array).map_err(|message| invalid_input(py, message))?;
        vectors::<2>(name, &array)
    });
    let (vertices, points) = (vertices?, points?);
    let margins =
        detached(py, || points.iter().map(|point| polygon_margin(&vertices, point)).collect::<Vec<_>>())?;
    Ok(PyArray1::from_vec(py, margins))
}
