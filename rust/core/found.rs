//! Forces added up from columns, and whether they are an answer: they balance the wrench, press no less than they
//! must, and their objective is the proven one.

use crate::columns::Objective;
use crate::contact::ContactForce;
use crate::error::{Error, Result};
use crate::grasp::{ContactMap, REPRESENTABLE, Wrench};

/// How much of the wrench, or of a contact's least force, may be missing, relative to the largest that counts.
const MISSING: f64 = 1e-9;

/// Forces and normalised normal forces of an answer, written in place.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    pub(crate) forces: Vec<ContactForce>,
    pub(crate) normals: Vec<f64>,
    /// Whether the forces were the only optimal ones.
    pub(crate) unique: bool,
}

/// The multipliers and what they prove of the forces that were found.
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
pub(crate) struct Demand<'a, const D: usize> {
    pub(crate) b: &'a Wrench<D>,
    pub(crate) maps: &'a [ContactMap<D>],
    /// What makes forces and torques comparable.
    pub(crate) units: &'a Wrench<D>,
    /// Lower bounds of the normalised normal forces; none where empty.
    pub(crate) least: &'a [f64],
    pub(crate) objective: Objective,
    /// Largest relative gap.
    pub(crate) tolerance: f64,
}

impl Found {
    pub(crate) fn new(contacts: usize) -> Self {
        Self { forces: vec![ContactForce::zeros(); contacts], normals: vec![0.0; contacts], unique: false }
    }

    pub(crate) fn clear(&mut self) {
        self.forces.fill(ContactForce::zeros());
        self.normals.fill(0.0);
    }

    pub(crate) fn totals(&self) -> (f64, f64) {
        self.normals.iter().fold((0.0, 0.0), |(largest, sum), n| (f64::max(largest, *n), sum + n))
    }

    /// Certifies the forces by a multiplier that proves `bound`, or says how far they are from an answer.
    pub(crate) fn certify<const D: usize>(
        &self,
        demand: &Demand<'_, D>,
        (dual, bound): (Wrench<D>, f64),
        solver: &'static str,
        pivots: usize,
    ) -> Result<Certificate<D>> {
        let (largest, sum) = self.totals();
        let sigma = demand.objective.value(largest, sum);
        if sigma > 0.0 && !REPRESENTABLE.contains(&sigma) {
            let reason =
                format!("forces of {sigma:e} times their limits are beyond what can be computed with");
            return Err(Error::input("external_wrench", reason));
        }
        let gap = (1.0 - bound / sigma).abs();
        let short = demand.least.iter().zip(&self.normals).map(|(least, n)| least - n).fold(0.0, f64::max);
        let missing = self.unbalanced(demand).max(short / largest);
        if gap <= demand.tolerance && missing <= MISSING {
            return Ok(Certificate { sigma, dual, gap, pivots, fell_back: false });
        }
        Err(Error::NotConverged { solver, iterations: pivots, gap: gap.max(missing) })
    }

    /// How far the forces are from balance, relative to the wrench or the strongest contact; infinite for NaN.
    fn unbalanced<const D: usize>(&self, demand: &Demand<'_, D>) -> f64 {
        let mut rest = demand.b.component_mul(demand.units);
        let mut largest = rest.amax();
        for (map, force) in demand.maps.iter().zip(&self.forces) {
            let wrench = (map * force).component_mul(demand.units);
            rest -= wrench;
            largest = largest.max(wrench.amax());
        }
        let share = if largest > 0.0 { rest.amax() / largest } else { 0.0 };
        if rest.iter().all(|x| x.is_finite()) { share } else { f64::INFINITY }
    }
}
