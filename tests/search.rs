//! The pruned choice among candidates is the unpruned one.

#[path = "../benches/common/mod.rs"]
mod common;

use graspforce::{CandidateSearch, Contact, Criterion, Grasp, QualityOptions};
use nalgebra::Vector3;

/// Contacts on a sphere at angles that make many candidates equal: a pattern about a symmetric centre.
fn pattern(center: [f64; 6], step: f64, index: usize, edges: usize) -> Vec<Contact> {
    let offset = |axis: usize| step * ((index / 3_usize.pow(axis as u32) % 3) as f64 - 1.0);
    (0..3)
        .map(|i| {
            let azimuth = center[2 * i] + offset(2 * i);
            let height = center[2 * i + 1] + offset(2 * i + 1);
            let (s, c) = azimuth.sin_cos();
            let outward = Vector3::new(c * height.cos(), s * height.cos(), height.sin());
            Contact::new(outward, -outward).friction(0.6).edges(edges)
        })
        .collect()
}

fn winner(prune: bool, criterion: Criterion, center: [f64; 6], step: f64) -> (usize, f64, f64, usize) {
    let mut search = CandidateSearch::<6>::new(QualityOptions::new(criterion), prune).expect("options");
    let mut last = (0, 0.0, 0.0, 0);
    // The pool of the first round serves the second.
    for scale in [1.0, 0.5] {
        let grasp = |index| Grasp::new(&pattern(center, scale * step, index, 6));
        let found = search.best(729, 364, None, grasp).expect("valid contacts");
        last = (found.index, found.rho, found.center_rho, found.counts.converged);
    }
    last
}

#[test]
fn pruning_changes_neither_the_winner_nor_its_quality() {
    let third = std::f64::consts::TAU / 3.0;
    let centers = [
        [0.0, 0.0, third, 0.0, 2.0 * third, 0.0],
        [0.1, 0.0, 2.0, 0.3, 4.4, -0.2],
        [0.0, 1.0, 0.0, 1.0, 0.0, 1.0],
    ];
    for center in centers {
        for criterion in [Criterion::Sum, Criterion::Max] {
            let pruned = winner(true, criterion, center, 0.2);
            let plain = winner(false, criterion, center, 0.2);
            assert_eq!((pruned.0, pruned.1, pruned.2), (plain.0, plain.1, plain.2), "{center:?}");
            assert!(pruned.3 <= plain.3);
        }
    }
}

#[test]
fn among_equals_the_centre_wins_and_else_the_lowest_number() {
    // All candidates but one are the same grasp.
    let grasp = |index: usize| {
        let spread = if index == 4 { 0.4 } else { 0.0 };
        let angles = [spread, 2.1, 4.2];
        Grasp::<3>::new(&angles.map(|angle: f64| {
            let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
            Contact::new(outward, -outward)
        }))
    };
    for prune in [true, false] {
        let mut search = CandidateSearch::new(QualityOptions::new(Criterion::Max), prune).expect("options");
        assert_eq!(search.best(7, 5, None, grasp).expect("valid").index, 5);
        assert_eq!(search.best(7, 4, None, grasp).expect("valid").index, 0);
    }
}

#[test]
fn a_candidate_that_is_no_grasp_is_named() {
    let mut search = CandidateSearch::new(QualityOptions::new(Criterion::Max), true).expect("options");
    let grasp = |index: usize| {
        let normal = if index == 2 { Vector3::zeros() } else { Vector3::x() };
        Grasp::<3>::new(&[Contact::new(Vector3::zeros(), normal)])
    };
    assert_eq!(search.best(4, 0, None, grasp).expect_err("no normal").0, 2);
    assert_eq!(search.best(4, 9, None, grasp).expect_err("no centre").0, 9);
}

#[test]
fn random_grasps_give_the_same_winner_with_and_without_pruning() {
    for (seed, criterion) in [(1, Criterion::Max), (2, Criterion::Sum), (3, Criterion::Max)] {
        let grasps = common::closed_grasps(seed, 60, 4, 8);
        let choose = |prune| {
            let mut search = CandidateSearch::new(QualityOptions::new(criterion), prune).expect("options");
            let found = search.best(60, 7, None, |index| Ok(grasps[index].clone())).expect("valid");
            (found.index, found.rho, found.center_rho)
        };
        assert_eq!(choose(true), choose(false));
    }
}
