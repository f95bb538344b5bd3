//! Numbers of some 32 digits: unevaluated sums of two doubles (Dekker, Numerische Mathematik 18, 1971).
//!
//! Columns that differ by a billionth make bases whose inverses lose nine digits, twice where two of them meet. With 32
//! digits every decision of the simplex method stays clear.

use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// `high + low`, where `low` is at most half a unit in the last place of `high`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct DoubleDouble {
    high: f64,
    low: f64,
}

/// Splits a double into two halves of 26 bits.
const SPLITTER: f64 = 134_217_729.0;

fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let high = a + b;
    DoubleDouble { high, low: b - (high - a) }
}

fn halves(a: f64) -> (f64, f64) {
    let t = SPLITTER * a;
    let high = t - (t - a);
    (high, a - high)
}

fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
    (product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2)
}

impl DoubleDouble {
    pub(crate) const ZERO: Self = Self { high: 0.0, low: 0.0 };
    pub(crate) const ONE: Self = Self { high: 1.0, low: 0.0 };

    pub(crate) fn value(self) -> f64 {
        self.high + self.low
    }

    pub(crate) fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    pub(crate) fn max(self, other: Self) -> Self {
        if other > self { other } else { self }
    }

    /// The square root of a positive number; zero of any other.
    pub(crate) fn sqrt(self) -> Self {
        if self.high.partial_cmp(&0.0) != Some(Ordering::Greater) {
            return Self::ZERO;
        }
        let root = Self::from(self.high.sqrt());
        // One step of Newton's doubles the digits.
        root + (self - root * root) / (root + root)
    }

    /// The product with a double.
    pub(crate) fn times(self, factor: f64) -> Self {
        let (high, low) = two_product(self.high, factor);
        quick_two_sum(high, low + self.low * factor)
    }
}

impl From<f64> for DoubleDouble {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl PartialOrd for DoubleDouble {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        match self.high.partial_cmp(&other.high) {
            Some(Ordering::Equal) => self.low.partial_cmp(&other.low),
            order => order,
        }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = two_sum(self.high, other.high);
        let (tail, rest) = two_sum(self.low, other.low);
        let first = quick_two_sum(high, low + tail);
        quick_two_sum(first.high, first.low + rest)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let (high, low) = two_product(self.high, other.high);
        quick_two_sum(high, low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other.times(first);
        let second = rest.high / other.high;
        let third = (rest - other.times(second)).high / other.high;
        let sum = quick_two_sum(first, second);
        sum + Self::from(third)
    }
}

impl AddAssign for DoubleDouble {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for DoubleDouble {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl MulAssign for DoubleDouble {
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl DivAssign for DoubleDouble {
    fn div_assign(&mut self, other: Self) {
        *self = *self / other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_quotients_keep_thirty_digits() {
        let third = DoubleDouble::ONE / DoubleDouble::from(3.0);
        let rest = third.times(3.0) - DoubleDouble::ONE;
        assert!(rest.abs().value() < 1e-31);
        let tiny = DoubleDouble::ONE + DoubleDouble::from(1e-25);
        let square = tiny * tiny - DoubleDouble::ONE;
        assert!((square.value() - 2e-25).abs() < 1e-31);
        let root = DoubleDouble::from(2.0).sqrt();
        assert!((root * root - DoubleDouble::from(2.0)).value().abs() < 1e-31);
        assert_eq!(DoubleDouble::from(-1.0).sqrt(), DoubleDouble::ZERO);
        assert!(((square / DoubleDouble::from(1e-25)).value() - 2.0).abs() < 1e-5);
    }
}
