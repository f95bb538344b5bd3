//! What fuzzing found, each as the law it broke: numbers nobody means are answered finitely, or refused.

use graspforce::{
    CandidateSearch, Contact, ContactForce, Criterion, DistributionOptions, Error, ForceModel, Grasp,
    GraspOptions, Metric, MinkowskiSum, QualityOptions, QualityWorkspace, Status, TriangleTree, Wrench,
};
use nalgebra::{SMatrix, Vector3};
use support::balance::assert_balanced;
use support::control_loop::ControlLoop;
use support::duality::assert_proven;

fn spatial(contacts: &[([f64; 3], [f64; 3])]) -> Vec<Contact> {
    contacts.iter().map(|(r, n)| Contact::new(Vector3::from(*r), Vector3::from(*n))).collect()
}

fn cage() -> Vec<Contact> {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    corners.map(|r| Contact::new(Vector3::from(r), -Vector3::from(r)).friction(0.7)).to_vec()
}

#[test]
fn norms_that_cannot_be_squared_are_refused() {
    let options = GraspOptions { length_scale: 1.4e306, ..GraspOptions::default() };
    let refused = Grasp::<6>::with_options(&cage(), options);
    assert!(matches!(refused, Err(Error::InvalidGrasp { argument: "length_scale", .. })), "{refused:?}");
    let metric = Metric::<6>::from_matrix(&(SMatrix::identity() * 1e300));
    assert!(matches!(metric, Err(Error::InvalidInput { argument: "metric", .. })), "{metric:?}");
}

#[test]
fn the_direction_of_the_smallest_quality_has_unit_length() {
    let mut contacts =
        spatial(&[([9.5e-7, -0.0625, -0.0625], [3.8e146, 5.875, 5.875]), ([7.9; 3], [0.0, 1.75, 1.1])]);
    contacts[0] = contacts[0].clone().friction(1.9).torsion(7.9).max_normal_force(7.9).cone();
    contacts[1].forces = ForceModel::Extreme(vec![ContactForce::new(3.9e-34, 1.3, 0.0, 0.0)]);
    let options = GraspOptions { friction_margin: 7.9, length_scale: 1e130, ..GraspOptions::default() };
    let grasp = Grasp::<6>::with_options(&contacts, options).unwrap();
    for criterion in [Criterion::Max, Criterion::Sum] {
        let quality = grasp.quality(criterion).unwrap();
        assert!((quality.metric.norm(&quality.direction) - 1.0).abs() < 1e-9, "{quality:?}");
        let gradient =
            grasp.gradient(&QualityOptions::new(criterion), &mut QualityWorkspace::default()).unwrap();
        assert!(gradient.positions.iter().flatten().all(|x| x.is_finite()), "{gradient:?}");
    }
}

#[test]
fn a_wrench_whose_forces_would_overflow_is_refused_also_in_a_known_region() {
    let distributor = ControlLoop::new(&Grasp::<6>::new(&cage()).unwrap(), Criterion::Max).unwrap();
    let weight = Wrench::<6>::new(0.0, 0.0, -1.0, 0.0, 0.0, 0.0);
    distributor.solve(&weight).unwrap();
    let mut forces = vec![7.0; 12];
    for size in [1.7e308, 1e200, 1e-200] {
        let refused = distributor.solve(&(weight * size));
        assert!(
            matches!(refused, Err(Error::InvalidInput { argument: "external_wrench", .. })),
            "{refused:?}"
        );
        assert!(distributor.solve_into(&(weight * size), &mut forces).is_err());
        let batch = distributor.solve_many(&[weight, weight * size], false).unwrap();
        assert_eq!(batch.status, [Status::Solved, Status::Invalid]);
    }
    assert!(forces.iter().all(|x| *x == 7.0), "untouched");
    for size in [1e130, 1e-130] {
        let sigma = distributor.solve(&(weight * size)).unwrap().sigma / size;
        assert!((sigma - distributor.solve(&weight).unwrap().sigma).abs() < 1e-9);
    }
}

#[test]
fn a_weight_that_leaves_nothing_of_the_maximum_is_refused() {
    let mut options = DistributionOptions::default();
    options.weight = 2.8e101;
    let refused = ControlLoop::with_options(&Grasp::<6>::new(&cage()).unwrap(), Criterion::Max, options);
    assert!(matches!(refused, Err(Error::InvalidInput { argument: "weight", .. })));
}

#[test]
fn contacts_with_listed_forces_beside_true_cones_count_by_multiples_of_their_forces() {
    let mut contacts = cage().into_iter().map(Contact::cone).collect::<Vec<_>>();
    // This one pulls: its forces have negative normal components, and still take effort.
    contacts[3].forces = ForceModel::Extreme(vec![
        ContactForce::new(-2.0, 1.0, 0.0, 0.0),
        ContactForce::new(-2.0, -1.0, 1.0, 0.0),
        ContactForce::new(2.0, 0.0, -1.0, 0.0),
    ]);
    let grasp = Grasp::<6>::new(&contacts).unwrap();
    let mut solved = 0;
    for criterion in [Criterion::Max, Criterion::Sum] {
        let distributor = ControlLoop::new(&grasp, criterion).unwrap();
        for k in 0..50 {
            let external =
                Wrench::<6>::from_fn(|row, _| f64::sin(f64::from(row as u8) * 7.0 + f64::from(k) + 0.3));
            let Ok(found) = distributor.solve(&external) else { continue };
            solved += 1;
            assert_proven(&grasp, &external, &found, 0.0);
            assert!(found.sigma_max > 0.0 && found.sigma_sum >= found.sigma_max, "{found:?}");
        }
    }
    assert!(solved > 20, "{solved}");
}

#[test]
fn tangents_and_forces_that_make_no_finite_wrenches_are_refused() {
    let mut contacts = cage();
    contacts[1].tangent = Some(Vector3::new(f64::NAN, 1.0, 0.0));
    let refused = Grasp::<6>::new(&contacts);
    assert!(matches!(refused, Err(Error::InvalidGrasp { argument: "tangents", contact: Some(1), .. })));
    let mut contacts = cage();
    contacts[2].forces = ForceModel::Extreme(vec![ContactForce::new(0.0, 0.0, 0.0, 1.5e-307)]);
    assert!(Grasp::<6>::new(&contacts).is_err());
}

#[test]
fn forces_over_true_cones_balance_also_beside_a_contact_that_is_far_away() {
    let contacts = [
        Contact::new(Vector3::new(7.0625, 0.0, 0.0), Vector3::new(7.1875, -6.875, -7.25))
            .friction(3.0625)
            .torsion(3.0625)
            .max_normal_force(0.125)
            .cone(),
        Contact::new(Vector3::new(-6.4375, 3.0625, 3.0625), Vector3::x()).friction(0.0625).edges(3),
        Contact::new(Vector3::new(8_589_934_592.0, 1.9375, 1.9375), Vector3::new(2.9375, 7.0625, 7.0625))
            .friction(7.0625)
            .cone(),
        Contact::new(Vector3::repeat(7.1875), Vector3::new(7.1875, 7.1875, 3.0625))
            .friction(3.0625)
            .torsion(3.0625)
            .max_normal_force(3.0625)
            .edges(7),
    ];
    let grasp = Grasp::<6>::new(&contacts).unwrap();
    let mut options = DistributionOptions::default();
    options.rtol = 1e-6;
    let distributor = ControlLoop::with_options(&grasp, Criterion::Sum, options).unwrap();
    let external = Wrench::<6>::new(7.1875, 7.1875, 0.0, 0.0, 0.0, 6.8125);
    match distributor.solve(&external) {
        Ok(found) => assert_balanced(&grasp, &external, &found),
        refused => assert!(matches!(refused, Err(Error::NotConverged { .. })), "{refused:?}"),
    }
}

#[test]
fn what_only_a_contact_a_billion_times_weaker_balances_is_not_called_infeasible() {
    let contact = |r: [f64; 2], n: [f64; 2], friction, limit| {
        Contact::new(Vector3::new(r[0], r[1], 0.0), Vector3::new(n[0], n[1], 0.0))
            .friction(friction)
            .max_normal_force(limit)
    };
    let grasp = Grasp::<3>::new(&[
        contact([2.5, 1.1875], [1.0, 1.0], 0.5, 1.0),
        contact([1.1875, 3.8125], [-1.0, 0.0], 0.5, 1.0),
        contact([1.1875, 1.1875], [-1.0, -1.0], 0.5, 1.0),
        contact([1.1875, 3.8125], [-1.0, 0.0], 4.1875, 4.1875),
        contact([4.1875, 4.1875], [1.0, 1.0], 0.125, 1.3e-8),
    ])
    .unwrap();
    for criterion in [Criterion::Max, Criterion::Sum] {
        let distributor = ControlLoop::new(&grasp, criterion).unwrap();
        for external in [[1.1875, 1.1875, 5.3125], [2.4375, 0.875, 4.1875], [1.1875, 0.6, 0.0]] {
            let external = Wrench::<3>::from(external);
            match distributor.solve(&external) {
                Ok(found) => assert_balanced(&grasp, &external, &found),
                refused => assert!(matches!(refused, Err(Error::NotConverged { .. })), "{refused:?}"),
            }
        }
    }
}

#[test]
fn a_center_far_away_hides_no_candidate() {
    let contact = Vector3::new(-5.5, 5.4375, -5.5);
    let candidate = |k: usize| {
        let away = if k == 0 { Vector3::new(0.7, 0.0, 7.2e111) } else { Vector3::zeros() };
        Grasp::<6>::new(&[Contact::new(contact + away, -contact).friction(0.0)])
    };
    for prune in [false, true] {
        let mut search = CandidateSearch::new(QualityOptions::new(Criterion::Sum), prune).unwrap();
        assert_eq!(search.best(3, 0, None, candidate).map(|winner| winner.index), Ok(1), "prune {prune}");
    }
}

#[test]
fn meshes_and_points_whose_distances_overflow_are_refused() {
    let corners = [Vector3::zeros(), Vector3::x(), Vector3::new(0.0, 0.0, -1.6e283)];
    assert!(matches!(
        TriangleTree::new(&corners, &[[0, 1, 2]]),
        Err(Error::InvalidInput { argument: "vertices", row: Some(2), .. })
    ));
    let tree = TriangleTree::new(&[Vector3::zeros(), Vector3::x(), Vector3::y()], &[[0, 1, 2]]).unwrap();
    let refused = tree.closest_many(&[Vector3::zeros(), Vector3::repeat(1e300)]);
    assert!(matches!(refused, Err(Error::InvalidInput { argument: "points", row: Some(1), .. })));
}

#[test]
fn sizes_that_would_fill_memory_are_refused_before_it_is_taken() {
    let soft = cage().into_iter().map(|contact| contact.torsion(0.1).edges(65_536)).collect::<Vec<_>>();
    assert!(matches!(Grasp::<6>::new(&soft), Err(Error::InvalidGrasp { argument: "edges", .. })));
    let many = vec![cage()[0].clone().edges(65_536); 17];
    assert!(matches!(
        Grasp::<6>::new(&many),
        Err(Error::InvalidGrasp { argument: "edges", contact: Some(16), .. })
    ));
    let large = cage().into_iter().map(|contact| contact.edges(2000)).collect::<Vec<_>>();
    let sum = MinkowskiSum::with_limit(&Grasp::<6>::new(&large).unwrap(), u128::MAX);
    assert!(matches!(sum, Err(Error::TooLarge { .. })));
}

#[test]
fn hundreds_of_equal_contacts_are_balanced_at_once() {
    let contacts: Vec<_> = cage().iter().cycle().take(1200).cloned().collect();
    let distributor = ControlLoop::new(&Grasp::<6>::new(&contacts).unwrap(), Criterion::Max).unwrap();
    let four = ControlLoop::new(&Grasp::<6>::new(&cage()).unwrap(), Criterion::Max).unwrap();
    let external = Wrench::<6>::new(0.1, 0.2, -1.0, 0.0, 0.1, 0.0);
    let start = std::time::Instant::now();
    let (many, few) = (distributor.solve(&external).unwrap(), four.solve(&external).unwrap());
    assert!((300.0 * many.sigma_max - few.sigma_max).abs() < 1e-9 * few.sigma_max);
    // It took minutes while the third level was sought at any price.
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
}

#[test]
fn a_contact_of_immense_strength_does_not_hide_how_far_the_others_stay_away() {
    let contact = |x: f64, y: f64, limit: f64| {
        let mut contact = Contact::new(Vector3::new(x, y, 0.0), Vector3::new(1.0, 1.0, 0.0));
        contact.max_normal_force = limit;
        contact.friction(0.0)
    };
    for limit in [1e9, 1e30, 5.6e112] {
        // Both push along (1, 1): the weaker one alone sets the distance.
        let contacts = [contact(2.8, 2.8, 1.0), contact(-7.6, 5.4, limit)];
        let quality = Grasp::<3>::new(&contacts).unwrap().quality(Criterion::Sum).unwrap();
        assert!(quality.converged && (quality.rho - 1.0).abs() < 1e-9, "{limit:e}: {quality:?}");
    }
}

#[test]
fn a_strong_contact_never_pulls_however_small_its_share_is_beside_a_weak_one() {
    let contact = |r: [f64; 2], n: [f64; 2], friction: f64, limit: f64| {
        let planar = |v: [f64; 2]| Vector3::new(v[0], v[1], 0.0);
        Contact::new(planar(r), planar(n)).friction(friction).max_normal_force(limit)
    };
    let contacts = [
        contact([2.5, 1.1875], [1.1875, 1.1875], 0.5, 1.0),
        contact([1.1875, 3.8125], [-8.0, 0.0], 0.5, 1.0),
        contact([1.1875, 1.1875], [-1.1875, -1.1875], 0.5, 1.0),
        contact([1.1875, 3.8125], [-8.0, 0.0], 4.1875, 4.1875),
        contact([4.1875, 4.1875], [1.1875, 1.1875], 0.125, 1.303_851_6e-8),
    ];
    let grasp = Grasp::<3>::new(&contacts).unwrap();
    for criterion in [Criterion::Max, Criterion::Sum] {
        let distributor = ControlLoop::new(&grasp, criterion).unwrap();
        for external in [[1.1875, -3.1875, 0.0], [8.6e-217, 1.1875, 1.1875], [1.1875, -2.5, 0.0]] {
            let Ok(found) = distributor.solve(&Wrench::<3>::from(external)) else { continue };
            let largest = found.forces.iter().map(ContactForce::amax).fold(0.0, f64::max);
            for (contact, force) in contacts.iter().zip(&found.forces) {
                let outside = force[2].abs() - contact.friction * force[0];
                assert!(force[0] >= -1e-8 * largest && outside <= 1e-8 * largest, "{found:?}");
            }
        }
    }
}

#[test]
fn forces_that_drown_in_the_torsion_of_an_immense_one_are_no_answer() {
    let mut contact = Contact::new(Vector3::new(-2.75, 1.1875, 2.5), Vector3::new(2.75, -1.1875, -2.5));
    contact.tangent = Some(Vector3::new(-0.5, 1.1875, 1.1875));
    let force = |f: [f64; 4]| ContactForce::from(f);
    contact.forces = ForceModel::Extreme(vec![
        force([0.125, 5.3125, 5.3125, 5.3125]),
        force([0.0, 1.1875, 1.1875, 1.1875]),
        force([1.1875, 4.0625, 3.25, 0.0]),
        force([1.5625, 0.0, -0.1875, 1.2e103]),
        force([5.3125, 0.0, 1.1875, 1.1875]),
        force([1.1875, 1.1875, 4.0625, 3.25]),
    ]);
    let distributor = ControlLoop::new(&Grasp::<6>::new(&[contact]).unwrap(), Criterion::Max).unwrap();
    let external = Wrench::<6>::new(-2.75, 1.1875, 1.1875, 0.0, 0.0, 0.0);
    let refused = distributor.solve(&external);
    assert!(matches!(refused, Err(Error::NotConverged { .. })), "{refused:?}");
}

#[test]
fn a_wrench_beyond_what_can_be_squared_is_refused_also_after_one_that_was_balanced() {
    let position = Vector3::new(4.97e-316, 0.0, 0.0);
    let grasp = Grasp::<3>::new(&[Contact::new(position, -position)]).unwrap();
    let distributor = ControlLoop::new(&grasp, Criterion::Max).unwrap();
    distributor.solve(&Wrench::<3>::new(5.3125, -0.0625, 0.0)).unwrap();
    let refused = distributor.solve(&Wrench::<3>::new(5.3125, -0.0625, -3e306));
    assert!(matches!(refused, Err(Error::InvalidInput { .. })), "{refused:?}");
}

#[test]
fn the_direction_to_wrenches_whose_squares_vanish_has_unit_length() {
    let mut contact = Contact::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(-1.0, -2.0, -3.0));
    for size in [1e-155, 1e-160, 1e-200] {
        let weak = ContactForce::new(size, 0.3 * size, -0.2 * size, 0.0);
        contact.forces = ForceModel::Extreme(vec![ContactForce::new(1.0, 0.0, 0.0, 0.0), weak]);
        let quality = Grasp::<6>::new(&[contact.clone()]).unwrap().quality(Criterion::Max).unwrap();
        assert!((quality.metric.norm(&quality.direction) - 1.0).abs() < 1e-9, "{quality:?}");
    }
}

#[test]
fn a_witness_along_which_a_weak_contact_pushes_is_none_whatever_solver_found_it() {
    let contacts = [(-1.0, 1e14), (1.0, 1.0)].map(|(x, limit): (f64, f64)| {
        let contact = Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(-x, 0.0, 0.0));
        contact.friction(0.5).max_normal_force(limit)
    });
    // The second contact alone balances it.
    let external = Wrench::<6>::new(1.0, -0.5, 0.0, 0.0, 0.0, -0.5);
    for cones in [false, true] {
        let contacts = contacts.clone().map(|contact| if cones { contact.cone() } else { contact });
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        for least in [vec![], vec![1e-3]] {
            let mut options = DistributionOptions::default();
            options.min_normal = least;
            let distributor = ControlLoop::with_options(&grasp, Criterion::Max, options).unwrap();
            let found = distributor.solve(&external);
            assert!(!matches!(found, Err(Error::InfeasibleWrench { .. })), "{found:?}");
        }
        let most = grasp.resistance(&[external], Criterion::Max, None);
        assert!(most.as_ref().map_or(true, |most| most[0] > 0.1), "{most:?}");
    }
}

#[test]
fn a_grasp_that_is_thinner_than_its_longest_wrench_can_tell_is_not_certified_thick() {
    let contact = |r: [f64; 2], n: [f64; 2], friction: f64, limit: f64| {
        let planar = |v: [f64; 2]| Vector3::new(v[0], v[1], 0.0);
        Contact::new(planar(r), planar(n)).friction(friction).max_normal_force(limit)
    };
    let contacts =
        [contact([0.75; 2], [-0.75; 2], 3.1875, 3.1875), contact([1e13, 6.5625], [1.0; 2], 4.8125, 9.518e-7)];
    let grasp = Grasp::<3>::new(&contacts).unwrap();
    for criterion in [Criterion::Max, Criterion::Sum] {
        let quality = grasp.quality(criterion).unwrap();
        // Across the weak contact's forces the grasp reaches no further than a few of these.
        assert!(-quality.upper <= 1e-5, "{quality:?}");
    }
}
