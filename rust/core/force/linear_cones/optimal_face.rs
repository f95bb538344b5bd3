//! The face of optimal solutions: which extreme forces the contacts may use once the multipliers are known.
//!
//! By complementary slackness any optimal multipliers tell all optimal forces. With `h_i = max_h w_ih . z_b`,
//! a contact with `h_i > 0` presses at the maximum (saturated) by the extreme forces that attain `h_i`; one
//! with `h_i = 0` may press up to the maximum (free); one with `h_i < 0` does not press at all. The
//! tie-break's multipliers thin this out in the same way.

use nalgebra::SVector;

use crate::force::linear_cones::cone_interior::Interior;
use crate::force::simplex::columns::ImplicitColumns;
use crate::force::simplex::pricing::{Objective, UNUSED, tied_cost};
use crate::force::simplex::primal::Simplex;
use crate::tolerances::{NEARLY_TIED, NEARLY_TIED_GAIN, ROUNDED_GAIN, ROUNDED_TIE, UNUSED_LEVEL};

/// How hard a contact presses in every optimal solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ContactStatus {
    /// Not at all, or no harder than its lower bound.
    Idle,
    /// As hard as any, or less.
    Free,
    /// As hard as any contact.
    Saturated,
}

/// Statuses of the contacts and the extreme forces they may use, counted over all contacts.
#[derive(Debug, Clone)]
pub(crate) struct OptimalFace {
    pub(crate) statuses: Vec<ContactStatus>,
    /// Whether a contact's edges are coordinates of forces anywhere inside its cone.
    pub(crate) inside: Vec<bool>,
    edges: Vec<u32>,
    starts: Vec<usize>,
    /// Whether the objective knows a maximum that a free contact must not exceed.
    pub(crate) limited: bool,
    /// Whether more than rounding, but less than the third level may lose, keeps a force off the face.
    pub(crate) nearly_tied: bool,
}

impl OptimalFace {
    pub(crate) fn with_capacity(contacts: usize, edges: usize) -> Self {
        Self {
            statuses: Vec::with_capacity(contacts),
            inside: Vec::with_capacity(contacts),
            edges: Vec::with_capacity(edges),
            starts: Vec::with_capacity(contacts + 1),
            limited: true,
            nearly_tied: false,
        }
    }

    /// The extreme forces that contact `i` may use.
    pub(crate) fn edges(&self, contact: usize) -> &[u32] {
        &self.edges[self.starts[contact]..self.starts[contact + 1]]
    }

    /// All of these, contact by contact.
    pub(crate) fn all_edges(&self) -> impl Iterator<Item = (usize, u32)> {
        (0..self.statuses.len()).flat_map(|i| self.edges(i).iter().map(move |&edge| (i, edge)))
    }

    pub(crate) fn clear(&mut self, objective: Objective) {
        self.limited = objective != Objective::Sum;
        self.nearly_tied = false;
        self.statuses.clear();
        self.inside.clear();
        self.edges.clear();
        self.starts.clear();
        self.starts.push(0);
    }

    /// Reads the face off an optimal simplex state.
    pub(crate) fn read<const R: usize>(
        &mut self,
        columns: &ImplicitColumns<R>,
        simplex: &Simplex<R>,
        interiors: &[Option<Interior>],
    ) {
        self.clear(columns.objective);
        let used = UNUSED_LEVEL * simplex.levels.lp_norm(1);
        for (contact, interior) in interiors.iter().enumerate() {
            let status = self.read_contact(columns, &simplex.multipliers, contact);
            let start = self.starts[contact];
            let active = self.edges.len() - start;
            // The solution at hand lies on the face whatever rounding says of its reduced costs.
            let (mut every, mut any) = (true, false);
            for row in (0..R).filter(|&row| simplex.levels[row] > used && !simplex.basis.artificial[row]) {
                let edge = simplex.basis.edges(row)[contact];
                every &= edge != UNUSED;
                any |= edge != UNUSED;
                if edge != UNUSED {
                    self.push_edge(edge);
                }
            }
            let status = match status {
                ContactStatus::Saturated if !every => ContactStatus::Free,
                ContactStatus::Idle if any => ContactStatus::Free,
                status => status,
            };
            if status == ContactStatus::Idle {
                self.edges.truncate(start);
            }
            self.end_contact(status, active, interior.as_ref());
        }
    }

    /// Adds extreme forces of the contact at hand, of which none is there yet, and returns how many.
    pub(crate) fn extend_edges(&mut self, edges: impl Iterator<Item = u32>) -> usize {
        let before = self.edges.len();
        self.edges.extend(edges);
        self.edges.len() - before
    }

    /// Adds an extreme force of the contact at hand, unless it is there already.
    pub(crate) fn push_edge(&mut self, edge: u32) {
        let start = self.starts.last().copied().unwrap_or(0);
        if !self.edges[start..].contains(&edge) {
            self.edges.push(edge);
        }
    }

    /// Ends the contact at hand, of whose edges so many are active by the multipliers. Where all are, a few of them
    /// serve as coordinates.
    pub(crate) fn end_contact(&mut self, status: ContactStatus, active: usize, interior: Option<&Interior>) {
        let start = self.starts.last().copied().unwrap_or(0);
        let count = self.edges.len() - start;
        let interior = interior.filter(|interior| interior.holds(active.min(count), count));
        if let Some(interior) = interior {
            self.edges.truncate(start);
            self.edges.extend(&interior.edges);
        }
        self.edges[start..].sort_unstable();
        self.inside.push(interior.is_some());
        self.statuses.push(status);
        self.starts.push(self.edges.len());
    }

    /// The extreme forces and statuses of one basis, ties left aside: a face of this one where rounding forbids
    /// to tell more.
    pub(crate) fn read_basis<const R: usize>(&mut self, columns: &ImplicitColumns<R>, simplex: &Simplex<R>) {
        self.clear(columns.objective);
        self.inside.resize(columns.contacts.len(), false);
        for contact in 0..columns.contacts.len() {
            let start = self.edges.len();
            let mut every = true;
            for row in (0..R).filter(|&row| !simplex.basis.artificial[row]) {
                let edge = simplex.basis.edges(row)[contact];
                every &= edge != UNUSED;
                if edge != UNUSED && !self.edges[start..].contains(&edge) {
                    self.edges.push(edge);
                }
            }
            let used = self.edges.len() > start;
            self.statuses.push(match (used, every && self.limited) {
                (false, _) => ContactStatus::Idle,
                (true, true) => ContactStatus::Saturated,
                (true, false) => ContactStatus::Free,
            });
            self.starts.push(self.edges.len());
        }
    }

    /// Appends a contact's edges and tells its status.
    fn read_contact<const R: usize>(
        &mut self,
        columns: &ImplicitColumns<R>,
        z: &[SVector<f64, R>; 2],
        contact: usize,
    ) -> ContactStatus {
        let tolerance = 2.0 * tied_cost(&z[0]);
        let support = &columns.contacts[contact];
        let (best, edge) = support.furthest(&z[0]);
        let threshold = if columns.objective == Objective::Sum { 1.0 } else { columns.objective.weight() };
        let near = ROUNDED_TIE * z[0].lp_norm(1)..NEARLY_TIED * columns.objective.unit();
        self.nearly_tied |= near.contains(&(best - threshold).abs());
        if best < threshold - tolerance {
            return ContactStatus::Idle;
        }
        let start = self.edges.len();
        for edge in support.range() {
            let cost = best - support.wrench(&z[0], edge).dot(&z[0]);
            self.nearly_tied |= near.contains(&cost);
            if cost <= tolerance {
                self.edges.push(edge as u32);
            }
        }
        if self.edges.len() == start {
            self.edges.push(edge as u32);
        }
        let saturated = self.limited && best > threshold + tolerance;
        let status = if saturated { ContactStatus::Saturated } else { ContactStatus::Free };
        if columns.objective != Objective::MaxThenSum {
            return status;
        }
        let tolerance = 10.0 * tied_cost(&z[1]);
        let gain = |edge: u32| columns.wrench(contact, edge).dot(&z[1]) - 1.0;
        let best = self.edges[start..].iter().map(|&edge| gain(edge)).fold(f64::NEG_INFINITY, f64::max);
        let near = ROUNDED_GAIN * z[1].lp_norm(1)..NEARLY_TIED_GAIN;
        self.nearly_tied |= near.contains(&best.abs())
            || self.edges[start..].iter().any(|&edge| near.contains(&(best - gain(edge))));
        let mut kept = start;
        for at in start..self.edges.len() {
            if gain(self.edges[at]) >= best - tolerance {
                self.edges.swap(kept, at);
                kept += 1;
            }
        }
        self.edges.truncate(kept);
        match status {
            ContactStatus::Free if best > tolerance => ContactStatus::Saturated,
            ContactStatus::Free if best < -tolerance => ContactStatus::Idle,
            status => status,
        }
    }
}
