//! Columns of the force distribution program for the simplex method in 32 digits.
//!
//! Coordinates are physical ones over the largest force and the largest torque of one contact, so that an
//! imbalance means the same in every row. With lower bounds `c_i`, scaled to a largest of one, the vertices (points of
//! `sum_i [c_i, c_max] H_i`) are combined convexly in one more row, as in [`preload`](crate::force::preload).

use crate::force::simplex::pricing::Objective;
use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, Wrench};
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::{PUSHING, ROUNDED_SUPPORT};

/// Six rows of the wrench and the one that makes combinations convex.
pub(crate) const ROWS: usize = 7;

/// A column, a right-hand side or a multiplier.
pub(crate) type Vector = [DoubleDouble; ROWS];

/// What the maximum's tie-break by the sum weighs beside it: less than the tolerance of the objective, and as much as
/// counts as a tie in doubles ([`TIED_COST`](crate::tolerances::TIED_COST)).
const TIE_BREAK: f64 = 1e-11;

/// The wrenches of one contact.
#[derive(Debug, Clone)]
enum Reach {
    Finite { wrenches: Vec<[f64; 6]>, forces: Vec<ContactForce> },
    Cone { map: [[f64; 6]; 4], limit: f64, mu: f64, gamma: f64 },
}

/// What one contact contributes to a column: its normalised normal force, and its force at a share of one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Share {
    pub(crate) contact: usize,
    pub(crate) normal: f64,
    pub(crate) force: ContactForce,
}

/// A point of the wrench set with its cost.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    pub(crate) wrench: Vector,
    pub(crate) cost: DoubleDouble,
    pub(crate) shares: Vec<Share>,
}

/// The wrench set, and what its points cost.
#[derive(Debug, Clone)]
pub(crate) struct DoubleDoubleColumns {
    reaches: Vec<Reach>,
    objective: Objective,
    /// Lower bounds over the largest of them; none where empty.
    least: Vec<f64>,
    /// Rows of the wrench; the convexity row, if there is one, comes next.
    pub(crate) dim: usize,
    /// Reciprocals of the largest force and torque of one contact.
    pub(crate) units: [f64; 6],
    /// Gains below this are no improvement.
    pub(crate) threshold: f64,
}

/// How far one contact reaches, and by what.
struct Best {
    value: DoubleDouble,
    wrench: [DoubleDouble; 6],
    force: ContactForce,
}

/// The force of a cone that reaches furthest where its components reach `along`, at a normal force of one.
fn furthest_force(along: &[DoubleDouble; 4], mu: f64, gamma: f64) -> [DoubleDouble; 4] {
    let scaled = [along[1].times(mu), along[2].times(mu), along[3].times(gamma)];
    // Scaled to a largest of one, so that no square vanishes.
    let largest = scaled.iter().fold(0.0_f64, |largest, x| largest.max(x.value().abs()));
    if largest == 0.0 {
        return [DoubleDouble::ONE, DoubleDouble::ZERO, DoubleDouble::ZERO, DoubleDouble::ZERO];
    }
    let directed = scaled.map(|x| x / DoubleDouble::from(largest));
    let length = directed.iter().fold(DoubleDouble::ZERO, |sum, x| sum + *x * *x).sqrt();
    let [o, t, twist] = directed.map(|x| x / length);
    [DoubleDouble::ONE, o.times(mu), t.times(mu), twist.times(gamma)]
}

pub(crate) fn dot(wrench: &[f64; 6], z: &Vector) -> DoubleDouble {
    wrench
        .iter()
        .zip(z)
        .fold(DoubleDouble::ZERO, |sum, (w, z)| if *w == 0.0 { sum } else { sum + z.times(*w) })
}

impl DoubleDoubleColumns {
    /// `least` holds the lower bounds over the largest of them, or nothing.
    pub(crate) fn new<const D: usize>(
        grasp: &Grasp<D>,
        scales: &Wrench<D>,
        objective: Objective,
        least: Vec<f64>,
        tolerance: f64,
    ) -> Self {
        let scaled = |wrench: &[f64]| {
            let mut row = [0.0; 6];
            row.iter_mut().zip(wrench).zip(scales).for_each(|((x, w), unit)| *x = w * unit);
            row
        };
        let reach = |i: usize| {
            let contact = &grasp.contacts()[i];
            if let Some(range) = grasp.edges(i) {
                let wrenches = grasp.finite_wrenches()[range.clone()].iter();
                return Reach::Finite {
                    wrenches: wrenches.map(|w| scaled(w.as_slice())).collect(),
                    forces: grasp.finite_forces()[range].to_vec(),
                };
            }
            let limit = contact.max_normal_force;
            let mut map = [[0.0; 6]; 4];
            for (row, column) in map.iter_mut().zip(grasp.maps()[i].column_iter()) {
                *row = scaled((column * limit).as_slice());
            }
            Reach::Cone { map, limit, mu: contact.friction, gamma: contact.torsion }
        };
        let mut units = [0.0; 6];
        units[..D].copy_from_slice(scales.as_slice());
        Self {
            reaches: (0..grasp.num_contacts()).map(reach).collect(),
            objective,
            least,
            dim: D,
            units,
            threshold: if grasp.is_finite() { 1e-24 } else { (0.1 * tolerance).min(1e-8) },
        }
    }

    pub(crate) fn num_contacts(&self) -> usize {
        self.reaches.len()
    }

    /// Rows of the program.
    pub(crate) fn rows(&self) -> usize {
        self.dim + usize::from(!self.least.is_empty())
    }

    /// Whether every contact lists its extreme forces.
    pub(crate) fn is_finite(&self) -> bool {
        self.reaches.iter().all(|reach| matches!(reach, Reach::Finite { .. }))
    }

    pub(crate) fn objective(&self) -> Objective {
        self.objective
    }

    /// The extreme forces of a contact and their wrenches; `None` for a true cone.
    pub(crate) fn listed(&self, contact: usize) -> Option<(&[[f64; 6]], &[ContactForce])> {
        match &self.reaches[contact] {
            Reach::Finite { wrenches, forces } => Some((wrenches, forces)),
            Reach::Cone { .. } => None,
        }
    }

    /// What a column of one contact costs.
    pub(crate) fn unit(&self) -> f64 {
        self.objective.unit()
    }

    /// What each contact adds to the cost of a column.
    pub(crate) fn weight(&self) -> f64 {
        match self.objective {
            Objective::Sum => 0.0,
            Objective::MaxThenSum => TIE_BREAK,
            Objective::Weighted(weight) => weight,
        }
    }

    fn best(&self, contact: usize, z: &Vector) -> Best {
        match &self.reaches[contact] {
            Reach::Finite { wrenches, forces } => {
                let rough = z.map(DoubleDouble::value);
                let size: f64 = rough.iter().map(|x| x.abs()).sum();
                let product = |w: &[f64; 6]| w.iter().zip(&rough).map(|(w, z)| w * z).sum::<f64>();
                let furthest = wrenches.iter().map(product).fold(f64::NEG_INFINITY, f64::max);
                let near = |w: &[f64; 6]| product(w) >= furthest - ROUNDED_SUPPORT * size;
                let candidates = wrenches.iter().enumerate().filter(|(_, w)| near(w));
                let (value, edge) = candidates
                    .map(|(edge, w)| (dot(w, z), edge))
                    .reduce(|best, next| if next.0 > best.0 { next } else { best })
                    .unwrap_or((DoubleDouble::from(f64::MIN), 0));
                Best { value, wrench: wrenches[edge].map(DoubleDouble::from), force: forces[edge] }
            }
            Reach::Cone { map, limit, mu, gamma } => {
                // In doubles it would be off the cone by a rounding, which large multipliers show.
                let along = map.each_ref().map(|column| dot(column, z));
                let force = furthest_force(&along, *mu, *gamma);
                let mut wrench = [DoubleDouble::ZERO; 6];
                for (column, share) in map.iter().zip(force) {
                    wrench.iter_mut().zip(column).for_each(|(w, x)| *w += share.times(*x));
                }
                let value = along.iter().zip(&force).fold(DoubleDouble::ZERO, |sum, (x, f)| sum + *x * *f);
                let force = ContactForce::from_fn(|k, _| force[k].value()) * *limit;
                Best { value, wrench, force }
            }
        }
    }

    /// The support functions of the rays and of the vertices, with `weight` taken off for each contact.
    pub(crate) fn values(&self, z: &Vector, weight: f64) -> [DoubleDouble; 2] {
        let (mut rays, mut vertices) = (DoubleDouble::ZERO, DoubleDouble::ZERO);
        for contact in 0..self.reaches.len() {
            let value = self.best(contact, z).value - DoubleDouble::from(weight);
            let positive = value.max(DoubleDouble::ZERO);
            let least = value.times(self.least.get(contact).copied().unwrap_or(0.0));
            if self.objective == Objective::Sum {
                rays = rays.max(value);
                vertices += least;
            } else {
                rays += positive;
                vertices += if value > DoubleDouble::ZERO { value } else { least };
            }
        }
        [rays, vertices]
    }

    /// Whether the wrench of some contact reaches along `z` by more than rounding of that wrench: strong contacts beside it
    /// hide it.
    pub(crate) fn pushes(&self, z: &Vector) -> bool {
        // Lengths in N and N m, the way a caller checks the direction.
        let units = &self.units[..self.dim];
        let size = z.iter().zip(units).fold(0.0_f64, |size, (z, unit)| size.hypot(z.value() * unit));
        let pushes = |value: DoubleDouble, length: f64| value.value() > PUSHING * length * size;
        let length = |row: &[f64]| row.iter().zip(units).fold(0.0_f64, |sum, (x, unit)| sum.hypot(x / unit));
        self.reaches.iter().enumerate().any(|(contact, reach)| match reach {
            Reach::Finite { wrenches, .. } => wrenches.iter().any(|w| pushes(dot(w, z), length(w))),
            Reach::Cone { .. } => {
                let best = self.best(contact, z);
                pushes(best.value, length(&best.wrench.map(DoubleDouble::value)))
            }
        })
    }

    /// The column whose gain `p . z - cost` is the largest, with that gain. Points are free where `costs` is false.
    pub(crate) fn furthest(&self, z: &Vector, costs: bool) -> Option<(DoubleDouble, Point)> {
        let weight = DoubleDouble::from(if costs { self.weight() } else { 0.0 });
        let fixed = if costs { DoubleDouble::ONE } else { DoubleDouble::ZERO };
        let each: Vec<Best> = (0..self.reaches.len()).map(|contact| self.best(contact, z)).collect();
        let sum = self.objective == Objective::Sum;
        let first = (0..each.len()).reduce(|a, b| if each[b].value > each[a].value { b } else { a })?;
        let presses = |i: usize| each[i].value > weight;
        let single = sum || !presses(first);
        let rays: Vec<(usize, f64)> = (0..each.len())
            .filter(|&i| if single { i == first } else { presses(i) })
            .map(|i| (i, 1.0))
            .collect();
        let gain = |chosen: &[(usize, f64)]| {
            chosen.iter().fold(DoubleDouble::ZERO, |total, &(i, normal)| {
                total + (each[i].value - weight).times(normal)
            })
        };
        let ray_gain = gain(&rays) - fixed;
        let mut best = (ray_gain, rays, false);
        if !self.least.is_empty() {
            let normal = |i: usize| if presses(i) && !sum { 1.0 } else { self.least[i] };
            let vertices: Vec<(usize, f64)> =
                (0..each.len()).map(|i| (i, normal(i))).filter(|(_, normal)| *normal > 0.0).collect();
            let vertex_gain = gain(&vertices) + z[self.dim];
            if vertex_gain > best.0 {
                best = (vertex_gain, vertices, true);
            }
        }
        let (gain, chosen, is_vertex) = best;
        // What it costs where prices count, even if it was found where they do not.
        let mut cost = if is_vertex { DoubleDouble::ZERO } else { DoubleDouble::ONE };
        let own = DoubleDouble::from(self.weight());
        let mut wrench = [DoubleDouble::ZERO; ROWS];
        let mut shares = Vec::with_capacity(chosen.len());
        for (contact, normal) in chosen {
            for (sum, w) in wrench.iter_mut().zip(&each[contact].wrench) {
                *sum += w.times(normal);
            }
            cost += own.times(normal);
            shares.push(Share { contact, normal, force: each[contact].force });
        }
        if is_vertex {
            wrench[self.dim] = DoubleDouble::ONE;
        }
        Some((gain, Point { wrench, cost, shares }))
    }
}
