//! The pruned choice among candidates is the unpruned one.

use graspforce::{
    BoxBound, CandidateSearch, Contact, Criterion, Error, Grasp, GraspOptions, QualityOptions, Stencil,
};
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
    let (row, error) = search.best(4, 9, None, grasp).expect_err("no centre");
    assert!(row == 9 && error.to_string().starts_with("center_index: 9"), "{error}");
}

#[test]
fn random_grasps_give_the_same_winner_with_and_without_pruning() {
    for (seed, criterion) in [(1, Criterion::Max), (2, Criterion::Sum), (3, Criterion::Max)] {
        let grasps = support::problems::closed_grasps(seed, 60, 4, 8);
        let choose = |prune| {
            let mut search = CandidateSearch::new(QualityOptions::new(criterion), prune).expect("options");
            let found = search.best(60, 7, None, |index| Ok(grasps[index].clone())).expect("valid");
            (found.index, found.rho, found.center_rho)
        };
        assert_eq!(choose(true), choose(false));
    }
}

#[test]
fn an_open_candidate_has_its_distance_as_quality() {
    // Thin for its size: an upper bound near zero is met before all artificial vertices are gone.
    let positions = [
        [0.926_225_675_160_788_6, 0.025_706_029_105_770_307, 0.488_276_779_025_802_47],
        [0.541_309_099_148_933_4, -0.629_744_935_581_684_5, 0.384_172_030_297_226_46],
        [0.217_726_079_492_738_4, 0.220_713_370_392_503_63, 1.217_066_024_400_473],
        [0.190_542_302_588_251_4, 0.408_625_295_013_827_77, -1.089_827_898_965_239_7],
        [0.204_331_880_552_986_48, 0.575_960_067_273_003, -0.862_244_400_805_991_7],
    ];
    let axes = Vector3::new(1.0, 0.8, 1.3);
    let contacts = positions.map(|p| {
        let p = Vector3::from(p);
        let outward = p.component_div(&axes).component_div(&axes);
        Contact::new(p, -outward)
    });
    for criterion in [Criterion::Sum, Criterion::Max] {
        let mut search = CandidateSearch::<6>::new(QualityOptions::new(criterion), true).expect("options");
        let found = search.best(1, 0, None, |_| Grasp::new(&contacts)).expect("valid");
        assert!((found.rho - 0.004_875_705_593_900_9).abs() < 1e-12, "{criterion:?} {found:?}");
    }
}

#[test]
fn a_box_of_no_grasps_or_of_too_many_is_refused_and_spoils_nothing() {
    let grasp = |vertex: usize| {
        let angles = [0.0, [2.8, 3.0][vertex]];
        Grasp::<3>::new(&angles.map(|angle: f64| {
            let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
            Contact::new(outward, -outward)
        }))
    };
    let mut bound = BoxBound::new(QualityOptions::new(Criterion::Max)).expect("options");
    assert!(bound.over(&[0.01], None, 0.0, |_| 0..0, grasp).is_err());
    for axes in [1, 2, 63, 64, usize::MAX] {
        assert!(
            bound.over(&[0.01], Some(Stencil { axes, safety: 1.5 }), 0.0, |_| 0..2, grasp).is_err(),
            "{axes}"
        );
    }
    let mut fresh = BoxBound::new(QualityOptions::new(Criterion::Max)).expect("options");
    let after = bound.over(&[0.01], None, 1e-3, |_| 0..2, grasp).expect("two vertices");
    assert_eq!(after, fresh.over(&[0.01], None, 1e-3, |_| 0..2, grasp).expect("two vertices"));
    assert!(after[0] >= -grasp(1).unwrap().quality(Criterion::Max).unwrap().rho);
}

#[test]
fn a_vertex_whose_wrenches_cannot_be_measured_is_named_by_its_own_row() {
    let grasp = |row: usize| {
        let limit = if row == 3 { 1e139 } else { 1.0 };
        let options = GraspOptions { length_scale: 1e-10, ..GraspOptions::default() };
        let contacts = [-1.0, 1.0].map(|x: f64| {
            Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(-x, 0.0, 0.0)).max_normal_force(limit)
        });
        Grasp::<3>::with_options(&contacts, options)
    };
    let mut bound = BoxBound::new(QualityOptions::new(Criterion::Max)).unwrap();
    let refused = bound.over(&[0.0; 2], None, 0.0, |index| 2 * index..2 * index + 2, grasp);
    assert!(matches!(refused, Err((3, Error::InvalidGrasp { .. }))), "{refused:?}");
}
