//! The optimal face with lower bounds: by complementary slackness the multipliers tell how hard each contact presses in
//! every optimal solution, at the level of the saturated contacts, at its lower bound, or between.

use nalgebra::{DMatrix, DVector, SVector};

use crate::force::least_norm::face_program::{Balance, Chosen, FaceProgram};
use crate::force::linear_cones::optimal_face::{ContactStatus, OptimalFace};
use crate::force::preload::columns::{PreloadColumns, ROWS};
use crate::force::simplex::pricing::{Objective, tied_cost};
use crate::force::simplex::primal::Simplex;
use crate::grasp::contact::ContactForce;
use crate::tolerances::{SAME_SHARE, UNMOVED};

/// An extreme force that a solution uses, counted over all contacts, and its coefficient.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UsedEdge {
    pub(crate) contact: usize,
    pub(crate) edge: usize,
    pub(crate) level: f64,
}

/// The bounds in the simplex's units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    /// The largest lower bound.
    pub(crate) least: f64,
    /// The largest normalised normal force of the basic solution.
    pub(crate) most: f64,
}

impl<const D: usize> PreloadColumns<D> {
    /// Solves the third level at an optimal simplex state; `used` holds the basic solution and is replaced.
    /// Returns whether there was nothing to choose, or `None` where rounding prevents it.
    pub(crate) fn choose_least_norm(
        &self,
        simplex: &Simplex<ROWS>,
        bounds: Bounds,
        face: &mut OptimalFace,
        used: &mut Vec<UsedEdge>,
    ) -> Option<bool> {
        self.optimal_face(simplex, bounds, used, face);
        let z = simplex.multipliers.map(|z| self.wrench_part(&z));
        // Where no ray lowers the objective, the largest lower bound is the level.
        let held = bounds.most <= bounds.least * (1.0 + SAME_SHARE)
            && self.values(&z[0]).0 < 1.0 - tolerances(&z)[0];
        let least: Vec<f64> = self.least.iter().map(|bound| bound * bounds.least).collect();
        let program = FaceProgram {
            face,
            components: &[0, 1, 2, 3],
            interiors: &self.interiors,
            limits: &self.limits,
            least: &least,
            level: (face.limited && held).then_some(bounds.least),
        };
        let wrench = SVector::<f64, D>::from_fn(|k, _| if k < self.rank { simplex.target[k] } else { 0.0 });
        let right = DMatrix::from_column_slice(D, 1, wrench.as_slice());
        let column = |contact, edge| self.column(contact, edge);
        let chosen = program.solve(&Balance { right, at: DVector::repeat(1, 1.0) }, column)?;
        let Chosen::LeastNorm(least_norm) = chosen else { return Some(true) };
        let unique = program.freedom(&least_norm, column) <= UNMOVED;
        used.clear();
        let mut levels = least_norm.solution.iter();
        for contact in 0..self.contacts.len() {
            for (&edge, &level) in face.edges(contact).iter().zip(&mut levels) {
                let level = if face.inside[contact] { level } else { level.max(0.0) };
                used.push(UsedEdge { contact, edge: edge as usize, level });
            }
        }
        Some(unique)
    }

    /// An extreme force, counted over all contacts, and its wrench.
    fn column(&self, contact: usize, edge: u32) -> (SVector<f64, D>, ContactForce) {
        let (support, edge) = (&self.contacts[contact], edge as usize);
        let z = SVector::zeros();
        (support.wrench(&z, edge), support.force(&z, edge, &self.extreme_forces))
    }

    /// How hard the contacts press, and the edges they may use. `basic` is the basic solution.
    fn optimal_face(
        &self,
        simplex: &Simplex<ROWS>,
        bounds: Bounds,
        basic: &[UsedEdge],
        face: &mut OptimalFace,
    ) {
        let z = simplex.multipliers.map(|z| self.wrench_part(&z));
        let [first, second] = tolerances(&z);
        let threshold = if self.objective == Objective::Sum { 1.0 } else { self.objective.weight() };
        let ties = self.objective == Objective::MaxThenSum;
        face.clear(self.objective);
        for (contact, support) in self.contacts.iter().enumerate() {
            let (value, _, gain) = self.tied(contact, &z, first);
            let side = |x: f64, tolerance: f64| match x {
                x if x > tolerance => ContactStatus::Saturated,
                x if x < -tolerance => ContactStatus::Idle,
                _ => ContactStatus::Free,
            };
            let mut status = side(value - threshold, first);
            if status == ContactStatus::Free && ties {
                status = side(gain, second);
            }
            // The solution at hand lies on the face whatever rounding says of its reduced costs.
            let own = || basic.iter().filter(|used| used.contact == contact);
            let normal: f64 = own().map(|used| used.level).sum();
            let lower = self.least[contact] * bounds.least;
            let off = |bound: f64| (normal - bound).abs() > SAME_SHARE * bounds.most;
            if (status == ContactStatus::Saturated && (!face.limited || off(bounds.most)))
                || (status == ContactStatus::Idle && off(lower))
            {
                status = ContactStatus::Free;
            }
            let mut active = 0;
            if status != ContactStatus::Idle || lower > 0.0 {
                let second_best =
                    |edge: &usize| !ties || support.wrench(&z[0], *edge).dot(&z[1]) - 1.0 >= gain - second;
                let optimal = support.edges_reaching(&z[0], value - first).filter(second_best);
                active = face.extend_edges(optimal.map(|edge| edge as u32));
                for used in own().filter(|used| used.level > 0.0) {
                    face.push_edge(used.edge as u32);
                }
            }
            face.end_contact(status, active, self.interiors[contact].as_ref());
        }
    }
}

/// Reduced costs of the objective and of the tie-break that are zero but for rounding.
fn tolerances<const D: usize>(z: &[SVector<f64, D>; 2]) -> [f64; 2] {
    [2.0 * tied_cost(&z[0]), 10.0 * tied_cost(&z[1])]
}
