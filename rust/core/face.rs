//! The face of optimal solutions: which extreme forces the contacts may use once the multipliers are known.
//!
//! By complementary slackness any optimal multipliers tell all optimal forces. With `h_i = max_h w_ih . z_b`,
//! a contact with `h_i > 0` presses at the maximum (saturated) by the extreme forces that attain `h_i`; one
//! with `h_i = 0` may press up to the maximum (free); one with `h_i < 0` does not press at all. The
//! tie-break's multipliers thin this out in the same way.

use nalgebra::SVector;

use crate::columns::{ImplicitColumns, Objective, UNUSED};
use crate::interior::Interior;
use crate::simplex::{Simplex, TIE};

/// Levels below this share of their sum do not count as used.
const UNUSED_LEVEL: f64 = 1e-11;

/// How hard a contact presses in every optimal solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Not at all.
    Idle,
    /// As hard as any, or less.
    Free,
    /// As hard as any contact.
    Saturated,
}

/// Roles of the contacts and the extreme forces they may use, counted over all contacts.
#[derive(Debug, Clone)]
pub(crate) struct Face {
    pub(crate) roles: Vec<Role>,
    /// Whether a contact's edges are coordinates of forces anywhere inside its cone.
    pub(crate) inside: Vec<bool>,
    edges: Vec<u32>,
    starts: Vec<usize>,
    /// Whether the objective knows a maximum that a free contact must not exceed.
    pub(crate) limited: bool,
}

impl Face {
    pub(crate) fn with_capacity(contacts: usize, edges: usize) -> Self {
        Self {
            roles: Vec::with_capacity(contacts),
            inside: Vec::with_capacity(contacts),
            edges: Vec::with_capacity(edges),
            starts: Vec::with_capacity(contacts + 1),
            limited: true,
        }
    }

    /// The extreme forces that contact `i` may use.
    pub(crate) fn edges(&self, contact: usize) -> &[u32] {
        &self.edges[self.starts[contact]..self.starts[contact + 1]]
    }

    fn clear(&mut self, objective: Objective) {
        self.limited = objective != Objective::Sum;
        self.roles.clear();
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
            let role = self.read_contact(columns, &simplex.multipliers, contact);
            let start = self.starts[contact];
            // The solution at hand lies on the face whatever rounding says of its reduced costs.
            let (mut every, mut any) = (true, false);
            for row in (0..R).filter(|&row| simplex.levels[row] > used && !simplex.basis.artificial[row]) {
                let edge = simplex.basis.edges(row)[contact];
                every &= edge != UNUSED;
                any |= edge != UNUSED;
                if edge != UNUSED && !self.edges[start..].contains(&edge) {
                    self.edges.push(edge);
                }
            }
            let role = match role {
                Role::Saturated if !every => Role::Free,
                Role::Idle if any => Role::Free,
                role => role,
            };
            if role == Role::Idle {
                self.edges.truncate(start);
            }
            self.edges[start..].sort_unstable();
            let interior = interior.as_ref().filter(|_| self.edges.len() > start + 3);
            if let Some(interior) = interior {
                self.edges.truncate(start);
                self.edges.extend(interior.edges);
            }
            self.inside.push(interior.is_some());
            self.roles.push(role);
            self.starts.push(self.edges.len());
        }
    }

    /// The extreme forces and roles of one basis, ties left aside: a face of this one where rounding forbids
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
            self.roles.push(match (used, every && self.limited) {
                (false, _) => Role::Idle,
                (true, true) => Role::Saturated,
                (true, false) => Role::Free,
            });
            self.starts.push(self.edges.len());
        }
    }

    /// Appends a contact's edges and tells its role.
    fn read_contact<const R: usize>(
        &mut self,
        columns: &ImplicitColumns<R>,
        z: &[SVector<f64, R>; 2],
        contact: usize,
    ) -> Role {
        let tolerance = 2.0 * TIE.max(2e-15 * z[0].lp_norm(1));
        let (best, edge) = columns.best(contact, &z[0]);
        let threshold = if columns.objective == Objective::Sum { 1.0 } else { columns.objective.weight() };
        if best < threshold - tolerance {
            return Role::Idle;
        }
        let start = self.edges.len();
        for edge in columns.contacts[contact].clone() {
            if columns.wrenches[edge].dot(&z[0]) >= best - tolerance {
                self.edges.push(edge as u32);
            }
        }
        if self.edges.len() == start {
            self.edges.push(edge as u32);
        }
        let role = if self.limited && best > threshold + tolerance { Role::Saturated } else { Role::Free };
        if columns.objective != Objective::MaxThenSum {
            return role;
        }
        let tolerance = 10.0 * TIE.max(2e-15 * z[1].lp_norm(1));
        let gain = |edge: u32| columns.wrenches[edge as usize].dot(&z[1]) - 1.0;
        let best = self.edges[start..].iter().map(|&edge| gain(edge)).fold(f64::NEG_INFINITY, f64::max);
        let mut kept = start;
        for at in start..self.edges.len() {
            if gain(self.edges[at]) >= best - tolerance {
                self.edges.swap(kept, at);
                kept += 1;
            }
        }
        self.edges.truncate(kept);
        match role {
            Role::Free if best > tolerance => Role::Saturated,
            Role::Free if best < -tolerance => Role::Idle,
            role => role,
        }
    }
}
