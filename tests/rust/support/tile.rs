//! The paper's Example 2: four contacts on a tile, and its two dynamic wrenches.

use graspforce::{Contact, Grasp, Wrench};
use nalgebra::Vector3;

/// The contacts at `[phi_1, psi_1, phi_3, psi_3]`, with the printed coefficient 10 and limits of 10 N, and the
/// inferred friction 0.68. `edges` zero means true cones.
pub fn tile(c: [f64; 4], edges: usize) -> Grasp<6> {
    let sides = [(c[0], c[1], 1.0), (-c[0], -c[1], 1.0), (c[2], c[3], -1.0), (-c[2], -c[3], -1.0)];
    let contacts = sides.map(|(phi, psi, side)| {
        let height = 10.0 * (phi.powi(3) - 3.0 * psi * psi * phi) + side * 0.005;
        let slope = (30.0 * (phi * phi - psi * psi), -60.0 * psi * phi);
        let normal = Vector3::new(slope.0, slope.1, -1.0) * side;
        let contact =
            Contact::new(Vector3::new(phi, psi, height), normal).friction(0.68).max_normal_force(10.0);
        if edges == 0 { contact.cone() } else { contact.edges(edges) }
    });
    Grasp::new(&contacts).expect("the tile's contacts are valid")
}

/// The printed optimum for the maximum.
pub const OPTIMUM: [f64; 4] = [-0.2, 0.0375, 0.1992, -0.2];

/// The wrench of Fig. 6 at time `t` in s.
pub fn wrench(t: f64) -> Wrench<6> {
    let (s, c) = (0.2 * std::f64::consts::PI * t).sin_cos();
    Wrench::<6>::new(
        -0.7 * c - 0.4 * s - 7.8,
        0.2 * c - 1.4 * s + 2.2,
        -2.7 * c + 2.0,
        -0.7 * c - 1.1 * s + 0.8,
        c - 0.8 * s - 1.2,
        0.7 * c + 2.5,
    )
}
