//! The support of a friction cone with unit normal force, hard (`gamma = 0`) or soft, in its contact frame.

use crate::grasp::contact::ContactForce;

/// `sqrt(mu^2 (h_o^2 + h_t^2) + gamma^2 h_torsion^2)` for `h = G_i^T z`.
#[inline]
pub(crate) fn cone_slope(h: &ContactForce, mu: f64, gamma: f64) -> f64 {
    let (o, t, torsion) = (mu * h[1], mu * h[2], gamma * h[3]);
    (o * o + t * t + torsion * torsion).sqrt()
}

/// The force of unit normal component in the cone that reaches furthest along `h`.
#[inline]
pub(crate) fn cone_support(h: &ContactForce, mu: f64, gamma: f64) -> ContactForce {
    let slope = cone_slope(h, mu, gamma);
    if slope == 0.0 {
        return ContactForce::new(1.0, 0.0, 0.0, 0.0);
    }
    let (tangential, torsional) = (mu / slope, gamma / slope);
    ContactForce::new(1.0, tangential * (mu * h[1]), tangential * (mu * h[2]), torsional * (gamma * h[3]))
}
