//! The least maximum of shares over true cones beside a high price of the residual: the cap of all shares at which a larger
//! cap costs as much as it saves.

use crate::force::nearest::by_price::{Cost, Point, Pricing, Trial};
use crate::force::nearest::vertices::Vector;
use crate::force::squares::dual::Dual;
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::CLOSE_GAP;

/// How much smaller than the gap of the least maximum that of the forces up to a cap has to be.
const PRECISER: f64 = 1e-3;

/// Caps of the shares that are tried at one weight.
const MAX_CAPS: usize = 40;

impl<const D: usize> Pricing<'_, D> {
    /// The least maximum: the cap of all shares that costs as much as it saves.
    pub(super) fn lower_cap(&mut self, weight: f64, point: Point<D>) -> Point<D> {
        let Cost::Shares { of_sum, max: true } = self.cost else { return point };
        if self.vertices.is_some() {
            // Vertices lower the maximum themselves.
            return point;
        }
        // What a larger cap costs more than it saves.
        let loss = |dual: &Dual<D>, y: &Vector<D>| {
            dual.contacts.iter().fold(DoubleDouble::from(weight), |left, contact| {
                let gain = contact.furthest(&contact.pull(y)).times(contact.unit)
                    - DoubleDouble::from(weight * of_sum);
                if gain > DoubleDouble::ZERO { left - gain } else { left }
            })
        };
        let least = self.bounds.iter().map(|(low, _)| *low).fold(0.0, f64::max);
        let (mut low, mut low_y, mut low_loss, mut part) = (least, None, f64::NEG_INFINITY, 0.1_f64);
        let (mut high, mut high_loss) = (point.forces.totals().0, loss(&self.dual, &point.y).value());
        let mut best = point;
        for turn in 0..MAX_CAPS {
            if high_loss <= 0.0 || best.excess <= CLOSE_GAP * best.cost || self.has_to_end() {
                break;
            }
            // What the multiplier proves of the least maximum is near to it from below.
            let proven = (high - best.excess / weight).max(low);
            let cap = if turn % 4 == 3 { 0.5 * (low + high) } else { proven + (high - proven) * part };
            if cap <= low || cap >= high {
                break;
            }
            let enough = CLOSE_GAP.max(PRECISER * best.excess / best.cost);
            let Some(found) = self.at(&Trial { weight, cap, enough }, &[best.y], &best.forces) else { break };
            let now = loss(&self.dual, &found.y).value();
            if now < 0.0 {
                (low, low_y, low_loss, part) = (cap, Some(found.y), now, part.sqrt());
            } else {
                (high, high_loss, part) = (cap, now, part * part);
                best = found;
            }
            // Between both multipliers lies one whose cap costs as much as it saves.
            if let Some(low_y) = low_y {
                let share = -low_loss / (high_loss - low_loss);
                let y = low_y + (best.y - low_y).map(|x| x.times(share));
                let (excess, ..) = self.excess(weight, &y, &best.exact, &best.forces);
                let lower = self.lower(&y, &best.forces);
                if excess < best.excess {
                    (best.excess, best.proof) = (excess, y);
                    best.lower = best.lower.max(lower);
                }
            }
        }
        best
    }
}
