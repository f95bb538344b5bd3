//! The least price over finitely many extreme forces, exactly: an active-set method in 32 digits.
//!
//! An extreme force and a share for each contact are a vertex `(w, c)`: the wrench that they exert, and the weighted
//! objective. `min |sum_k mu_k w_k - b|^2 / 2 + sum_k mu_k c_k` over convex combinations is Wolfe's problem of the nearest
//! point (Mathematical Programming 11, 1976) with costs. For the residual `z = b - sum_k mu_k w_k` a vertex improves where
//! its `w . z - c` is larger than that of the vertices in use. Without upper bounds shares grow along rays.

use nalgebra::{SMatrix, SVector};

use crate::force::certificate::ContactForces;
use crate::force::squares::dual::{Dual, DualContact, ForceSet};
use crate::force::squares::projection::Force;
use crate::grasp::Wrench;
use crate::grasp::contact::ContactForce;
use crate::interrupt;
use crate::linalg::double_double::DoubleDouble;
use crate::linalg::real::{dot, norm, values};
use crate::tolerances::{DEPENDENT_EDGE_32_DIGITS, ROUNDED_SUPPORT};

/// Vertices that are taken in for one weight; twenty are usual.
const MAX_VERTICES: usize = 400;

/// Vertices in a row that bring no progress: rounding is larger than what they gain.
const MAX_STALLED_VERTICES: usize = 4;

/// What a vertex has to gain, relative to the cost.
const LEAST_GAIN: f64 = 1e-13;

/// The same, relative to the residual and the longest wrench: some hundred roundings of 32 digits.
const ROUNDED_GAIN_32_DIGITS: f64 = 1e-29;

/// The weighted objective: that of the sum of shares, and of the largest one if it counts.
#[derive(Clone, Copy)]
pub(super) struct ShareCost {
    pub(super) weight: f64,
    pub(super) of_sum: f64,
    pub(super) max: bool,
}

/// A wrench or multiplier in 32 digits.
pub(super) type Vector<const D: usize> = SVector<DoubleDouble, D>;

/// A vertex, or a ray of shares without an upper bound.
struct Member<const D: usize> {
    wrench: Vector<D>,
    cost: DoubleDouble,
    is_vertex: bool,
    weight: DoubleDouble,
    /// The extreme force and the share of each contact.
    choice: Vec<(usize, f64)>,
    /// The largest share.
    level: f64,
}

/// The extreme forces of a contact as wrenches where the metric is Euclidean.
struct Columns<const D: usize> {
    exact: Vec<Vector<D>>,
    rounded: Vec<Wrench<D>>,
    longest: f64,
    low: f64,
    high: f64,
}

pub(super) struct Vertices<const D: usize> {
    /// `L` with `L L^T = S^-1`.
    factor: SMatrix<DoubleDouble, D, D>,
    contacts: Vec<Columns<D>>,
    target: Vector<D>,
    used: Vec<Member<D>>,
}

/// Where the weights of the members should go.
enum Aim<const D: usize> {
    /// To the minimiser of their affine hull, whose residual this is.
    Weights(Vec<DoubleDouble>, Vector<D>),
    /// As far as possible: the wrench stays and the cost falls.
    Direction(Vec<DoubleDouble>),
}

impl<const D: usize> Vertices<D> {
    /// `None` where contacts have true cones. `target` is in the coordinates of `dual`, which has a price of the residual.
    pub(super) fn new(dual: &Dual<D>, bounds: &[(f64, f64)], target: &Wrench<D>) -> Option<Self> {
        let factor = cholesky(dual.slack.as_ref()?);
        let columns = |(contact, &(low, high)): (&DualContact<D>, &(f64, f64))| {
            let forces = match &contact.set {
                ForceSet::Cone(_) => return None,
                ForceSet::Finite(polytope) => &polytope.forces[..],
                ForceSet::Zero => &[],
            };
            let euclidean =
                |force: &ContactForce| solve_lower(&factor, contact.wrench(&force.map(DoubleDouble::from)));
            let exact: Vec<Vector<D>> = forces.iter().map(euclidean).collect();
            let rounded: Vec<_> = exact.iter().map(values).collect();
            let longest = rounded.iter().map(Wrench::norm).fold(0.0, f64::max);
            let high = if forces.is_empty() { 0.0 } else { high };
            Some(Columns { exact, rounded, longest, low, high })
        };
        let contacts = dual.contacts.iter().zip(bounds).map(columns).collect::<Option<_>>()?;
        let target = solve_lower(&factor, target.map(DoubleDouble::from));
        Some(Self { factor, contacts, target, used: Vec::new() })
    }

    /// Moves to the least price. Returns its multiplier in the coordinates of the dual, and how many vertices were taken in.
    /// Rays have to gain for shares up to `strongest`.
    pub(super) fn minimise(&mut self, cost: ShareCost, strongest: f64) -> (Vector<D>, usize) {
        for member in &mut self.used {
            member.cost = cost.of(member);
        }
        if self.used.is_empty() {
            let (mut first, _) = self.furthest(&self.target, cost);
            first.weight = DoubleDouble::ONE;
            self.used.push(first);
        }
        let longest = self.contacts.iter().map(|contact| contact.longest).fold(0.0, f64::max);
        let (mut z, mut least, mut stalled, mut steps) = (self.settle(), None, 0, 0);
        while steps < MAX_VERTICES && stalled < MAX_STALLED_VERTICES && !interrupt::stopped() {
            steps += 1;
            let paid = self.used.iter().fold(DoubleDouble::ZERO, |sum, m| sum + m.weight * m.cost);
            let value = paid + dot(&z, &z).times(0.5);
            stalled = if least.is_none_or(|least| value < least) { 0 } else { stalled + 1 };
            least =
                Some(least.map_or(value, |least: DoubleDouble| if value < least { value } else { least }));
            let gained = |member: &Member<D>| (dot(&member.wrench, &z) - member.cost).value();
            let known = dot(&(self.target - z), &z) - paid;
            let enough = (LEAST_GAIN * paid.value()).max(ROUNDED_GAIN_32_DIGITS * norm(&z).value() * longest);
            let (vertex, ray) = self.furthest(&z, cost);
            let next = match ray {
                Some(ray) if gained(&ray) * strongest > enough => ray,
                _ if (dot(&vertex.wrench, &z) - vertex.cost - known).value() > enough => vertex,
                _ => break,
            };
            let same = |m: &Member<D>| m.is_vertex == next.is_vertex && m.choice == next.choice;
            if self.used.iter().any(same) {
                break;
            }
            self.used.push(next);
            z = self.settle();
        }
        (self.multiplier(z), steps)
    }

    /// The forces of the members in use.
    pub(super) fn forces(&self, dual: &Dual<D>) -> (Vec<Force<DoubleDouble>>, ContactForces) {
        let mut found = ContactForces::new(self.contacts.len());
        let mut exact = vec![Force::repeat(DoubleDouble::ZERO); self.contacts.len()];
        for (i, contact) in dual.contacts.iter().enumerate() {
            let ForceSet::Finite(polytope) = &contact.set else { continue };
            let mut total = DoubleDouble::ZERO;
            for member in &self.used {
                let (h, share) = member.choice[i];
                let by = member.weight.times(share);
                total += by;
                exact[i] += polytope.forces[h].map(|x| by.times(x));
            }
            (found.forces[i], found.shares[i]) = (values(&exact[i]), total.value());
        }
        (exact, found)
    }

    /// The vertex that reaches furthest along `z` beyond its cost, and the best ray.
    fn furthest(&self, z: &Vector<D>, cost: ShareCost) -> (Member<D>, Option<Member<D>>) {
        let of_sum = DoubleDouble::from(cost.weight * cost.of_sum);
        let rounded = values(z);
        let reach = self.contacts.iter().map(|contact| {
            let (h, reach) = contact.furthest(z, &rounded);
            (h, reach - of_sum)
        });
        let gains: Vec<(usize, DoubleDouble)> = reach.collect();
        let highest = self.contacts.iter().map(|contact| contact.high).fold(0.0, f64::max);
        let least = self.contacts.iter().map(|contact| contact.low).fold(0.0, f64::max);
        let positive = |i: usize| gains[i].1 > DoubleDouble::ZERO && self.contacts[i].high > 0.0;
        let all = (0..gains.len()).filter(|&i| positive(i));
        let together = all.fold(DoubleDouble::ZERO, |sum, i| sum + gains[i].1);
        let pays = !cost.max || together > DoubleDouble::from(cost.weight);
        let bounded = highest.is_finite();
        let level = match (cost.max, bounded && pays) {
            (true, true) => highest,
            (true, false) => least,
            (false, _) => f64::INFINITY,
        };
        let share = |i: usize| {
            let Columns { low, high, .. } = self.contacts[i];
            let most = high.min(level);
            if positive(i) && most.is_finite() { most } else { low }
        };
        let choice =
            |share: &dyn Fn(usize) -> f64| (0..gains.len()).map(|i| (gains[i].0, share(i))).collect();
        let vertex = self.member(choice(&share), level, true, cost);
        let growing = |i: usize| positive(i) && self.contacts[i].high == f64::INFINITY;
        let fastest = (0..gains.len()).filter(|&i| growing(i)).max_by(|&i, &j| {
            let speed = |i: usize| gains[i].1.value() / self.contacts[i].longest;
            speed(i).total_cmp(&speed(j))
        });
        let ray = fastest.filter(|_| pays).map(|fastest| {
            let grows = |i: usize| f64::from(u8::from(if cost.max { growing(i) } else { i == fastest }));
            self.member(choice(&grows), 1.0, false, cost)
        });
        (vertex, ray)
    }

    fn member(&self, choice: Vec<(usize, f64)>, level: f64, is_vertex: bool, cost: ShareCost) -> Member<D> {
        let mut wrench = Vector::repeat(DoubleDouble::ZERO);
        for (contact, &(h, share)) in self.contacts.iter().zip(&choice).filter(|(_, (_, share))| *share > 0.0)
        {
            wrench += contact.exact[h].map(|x| x.times(share));
        }
        let mut member =
            Member { wrench, cost: DoubleDouble::ZERO, is_vertex, weight: DoubleDouble::ZERO, choice, level };
        member.cost = cost.of(&member);
        member
    }

    /// Moves the weights to the minimiser over the hull of the members, which lose those without weight.
    fn settle(&mut self) -> Vector<D> {
        loop {
            let (direction, end) = match self.aim() {
                Aim::Weights(aim, z) => {
                    let by = aim.iter().zip(&self.used).map(|(aim, member)| *aim - member.weight);
                    (by.collect::<Vec<_>>(), Some(z))
                }
                Aim::Direction(direction) => (direction, None),
            };
            let mut first: Option<(usize, DoubleDouble)> = None;
            for (k, (by, member)) in direction.iter().zip(&self.used).enumerate() {
                if *by < DoubleDouble::ZERO && (end.is_none() || -*by >= member.weight) {
                    let step = member.weight / -*by;
                    if first.is_none_or(|(_, least)| step < least) {
                        first = Some((k, step));
                    }
                }
            }
            if first.is_some() || end.is_some() {
                let step = first.map_or(DoubleDouble::ONE, |(_, step)| step);
                for (member, by) in self.used.iter_mut().zip(&direction) {
                    member.weight += step * *by;
                }
            }
            match (first, end) {
                (Some((k, _)), _) if self.used.len() > 1 => drop(self.used.swap_remove(k)),
                (_, Some(z)) => return z,
                // A ray that costs nothing and exerts nothing.
                _ => drop(self.used.pop()),
            }
        }
    }

    /// By Gram-Schmidt, applied twice, over the edges from the first vertex and the rays.
    fn aim(&self) -> Aim<D> {
        let zero = DoubleDouble::ZERO;
        let base = self.used.iter().position(|member| member.is_vertex).unwrap_or(0);
        let (start, price) = (self.used[base].wrench, self.used[base].cost);
        let others: Vec<usize> = (0..self.used.len()).filter(|&k| k != base).collect();
        let (mut axes, mut r, mut pulls) =
            (Vec::<Vector<D>>::new(), Vec::<Vec<DoubleDouble>>::new(), Vec::new());
        let all_weights = |moved: &[DoubleDouble], whole: DoubleDouble| {
            let mut weights = vec![zero; self.used.len()];
            weights[base] = whole;
            for (by, &k) in moved.iter().zip(&others) {
                weights[k] = *by;
                if self.used[k].is_vertex {
                    weights[base] -= *by;
                }
            }
            weights
        };
        for &k in &others {
            let member = &self.used[k];
            let (edge, dearer) = if member.is_vertex {
                (member.wrench - start, member.cost - price)
            } else {
                (member.wrench, member.cost)
            };
            let (along, rest) = split(&edge, &axes);
            let left = norm(&rest);
            if left <= norm(&edge).times(DEPENDENT_EDGE_32_DIGITS) {
                // The wrench of the edge is that of others.
                let mut moved: Vec<DoubleDouble> = back_substituted(&r, &along).iter().map(|x| -*x).collect();
                let others_cost = |k: usize| {
                    let member: &Member<D> = &self.used[others[k]];
                    if member.is_vertex { member.cost - price } else { member.cost }
                };
                let slope = (0..moved.len()).fold(dearer, |sum, k| sum + moved[k] * others_cost(k));
                moved.push(DoubleDouble::ONE);
                if slope > zero {
                    moved = moved.iter().map(|by| -*by).collect();
                }
                return Aim::Direction(all_weights(&moved, zero));
            }
            // `R^T s = d`.
            let known = along.iter().zip(&pulls).fold(zero, |sum, (x, s)| sum + *x * *s);
            pulls.push((dearer - known) / left);
            axes.push(rest / left);
            r.push(along.into_iter().chain([left]).collect());
        }
        let (along, mut z) = split(&(self.target - start), &axes);
        for (axis, pull) in axes.iter().zip(&pulls) {
            z += axis * *pull;
        }
        let right: Vec<_> = along.iter().zip(&pulls).map(|(x, pull)| *x - *pull).collect();
        Aim::Weights(all_weights(&back_substituted(&r, &right), DoubleDouble::ONE), z)
    }

    /// `L^-T z`.
    fn multiplier(&self, mut z: Vector<D>) -> Vector<D> {
        for k in (0..D).rev() {
            for row in k + 1..D {
                let known = self.factor[(row, k)] * z[row];
                z[k] -= known;
            }
            z[k] /= self.factor[(k, k)];
        }
        z
    }
}

impl ShareCost {
    fn of<const D: usize>(self, member: &Member<D>) -> DoubleDouble {
        let sum: DoubleDouble =
            member.choice.iter().fold(DoubleDouble::ZERO, |sum, (_, share)| sum + DoubleDouble::from(*share));
        let largest = if self.max { member.level } else { 0.0 };
        (sum.times(self.of_sum) + DoubleDouble::from(largest)).times(self.weight)
    }
}

impl<const D: usize> Columns<D> {
    /// The extreme force that reaches furthest, and how far. Doubles leave the nearly furthest ones to choose from.
    fn furthest(&self, z: &Vector<D>, rounded: &Wrench<D>) -> (usize, DoubleDouble) {
        let most = self.rounded.iter().map(|w| w.dot(rounded)).fold(f64::NEG_INFINITY, f64::max);
        let near = most - ROUNDED_SUPPORT * self.longest * rounded.norm();
        let mut best = (0, DoubleDouble::ZERO);
        let candidates = self.rounded.iter().enumerate().filter(|(_, w)| w.dot(rounded) >= near);
        for (turn, (h, _)) in candidates.enumerate() {
            let reach = dot(&self.exact[h], z);
            if turn == 0 || reach > best.1 {
                best = (h, reach);
            }
        }
        best
    }
}

/// The parts of a vector along orthonormal axes, and the rest.
fn split<const D: usize>(vector: &Vector<D>, axes: &[Vector<D>]) -> (Vec<DoubleDouble>, Vector<D>) {
    let (mut along, mut rest) = (vec![DoubleDouble::ZERO; axes.len()], *vector);
    for _ in 0..2 {
        for (axis, along) in axes.iter().zip(&mut along) {
            let by = dot(axis, &rest);
            *along += by;
            rest -= axis * by;
        }
    }
    (along, rest)
}

/// The solution of `R x = right` for an upper triangle by columns.
fn back_substituted(r: &[Vec<DoubleDouble>], right: &[DoubleDouble]) -> Vec<DoubleDouble> {
    let mut x = right.to_vec();
    for k in (0..x.len()).rev() {
        x[k] /= r[k][k];
        let by = x[k];
        for (row, entry) in r[k][..k].iter().enumerate() {
            x[row] -= *entry * by;
        }
    }
    x
}

fn cholesky<const D: usize>(matrix: &SMatrix<f64, D, D>) -> SMatrix<DoubleDouble, D, D> {
    let mut factor = SMatrix::repeat(DoubleDouble::ZERO);
    for c in 0..D {
        for r in c..D {
            let terms = (0..c).fold(DoubleDouble::ZERO, |sum, k| sum + factor[(r, k)] * factor[(c, k)]);
            let left = DoubleDouble::from(matrix[(r, c)]) - terms;
            factor[(r, c)] = if r == c { left.sqrt() } else { left / factor[(c, c)] };
        }
    }
    factor
}

/// `L^-1 w`.
fn solve_lower<const D: usize>(factor: &SMatrix<DoubleDouble, D, D>, mut w: Vector<D>) -> Vector<D> {
    for k in 0..D {
        for c in 0..k {
            let known = factor[(k, c)] * w[c];
            w[k] -= known;
        }
        w[k] /= factor[(k, k)];
    }
    w
}
