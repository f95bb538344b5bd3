//! Numbers that the field optimises in place of the quality, each with its gradient.
//!
//! | file | number | from |
//! |---|---|---|
//! | [`min_weight`] | the largest least weight of primitive wrenches that sum to zero | `FRoGGeR` |
//! | [`force_closure`] | the norm of the wrench of unit normal forces | Liu et al. 2021 |
//! | [`span_residual`] | the least wrench of forces whose edges all take part | `GraspQP` |
//!
//! [`batch`] computes them for many grasps.

pub(crate) mod batch;
mod force_closure;
mod min_weight;
mod span_residual;

use nalgebra::{SVector, Vector3};

use crate::error::{Error, Result};
use crate::force::equilibration::units;
use crate::grasp::contact::ContactForce;
use crate::grasp::derivative::ForceDerivative;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{Grasp, Wrench};
use crate::tolerances::INDEPENDENT_SHIFT;

/// Which number stands in for the quality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Surrogate {
    /// The largest `min_j alpha_j` with `sum_j alpha_j w_j = 0` and `sum_j alpha_j = 1` over all primitive wrenches:
    /// positive for force closure, zero on its boundary, negative without.
    MinWeight,
    /// `|sum_i G_i n_i|`, the norm of the wrench of unit normal forces.
    ForceClosure,
    /// The least `|sum_j x_j w_j|` over `1 <= x_j <= limit`.
    SpanResidual {
        /// The largest coefficient, at least 1.
        limit: f64,
    },
}

/// A surrogate of one grasp.
#[derive(Debug, Clone, PartialEq)]
pub struct SurrogateValue {
    /// The number.
    pub value: f64,
    /// Of each contact: change by m of displacement (planar: the z component is zero).
    pub positions: Vec<Vector3<f64>>,
    /// Of each contact: change by rad that its normal turns; orthogonal to the normal.
    pub normals: Vec<Vector3<f64>>,
    /// Of each contact: change by rad that its frame spins about its normal.
    pub spins: Vec<f64>,
    /// Whether these are derivatives, as far as rounding can tell. Else the number has a kink.
    pub unique: bool,
}

impl Surrogate {
    /// Refuses a limit that leaves no coefficients.
    pub fn check(&self) -> Result<()> {
        match self {
            Self::SpanResidual { limit } if !(1.0..=LARGEST_LIMIT).contains(limit) => Err(Error::input(
                "limit",
                format!("{limit} must be at least 1, and at most {LARGEST_LIMIT:e}"),
            )),
            _ => Ok(()),
        }
    }

    /// The number of a grasp, and its gradient.
    ///
    /// ```
    /// use graspforce::{Contact, Grasp, Surrogate};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)]
    ///     .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)));
    /// let grasp = Grasp::<3>::new(&fingers)?;
    /// // Four primitive wrenches of equal weight sum to zero; so do the two normals.
    /// assert!((Surrogate::MinWeight.of(&grasp)?.value - 0.25).abs() < 1e-12);
    /// assert_eq!(Surrogate::ForceClosure.of(&grasp)?.value, 0.0);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn of<const D: usize>(&self, grasp: &Grasp<D>) -> Result<SurrogateValue> {
        self.check()?;
        match self {
            Self::MinWeight => min_weight::min_weight(grasp),
            Self::ForceClosure => Ok(force_closure::force_closure(grasp)),
            Self::SpanResidual { limit } => span_residual::span_residual(grasp, *limit),
        }
    }
}

/// Beyond it a coefficient is no longer limited.
const LARGEST_LIMIT: f64 = 1e9;

/// A value that changes as `z . sum_i G_i f_i` does.
fn with_gradient<const D: usize>(
    grasp: &Grasp<D>,
    value: f64,
    (z, forces): (&Wrench<D>, &[ContactForce]),
    unique: bool,
) -> SurrogateValue {
    let changes = || forces.iter().enumerate().map(|(i, force)| ForceDerivative::of(grasp, i, force, z));
    SurrogateValue {
        value,
        positions: changes().map(|change| change.position).collect(),
        normals: changes().map(|change| change.normal).collect(),
        spins: changes().map(|change| change.spin).collect(),
        unique,
    }
}

/// The norm of the wrench of these forces, with the gradient of that norm.
fn norm_of_forces<const D: usize>(grasp: &Grasp<D>, forces: &[ContactForce], unique: bool) -> SurrogateValue {
    let metric = Metric::from_length_scale(grasp.options().length_scale);
    let wrench: Wrench<D> = grasp.maps().iter().zip(forces).map(|(map, force)| map * force).sum();
    let euclidean = metric.to_euclidean(&wrench);
    let norm = euclidean.norm();
    let z = if norm > 0.0 { metric.functional(&(euclidean / norm)) } else { Wrench::zeros() };
    with_gradient(grasp, norm, (&z, forces), unique && norm > 0.0)
}

/// Whether forces that differ by multiples of these edges alone exert different wrenches. Within a contact edges may depend
/// on each other.
fn determine_forces<const D: usize>(grasp: &Grasp<D>, is_open: impl Fn(usize) -> bool) -> bool {
    let units = units(grasp);
    let mut exerted: Vec<Wrench<D>> = Vec::with_capacity(D);
    (0..grasp.num_contacts()).all(|i| {
        let mut forces: Vec<ContactForce> = Vec::with_capacity(4);
        let open = grasp.edges(i).into_iter().flatten().filter(|edge| is_open(*edge));
        for edge in open {
            admit(&mut forces, &grasp.finite_forces()[edge]);
        }
        forces.iter().all(|force| admit(&mut exerted, &(grasp.maps()[i] * force).component_mul(&units)))
    })
}

/// Adds what of a vector is orthogonal to an orthonormal basis; false where that is nothing.
fn admit<const R: usize>(basis: &mut Vec<SVector<f64, R>>, vector: &SVector<f64, R>) -> bool {
    let rest = basis.iter().fold(*vector, |rest, other| rest - other * other.dot(&rest));
    let independent = rest.norm() > INDEPENDENT_SHIFT * vector.norm();
    if independent {
        basis.push(rest / rest.norm());
    }
    independent
}
