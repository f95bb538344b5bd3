//! Tolerances of grasps.

/// How far outside a bound on torques a vertex may lie, relative to its size: three rounded bounds meet in it.
pub(crate) const OUTSIDE_TORQUE_LIMITS: f64 = 1e-9;

/// A pivot of a metric's factor below this part of its diagonal entry cannot be told from zero: 32 digits, less four.
pub(crate) const INDEFINITE: f64 = 1e-28;

/// Cosine to the centre below which a normal points away from it: heights that differ by rounding or by noise are
/// no direction.
pub(crate) const AWAY_FROM_CENTRE: f64 = -1e-3;
