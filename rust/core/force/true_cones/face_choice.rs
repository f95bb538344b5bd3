//! The least sum, then the least norm, among forces that are equally good, where several directions are free.
//!
//! Optimal forces are those that balance the wrench on a face of each cone: a ray where the contact slides, the cone
//! below the level where it sticks, a disc of it at the level. Over these faces
//!
//! ```text
//! min  sum_i n_i + share / 2 sum_i |f_i|^2 / f_i^U^2
//! ```
//!
//! has one solution. Its dual has six unknowns, projections onto the faces give its gradient, and Newton's method with
//! a line search finds it. The solution is smooth in `share`, so that solutions for falling shares extrapolate to the
//! share of zero (Richardson): the forces of least norm among those of least sum. Where all forces have the same sum
//! one solution suffices.

use nalgebra::{SMatrix, SVector, Vector4};

use crate::force::squares::projection::{CutCone, Projection};
use crate::force::true_cones::choice::Choice;
use crate::force::true_cones::contact_status::{ContactStatus, friction, load};
use crate::force::true_cones::optimal_point::{ConeConditions, OptimalPoint};
use crate::force::true_cones::optimality_system::{OptimalitySystem, Unknown};

const MAX_CHOICE_STEPS: usize = 60;
const MAX_CHOICE_TRIALS: usize = 20;

/// The gradient that counts as zero, relative to its terms, and what a stalled iteration may leave of it.
const CONVERGED_CHOICE: f64 = 2e-14;
const STALLED_CHOICE: f64 = 1e-10;

/// Shares of the norm fall by this factor, this often.
const FALL: f64 = 0.25;
const FALLS: usize = 9;

/// The order of the extrapolation.
const ORDER: usize = 4;

/// Extrapolated forces that differ by less are final, relative to the level.
const EXTRAPOLATED: f64 = 1e-12;
const ACCEPTED: f64 = 1e-10;

/// Reduced costs below this are zero, beside the cost of one of a share.
const TIED: f64 = 1e-2;

/// The dual function at a multiplier, and the forces there.
#[derive(Debug, Clone, Copy)]
struct DualPoint<const D: usize> {
    z: SVector<f64, D>,
    value: f64,
    gradient: SVector<f64, D>,
    hessian: SMatrix<f64, D, D>,
    /// Sizes of the terms of value and gradient.
    terms: f64,
    size: f64,
}

/// The faces, their program, and buffers.
#[derive(Debug, Clone)]
pub(crate) struct FaceChoice<const D: usize> {
    /// The coordinates `x` of the solution.
    solution: Vec<Vector4<f64>>,
    /// One row of extrapolated solutions for each order, and the best of them.
    table: Vec<Vector4<f64>>,
    best: Vec<Vector4<f64>>,
    system: OptimalitySystem<D>,
}

/// What the program minimises.
#[derive(Debug, Clone, Copy)]
struct Program<'a, const D: usize> {
    conditions: &'a ConeConditions<D>,
    point: &'a OptimalPoint<D>,
    target: SVector<f64, D>,
    /// The price of a share: one, or zero where the sum is the same everywhere.
    price: f64,
    /// The share of the norm.
    share: f64,
}

impl<const D: usize> FaceChoice<D> {
    pub(crate) fn new(contacts: usize) -> Self {
        let solution = vec![Vector4::zeros(); contacts];
        let (table, best) = (vec![Vector4::zeros(); contacts * (ORDER + 1)], solution.clone());
        Self { solution, table, best, system: OptimalitySystem::new(contacts) }
    }

    /// Moves the forces of the point to the choice; `sum_changes` asks for the least sum first.
    pub(crate) fn choose(
        &mut self,
        conditions: &ConeConditions<D>,
        point: &mut OptimalPoint<D>,
        target: &SVector<f64, D>,
        sum_changes: bool,
    ) -> Choice {
        let mut target = *target;
        for (contact, cone) in conditions.cones.iter().enumerate() {
            match point.contacts[contact].status {
                ContactStatus::FullSliding => target -= cone.wrench(&point.force(contact)),
                ContactStatus::Sticking | ContactStatus::FullSticking
                    if cone.mu == 0.0 && cone.gamma > 0.0 =>
                {
                    return Choice::Open;
                }
                _ => {}
            }
        }
        let mut program = Program { conditions, point, target, price: 0.0, share: 1.0 };
        let mut z = SVector::zeros();
        let found = if sum_changes {
            program.price = 1.0;
            self.extrapolate(program, &mut z)
        } else {
            program.minimise(&mut z, &mut self.solution).then_some(false)
        };
        let Some(unique) = found else { return Choice::Open };
        for (contact, x) in point.contacts.iter_mut().zip(&self.solution) {
            match contact.status {
                ContactStatus::Idle | ContactStatus::FullSliding => {}
                ContactStatus::Sliding => contact.x[0] = x[0],
                ContactStatus::Sticking | ContactStatus::FullSticking => contact.x = *x,
            }
        }
        if unique { Choice::Unique } else { Choice::LeastNorm }
    }

    /// The limit of the solutions as the share of the norm vanishes, and whether the least sum alone determines it.
    fn extrapolate(&mut self, mut program: Program<'_, D>, z: &mut SVector<f64, D>) -> Option<bool> {
        let contacts = program.point.contacts.len();
        let level = program.point.contacts.iter().enumerate().map(|(i, _)| program.point.force(i)[0]);
        let level = level.fold(program.point.level, f64::max);
        let mut closest = f64::INFINITY;
        for fall in 0..=FALLS {
            if !program.minimise(z, &mut self.solution) {
                return None;
            }
            // Neville's scheme: row k holds the extrapolation over the last k + 1 shares.
            let order = fall.min(ORDER);
            let mut change = if order > 0 { 0.0_f64 } else { f64::INFINITY };
            for (i, solved) in self.solution.iter().enumerate() {
                let (mut extrapolated, mut power) = (*solved, 1.0);
                for k in 0..=order {
                    let before = std::mem::replace(&mut self.table[k * contacts + i], extrapolated);
                    if k < order {
                        power /= FALL;
                        let correction = (extrapolated - before) / (power - 1.0);
                        extrapolated += correction;
                        if k + 1 == order {
                            change = change.max(correction.amax());
                        }
                    }
                }
            }
            if change < closest {
                closest = change;
                self.best.copy_from_slice(&self.table[order * contacts..(order + 1) * contacts]);
            }
            if change <= EXTRAPOLATED * level {
                break;
            }
            program.share *= FALL;
        }
        if closest > ACCEPTED * level {
            return None;
        }
        let unique = self.determined(&program, z);
        self.solution.copy_from_slice(&self.best);
        Some(unique)
    }

    /// Whether forces of the same sum differ on no line: columns of the faces that the price leaves are independent.
    fn determined(&mut self, program: &Program<'_, D>, z: &SVector<f64, D>) -> bool {
        let Self { system, solution, .. } = self;
        system.clear();
        let level = program.level();
        for (contact, cone) in program.conditions.cones.iter().enumerate() {
            let at = &program.point.contacts[contact];
            let (v, x) = (cone.conjugate(z), solution[contact]);
            let inside = load(&x) < x[0] * (1.0 - TIED * TIED);
            let unmoved = load(&v) <= TIED;
            let coordinates = match at.status {
                ContactStatus::Sliding => {
                    if (v[0] + at.direction.dot(&v) - program.price).abs() <= TIED {
                        system.push(Unknown::Share { contact }, cone.axes[0] + cone.wrench(&at.direction));
                    }
                    continue;
                }
                ContactStatus::Sticking => {
                    let free = v[0] + load(&v) - program.price;
                    if free < -TIED {
                        continue;
                    }
                    if !inside && !unmoved {
                        if free <= TIED {
                            let ray = cone.axes[0] + cone.wrench(&(friction(&v) / load(&v)));
                            system.push(Unknown::Share { contact }, ray);
                        }
                        continue;
                    }
                    if free > TIED && x[0] >= level * (1.0 - TIED) { 1..cone.dim } else { 0..cone.dim }
                }
                ContactStatus::FullSticking if inside || unmoved => 1..cone.dim,
                _ => continue,
            };
            for k in coordinates {
                system.push(Unknown::Coordinate { contact, k }, cone.axes[k]);
            }
        }
        system.factorise(false);
        system.free_directions() == 0
    }
}

impl<const D: usize> Program<'_, D> {
    fn level(&self) -> f64 {
        if self.conditions.bounded { self.point.level } else { f64::INFINITY }
    }

    /// The dual function at `z`; leaves the forces in `solution`.
    fn at(&self, z: SVector<f64, D>, solution: &mut [Vector4<f64>]) -> DualPoint<D> {
        let value = -self.target.dot(&z);
        let (mut gradient, mut hessian) = (-self.target, SMatrix::<f64, D, D>::zeros());
        let mut point =
            DualPoint { z, value, gradient, hessian, terms: value.abs(), size: self.target.amax() };
        let per_share = 1.0 / self.share;
        let mut add =
            |wrench: &SVector<f64, D>, share: f64| hessian.ger(share * per_share, wrench, wrench, 1.0);
        for (contact, cone) in self.conditions.cones.iter().enumerate() {
            let at = &self.point.contacts[contact];
            let (low, high) = match at.status {
                ContactStatus::Idle | ContactStatus::FullSliding => continue,
                ContactStatus::FullSticking => (self.level(), self.level()),
                ContactStatus::Sliding | ContactStatus::Sticking => (0.0, self.level()),
            };
            let v = cone.conjugate(&z);
            if at.status == ContactStatus::Sliding {
                let mut ray = at.direction;
                ray[0] = 1.0;
                let weight = ray.component_mul(&ray).dot(&cone.weights);
                let gain = ray.dot(&v) - self.price;
                let wanted = gain * per_share / weight;
                let share = wanted.max(low).min(high);
                let wrench = cone.wrench(&ray);
                gradient += wrench * share;
                if share == wanted {
                    add(&wrench, 1.0 / weight);
                }
                let cost = 0.5 * self.share * weight * share * share;
                point.value += gain * share - cost;
                point.terms += (gain * share).abs() + cost;
                point.size += share;
                solution[contact] = ray * share;
                continue;
            }
            let mut reduced = v;
            reduced[0] -= self.price;
            // Conjugate to the normalised force: a coordinate and its multiplier scale inversely.
            let pull =
                cone.normalised(&reduced.zip_map(&cone.weights, |v, w| if w > 0.0 { v / w } else { 0.0 }));
            let set = CutCone { mu: cone.mu, gamma: cone.gamma, low, high };
            let found: Projection = set.project(&(pull * per_share));
            let x = cone.coordinates_of_normalised(&found.force);
            gradient += cone.wrench(&x);
            let cost = 0.5 * self.share * found.force.norm_squared();
            let gain = reduced.dot(&x);
            point.value += gain - cost;
            point.terms += gain.abs() + cost;
            point.size += x.amax();
            solution[contact] = x;
            if found.inside {
                for k in 0..cone.dim {
                    add(&cone.axes[k], 1.0 / cone.weights[k]);
                }
                continue;
            }
            for (axis, share) in found.axes.iter().zip(found.shares).take(found.count) {
                add(&cone.wrench(&cone.coordinates_of_normalised(axis)), share);
            }
        }
        (point.gradient, point.hessian) = (gradient, hessian);
        point
    }

    /// Minimises the dual function from `z`, which is left at the minimiser.
    fn minimise(&self, z: &mut SVector<f64, D>, solution: &mut [Vector4<f64>]) -> bool {
        let mut point = self.at(*z, solution);
        let scale: f64 =
            self.conditions.cones.iter().map(|c| c.axes[0].norm_squared()).sum::<f64>() / self.share;
        let mut stalled = 0;
        for _ in 0..MAX_CHOICE_STEPS {
            let error = point.gradient.amax() / point.size;
            *z = point.z;
            if error <= CONVERGED_CHOICE {
                return true;
            }
            if stalled >= 2 && error <= STALLED_CHOICE {
                return true;
            }
            if stalled > 6 || !error.is_finite() {
                return false;
            }
            let mut matrix = point.hessian;
            for k in 0..D {
                matrix[(k, k)] += (1e-3 * error).clamp(1e-15, 1e-3) * scale;
            }
            let Some(factor) = matrix.cholesky() else { return false };
            let direction = -factor.solve(&point.gradient);
            let Some(next) = self.line_search(&point, &direction, solution) else {
                self.at(point.z, solution);
                return error <= STALLED_CHOICE;
            };
            let halved = next.gradient.amax() <= 0.5 * point.gradient.amax();
            stalled = if halved { 0 } else { stalled + usize::from(error <= STALLED_CHOICE) };
            point = next;
        }
        false
    }

    /// A point along the direction whose slope is at most half: the function is convex, so that its slope grows.
    fn line_search(
        &self,
        from: &DualPoint<D>,
        direction: &SVector<f64, D>,
        solution: &mut [Vector4<f64>],
    ) -> Option<DualPoint<D>> {
        let slope = from.gradient.dot(direction);
        let (mut low, mut low_slope, mut high, mut high_slope) = (0.0, slope, f64::INFINITY, 0.0);
        let mut step = 1.0;
        for _ in 0..MAX_CHOICE_TRIALS {
            let found = self.at(from.z + direction * step, solution);
            let now = found.gradient.dot(direction);
            let rounding = 8.0 * f64::EPSILON * found.terms.max(from.terms);
            // Kinks at the minimum leave slopes that the values cannot tell from rounding.
            if found.gradient.amax() <= 0.5 * from.gradient.amax() && found.value <= from.value + rounding {
                return Some(found);
            }
            if now.abs() <= 0.5 * slope.abs() && (now <= 0.0 || found.value <= from.value + rounding) {
                return Some(found);
            }
            if now <= 0.0 {
                (low, low_slope) = (step, now);
            } else {
                (high, high_slope) = (step, now);
            }
            step = if high.is_finite() {
                let secant = low - low_slope * (high - low) / (high_slope - low_slope);
                secant.max(low + 0.1 * (high - low)).min(high - 0.1 * (high - low))
            } else {
                4.0 * step
            };
        }
        None
    }
}
