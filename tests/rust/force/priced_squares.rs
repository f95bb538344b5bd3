//! Least squares beside a price of the residual: every wrench has an answer.

use graspforce::{ContactForce, Distribution, ForceDistributor, Grasp, SquaresOptions};
use support::problems::Random;

use super::squares::{KINDS, assert_allowed, grasp, price, wrench};

#[test]
fn every_wrench_has_an_answer_with_a_price() {
    let mut random = Random::new(45);
    for turn in 0..600 {
        let grasp = grasp(&mut random, 1 + turn % 5, KINDS[turn % 6]);
        let value = 10.0_f64.powf(random.within(-8.0, 12.0));
        let mut options =
            SquaresOptions { slack: Some(price(value)), limits: turn % 2 == 0, ..SquaresOptions::default() };
        if turn % 7 == 0 {
            options.min_normal = vec![0.2];
        }
        let distributor = ForceDistributor::squares(&grasp, options.clone()).unwrap();
        let mut workspace = distributor.workspace();
        let size = 10.0_f64.powf(random.within(-2.0, 2.0));
        for external in [wrench::<6>(&mut random, size), wrench::<6>(&mut random, size)] {
            let found = distributor.solve(&mut workspace, &external).unwrap();
            assert_allowed(&grasp, &options, &external, &found);
            // The multiplier is the price of the residual.
            let apart = (found.residual + found.dual / value).norm();
            let pressing: f64 = found.forces.iter().map(ContactForce::norm).sum();
            assert!(
                apart <= 2e-9 * (external.norm() + found.residual.norm()) + 1e-14 * pressing,
                "{turn} {apart:e}"
            );
            assert_stationary(&grasp, &options, &found);
        }
    }
}

/// Each force is the one of its set that reaches furthest along what the multiplier leaves of it: a proof of optimality that
/// knows nothing of projections.
fn assert_stationary(grasp: &Grasp<6>, options: &SquaresOptions<6>, found: &Distribution<6>) {
    let low = options.min_normal.first().copied().unwrap_or(0.0);
    let (mut gap, mut size) = (0.0, 0.0);
    for (i, (force, share)) in found.forces.iter().zip(&found.shares).enumerate() {
        let pull = grasp.maps()[i].tr_mul(&found.dual) - force;
        let furthest = furthest_share(grasp, i, &pull);
        // The objective is concave: what is furthest among forces up to twice as strong is so among all.
        let near = 2.0 * share.max(low) + furthest.max(0.0);
        let high = if options.limits { near.min(1.0) } else { near };
        gap += furthest * if furthest > 0.0 { high } else { low } - pull.dot(force);
        size += grasp.maps()[i].norm() * found.dual.norm() * force.norm() + force.norm_squared();
    }
    assert!(gap.abs() <= 1e-9 * size, "{gap:e} {size:e}");
}

/// How far a force of share one reaches along `h`.
fn furthest_share(grasp: &Grasp<6>, i: usize, h: &ContactForce) -> f64 {
    let contact = &grasp.contacts()[i];
    if grasp.edges(i).is_some() {
        let alone = Grasp::<6>::new(std::slice::from_ref(contact)).unwrap();
        return alone.extreme_forces().unwrap().iter().map(|f| f.dot(h)).fold(f64::NEG_INFINITY, f64::max);
    }
    let slope = (contact.friction * h[1].hypot(h[2])).hypot(contact.torsion * h[3]);
    (h[0] + slope) * contact.max_normal_force
}
