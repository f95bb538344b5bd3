//! Contact forces and their certificate: they balance the wrench (Eq. 11), keep their lower bounds, and attain the
//! objective that a multiplier proves least (Eq. 26).

use crate::error::{Error, Result, Unmet};
use crate::force::simplex::pricing::Objective;
use crate::grasp::contact::ContactForce;
use crate::grasp::{ContactMap, REPRESENTABLE, Wrench, unit};
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::{
    DOUBTFUL_GAP, FEASIBILITY_TOLERANCE, IMMENSE_ARM, ROUNDED_GAP, ROUNDED_TERMS, ROUNDED_TORQUE,
};

/// Forces and normalised normal forces of an answer, written in place.
#[derive(Debug)]
pub(crate) struct ContactForces {
    pub(crate) forces: Vec<ContactForce>,
    pub(crate) shares: Vec<f64>,
    /// Whether the forces were the only optimal ones.
    pub(crate) unique: bool,
    /// The relative gap of the last answer.
    pub(crate) gap: f64,
}

impl Clone for ContactForces {
    fn clone(&self) -> Self {
        let Self { unique, gap, .. } = *self;
        Self { forces: self.forces.clone(), shares: self.shares.clone(), unique, gap }
    }

    /// Allocates nothing where there are as many contacts.
    fn clone_from(&mut self, other: &Self) {
        self.forces.clone_from(&other.forces);
        self.shares.clone_from(&other.shares);
        (self.unique, self.gap) = (other.unique, other.gap);
    }
}

/// The multipliers and what they prove of the forces.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Certificate<const D: usize> {
    pub(crate) sigma: f64,
    pub(crate) dual: Wrench<D>,
    pub(crate) gap: f64,
    pub(crate) pivots: usize,
    /// Whether the interior-point solver had to give the answer.
    pub(crate) fell_back: bool,
}

/// The right-hand side `b = -w_ext` and all that forces have to keep.
#[derive(Debug)]
pub(crate) struct Requirements<'a, const D: usize> {
    pub(crate) b: &'a Wrench<D>,
    pub(crate) maps: &'a [ContactMap<D>],
    /// Reciprocals of the largest force and torque of one contact.
    pub(crate) units: &'a Wrench<D>,
    /// Lower bounds of the normalised normal forces; none where empty.
    pub(crate) least: &'a [f64],
    /// The largest force that they ask for, in units.
    pub(crate) held: f64,
    pub(crate) objective: Objective,
    /// Largest relative gap.
    pub(crate) tolerance: f64,
}

impl ContactForces {
    pub(crate) fn new(contacts: usize) -> Self {
        let forces = vec![ContactForce::zeros(); contacts];
        Self { forces, shares: vec![0.0; contacts], unique: false, gap: 0.0 }
    }

    pub(crate) fn clear(&mut self) {
        self.forces.fill(ContactForce::zeros());
        self.shares.fill(0.0);
    }

    pub(crate) fn totals(&self) -> (f64, f64) {
        self.shares.iter().fold((0.0, 0.0), |(largest, sum), n| (f64::max(largest, *n), sum + n))
    }

    /// Certifies the forces by a multiplier that proves `bound` for `b`, or says how far they are from an answer.
    pub(crate) fn certify<const D: usize>(
        &self,
        required: &Requirements<'_, D>,
        (dual, bound): (Wrench<D>, f64),
        solver: &'static str,
        pivots: usize,
    ) -> Result<Certificate<D>> {
        let (largest, sum) = self.totals();
        let sigma = required.objective.value(largest, sum);
        check_size(sigma)?;
        // The bound is that of the wrench which the forces balance: no other says anything of these forces.
        let contacts = required.maps.iter().zip(self.forces.iter().copied());
        let rest = residual(required.b, contacts.clone());
        let gap = (1.0 - (bound + dual.dot(&rest)) / sigma).abs();
        let short = required.least.iter().zip(&self.shares).map(|(least, n)| least - n).fold(0.0, f64::max);
        let missing = imbalance(required.b, required.units, required.held, contacts);
        let allowed = FEASIBILITY_TOLERANCE;
        let unmet = if missing > allowed {
            Unmet::Balance { found: missing, allowed }
        } else if short > allowed * largest {
            Unmet::LeastNormal { found: short / largest, allowed }
        } else if gap <= required.tolerance {
            return Ok(Certificate { sigma, dual, gap, pivots, fell_back: false });
        } else {
            Unmet::Gap { found: gap, allowed: required.tolerance }
        };
        Err(Error::NotConverged { solver, iterations: pivots, unmet })
    }
}

/// The error that no forces balance a wrench, with a direction of any length as its witness.
pub(crate) fn infeasible<const D: usize>(direction: &Wrench<D>) -> Error {
    Error::InfeasibleWrench { direction: unit(direction).as_slice().to_vec(), lower_bounds: false }
}

/// Refuses forces whose objective is too large or too small to compute with.
pub(crate) fn check_size(sigma: f64) -> Result<()> {
    if sigma > 0.0 && !REPRESENTABLE.contains(&sigma) {
        let reason =
            format!("forces of {sigma:e} times their limits lie outside 1e-140 to 1e140; check the units");
        return Err(Error::input("external_wrench", reason));
    }
    Ok(())
}

/// The gap that counts as solved: multipliers of this size, beside an objective of one, cannot be written down any
/// better. Where that is more than rounding, 32 digits decide.
pub(crate) fn loosened(tolerance: f64, size: f64) -> f64 {
    tolerance.max((ROUNDED_GAP * size).min(DOUBTFUL_GAP))
}

/// How far contact forces are from balancing `b`: forces and torques each for itself, relative to what they add up from,
/// whatever cancels, and together relative to the wrench; infinite for NaN. A contact far away must not hide torques
/// that the others lack, and where no torque takes part, its rounding is not compared with itself.
///
/// `units` make forces and torques comparable; `held` is the largest force that contacts must press with, in
/// these units.
pub(crate) fn imbalance<'a, const D: usize>(
    b: &Wrench<D>,
    units: &Wrench<D>,
    held: f64,
    contacts: impl Iterator<Item = (&'a ContactMap<D>, ContactForce)> + Clone,
) -> f64 {
    let split = if D == 3 { 2 } else { 3 };
    let parts = |w: &Wrench<D>| [w.rows_range(..split).amax(), w.rows_range(split..).amax()];
    let mut rest = *b;
    let [mut force, mut torque] = parts(b);
    let mut longest = 0.0_f64;
    for (map, f) in contacts.clone() {
        rest -= map * f;
        let push = f.fixed_rows::<3>(0).amax();
        // Through the origin every force has an arm of rounding.
        let arm = map.fixed_columns::<3>(0).rows_range(split..).amax().max(REPRESENTABLE.start);
        longest = longest.max(arm);
        force += push;
        torque += push * arm + f[3].abs();
    }
    if !rest.iter().all(|x| x.is_finite()) {
        return f64::INFINITY;
    }
    let share = |left: f64, terms: f64| if left > 0.0 { left / terms } else { 0.0 };
    // Where all normals meet in the origin the arm is that of torsion. Beside arms that are no rounding an immense one
    // would hide torques.
    let torsion = units[0] / units[split];
    if torsion <= IMMENSE_ARM * longest || longest <= REPRESENTABLE.start {
        longest = longest.max(torsion);
    }
    let [force_left, torque_left] = parts(&rest);
    let size = b.component_mul(units).amax().max(held);
    let rounded = torque_left <= ROUNDED_TORQUE * force * longest;
    let torque_share = if rounded { 0.0 } else { share(torque_left, torque) };
    let mut left = rest.component_mul(units).lp_norm(1);
    if left + ROUNDED_TERMS * (force * units[0] + torque * units[split]) > FEASIBILITY_TOLERANCE * size {
        left = exact_rest(b, contacts).component_mul(units).lp_norm(1);
    }
    share(force_left, force).max(torque_share).max(share(left, size))
}

/// What forces leave of `b`, with the sign of the external wrench: `sum_i G_i f_i - b`.
pub(crate) fn residual<'a, const D: usize>(
    b: &Wrench<D>,
    contacts: impl Iterator<Item = (&'a ContactMap<D>, ContactForce)>,
) -> Wrench<D> {
    contacts.fold(-b, |rest, (map, force)| rest + map * force)
}

/// What forces leave of `b`, free of rounding.
pub(crate) fn exact_rest<'a, const D: usize>(
    b: &Wrench<D>,
    contacts: impl Iterator<Item = (&'a ContactMap<D>, ContactForce)>,
) -> Wrench<D> {
    let mut rest = [DoubleDouble::ZERO; 6];
    rest.iter_mut().zip(b.iter()).for_each(|(rest, b)| *rest = DoubleDouble::from(*b));
    for (map, force) in contacts {
        for (column, f) in map.column_iter().zip(force.iter()) {
            rest.iter_mut()
                .zip(column.iter())
                .for_each(|(rest, x)| *rest -= DoubleDouble::from(*x).times(*f));
        }
    }
    Wrench::<D>::from_fn(|row, _| rest[row].value())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::grasp::Grasp;
    use crate::grasp::contact::Contact;

    #[test]
    fn a_contact_far_away_hides_no_torque_that_others_lack() {
        let contact = |x: f64| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(-x.signum(), 0.0, 0.0));
        let grasp = Grasp::<3>::new(&[contact(-1.0), contact(1.0), contact(1e10)]).unwrap();
        let forces = [1.0, 1.0, 0.0].map(|n| ContactForce::new(n, 0.0, 0.5 * n, 0.0));
        let units = crate::force::equilibration::units(&grasp);
        let missing = |b| imbalance(&b, &units, 0.0, grasp.maps().iter().zip(forces));
        let balanced: Wrench<3> = grasp.maps().iter().zip(&forces).map(|(map, f)| map * f).sum();
        assert!(missing(balanced) < 1e-15);
        assert!(missing(balanced + Wrench::<3>::new(0.0, 0.0, 0.1)) > 0.01);
        assert!(missing(balanced * f64::NAN).is_infinite());
    }
}
