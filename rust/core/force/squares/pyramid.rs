//! Projections onto a regular pyramid, the linearised cone of a hard finger, in closed form.
//!
//! The planes through the axis and an edge, or through the axis and the middle of a facet, are mirrors of the pyramid. The
//! nearest point lies between the same two mirrors as the force, so that one facet and one of its edges remain. In
//! coordinates `(n, a, b)`, `a` towards the middle of the facet and `b` from there towards the edge, the facet is
//! `a = apothem n` and the edge `(1, apothem, side) n`.

use std::f64::consts::{PI, TAU};

use crate::force::squares::projection::Projection;
use crate::grasp::contact::ContactForce;

/// How far, relative to its tangential part, an edge of a regular pyramid may be from its place: some roundings.
const ROUNDED_EDGE: f64 = 1e-13;

/// A pyramid with `edges` at the angles `2 pi h / edges`, beginning with `h = 1` (Eq. 3).
#[derive(Debug, Clone)]
pub(crate) struct Pyramid {
    edges: f64,
    /// The normal force of the extreme forces.
    unit: f64,
    apothem: f64,
    side: f64,
    /// Reciprocals of the squared lengths of `(1, apothem)` and of an edge.
    facet_square: f64,
    edge_square: f64,
    /// The directions of the edge at zero, of the facet behind it, of the next edge and so on.
    directions: Vec<[f64; 2]>,
}

impl Pyramid {
    /// The pyramid with these edges; `None` where they are others.
    pub(crate) fn of(forces: &[ContactForce]) -> Option<Self> {
        let unit = forces.first()?[0];
        let edges = forces.len() as f64;
        let mu = forces.last()?[1] / unit;
        let regular = |(h, force): (usize, &ContactForce)| {
            let (sine, cosine) = (TAU * (h + 1) as f64 / edges).sin_cos();
            let off = (force[1] - unit * mu * cosine).hypot(force[2] - unit * mu * sine);
            force[0] == unit && force[3] == 0.0 && off <= ROUNDED_EDGE * unit * mu
        };
        if forces.len() < 3 || mu.is_nan() || mu <= 0.0 || !forces.iter().enumerate().all(regular) {
            return None;
        }
        let (sine, cosine) = (PI / edges).sin_cos();
        let direction = |k: usize| (PI * k as f64 / edges).sin_cos();
        Some(Self {
            edges,
            unit,
            apothem: mu * cosine,
            side: mu * sine,
            facet_square: (1.0 + (mu * cosine).powi(2)).recip(),
            edge_square: (1.0 + mu * mu).recip(),
            directions: (0..2 * forces.len()).map(direction).map(|(s, c)| [c, s]).collect(),
        })
    }

    /// The nearest force whose share lies between the bounds.
    #[inline]
    pub(crate) fn project(&self, x: &ContactForce, low: f64, high: f64) -> Projection {
        let (o, t) = (x[1], x[2]);
        let angle = t.atan2(o) * (0.5 / PI) * self.edges;
        let edge = angle.round();
        // Towards the edge from the facet before it, or after it.
        let (turn, sign) = if angle < edge { (-1.0, 1.0) } else { (1.0, -1.0) };
        let at = (2.0 * edge + turn).rem_euclid(2.0 * self.edges) as usize;
        let middle = self.directions[at.min(self.directions.len() - 1)];
        let across = [-sign * middle[1], sign * middle[0]];
        let a = o * middle[0] + t * middle[1];
        let b = (o * across[0] + t * across[1]).max(0.0);
        let n = x[0];
        let tangential = |a: f64, b: f64| (a * middle[0] + b * across[0], a * middle[1] + b * across[1]);
        let force = |n: f64, a: f64, b: f64| {
            let (o, t) = tangential(a, b);
            ContactForce::new(n, o, t, 0.0)
        };
        let inside = n >= 0.0 && a <= self.apothem * n;
        let c = (n + self.apothem * a) * self.facet_square;
        let normal = if inside {
            n
        } else if b <= self.side * c {
            c
        } else {
            ((n + self.apothem * a + self.side * b) * self.edge_square).max(0.0)
        };
        let share = normal / self.unit;
        if share > high || share < low {
            let share = if share > high { high } else { low };
            return self.slice(share, (a, b), x, force);
        }
        if inside {
            let mut found = Projection::fixed(ContactForce::new(n, o, t, 0.0), share);
            for component in 0..3 {
                let mut axis = ContactForce::zeros();
                axis[component] = 1.0;
                found.push(axis, 1.0);
            }
            found.inside = true;
            return found;
        }
        if b <= self.side * c {
            let mut found = Projection::fixed(force(c, self.apothem * c, b), share);
            let length = self.facet_square.sqrt();
            found.push(force(length, self.apothem * length, 0.0), 1.0);
            found.push(force(0.0, 0.0, 1.0), 1.0);
            return found;
        }
        if normal == 0.0 {
            return Projection::fixed(ContactForce::zeros(), 0.0);
        }
        let mut found = Projection::fixed(force(normal, self.apothem * normal, self.side * normal), share);
        let length = self.edge_square.sqrt();
        found.push(force(length, self.apothem * length, self.side * length), 1.0);
        found
    }

    /// The nearest force of one share.
    #[inline]
    fn slice(
        &self,
        share: f64,
        (a, b): (f64, f64),
        x: &ContactForce,
        force: impl Fn(f64, f64, f64) -> ContactForce,
    ) -> Projection {
        let level = share * self.unit;
        if level == 0.0 {
            return Projection::fixed(ContactForce::zeros(), 0.0);
        }
        let (apothem, side) = (self.apothem * level, self.side * level);
        if a <= apothem {
            let mut found = Projection::fixed(ContactForce::new(level, x[1], x[2], 0.0), share);
            found.push(ContactForce::new(0.0, 1.0, 0.0, 0.0), 1.0);
            found.push(ContactForce::new(0.0, 0.0, 1.0, 0.0), 1.0);
            return found;
        }
        let mut found = Projection::fixed(force(level, apothem, b.min(side)), share);
        if b < side {
            found.push(force(0.0, 0.0, 1.0), 1.0);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::squares::polytope::Polytope;
    use crate::linalg::double_double::DoubleDouble;
    use crate::linalg::real::values;
    use crate::test_numbers::numbers;

    #[test]
    fn the_closed_form_is_what_the_search_over_faces_finds() {
        let mut number = numbers(5);
        for k in 0..20_000 {
            let (edges, mu, unit) = (3 + k % 14, 0.1 + 0.9 * number().abs(), 0.5 + 3.0 * number().abs());
            let edge = |h| {
                let (sine, cosine) = (TAU * f64::from(h) / f64::from(edges)).sin_cos();
                ContactForce::new(unit, unit * mu * cosine, unit * mu * sine, 0.0)
            };
            let mut polytope = Polytope::new((1..=edges).map(edge).collect(), false);
            polytope.low = if k % 3 == 0 { 0.3 } else { 0.0 };
            polytope.high = if k % 5 < 2 { 1.0 } else { f64::INFINITY };
            assert!(Pyramid::of(&polytope.forces).is_some());
            let mut x = ContactForce::from_fn(|_, _| 4.0 * number());
            x[3] = 0.0;
            let found = polytope.project(&x);
            // Numbers of 32 digits search.
            let searched = polytope.project(&x.map(DoubleDouble::from));
            let apart = (found.force - values(&searched.force)).norm();
            assert!(apart <= 1e-14 * (x.norm() + unit), "{polytope:?} {x} {found:?} {apart:e}");
            assert!((found.share - searched.share.value()).abs() <= 1e-13);
            if found.count != searched.count {
                continue;
            }
            let step = ContactForce::new(number(), number(), number(), 0.0);
            let along = |axes: &[ContactForce]| axes.iter().map(|a| a * a.dot(&step)).sum::<ContactForce>();
            let theirs: Vec<_> = searched.axes[..searched.count].iter().map(values).collect();
            let apart = (along(&found.axes[..found.count]) - along(&theirs)).norm();
            assert!(apart <= 1e-12, "{polytope:?} {x} {apart:e}");
        }
    }
}
