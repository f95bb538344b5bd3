//! Coordinates in which every row of the primitive wrenches is of order one.
//!
//! Newtons and newton metres, millimetres and metres, and force limits spread over many orders make rows of
//! the grasp equation that differ by as many orders. A pivoted orthogonalisation of the wrenches gives a map
//! `T` with `|T w_ih| <= 1` in every component, whose first `rank` rows are the directions in which the grasp
//! can act at all, the strongest first. The simplex then works with one tolerance.

use nalgebra::{SMatrix, SVector};

use crate::error::{Error, Result};
use crate::force::certificate::infeasible;
use crate::force::simplex::primal::RightHandSide;
use crate::grasp::contact::Contact;
use crate::grasp::{Grasp, REPRESENTABLE};
use crate::linalg::pivoted_basis::PivotedBasis;
use crate::tolerances::{RANK_TOLERANCE, ROUNDED_TORQUE, UNBALANCED_WRENCH};

/// The map `T` between physical wrenches and equilibrated coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Equilibration<const D: usize> {
    map: SMatrix<f64, D, D>,
    /// Strengths of the rows, relative to the strongest contact.
    lengths: SVector<f64, D>,
    units: SVector<f64, D>,
    /// Rows beyond this are zero for every wrench the grasp can exert.
    pub(crate) rank: usize,
}

/// A wrench in equilibrated coordinates: `T b = scale * target`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reachable<const D: usize> {
    pub(crate) target: RightHandSide<D>,
    pub(crate) scale: f64,
}

impl<const D: usize> Equilibration<D> {
    /// Equilibrates the wrenches that span what the grasp can exert.
    pub(crate) fn new(grasp: &Grasp<D>, wrenches: &[SVector<f64, D>]) -> Self {
        let units = units(grasp);
        let wrenches = wrenches.iter().map(|w| w.component_mul(&units)).collect();
        let basis = PivotedBasis::new(wrenches, RANK_TOLERANCE);
        Self { map: basis.map(&units), lengths: basis.lengths, units, rank: basis.rank }
    }

    /// `T w` of a wrench that the grasp can exert.
    pub(crate) fn wrench(&self, wrench: &SVector<f64, D>) -> SVector<f64, D> {
        let mut mapped = self.map * wrench;
        mapped.rows_range_mut(self.rank..).fill(0.0);
        mapped
    }

    /// `b` in equilibrated coordinates; an error if the grasp cannot act on it at all.
    pub(crate) fn reachable(&self, b: &SVector<f64, D>) -> Result<Reachable<D>> {
        let rank = self.rank;
        let largest = b.amax();
        if !(largest > 0.0 && b.iter().all(|x| x.is_finite())) {
            return Err(Error::input("external_wrench", format!("{:?} has no direction", b.as_slice())));
        }
        if !REPRESENTABLE.contains(&largest) {
            let reason =
                format!("its largest component, {largest:e}, lies outside 1e-140 to 1e140; check the units");
            return Err(Error::input("external_wrench", reason));
        }
        // Scaled first, so that one tolerance has one meaning.
        let mapped = self.map * (b / largest);
        let unscaled = mapped.component_mul(&self.lengths).norm();
        let mut wrench = mapped;
        if let Some(k) = (rank..D).max_by(|&a, &b| mapped[a].abs().total_cmp(&mapped[b].abs())) {
            if mapped[k].abs() > UNBALANCED_WRENCH * unscaled {
                let mut z = SVector::zeros();
                z[k] = mapped[k].signum();
                return Err(self.infeasible(&z));
            }
            wrench.rows_range_mut(rank..).fill(0.0);
        }
        let size = wrench.amax();
        // Rounding in the wrench grows where a weak direction was strengthened, and only there.
        let rounding = 4.0 * f64::EPSILON * unscaled / size;
        let tolerance = self.lengths.map(|length| UNBALANCED_WRENCH + rounding / length);
        Ok(Reachable {
            target: RightHandSide { wrench: wrench / size, rank, tolerance },
            scale: largest * size,
        })
    }

    /// The error for a wrench that this multiplier separates from all the grasp can balance.
    pub(crate) fn infeasible(&self, multiplier: &SVector<f64, D>) -> Error {
        infeasible(&self.dual(multiplier))
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
pub(crate) fn units<const D: usize>(grasp: &Grasp<D>) -> SVector<f64, D> {
    let planar = D == 3;
    // In space the arm stands in the map twice, once for each direction across it.
    let (split, times) = if planar { (2, 1.0) } else { (3, 2.0_f64.sqrt()) };
    let (mut force, mut torque, mut bound) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (i, (contact, map)) in grasp.contacts().iter().zip(grasp.maps()).enumerate() {
        let lever = map.fixed_columns::<3>(0).rows_range(split..).norm() / times;
        let (strength, torsion, exerted) = if let Some(range) = grasp.edges(i) {
            grasp.finite_forces()[range].iter().fold((0.0_f64, 0.0_f64, 0.0_f64), |(f, t, w), s| {
                let exerted = (map * s).rows_range(split..).norm();
                (f.max(s.fixed_rows::<3>(0).norm()), t.max(s[3].abs()), w.max(exerted))
            })
        } else {
            let limit = contact.max_normal_force;
            let (strength, torsion) = (limit * contact.friction.hypot(1.0), limit * contact.torsion);
            (strength, torsion, strength * lever + torsion)
        };
        force = force.max(strength);
        let most = strength * lever + torsion;
        bound = bound.max(most);
        // A normal through the origin exerts nothing, or rounding of nothing, however far the contact is.
        if exerted > ROUNDED_TORQUE * most {
            torque = torque.max(most);
        }
    }
    if torque == 0.0 {
        torque = bound;
    }
    // What is nearly nothing has no reciprocal.
    let reciprocal = |x: f64| if REPRESENTABLE.contains(&x) { 1.0 / x } else { 1.0 };
    let (force, torque) = (reciprocal(force), reciprocal(torque));
    SVector::from_fn(|row, _| if row < split { force } else { torque })
}

/// The largest force that a lower bound of a normalised normal force asks for, in these [`units`]; zero without.
pub(crate) fn held_force<const D: usize>(grasp: &Grasp<D>, units: &SVector<f64, D>, bounds: &[f64]) -> f64 {
    let force =
        |(bound, contact): (&f64, &Contact)| bound * contact.max_normal_force * contact.friction.hypot(1.0);
    units[0] * bounds.iter().zip(grasp.contacts()).map(force).fold(0.0, f64::max)
}
