//! The program of Eqs. 24 and 26 in 32 digits (pairs of doubles), where doubles cannot decide.
//!
//! The forces are exactly optimal for the wrench that they balance. That wrench differs from the given one by no more
//! than the feasibility tolerance. Otherwise a witness separates the given wrench by more than the tolerance.
//!
//! - [`simplex`]: the simplex method with a price on imbalance; [`columns`]: its columns; [`solution`]: what a basis says.
//! - [`tolerated`]: the price at which the tolerance is used up.
//! - [`choice`]: the third level.

pub(crate) mod choice;
pub(crate) mod columns;
pub(crate) mod simplex;
pub(crate) mod solution;
pub(crate) mod tolerated;

use crate::error::{Error, Result, Unmet};
use crate::force::certificate::{Certificate, ContactForces, exact_rest, infeasible};
use crate::force::double_double::choice::{Optimum, least_squares_levels};
use crate::force::double_double::columns::{DoubleDoubleColumns, ROWS, Vector};
use crate::force::double_double::simplex::{DoubleDoubleSimplex, Outcome};
use crate::force::double_double::solution::Solution;
use crate::force::equilibration::held_force;
use crate::force::simplex::pricing::Objective;
use crate::grasp::contact::ContactForce;
use crate::grasp::{ContactMap, Grasp, REPRESENTABLE, Wrench};
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::{
    CHOSEN_GAP, CHOSEN_REST, CLEAR_MARGIN, CLEAR_REACH, DOUBTFUL_GAP, FEASIBILITY_TOLERANCE,
};

const SOLVER: &str = "simplex in 32 digits";

/// Shares of the feasibility tolerance that mixtures may take: what rounding of the forces adds has to fit in.
const SHARES_OF_TOLERANCE: [f64; 5] = [0.5, 0.9, 0.99, 0.9999, 0.999_999];

/// A wrench `b`, and the same in units over its size.
struct Scaled<'a, const D: usize> {
    b: &'a Wrench<D>,
    target: &'a Vector,
    size: f64,
}

/// The program of one grasp and objective.
#[derive(Debug, Clone)]
pub(crate) struct DoubleDoubleProgram<const D: usize> {
    columns: DoubleDoubleColumns,
    components: &'static [usize],
    limits: Vec<f64>,
    maps: Vec<ContactMap<D>>,
    /// The largest lower bound of normalised normal forces; zero without.
    largest: f64,
    /// The largest force that a lower bound asks for, in units.
    held: f64,
    /// Lower bounds over the largest.
    least: Vec<f64>,
    tolerance: f64,
}

impl<const D: usize> DoubleDoubleProgram<D> {
    /// `bounds` are the lower bounds of normalised normal forces; none where empty. `units` are those of the equilibration.
    pub(crate) fn new(
        grasp: &Grasp<D>,
        units: &Wrench<D>,
        objective: Objective,
        bounds: &[f64],
        tolerance: f64,
    ) -> Self {
        let largest = bounds.iter().copied().fold(0.0, f64::max);
        let least: Vec<f64> = bounds.iter().map(|bound| bound / largest).collect();
        Self {
            columns: DoubleDoubleColumns::new(grasp, units, objective, least.clone(), tolerance),
            components: grasp.force_components(),
            limits: grasp.contacts().iter().map(|contact| contact.max_normal_force).collect(),
            maps: grasp.maps().to_vec(),
            largest,
            held: held_force(grasp, units, bounds),
            least,
            tolerance,
        }
    }

    /// Least forces for `b = -w_ext`, written in `forces`.
    pub(crate) fn solve(&self, b: &Wrench<D>, forces: &mut ContactForces) -> Result<Certificate<D>> {
        let units = &self.columns.units;
        let size = b.iter().zip(units).map(|(b, unit)| (b * unit).abs()).fold(self.held, f64::max);
        let stalled =
            |pivots| Error::NotConverged { solver: SOLVER, iterations: pivots, unmet: Unmet::Pivots };
        if !REPRESENTABLE.contains(&size) {
            return Err(stalled(0));
        }
        let mut target = [0.0; ROWS];
        target.iter_mut().zip(b.iter()).zip(units).for_each(|((t, b), unit)| *t = b * unit / size);
        if self.largest > 0.0 {
            target[D] = self.largest / size;
        }
        let mut simplex = DoubleDoubleSimplex::new(&self.columns, &target);
        match simplex.solve() {
            Outcome::Balanced => {}
            Outcome::Infeasible => {
                return Err(self.infeasible(&simplex.solution.multiplier));
            }
            Outcome::Stalled => return Err(stalled(simplex.pivots)),
        }
        let wrench = Scaled { b, target: &simplex.target.clone(), size };
        let answer = self.finish(&simplex.solution, &wrench, true, simplex.pivots, forces);
        let Err(error @ Error::NotConverged { unmet: Unmet::Balance { .. } | Unmet::Gap { .. }, .. }) =
            answer
        else {
            return answer;
        };
        // Forces so large that rounding of their products exceeds the tolerance balance nothing, and multipliers may be
        // as large. Smaller ones may come within the tolerance.
        let Some(tolerated) = simplex.tolerated() else { return Err(error) };
        let mixtures = SHARES_OF_TOLERANCE
            .into_iter()
            .filter_map(|share| tolerated.mixture(share * FEASIBILITY_TOLERANCE));
        for solution in mixtures.chain([tolerated.within.clone()]) {
            let answer = self.finish(&solution, &wrench, false, simplex.pivots, forces);
            if answer.is_ok() {
                return answer;
            }
        }
        if simplex.separates(&tolerated) {
            return Err(self.infeasible(&tolerated.within.multiplier));
        }
        Err(error)
    }

    /// The forces of a solution, with `level` the least of those that are as good, with their certificate.
    fn finish(
        &self,
        solution: &Solution,
        wrench: &Scaled<'_, D>,
        level: bool,
        pivots: usize,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        let size = wrench.size;
        Self::add_up(solution, size, forces);
        let mut balanced = *wrench.target;
        balanced.iter_mut().zip(solution.slack()).for_each(|(b, rest)| *b -= DoubleDouble::from(rest));
        let mut certificate = self.certify(&solution.multiplier, &balanced, size, forces, pivots);
        if level && let Some(better) = self.choose(solution, &balanced, size, pivots, forces) {
            certificate = better;
        }
        let not_converged = |unmet| Err(Error::NotConverged { solver: SOLVER, iterations: pivots, unmet });
        let found = self.left_over(wrench.b, forces) / size;
        if found > FEASIBILITY_TOLERANCE {
            return not_converged(Unmet::Balance { found, allowed: FEASIBILITY_TOLERANCE });
        }
        self.check_parts(wrench.b, forces, pivots)?;
        let allowed = self.tolerance.max(DOUBTFUL_GAP);
        if certificate.gap <= allowed {
            return Ok(certificate);
        }
        not_converged(Unmet::Gap { found: certificate.gap, allowed })
    }

    /// The error for a wrench that a multiplier separates from all that the contacts balance.
    fn infeasible(&self, witness: &Vector) -> Error {
        infeasible(&Wrench::<D>::from_fn(|k, _| witness[k].value() * self.columns.units[k]))
    }

    /// What the forces leave over, in units.
    fn left_over(&self, b: &Wrench<D>, forces: &ContactForces) -> f64 {
        let rest = exact_rest(b, self.maps.iter().zip(forces.forces.iter().copied()));
        rest.iter().zip(&self.columns.units).map(|(rest, unit)| (rest * unit).abs()).sum()
    }

    /// A torsion or a friction of immense size makes the unit of torques or of forces immense. What is left over must
    /// also be nothing beside the forces themselves, and beside the torques that they exert at the longest arm.
    fn check_parts(&self, b: &Wrench<D>, forces: &ContactForces, pivots: usize) -> Result<()> {
        let split = if D == 3 { 2 } else { 3 };
        let (mut rest, mut force, mut torsion, mut arm) = (*b, b.rows_range(..split).amax(), 0.0, 0.0_f64);
        for (map, f) in self.maps.iter().zip(&forces.forces) {
            rest -= map * f;
            force += f.fixed_rows::<3>(0).amax();
            torsion += f[3].abs();
            arm = arm.max(map.fixed_columns::<3>(0).rows_range(split..).norm());
        }
        let torque = force * arm + torsion + b.rows_range(split..).amax();
        let parts = [(rest.rows_range(..split).amax(), force), (rest.rows_range(split..).amax(), torque)];
        let within = |&(left, terms): &(f64, f64)| left <= 2.0 * FEASIBILITY_TOLERANCE * terms;
        let Some((left, terms)) = parts.into_iter().find(|part| !within(part)) else { return Ok(()) };
        let unmet = Unmet::Balance { found: left / terms, allowed: FEASIBILITY_TOLERANCE };
        Err(Error::NotConverged { solver: SOLVER, iterations: pivots, unmet })
    }

    /// Whether an answer in doubles leaves open what 32 digits can tell.
    pub(crate) fn must_decide<T>(&self, answer: &Result<T>, b: &Wrench<D>) -> bool {
        match answer {
            Err(Error::NotConverged { .. }) => true,
            Err(Error::InfeasibleWrench { direction, .. }) => !self.clearly_separated(direction, b),
            _ => false,
        }
    }

    /// Whether a direction that doubles computed separates `b` from all the grasp can balance, beyond any doubt.
    pub(crate) fn clearly_separated(&self, direction: &[f64], b: &Wrench<D>) -> bool {
        let units = &self.columns.units;
        let (mut z, mut largest) = ([0.0; ROWS], 0.0_f64);
        for (z, (e, unit)) in z.iter_mut().zip(direction.iter().zip(units)) {
            *z = e / unit;
            largest = largest.max(z.abs());
        }
        let size = b.iter().zip(units).map(|(b, unit)| (b * unit).abs()).fold(self.held, f64::max);
        let multiplier = z.map(|z| DoubleDouble::from(z / largest));
        let [reach, vertices] = self.columns.values(&multiplier, 0.0);
        let product: f64 =
            multiplier.iter().zip(b.iter().zip(units)).map(|(z, (b, u))| z.value() * b * u).sum();
        let margin = (product - self.largest * vertices.value()) / size;
        !self.columns.pushes(&multiplier) && reach.value() <= CLEAR_REACH && margin > CLEAR_MARGIN
    }

    fn add_up(solution: &Solution, size: f64, forces: &mut ContactForces) {
        forces.clear();
        forces.unique = false;
        for (level, share) in solution.shares() {
            let level = level * share.normal * size;
            forces.forces[share.contact] += share.force * level;
            forces.shares[share.contact] += level;
        }
    }

    /// What the multiplier proves of the forces for the wrench that they balance, both scaled. Rounded to doubles, a
    /// large multiplier would prove less.
    fn certify(
        &self,
        z: &Vector,
        balanced: &Vector,
        size: f64,
        forces: &ContactForces,
        pivots: usize,
    ) -> Certificate<D> {
        let objective = self.columns.objective();
        let mut multiplier = *z;
        multiplier[D..].fill(DoubleDouble::ZERO);
        let weight = objective.weight();
        let [rays, _] = self.columns.values(&multiplier, weight);
        // With a weight or lower bounds the bound is not homogeneous, and only what reaches too far may shrink.
        let homogeneous = weight == 0.0 && self.least.is_empty();
        let floor = if homogeneous { f64::MIN_POSITIVE } else { 1.0 };
        let shrink = DoubleDouble::ONE / rays.max(DoubleDouble::from(floor));
        let shrunk = multiplier.map(|z| z * shrink);
        let product =
            shrunk.iter().zip(balanced).take(D).fold(DoubleDouble::ZERO, |sum, (z, b)| sum + *z * *b);
        let mut bound = product.value() * size;
        if !self.least.is_empty() {
            let [_, vertices] = self.columns.values(&shrunk, weight);
            let free = if objective == Objective::Sum { self.least.iter().sum() } else { 1.0 };
            bound += self.largest * (free - vertices.value());
        }
        let (largest, sum) = forces.totals();
        let sigma = objective.value(largest, sum);
        let dual = self.valid_in_doubles(&shrunk);
        let gap = if sigma > 0.0 { (1.0 - bound / sigma).abs() } else { 0.0 };
        Certificate { sigma, dual, gap, pivots, fell_back: false }
    }

    /// The multiplier in doubles, shrunk by what it reaches beyond one since it was rounded.
    fn valid_in_doubles(&self, z: &Vector) -> Wrench<D> {
        let units = &self.columns.units;
        let rounded = Wrench::<D>::from_fn(|k, _| z[k].value() * units[k]);
        let mut again = [DoubleDouble::ZERO; ROWS];
        again.iter_mut().zip(rounded.iter().zip(units)).for_each(|(z, (dual, unit))| {
            *z = DoubleDouble::from(*dual) / DoubleDouble::from(*unit);
        });
        let [reach, _] = self.columns.values(&again, self.columns.objective().weight());
        if self.least.is_empty() { rounded / reach.value().max(1.0) } else { rounded }
    }

    /// The third level: replaces the forces by the least among those that are as good, and certifies these.
    fn choose(
        &self,
        solution: &Solution,
        balanced: &Vector,
        size: f64,
        pivots: usize,
        forces: &mut ContactForces,
    ) -> Option<Certificate<D>> {
        let z = &solution.multiplier;
        let (_, sum) = forces.totals();
        // In 32 digits: what is rounded here contradicts equations that differ by a billionth.
        let sigma_max = solution.largest_share(self.limits.len());
        let (largest, highest) = (sigma_max.value() * size, DoubleDouble::from(self.largest / size));
        let bound = |least: &f64| highest.times(*least) / sigma_max;
        let optimum = Optimum {
            balanced: &balanced.map(|b| b / sigma_max),
            multiplier: z,
            sigma_max: sigma_max.value(),
            sigma_sum: sum / size,
            least: &self.least.iter().map(bound).collect::<Vec<_>>(),
            lost: CHOSEN_GAP.min(0.5 * self.tolerance),
        };
        let levels = least_squares_levels(&self.columns, self.components, &self.limits, &optimum)?;
        let mut chosen = ContactForces::new(forces.forces.len());
        let mut rest = *balanced;
        for (contact, edge, level) in levels {
            let (wrenches, forces) = self.columns.listed(contact)?;
            for (rest, w) in rest.iter_mut().zip(&wrenches[edge]) {
                *rest -= DoubleDouble::from(*w).times(level * optimum.sigma_max);
            }
            let force: ContactForce = forces[edge];
            chosen.forces[contact] += force * (level * largest);
            chosen.shares[contact] += level * largest;
        }
        // What they balance themselves; it may not be farther from the given wrench than rounding.
        let left: f64 = rest.iter().take(D).map(|x| x.value().abs()).sum();
        if left > CHOSEN_REST || left + solution.left_over() > FEASIBILITY_TOLERANCE {
            return None;
        }
        let mut own = *balanced;
        own.iter_mut().zip(&rest).take(D).for_each(|(b, rest)| *b -= *rest);
        let certificate = self.certify(z, &own, size, &chosen, pivots);
        (certificate.gap <= self.tolerance).then(|| {
            *forces = chosen;
            certificate
        })
    }
}
