//! Limits that change: the answers are those of a grasp with these limits and without the contacts that are off.

use graspforce::{Contact, Criterion, ForceDistributor, Grasp, NearestOptions, SquaresOptions, Wrench};
use nalgebra::Vector3;
use support::problems::Random;

fn feet(random: &mut Random, cone: bool) -> Vec<Contact> {
    [(0.3, 0.2), (0.3, -0.2), (-0.3, 0.2), (-0.3, -0.2)]
        .map(|(x, y)| {
            let normal = Vector3::new(random.within(-0.2, 0.2), random.within(-0.2, 0.2), 1.0);
            let foot = Contact::new(Vector3::new(x, y, 0.0), normal).friction(0.6).max_normal_force(3.0);
            if cone { foot.cone() } else { foot.edges(8) }
        })
        .to_vec()
}

fn distributor(grasp: &Grasp<6>, which: usize) -> ForceDistributor<6> {
    match which {
        0 => ForceDistributor::new(grasp, Criterion::Max).unwrap(),
        1 => ForceDistributor::new(grasp, Criterion::Sum).unwrap(),
        _ => {
            let options =
                SquaresOptions { limits: true, weights: vec![1.0, 2.0, 1.0, 0.5], ..Default::default() };
            ForceDistributor::squares(grasp, options).unwrap()
        }
    }
}

#[test]
fn limits_give_the_answers_of_a_grasp_with_these_limits() {
    let mut random = Random::new(61);
    for turn in 0..60 {
        let contacts = feet(&mut random, turn % 2 == 0 && turn % 3 == 2);
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        let mut changing = distributor(&grasp, turn % 3);
        let mut workspace = changing.workspace();
        for step in 0..8 {
            let mut limits: Vec<f64> = (0..4).map(|_| random.within(0.5, 4.0)).collect();
            if step % 2 == 1 {
                limits[step / 2] = 0.0;
            }
            changing.set_limits(&mut workspace, &limits).unwrap();
            assert_eq!(changing.limits(), limits);
            let on: Vec<usize> = (0..4).filter(|&i| limits[i] > 0.0).collect();
            let reduced: Vec<Contact> =
                on.iter().map(|&i| contacts[i].clone().max_normal_force(limits[i])).collect();
            let reduced = Grasp::<6>::new(&reduced).unwrap();
            let fixed = if turn % 3 == 2 {
                let weights = on.iter().map(|&i| [1.0, 2.0, 1.0, 0.5][i]).collect();
                let options = SquaresOptions { limits: true, weights, ..Default::default() };
                ForceDistributor::squares(&reduced, options).unwrap()
            } else {
                distributor(&reduced, turn % 3)
            };
            for _ in 0..3 {
                let x = Vector3::new(random.within(-0.05, 0.05), random.within(-0.05, 0.05), 0.0);
                let weight = Vector3::new(0.0, 0.0, -random.within(1.0, 2.0));
                let external = graspforce::wrench_of_force::<6>(&x, &weight);
                let found = changing.solve(&mut workspace, &external);
                let expected = fixed.solve(&mut fixed.workspace(), &external);
                match (found, expected) {
                    (Ok(found), Ok(expected)) => {
                        for (&i, force) in on.iter().zip(&expected.forces) {
                            assert!(
                                (found.forces[i] - force).norm() <= 1e-7,
                                "{turn} {i} {} {force}",
                                found.forces[i]
                            );
                        }
                        assert!((found.sigma - expected.sigma).abs() <= 1e-8 * expected.sigma);
                        let mut rows = [f64::NAN; 12];
                        changing.solve_into(&mut workspace, &external, &mut rows).unwrap();
                        for (i, row) in rows.chunks(3).enumerate() {
                            assert!((0..3).all(|k| (row[k] - found.forces[i][k]).abs() <= 1e-9), "{rows:?}");
                        }
                    }
                    (Err(found), Err(expected)) => {
                        assert_eq!(found.is_infeasible(), expected.is_infeasible());
                    }
                    (found, expected) => panic!("{found:?} {expected:?}"),
                }
                let options = NearestOptions::default();
                let found = changing.nearest(&mut workspace, &external, &options).unwrap();
                assert!((0..4).all(|i| limits[i] > 0.0 || found.forces[i].norm() == 0.0));
                assert!(found.sigma_max <= 1.0 + 2e-9);
            }
        }
    }
}

#[test]
fn a_foot_that_fades_in_moves_the_forces_no_faster_than_its_limit() {
    // A load of 2 on four feet; the fourth touches down with a limit that grows from nothing.
    let mut random = Random::new(62);
    let grasp = Grasp::<6>::new(&feet(&mut random, true)).unwrap();
    let options = SquaresOptions { limits: true, ..Default::default() };
    let mut distributor = ForceDistributor::squares(&grasp, options).unwrap();
    let mut workspace = distributor.workspace();
    let external =
        graspforce::wrench_of_force::<6>(&Vector3::new(0.08, 0.02, 0.0), &Vector3::new(0.0, 0.0, -2.0));
    let mut last: Option<Vec<graspforce::ContactForce>> = None;
    let ticks = 500;
    for tick in 0..=ticks {
        let limit = 3.0 * f64::from(tick) / f64::from(ticks);
        distributor.set_limits(&mut workspace, &[3.0, 3.0, 3.0, limit]).unwrap();
        let now = distributor.solve(&mut workspace, &external).unwrap();
        if let Some(last) = last {
            let jump = now.forces.iter().zip(&last).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            // The limit grows by 6 mN a tick.
            assert!(jump <= 2.0 * 3.0 / f64::from(ticks), "{tick} {jump:e}");
        }
        last = Some(now.forces);
    }
}

#[test]
fn contacts_that_are_all_off_balance_nothing_but_no_wrench() {
    let mut random = Random::new(63);
    let grasp = Grasp::<6>::new(&feet(&mut random, true)).unwrap();
    let mut distributor = distributor(&grasp, 0);
    let mut workspace = distributor.workspace();
    distributor.set_limits(&mut workspace, &[0.0; 4]).unwrap();
    let external = Wrench::<6>::new(0.0, 0.0, -1.0, 0.0, 0.0, 0.0);
    assert!(distributor.solve(&mut workspace, &external).unwrap_err().is_infeasible());
    assert_eq!(distributor.solve(&mut workspace, &Wrench::zeros()).unwrap().sigma, 0.0);
    let nearest = distributor.nearest(&mut workspace, &external, &NearestOptions::default()).unwrap();
    assert_eq!(nearest.distance, 1.0);
    distributor.set_limits(&mut workspace, &[3.0; 4]).unwrap();
    assert!(distributor.solve(&mut workspace, &external).unwrap().sigma > 0.0);
    let refused = distributor.set_limits(&mut workspace, &[1.0, -1.0, 1.0, 1.0]).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "max_normal_force, contact 1: -1 must be zero, or within 1e-140 to 1e140 N"
    );
}
