//! Local minima of the support of true cones on the unit sphere, by Newton's method.
//!
//! At a local minimum `z` of `p`, the boundary wrench along `z` is `p(z) z`. So forces within their limits exert the
//! wrench `z` at the level `1 / p(z)`, and their multiplier is `z`, too. These are the optimality conditions of least
//! forces with the multiplier in place of a given wrench, and Newton's method for least forces solves them.

use crate::force::simplex::pricing::Objective;
use crate::force::true_cones::contact_status::{ContactStatus, StandardCone, load};
use crate::force::true_cones::newton::{MANY_CHANGES, NewtonWorkspace};
use crate::force::true_cones::optimal_point::ConeConditions;
use crate::grasp::Wrench;
use crate::quality::query::QualityQuery;
use crate::tolerances::MINIMISER_RTOL;
use crate::wrench_set::Criterion;

/// What a contact reaches or turns by is zero where it is below this part of the largest of all contacts: guesses, in turn.
const GUESSES: [f64; 3] = [2e-3, 5e-2, 1e-4];

/// The search for local minima of one grasp.
pub(crate) struct LocalMinima<'a, const D: usize> {
    query: &'a QualityQuery<'a, D>,
    conditions: ConeConditions<D>,
    newton: NewtonWorkspace<D>,
}

impl<'a, const D: usize> LocalMinima<'a, D> {
    /// `None` where a contact has listed extreme forces, or an external wrench acts. Minima are about as large as `size`.
    pub(crate) fn new(query: &'a QualityQuery<'a, D>, size: f64) -> Option<Self> {
        if query.center.is_some() {
            return None;
        }
        let contacts = query.grasp.num_contacts();
        let coordinates = |wrench: &Wrench<D>| query.metric.to_euclidean(wrench) / size;
        let cones = (0..contacts).map(|i| StandardCone::new(query.grasp, i, coordinates));
        let objective = match query.set.criterion() {
            Criterion::Max => Objective::MaxThenSum,
            Criterion::Sum => Objective::Sum,
        };
        let conditions = ConeConditions::new(cones.collect::<Option<_>>()?, objective);
        Some(Self { query, conditions, newton: NewtonWorkspace::new(contacts) })
    }

    /// A local minimum near the unit `z` and its support; `None` where the search fails, or others beside it are as low.
    pub(crate) fn near(&mut self, z: &Wrench<D>) -> Option<(f64, Wrench<D>)> {
        GUESSES.iter().find_map(|guess| {
            self.start(z, *guess);
            let found = self.newton.local_minimum(&self.conditions, MANY_CHANGES)?.try_normalize(0.0)?;
            let value = self.query.value(&found);
            // Forces at a saddle, or those of another sign, satisfy the conditions as well.
            (value <= self.query.value(z) * (1.0 + MINIMISER_RTOL)).then_some((value, found))
        })
    }

    /// Starts from the statuses that the multiplier suggests, without forces.
    fn start(&mut self, z: &Wrench<D>, guess: f64) {
        let Self { conditions, newton, .. } = self;
        newton.restart();
        let point = &mut newton.point;
        let mut reach = 0.0_f64;
        for (cone, at) in conditions.cones.iter().zip(&mut point.contacts) {
            at.v = cone.conjugate(z);
            at.x.fill(0.0);
            at.guessed = false;
            let value = at.v[0] + load(&at.v);
            reach = if conditions.bounded { reach + value.max(0.0) } else { reach.max(value) };
        }
        point.z = z / reach;
        point.level = point.z.norm_squared();
        let largest = point.contacts.iter().map(|at| at.v.amax()).fold(0.0, f64::max);
        for (cone, at) in conditions.cones.iter().zip(&mut point.contacts) {
            let excess = at.v[0] + load(&at.v) - conditions.price * reach;
            let sticks = cone.dim > 1 && load(&at.v) <= guess * largest;
            let full = conditions.bounded && excess > guess * largest;
            at.status = match (full, sticks) {
                _ if excess < -guess * largest => ContactStatus::Idle,
                (false, false) => ContactStatus::Sliding,
                (false, true) => ContactStatus::Sticking,
                (true, false) => ContactStatus::FullSliding,
                (true, true) => ContactStatus::FullSticking,
            };
        }
    }
}
