//! How far forces can move along a direction that keeps the balance, and which contact stops them.

use nalgebra::Vector4;

use crate::force::true_cones::contact_status::{ContactStatus, load};
use crate::force::true_cones::optimal_point::OptimalPoint;
use crate::force::true_cones::optimality_system::Unknown;

/// An end of a segment: how far away it is, and the contact that stops there with the status that it takes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct End {
    pub(crate) at: f64,
    pub(crate) stop: Option<(usize, ContactStatus)>,
}

/// Steps along a direction of forces that keep all forces within their cones and below the level.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Segment {
    pub(crate) low: End,
    pub(crate) high: End,
}

impl Segment {
    fn everything() -> Self {
        Self { low: End { at: f64::NEG_INFINITY, stop: None }, high: End { at: f64::INFINITY, stop: None } }
    }

    /// Restricts the steps to those up to `at`.
    fn below(&mut self, at: f64, contact: usize, status: ContactStatus) {
        if at < self.high.at {
            self.high = End { at, stop: Some((contact, status)) };
        }
    }

    /// Restricts the steps to those from `at` on.
    fn above(&mut self, at: f64, contact: usize, status: ContactStatus) {
        if at > self.low.at {
            self.low = End { at, stop: Some((contact, status)) };
        }
    }

    /// Restricts the steps to those with `value + t slope >= 0`.
    fn nonnegative(&mut self, value: f64, slope: f64, contact: usize, status: ContactStatus) {
        if slope > 0.0 {
            self.above(-value / slope, contact, status);
        } else if slope < 0.0 {
            self.below(-value / slope, contact, status);
        }
    }

    /// Restricts the steps to those with `|y + t dy| <= n + t dn`.
    fn within_cone(
        &mut self,
        (x, dx): (&Vector4<f64>, &Vector4<f64>),
        contact: usize,
        status: ContactStatus,
    ) {
        // n^2 - |y|^2 = a t^2 + 2 b t + c
        let a = dx[0] * dx[0] - load(dx) * load(dx);
        let b = x[0] * dx[0] - (x[1] * dx[1] + x[2] * dx[2] + x[3] * dx[3]);
        let c = (x[0] - load(x)) * (x[0] + load(x));
        let size = dx.norm_squared();
        if a.abs() <= 1e-14 * size {
            self.nonnegative(c, 2.0 * b, contact, status);
            self.nonnegative(x[0], dx[0], contact, status);
            return;
        }
        let root = (b * b - a * c).max(0.0).sqrt();
        // Both roots without cancellation.
        let larger = -(b + root.copysign(b));
        let (first, second) = if larger == 0.0 { (0.0, 0.0) } else { (larger / a, c / larger) };
        let (first, second) = (first.min(second), first.max(second));
        if a < 0.0 {
            self.above(first, contact, status);
            self.below(second, contact, status);
        } else if dx[0] > 0.0 {
            self.above(second, contact, status);
        } else {
            self.below(first, contact, status);
        }
    }

    /// The steps along `along` from a point with these unknowns.
    pub(crate) fn of<const D: usize>(
        point: &OptimalPoint<D>,
        bounded: bool,
        unknowns: &[Unknown],
        along: &[f64],
    ) -> Self {
        let rise = match (unknowns.last(), along.last()) {
            (Some(Unknown::Level), Some(rise)) => *rise,
            _ => 0.0,
        };
        let mut segment = Self::everything();
        let mut at = 0;
        while at < unknowns.len() {
            let (Unknown::Share { contact } | Unknown::Coordinate { contact, .. }) = unknowns[at] else {
                break;
            };
            let status = point.contacts[contact].status;
            let x = point.force(contact);
            let mut dx = Vector4::zeros();
            if status == ContactStatus::FullSticking {
                dx[0] = rise;
            }
            while at < unknowns.len() {
                match unknowns[at] {
                    Unknown::Share { contact: c } if c == contact => dx[0] = along[at],
                    Unknown::Coordinate { contact: c, k } if c == contact => dx[k] = along[at],
                    _ => break,
                }
                at += 1;
            }
            let saturated = match status {
                ContactStatus::Sliding => Some(ContactStatus::FullSliding),
                ContactStatus::Sticking => Some(ContactStatus::FullSticking),
                _ => None,
            };
            if let Some(saturated) = saturated.filter(|_| bounded) {
                segment.nonnegative(point.level - x[0], rise - dx[0], contact, saturated);
            }
            match status {
                ContactStatus::Sliding => {
                    segment.nonnegative(x[0], dx[0], contact, ContactStatus::Idle);
                }
                ContactStatus::Sticking => {
                    segment.within_cone((&x, &dx), contact, ContactStatus::Sliding);
                }
                ContactStatus::FullSticking => {
                    segment.within_cone((&x, &dx), contact, ContactStatus::FullSliding);
                }
                ContactStatus::Idle | ContactStatus::FullSliding => {}
            }
        }
        segment
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_numbers::numbers;

    #[test]
    fn a_segment_is_what_of_a_line_lies_in_the_cone() {
        let mut next = numbers(1);
        for case in 0..2000 {
            let mut x = Vector4::from_fn(|_, _| next());
            x[0] = load(&x) + next().abs() * f64::from(case % 3);
            let mut dx = Vector4::from_fn(|_, _| next());
            if case % 5 == 0 {
                dx[0] = load(&dx).copysign(next());
            }
            let mut segment = Segment::everything();
            segment.within_cone((&x, &dx), 0, ContactStatus::Sliding);
            let inside = |t: f64| (x + dx * t)[0] - load(&(x + dx * t));
            assert!(segment.low.at <= 1e-12 && segment.high.at >= -1e-12, "{case} {segment:?}");
            for end in [segment.low.at, segment.high.at] {
                if end.is_finite() {
                    assert!(
                        inside(end).abs() <= 1e-9 * (1.0 + end * end),
                        "{case} {segment:?} {}",
                        inside(end)
                    );
                    let beyond = end + if end == segment.low.at { -0.1 } else { 0.1 };
                    assert!(inside(beyond) <= 1e-9, "{case}");
                } else {
                    assert!(inside(end.signum() * 1e6) >= -1e-6, "{case} {segment:?}");
                }
            }
        }
    }
}
