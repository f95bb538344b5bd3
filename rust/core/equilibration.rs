//! Coordinates in which every row of the primitive wrenches is of order one.
//!
//! Newtons and newton metres, millimetres and metres, and force limits spread over many orders make rows of
//! the grasp equation that differ by as many orders. A pivoted orthogonalisation of the wrenches gives a map
//! `T` with `|T w_ih| <= 1` in every component, whose first `rank` rows are the directions in which the grasp
//! can act at all, the strongest first. The simplex then works with one tolerance.

use nalgebra::{SMatrix, SVector};

use crate::grasp::Grasp;

/// Directions weaker than this, relative to the strongest, are rounding and not directions.
const RANK_TOLERANCE: f64 = 1e-12;

/// The map `T` between physical wrenches and equilibrated coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Equilibration<const D: usize> {
    map: SMatrix<f64, D, D>,
    lengths: SVector<f64, D>,
    units: SVector<f64, D>,
    /// Rows beyond this are zero for every wrench the grasp can exert.
    pub(crate) rank: usize,
}

impl<const D: usize> Equilibration<D> {
    /// Equilibrates the wrenches that span what the grasp can exert.
    pub(crate) fn new(grasp: &Grasp<D>, wrenches: &[SVector<f64, D>]) -> Self {
        let units = units(grasp);
        let mut rest: Vec<_> = wrenches.iter().map(|w| w.component_mul(&units)).collect();
        let mut axes = SMatrix::<f64, D, D>::zeros();
        let mut map = SMatrix::<f64, D, D>::zeros();
        let mut lengths = SVector::repeat(1.0);
        let mut rank = 0;
        while rank < D {
            let (strongest, length) = longest(&rest);
            if length <= RANK_TOLERANCE {
                break;
            }
            // The second projection removes what the first left when almost all of the wrench was cancelled.
            let mut axis = rest[strongest] / length;
            axis -= axes * axes.tr_mul(&axis);
            let axis = axis.normalize();
            axes.set_column(rank, &axis);
            lengths[rank] = length;
            map.set_row(rank, &(axis.component_mul(&units) / length).transpose());
            for wrench in &mut rest {
                *wrench -= axis * axis.dot(wrench);
            }
            rank += 1;
        }
        for k in rank..D {
            let axis = complement(&axes);
            axes.set_column(k, &axis);
            map.set_row(k, &axis.component_mul(&units).transpose());
        }
        Self { map, lengths, units, rank }
    }

    /// `T w` of a wrench that the grasp can exert.
    pub(crate) fn wrench(&self, wrench: &SVector<f64, D>) -> SVector<f64, D> {
        let mut mapped = self.map * wrench;
        mapped.rows_range_mut(self.rank..).fill(0.0);
        mapped
    }

    /// `T w` of any wrench; what the grasp cannot do at all shows beyond the rank.
    pub(crate) fn any(&self, wrench: &SVector<f64, D>) -> SVector<f64, D> {
        self.map * wrench
    }

    /// Length of a mapped wrench in plain units of force and torque, before any direction was strengthened.
    pub(crate) fn prescaled_norm(&self, mapped: &SVector<f64, D>) -> f64 {
        mapped.component_mul(&self.lengths).norm()
    }

    /// Strength of the weakest direction in which the grasp can act, relative to the strongest contact.
    pub(crate) fn weakest(&self) -> f64 {
        self.lengths.rows_range(..self.rank).min()
    }

    /// Reciprocals of the largest force and torque of one contact.
    pub(crate) fn units(&self) -> &SVector<f64, D> {
        &self.units
    }

    /// The map `T` itself.
    pub(crate) fn matrix(&self) -> &SMatrix<f64, D, D> {
        &self.map
    }

    /// The multiplier `z` with `z . w = z' . T w`.
    pub(crate) fn dual(&self, multiplier: &SVector<f64, D>) -> SVector<f64, D> {
        self.map.tr_mul(multiplier)
    }
}

/// Reciprocals of the largest force and the largest torque the contacts exert, so that their ratio is a
/// lever and not a choice of units. Taken from lengths and not from components: a component that is zero but
/// for rounding must stay that small.
fn units<const D: usize>(grasp: &Grasp<D>) -> SVector<f64, D> {
    let planar = D == 3;
    let split = if planar { 2 } else { 3 };
    let (mut force, mut torque) = (0.0_f64, 0.0_f64);
    for (i, (contact, map)) in grasp.contacts().iter().zip(grasp.maps()).enumerate() {
        let lever = map.fixed_columns::<3>(0).rows_range(split..).norm();
        let (strength, torsion) = if let Some(range) = grasp.edges(i) {
            grasp.finite_forces()[range]
                .iter()
                .fold((0.0_f64, 0.0_f64), |(f, t), s| (f.max(s.fixed_rows::<3>(0).norm()), t.max(s[3].abs())))
        } else {
            let limit = contact.max_normal_force;
            (limit * contact.friction.hypot(1.0), limit * contact.torsion)
        };
        force = force.max(strength);
        torque = torque.max(strength * lever + torsion);
    }
    let reciprocal = |x: f64| if x > 0.0 { 1.0 / x } else { 1.0 };
    let (force, torque) = (reciprocal(force), reciprocal(torque));
    SVector::from_fn(|row, _| if row < split { force } else { torque })
}

fn longest<const D: usize>(wrenches: &[SVector<f64, D>]) -> (usize, f64) {
    let lengths = wrenches.iter().map(SVector::norm).enumerate();
    lengths.fold((0, 0.0), |best, (i, length)| if length > best.1 { (i, length) } else { best })
}

/// A unit vector orthogonal to the columns set so far (the others are zero).
fn complement<const D: usize>(axes: &SMatrix<f64, D, D>) -> SVector<f64, D> {
    let mut best = SVector::zeros();
    for k in 0..D {
        let mut axis = SVector::<f64, D>::zeros();
        axis[k] = 1.0;
        axis -= axes * axes.tr_mul(&axis);
        axis -= axes * axes.tr_mul(&axis);
        if axis.norm_squared() > SVector::norm_squared(&best) {
            best = axis;
        }
    }
    best.normalize()
}
