//! Projections onto friction cones, cut or not, with their derivatives.
//!
//! The cone is `|(f_o, f_t)| <= mu f_n` for hard fingers, and `sqrt((f_o^2 + f_t^2) / mu^2 + f_torsion^2 / gamma^2) <= f_n`
//! for soft ones. It may be cut at `low <= f_n <= high`. Where the projection onto the whole cone breaks a bound, that
//! bound is active, because the set is convex. The force is then projected onto the disc (for soft fingers the ellipsoid)
//! of that normal force.

use crate::grasp::contact::ContactForce;
use crate::wrench_set::cone::cone_slope;

/// The nearest force of a convex set, and the derivative `J = sum_k shares_k axes_k axes_k^T` of the projection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Projection {
    pub(crate) force: ContactForce,
    /// The normalised normal force, or the sum of coefficients of extreme forces.
    pub(crate) share: f64,
    /// Whether the point lies inside: `J` is the identity on all components that the contact has.
    pub(crate) inside: bool,
    pub(crate) count: usize,
    pub(crate) axes: [ContactForce; 4],
    pub(crate) shares: [f64; 4],
}

impl Projection {
    /// A force that does not change.
    pub(crate) fn fixed(force: ContactForce, share: f64) -> Self {
        let axes = [ContactForce::zeros(); 4];
        Self { force, share, inside: false, count: 0, axes, shares: [0.0; 4] }
    }

    #[inline]
    pub(crate) fn push(&mut self, axis: ContactForce, share: f64) {
        self.axes[self.count] = axis;
        self.shares[self.count] = share;
        self.count += 1;
    }
}

/// A friction cone between two normal forces in N; `high` may be infinite.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CutCone {
    pub(crate) mu: f64,
    /// Zero for a hard finger.
    pub(crate) gamma: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl CutCone {
    #[inline]
    pub(crate) fn project(&self, x: &ContactForce) -> Projection {
        let onto_cone = if self.gamma == 0.0 { self.hard(x) } else { self.soft(x) };
        if onto_cone.force[0] > self.high {
            self.disc(x, self.high)
        } else if onto_cone.force[0] < self.low {
            self.disc(x, self.low)
        } else {
            onto_cone
        }
    }

    #[inline]
    fn hard(&self, x: &ContactForce) -> Projection {
        let (n, mu) = (x[0], self.mu);
        let r = (x[1] * x[1] + x[2] * x[2]).sqrt();
        if n >= 0.0 && r <= mu * n {
            let mut same = Projection::fixed(ContactForce::new(n, x[1], x[2], 0.0), 0.0);
            same.inside = true;
            return same;
        }
        if mu * r <= -n {
            return Projection::fixed(ContactForce::zeros(), 0.0);
        }
        let square = 1.0 + mu * mu;
        let c = (n + mu * r) / square;
        let (u, v) = (x[1] / r, x[2] / r);
        let mut found = Projection::fixed(ContactForce::new(c, mu * c * u, mu * c * v, 0.0), 0.0);
        let length = square.sqrt().recip();
        found.push(ContactForce::new(length, mu * length * u, mu * length * v, 0.0), 1.0);
        found.push(ContactForce::new(0.0, -v, u, 0.0), mu * c / r);
        found
    }

    /// The nearest point `p` has `(I + lambda D) p = x` and `p^T D p = 0` with `D = diag(-1, 1/mu^2, 1/mu^2, 1/gamma^2)`.
    /// The unknown is `u = lambda / (1 + lambda)`: the only root of a function that decreases on `[0, 1]`.
    fn soft(&self, x: &ContactForce) -> Projection {
        let (mu, gamma) = (self.mu, self.gamma);
        let meridian = Meridian::of(x);
        let (a, b) = (meridian.a, meridian.b);
        if (a / mu).hypot(b / gamma) <= x[0] {
            let mut same = Projection::fixed(*x, 0.0);
            same.inside = true;
            return same;
        }
        if cone_slope(x, mu, gamma) <= -x[0] {
            return Projection::fixed(ContactForce::zeros(), 0.0);
        }
        let u = self.root(a, b, 2.0, x[0]);
        let (p, q) = self.shrunk(a, b, u);
        let n = (p / mu).hypot(q / gamma);
        let mut found = Projection::fixed(meridian.force(n, p, q), 0.0);
        let length = (n * n + p * p + q * q).sqrt();
        if length == 0.0 {
            return found;
        }
        found.push(found.force / length, 1.0);
        found.push(meridian.across(), kept(u, mu));
        // Orthogonal to the point and to the normal of the cone, in the plane of the meridian.
        let slope = [-n, p / (mu * mu), q / (gamma * gamma)];
        let cross = [p * slope[2] - q * slope[1], q * slope[0] - n * slope[2], n * slope[1] - p * slope[0]];
        let size = cross[0].hypot(cross[1]).hypot(cross[2]);
        if size > 0.0 {
            let [n, p, q] = cross.map(|c| c / size);
            let curvature = ((p / mu).powi(2) + (q / gamma).powi(2) - n * n).max(0.0);
            found.push(meridian.force(n, p, q), (1.0 - u) / ((1.0 - u) + u * curvature));
        }
        found
    }

    /// The point of normal force `level` nearest to `x`.
    fn disc(&self, x: &ContactForce, level: f64) -> Projection {
        let (mu, gamma) = (self.mu, self.gamma);
        if level == 0.0 {
            return Projection::fixed(ContactForce::zeros(), 0.0);
        }
        if gamma == 0.0 {
            let (r, radius) = ((x[1] * x[1] + x[2] * x[2]).sqrt(), mu * level);
            if r <= radius {
                let mut found = Projection::fixed(ContactForce::new(level, x[1], x[2], 0.0), 0.0);
                found.push(ContactForce::new(0.0, 1.0, 0.0, 0.0), 1.0);
                found.push(ContactForce::new(0.0, 0.0, 1.0, 0.0), 1.0);
                return found;
            }
            let (u, v) = (x[1] / r, x[2] / r);
            let mut found = Projection::fixed(ContactForce::new(level, radius * u, radius * v, 0.0), 0.0);
            found.push(ContactForce::new(0.0, -v, u, 0.0), radius / r);
            return found;
        }
        let meridian = Meridian::of(x);
        let (a, b) = (meridian.a, meridian.b);
        if (a / mu).hypot(b / gamma) <= level {
            let mut found = Projection::fixed(ContactForce::new(level, x[1], x[2], x[3]), 0.0);
            for component in 1..4 {
                let mut axis = ContactForce::zeros();
                axis[component] = 1.0;
                found.push(axis, 1.0);
            }
            return found;
        }
        let u = self.root(a, b, 1.0, level);
        let (p, q) = self.shrunk(a, b, u);
        let mut found = Projection::fixed(meridian.force(level, p, q), 0.0);
        found.push(meridian.across(), kept(u, mu));
        let (along, aside) = (-q / (gamma * gamma), p / (mu * mu));
        let size = along.hypot(aside);
        if size > 0.0 {
            let (along, aside) = (along / size, aside / size);
            let curvature = (along / mu).powi(2) + (aside / gamma).powi(2);
            found.push(meridian.force(0.0, along, aside), (1.0 - u) / ((1.0 - u) + u * curvature));
        }
        found
    }

    /// The root on `[0, 1]` of `(1 - times u) R(u) = right`, with `R^2 = (a mu / A)^2 + (b gamma / B)^2`,
    /// `A = mu^2 (1 - u) + u` and `B = gamma^2 (1 - u) + u`: by Newton's method between bounds. The left side falls.
    fn root(&self, a: f64, b: f64, times: f64, right: f64) -> f64 {
        let (mu2, gamma2) = (self.mu * self.mu, self.gamma * self.gamma);
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        let mut u = 0.0;
        for _ in 0..MAX_ROOT_STEPS {
            let (wide, twist) = (mu2 * (1.0 - u) + u, gamma2 * (1.0 - u) + u);
            let (p, q) = (a * self.mu / wide, b * self.gamma / twist);
            let reach = p.hypot(q);
            let value = (1.0 - times * u) * reach - right;
            if value > 0.0 {
                low = u;
            } else {
                high = u;
            }
            let falls = (p * p * (1.0 - mu2) / wide + q * q * (1.0 - gamma2) / twist) / reach;
            let slope = -times * reach - (1.0 - times * u) * falls;
            let next = u - value / slope;
            let rounding = 2.0 * f64::EPSILON * (reach + right.abs());
            if value.abs() <= rounding || (next - u).abs() <= 2.0 * f64::EPSILON * u {
                return next.clamp(low, high);
            }
            u = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        u
    }

    /// The tangential force and the torsion after the root `u`.
    fn shrunk(&self, a: f64, b: f64, u: f64) -> (f64, f64) {
        (a * kept(u, self.mu), b * kept(u, self.gamma))
    }
}

/// `1 / (1 + lambda / coefficient^2)` with `u = lambda / (1 + lambda)`.
fn kept(u: f64, coefficient: f64) -> f64 {
    let inside = coefficient * coefficient * (1.0 - u);
    inside / (inside + u)
}

/// Bisection alone ends after these; Newton's steps take less than ten as a rule.
const MAX_ROOT_STEPS: usize = 100;

/// The half plane through the axis of the cone in which a force lies: `a` across the normal, `b` of torsion.
struct Meridian {
    a: f64,
    b: f64,
    direction: [f64; 2],
    twist: f64,
}

impl Meridian {
    fn of(x: &ContactForce) -> Self {
        let a = x[1].hypot(x[2]);
        let direction = if a > 0.0 { [x[1] / a, x[2] / a] } else { [1.0, 0.0] };
        Self { a, b: x[3].abs(), direction, twist: if x[3] < 0.0 { -1.0 } else { 1.0 } }
    }

    fn force(&self, n: f64, a: f64, b: f64) -> ContactForce {
        ContactForce::new(n, a * self.direction[0], a * self.direction[1], b * self.twist)
    }

    /// The unit vector around the axis.
    fn across(&self) -> ContactForce {
        ContactForce::new(0.0, -self.direction[1], self.direction[0], 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_numbers::numbers;

    /// Cones of all kinds with a point anywhere around them.
    fn cases() -> impl Iterator<Item = (CutCone, ContactForce)> {
        let mut number = numbers(7);
        (0..20_000).map(move |k| {
            let mu = 10.0_f64.powf(number());
            let gamma = if k % 2 == 0 { 0.0 } else { 10.0_f64.powf(2.0 * number() - 1.0) };
            let low = if k % 3 == 0 { 0.4 } else { 0.0 };
            let high = if k % 5 < 2 { 1.0 } else { f64::INFINITY };
            let mut x = ContactForce::from_fn(|_, _| 2.0 * number());
            if k % 7 == 0 {
                x *= 1e-9;
            }
            if gamma == 0.0 {
                x[3] = 0.0;
            }
            (CutCone { mu, gamma, low, high }, x)
        })
    }

    fn load(cone: &CutCone, f: &ContactForce) -> f64 {
        let twist = if cone.gamma > 0.0 { f[3] / cone.gamma } else { 0.0 };
        (f[1].hypot(f[2]) / cone.mu).hypot(twist)
    }

    #[test]
    fn a_projection_lies_inside_and_stays_there() {
        for (cone, x) in cases() {
            let p = cone.project(&x).force;
            let size = x.norm().max(cone.low).max(1e-300);
            let spread = (1.0 / cone.mu).max(if cone.gamma > 0.0 { 1.0 / cone.gamma } else { 1.0 }).max(1.0);
            assert!(load(&cone, &p) <= p[0] + 1e-14 * size * spread, "{cone:?} {x} {p}");
            assert!(p[0] >= cone.low - 1e-15 && p[0] <= cone.high + 1e-15, "{cone:?} {x} {p}");
            let again = cone.project(&p).force;
            assert!((again - p).norm() <= 1e-13 * size, "{cone:?} {x} {p} {again}");
        }
    }

    #[test]
    fn what_a_projection_takes_away_is_orthogonal_to_the_set() {
        // (x - p) . (q - p) <= 0 for every q of the set: for the furthest q along x - p, too.
        let mut number = numbers(7);
        for (cone, x) in cases() {
            let p = cone.project(&x).force;
            let rest = x - p;
            let reach = rest[0] + cone_slope(&rest, cone.mu, cone.gamma);
            let level = if reach > 0.0 { cone.high.min(1e3) } else { cone.low };
            // A cone that is not cut holds no direction of ascent: what is left is orthogonal to the point.
            assert!(cone.high.is_finite() || reach <= 1e-12 * x.norm(), "{cone:?} {x} {reach:e}");
            let furthest = if cone.high.is_finite() { level * reach } else { cone.low * reach.min(0.0) };
            let size = x.norm() * (x.norm() + level.min(1.0));
            assert!(
                furthest - rest.dot(&p) <= 2e-13 * size,
                "{cone:?} {x} {p} {:e}",
                furthest - rest.dot(&p)
            );
            let q = cone.project(&ContactForce::from_fn(|_, _| 3.0 * number())).force;
            assert!(rest.dot(&(q - p)) <= 2e-13 * size.max(q.norm() * x.norm()), "{cone:?} {x} {p} {q}");
        }
    }

    #[test]
    fn the_derivative_is_that_of_differences() {
        let mut number = numbers(7);
        let (mut checked, mut total) = (0, 0);
        for (cone, x) in cases().filter(|(_, x)| x.norm() > 0.1) {
            let found = cone.project(&x);
            let mut step = ContactForce::from_fn(|_, _| 1e-6 * number());
            if cone.gamma == 0.0 {
                step[3] = 0.0;
            }
            let [ahead, behind] = [x + step, x - step].map(|x| cone.project(&x));
            total += 1;
            // Between two pieces the derivative jumps.
            if [ahead, behind].iter().any(|p| p.count != found.count || p.inside != found.inside) {
                continue;
            }
            let mut expected = if found.inside { step } else { ContactForce::zeros() };
            for (axis, share) in found.axes.iter().zip(found.shares).take(found.count) {
                expected += axis * (share * axis.dot(&step));
            }
            let difference = (ahead.force - behind.force) / 2.0;
            assert!(
                (difference - expected).norm() <= 2e-4 * step.norm(),
                "{cone:?} {x} {difference} {expected}"
            );
            checked += 1;
        }
        assert!(checked * 100 > total * 99, "{checked} of {total}");
    }
}
