//! Projections onto friction cones, cut or not, with their derivatives.
//!
//! The cone is `|(f_o, f_t)| <= mu f_n` for hard fingers, and `sqrt((f_o^2 + f_t^2) / mu^2 + f_torsion^2 / gamma^2) <= f_n`
//! for soft ones. It may be cut at `low <= f_n <= high`. Where the projection onto the whole cone breaks a bound, that
//! bound is active, because the set is convex. The force is then projected onto the disc (for soft fingers the ellipsoid)
//! of that normal force.

use nalgebra::SVector;

use crate::linalg::real::{Real, norm};

/// A contact force in numbers of some precision.
pub(crate) type Force<R> = SVector<R, 4>;

/// The nearest force of a convex set, and the derivative `J = sum_k shares_k axes_k axes_k^T` of the projection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Projection<R: Real = f64> {
    pub(crate) force: Force<R>,
    /// The normalised normal force, or the sum of coefficients of extreme forces.
    pub(crate) share: R,
    /// Whether the point lies inside: `J` is the identity on all components that the contact has.
    pub(crate) inside: bool,
    pub(crate) count: usize,
    pub(crate) axes: [Force<R>; 4],
    pub(crate) shares: [R; 4],
}

impl<R: Real> Projection<R> {
    /// A force that does not change.
    pub(crate) fn fixed(force: Force<R>, share: R) -> Self {
        let axes = [Force::repeat(R::zero()); 4];
        Self { force, share, inside: false, count: 0, axes, shares: [R::zero(); 4] }
    }

    #[inline]
    pub(crate) fn push(&mut self, axis: Force<R>, share: R) {
        self.axes[self.count] = axis;
        self.shares[self.count] = share;
        self.count += 1;
    }

    /// A component that moves with the point.
    pub(crate) fn push_unit(&mut self, component: usize) {
        let mut axis = Force::repeat(R::zero());
        axis[component] = R::from(1.0);
        self.push(axis, R::from(1.0));
    }
}

impl Projection {
    /// The same in numbers of another precision.
    #[inline]
    pub(crate) fn converted<R: Real>(self) -> Projection<R> {
        let wide = |force: Force<f64>| force.map(R::from);
        Projection {
            force: wide(self.force),
            share: R::from(self.share),
            inside: self.inside,
            count: self.count,
            axes: self.axes.map(wide),
            shares: self.shares.map(R::from),
        }
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
    pub(crate) fn project<R: Real>(&self, x: &Force<R>) -> Projection<R> {
        let onto_cone = if self.gamma == 0.0 { self.hard(x) } else { self.soft(x) };
        let (low, high) = (R::from(self.low), R::from(self.high));
        if onto_cone.force[0] > high {
            self.disc(x, high)
        } else if onto_cone.force[0] < low {
            self.disc(x, low)
        } else {
            onto_cone
        }
    }

    #[inline]
    fn hard<R: Real>(&self, x: &Force<R>) -> Projection<R> {
        let (zero, n, mu) = (R::zero(), x[0], self.mu);
        let r = (x[1] * x[1] + x[2] * x[2]).square_root();
        if n >= zero && r <= n.times(mu) {
            let mut same = Projection::fixed(Force::new(n, x[1], x[2], zero), zero);
            same.inside = true;
            return same;
        }
        if r.times(mu) <= -n {
            return Projection::fixed(Force::repeat(zero), zero);
        }
        let square = R::from(1.0) + R::from(mu).times(mu);
        let c = (n + r.times(mu)) / square;
        let (u, v, slope) = (x[1] / r, x[2] / r, c.times(mu));
        let mut found = Projection::fixed(Force::new(c, slope * u, slope * v, zero), zero);
        let length = R::from(1.0) / square.square_root();
        let along = length.times(mu);
        found.push(Force::new(length, along * u, along * v, zero), R::from(1.0));
        found.push(Force::new(zero, -v, u, zero), slope / r);
        found
    }

    /// The nearest point `p` has `(I + lambda D) p = x` and `p^T D p = 0` with `D = diag(-1, 1/mu^2, 1/mu^2, 1/gamma^2)`.
    /// The unknown is `u = lambda / (1 + lambda)`: the only root of a function that decreases on `[0, 1]`.
    fn soft<R: Real>(&self, x: &Force<R>) -> Projection<R> {
        let (mu, gamma) = (R::from(self.mu), R::from(self.gamma));
        let meridian = Meridian::of(x);
        let (a, b) = (meridian.a, meridian.b);
        if (a / mu).hypotenuse(b / gamma) <= x[0] {
            let mut same = Projection::fixed(*x, R::zero());
            same.inside = true;
            return same;
        }
        if (a * mu).hypotenuse(b * gamma) <= -x[0] {
            return Projection::fixed(Force::repeat(R::zero()), R::zero());
        }
        let u = self.root(a, b, x[0]);
        let v = R::from(1.0) - u;
        let (p, q) = (a * kept(v, u, mu), b * kept(v, u, gamma));
        let n = (p / mu).hypotenuse(q / gamma);
        let mut found = Projection::fixed(meridian.force(n, p, q), R::zero());
        let length = norm(&found.force);
        if length == R::zero() {
            return found;
        }
        found.push(found.force / length, R::from(1.0));
        found.push(meridian.across(), kept(v, u, mu));
        // Orthogonal to the point and to the normal of the cone, in the plane of the meridian.
        let slope = [-n, p / (mu * mu), q / (gamma * gamma)];
        let cross = [p * slope[2] - q * slope[1], q * slope[0] - n * slope[2], n * slope[1] - p * slope[0]];
        let size = cross[0].hypotenuse(cross[1]).hypotenuse(cross[2]);
        if size > R::zero() {
            let [n, p, q] = cross.map(|c| c / size);
            let (pm, qg) = (p / mu, q / gamma);
            let curvature = pm * pm + qg * qg - n * n;
            let curvature = if curvature < R::zero() { R::zero() } else { curvature };
            found.push(meridian.force(n, p, q), v / (v + u * curvature));
        }
        found
    }

    /// The point of normal force `level` nearest to `x`.
    fn disc<R: Real>(&self, x: &Force<R>, level: R) -> Projection<R> {
        let (zero, one) = (R::zero(), R::from(1.0));
        let (mu, gamma) = (R::from(self.mu), R::from(self.gamma));
        if level == zero {
            return Projection::fixed(Force::repeat(zero), zero);
        }
        if self.gamma == 0.0 {
            let (r, radius) = ((x[1] * x[1] + x[2] * x[2]).square_root(), mu * level);
            if r <= radius {
                let mut found = Projection::fixed(Force::new(level, x[1], x[2], zero), zero);
                found.push(Force::new(zero, one, zero, zero), one);
                found.push(Force::new(zero, zero, one, zero), one);
                return found;
            }
            let (u, v) = (x[1] / r, x[2] / r);
            let mut found = Projection::fixed(Force::new(level, radius * u, radius * v, zero), zero);
            found.push(Force::new(zero, -v, u, zero), radius / r);
            return found;
        }
        let meridian = Meridian::of(x);
        let (a, b) = (meridian.a, meridian.b);
        if (a / mu).hypotenuse(b / gamma) <= level {
            let mut found = Projection::fixed(Force::new(level, x[1], x[2], x[3]), zero);
            (1..4).for_each(|component| found.push_unit(component));
            return found;
        }
        let lambda = self.multiplier(a, b, level);
        let (p, q) = (a * kept(one, lambda, mu), b * kept(one, lambda, gamma));
        let mut found = Projection::fixed(meridian.force(level, p, q), zero);
        found.push(meridian.across(), kept(one, lambda, mu));
        let (along, aside) = (-q / (gamma * gamma), p / (mu * mu));
        let size = along.hypotenuse(aside);
        if size > zero {
            let (along, aside) = (along / size, aside / size);
            let (am, ag) = (along / mu, aside / gamma);
            let curvature = am * am + ag * ag;
            found.push(meridian.force(zero, along, aside), one / (one + lambda * curvature));
        }
        found
    }

    /// The root on `[0, 1]` of `(1 - 2 u) R(u) = right`, with `R^2 = (a mu / A)^2 + (b gamma / B)^2`,
    /// `A = mu^2 (1 - u) + u` and `B = gamma^2 (1 - u) + u`: by Newton's method between bounds. The left side falls.
    fn root<R: Real>(&self, a: R, b: R, right: R) -> R {
        let (one, two) = (R::from(1.0), R::from(2.0));
        // Of length one, so that no square overflows.
        let size = a.hypotenuse(b);
        let (a, b, right) = (a / size, b / size, right / size);
        let (mu, gamma) = (R::from(self.mu), R::from(self.gamma));
        let (mu2, gamma2) = (mu * mu, gamma * gamma);
        let (mut low, mut high) = (R::zero(), one);
        // Doubles come near to it.
        let mut u = if R::ROUNDING == 1.0 {
            R::zero()
        } else {
            R::from(self.root(a.value(), b.value(), right.value()).clamp(0.0, 1.0))
        };
        let rounded = 2.0 * f64::EPSILON * R::ROUNDING;
        for _ in 0..MAX_ROOT_STEPS {
            let (wide, twist) = (mu2 * (one - u) + u, gamma2 * (one - u) + u);
            let (p, q) = (a * mu / wide, b * gamma / twist);
            let reach = (p * p + q * q).square_root();
            let value = (one - two * u) * reach - right;
            if value > R::zero() {
                low = u;
            } else {
                high = u;
            }
            let falls = (p * p * (one - mu2) / wide + q * q * (one - gamma2) / twist) / reach;
            let slope = -two * reach - (one - two * u) * falls;
            let next = u - value / slope;
            let rounding = (reach + right.magnitude()).times(rounded);
            if value.magnitude() <= rounding || (next - u).magnitude() <= u.times(rounded) {
                return if next < low {
                    low
                } else if next > high {
                    high
                } else {
                    next
                };
            }
            u = if next > low && next < high { next } else { (low + high).times(0.5) };
        }
        u
    }

    /// The multiplier `lambda` for which `(a mu / (mu^2 + lambda), b gamma / (gamma^2 + lambda))` is as long as `level`.
    /// The reciprocal of that length is nearly linear: Newton's method rises to the root.
    fn multiplier<R: Real>(&self, a: R, b: R, level: R) -> R {
        let (mu, gamma) = (R::from(self.mu), R::from(self.gamma));
        let (mu2, gamma2) = (mu * mu, gamma * gamma);
        let rounded = 2.0 * f64::EPSILON * R::ROUNDING;
        let mut lambda = if R::ROUNDING == 1.0 {
            R::zero()
        } else {
            // Newton's method rises to the root.
            R::from(self.multiplier(a.value(), b.value(), level.value()) * (1.0 - 1e-12))
        };
        for _ in 0..MAX_ROOT_STEPS {
            let (wide, twist) = (mu2 + lambda, gamma2 + lambda);
            let (p, q) = (a * mu / wide, b * gamma / twist);
            let length = p.hypotenuse(q);
            let above = length / level - R::from(1.0);
            let step = above / ((p / length) * (p / length) / wide + (q / length) * (q / length) / twist);
            lambda += step;
            if above.value() <= rounded || step <= lambda.times(rounded) {
                break;
            }
        }
        lambda
    }
}

/// `1 / (1 + lambda / coefficient^2)` with `lambda = u / v`.
fn kept<R: Real>(v: R, u: R, coefficient: R) -> R {
    let inside = coefficient * coefficient * v;
    inside / (inside + u)
}

/// Bisection alone ends after these; Newton's steps take less than ten as a rule.
const MAX_ROOT_STEPS: usize = 220;

/// The half plane through the axis of the cone in which a force lies: `a` across the normal, `b` of torsion.
struct Meridian<R> {
    a: R,
    b: R,
    direction: [R; 2],
    twist: f64,
}

impl<R: Real> Meridian<R> {
    fn of(x: &Force<R>) -> Self {
        let zero = R::zero();
        let a = x[1].hypotenuse(x[2]);
        let direction = if a > zero { [x[1] / a, x[2] / a] } else { [R::from(1.0), zero] };
        Self { a, b: x[3].magnitude(), direction, twist: if x[3] < zero { -1.0 } else { 1.0 } }
    }

    fn force(&self, n: R, a: R, b: R) -> Force<R> {
        Force::new(n, a * self.direction[0], a * self.direction[1], b.times(self.twist))
    }

    /// The unit vector around the axis.
    fn across(&self) -> Force<R> {
        Force::new(R::zero(), -self.direction[1], self.direction[0], R::zero())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasp::contact::ContactForce;
    use crate::test_numbers::numbers;
    use crate::wrench_set::cone::cone_slope;

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
