//! What a pickle claims about a result, checked before it becomes one: a record that contradicts itself is refused.

use std::fmt::Display;
use std::ops::RangeInclusive;

use graspforce::{Distribution, Grasp, room};
use numpy::ndarray::Dimension;
use numpy::{Element, PyArray, PyArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{read_only, vector};
use crate::convert::errors::to_python;

/// Relative error of numbers that are stored although others determine them.
const ROUNDING: f64 = 1e-9;

/// Why a record is refused.
pub type Checked<T = ()> = Result<T, String>;

/// The numbers of an array, and an array of them that nobody else can write.
pub type Owned<'py, T, D> = (Vec<T>, Bound<'py, PyArray<T, D>>);

/// Refuses unless `holds`.
pub fn expect(holds: bool, field: &str, value: impl Display, expected: &str) -> Checked {
    if holds { Ok(()) } else { Err(format!("state: {field} {value}, expected {expected}")) }
}

/// Refuses numbers that are not finite.
pub fn finite<'a>(field: &str, values: impl IntoIterator<Item = &'a f64>) -> Checked {
    values.into_iter().try_for_each(|value| expect(value.is_finite(), field, value, "finite numbers"))
}

/// Refuses a quality that does not lie in its bracket.
pub fn bracket(rho: f64, lower: f64, upper: f64) -> Checked {
    finite("bracket", &[rho, lower, upper])?;
    let shown = format!("[{lower}, {upper}] of rho {rho}");
    expect(lower <= rho && rho <= upper, "bracket", shown, "lower <= rho <= upper")
}

/// Refuses a closure that the bracket of the grasp's own quality excludes.
pub fn closure(name: &str, lower: f64, upper: f64) -> Checked {
    let possible = match name {
        "force" => lower <= 0.0,
        "partial" => lower <= 0.0 && upper >= 0.0,
        _ => upper >= 0.0,
    };
    expect(possible, "closure", name, "one that the bracket allows")
}

/// Refuses a worst direction that is none, and a nearest wrench that does not lie along it.
pub fn worst(rho: f64, direction: &[f64], wrench: &[f64], d: usize) -> Checked {
    let lengths = format!("{} and {}", direction.len(), wrench.len());
    let known = direction.len() == d && wrench.len() == d;
    expect(known, "direction and wrench of lengths", lengths, &format!("{d} both"))?;
    finite("direction", direction)?;
    finite("wrench", wrench)?;
    expect(direction.iter().any(|&x| x != 0.0), "direction", "zero", "one of unit norm")?;
    let along = direction.iter().map(|x| -rho * x);
    let near = along.zip(wrench).all(|(along, &x)| close(along, x));
    expect(near, "wrench", "elsewhere", "-rho * direction")
}

/// Refuses forces whose numbers contradict each other.
pub fn forces<const D: usize>(
    distribution: &Distribution<D>,
    grasp: &Grasp<D>,
    external_wrench: &[f64],
) -> Checked {
    finite("forces", distribution.forces.iter().flatten())?;
    finite("shares", &distribution.shares)?;
    finite("dual", distribution.dual.iter())?;
    finite("residual", distribution.residual.iter())?;
    expect(distribution.tolerance.is_finite(), "tolerance", distribution.tolerance, "a finite number")?;
    finite("distance", &[distribution.distance])?;
    finite("numbers", &[distribution.sigma, distribution.sigma_max, distribution.sigma_sum])?;
    within("gap", distribution.gap, 0.0..=f64::MAX)?;
    let Distribution { shares, sigma_max, sigma_sum, .. } = distribution;
    let largest = shares.iter().copied().fold(0.0, f64::max);
    expect(close(largest, *sigma_max), "sigma_max", sigma_max, "the largest of the shares")?;
    expect(close(shares.iter().sum(), *sigma_sum), "sigma_sum", sigma_sum, "the sum of the shares")?;
    let known = grasp.force_components();
    let stray = |force: &[f64]| force.iter().enumerate().any(|(k, &x)| x != 0.0 && !known.contains(&k));
    let strays = distribution.forces.iter().any(|force| stray(force.as_slice()));
    expect(!strays, "forces", "with more components", "only those of the grasp's contacts")?;
    let wrenches = distribution.contact_wrenches(grasp);
    let balanced = (0..D).all(|row| {
        let parts = wrenches.iter().map(|wrench| wrench[row]).chain([external_wrench[row]]);
        let size: f64 = parts.clone().map(f64::abs).sum();
        (parts.sum::<f64>() - distribution.residual[row]).abs() <= ROUNDING * size
    });
    expect(balanced, "residual", "elsewhere", "external_wrench + sum_i G_i f_i")
}

/// Refuses a number outside a range.
pub fn within<T: PartialOrd + Display>(field: &str, value: T, range: RangeInclusive<T>) -> Checked {
    let expected = format!("{} to {}", range.start(), range.end());
    expect(range.contains(&value), field, value, &expected)
}

/// The numbers of an array and a read-only copy.
pub fn copied<'py, T, D>(array: &Bound<'py, PyArray<T, D>>) -> PyResult<Owned<'py, T, D>>
where
    T: Element + Copy,
    D: Dimension,
{
    let view = array.try_readonly()?;
    let view = view.as_array();
    let numbers: Vec<T> = filled_from(array.py(), view.len(), view.iter().copied())?;
    let copy =
        vector(array.py(), "state", numbers.len(), numbers.iter().copied())?.reshape(view.raw_dim())?;
    Ok((numbers, read_only(copy)))
}

fn filled_from<T>(py: Python<'_>, count: usize, values: impl Iterator<Item = T>) -> PyResult<Vec<T>> {
    let mut filled = room("state", count).map_err(|error| to_python(py, &error))?;
    filled.extend(values);
    Ok(filled)
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs()) + f64::MIN_POSITIVE
}
