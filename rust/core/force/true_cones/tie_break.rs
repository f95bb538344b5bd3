//! The choice among optimal forces: the least sum where the maximum is minimised, then the least
//! `sum_i |f_i|^2 / f_i^U^2`.

use nalgebra::SVector;

use crate::force::true_cones::choice::Choice;
use crate::force::true_cones::face_choice::FaceChoice;
use crate::force::true_cones::optimal_point::{ConeConditions, OptimalPoint};
use crate::force::true_cones::optimality_system::{OptimalitySystem, Unknown};
use crate::force::true_cones::segment::Segment;

/// Directions along which the sum changes by less, relative to their length, keep it.
const CONSTANT_SUM: f64 = 1e-9;

/// Its buffers.
#[derive(Debug, Clone)]
pub(crate) struct TieBreak<const D: usize> {
    along: Vec<f64>,
    moved: OptimalPoint<D>,
    face: FaceChoice<D>,
}

impl<const D: usize> TieBreak<D> {
    pub(crate) fn new(contacts: usize) -> Self {
        Self {
            along: Vec::with_capacity(4 * contacts + 1),
            moved: OptimalPoint::new(contacts),
            face: FaceChoice::new(contacts),
        }
    }

    /// Chooses among the forces that satisfy the conditions at the point for the wrench `target`. The factorised system
    /// of the point has free directions.
    pub(crate) fn choose(
        &mut self,
        conditions: &ConeConditions<D>,
        point: &mut OptimalPoint<D>,
        target: &SVector<f64, D>,
        system: &OptimalitySystem<D>,
    ) -> Choice {
        if system.free_directions() == 1 {
            return self.along_a_line(conditions, point, system);
        }
        let mut sum_changes = false;
        for which in 0..system.free_directions() {
            system.null_vector(which, &mut self.along);
            let length = length(&self.along);
            if !conditions.least_sum
                && self.along.last().is_some_and(|rise| rise.abs() > CONSTANT_SUM * length)
            {
                let raised = system.unknowns.last() == Some(&Unknown::Level);
                if raised {
                    return Choice::Open;
                }
            }
            sum_changes |= sum_of(&system.unknowns, &self.along).abs() > CONSTANT_SUM * length;
        }
        self.face.choose(conditions, point, target, conditions.least_sum && sum_changes)
    }

    fn along_a_line(
        &mut self,
        conditions: &ConeConditions<D>,
        point: &mut OptimalPoint<D>,
        system: &OptimalitySystem<D>,
    ) -> Choice {
        let Self { along, moved, .. } = self;
        let unknowns = &system.unknowns;
        system.null_vector(0, along);
        let segment = Segment::of(point, conditions.bounded, unknowns, along);
        let (low, high) = (segment.low.at, segment.high.at);
        let sum = sum_of(unknowns, along);
        if conditions.least_sum && sum.abs() > CONSTANT_SUM * length(along) {
            let step = if sum > 0.0 { low } else { high };
            if !step.is_finite() {
                return Choice::Open;
            }
            point.advance(unknowns, along, step);
            return Choice::Unique;
        }
        moved.level = point.level;
        moved.contacts.copy_from_slice(&point.contacts);
        moved.advance(unknowns, along, 1.0);
        let (mut slope, mut bend) = (0.0, 0.0);
        for (contact, cone) in conditions.cones.iter().enumerate() {
            let x = point.force(contact);
            let dx = moved.force(contact) - x;
            let weighted = dx.component_mul(&cone.weights);
            slope += weighted.dot(&x);
            bend += weighted.dot(&dx);
        }
        let least = if bend > 0.0 { -slope / bend } else { 0.0 };
        let step = if low > high { f64::midpoint(low, high) } else { least.max(low).min(high) };
        if step.is_finite() {
            point.advance(unknowns, along, step);
        }
        Choice::LeastNorm
    }
}

/// How the sum of the shares below the level changes along a direction.
fn sum_of(unknowns: &[Unknown], along: &[f64]) -> f64 {
    let is_share =
        |unknown: &Unknown| matches!(unknown, Unknown::Share { .. } | Unknown::Coordinate { k: 0, .. });
    unknowns.iter().zip(along).filter(|(unknown, _)| is_share(unknown)).map(|(_, change)| change).sum()
}

fn length(along: &[f64]) -> f64 {
    along.iter().map(|x| x * x).sum::<f64>().sqrt()
}
