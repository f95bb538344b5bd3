//! No answer is returned as solved that does not balance its own wrench, within its cones, at its proven objective.

use graspforce::{
    Contact, ContactForce, Criterion, Distribution, DistributionOptions, Error, ForceModel, Grasp, Status,
    Wrench, WrenchSet,
};
use nalgebra::Vector3;
use support::balance::assert_balanced;
use support::control_loop::ControlLoop;
use support::duality::{assert_proven, assert_reaches_one};
use support::friction_cone::slip;
use support::random::Random;
use support::reference_cases::{close, value};

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];

/// How far an answer is from balance and from its cones, relative to its strongest contact.
fn wrong<const D: usize>(grasp: &Grasp<D>, external: &Wrench<D>, answer: &Distribution<D>) -> f64 {
    let wrenches = answer.contact_wrenches(grasp);
    let residual = (wrenches.iter().sum::<Wrench<D>>() + external).amax();
    let effort = wrenches.iter().map(Wrench::amax).fold(external.amax(), f64::max);
    let mut worst = residual / effort;
    for (contact, f) in grasp.contacts().iter().zip(&answer.forces) {
        if !matches!(contact.forces, ForceModel::Extreme(_)) {
            let slip = slip(contact, D == 3, f);
            worst = worst.max(slip / (answer.sigma_max * contact.max_normal_force));
        }
    }
    if answer.forces.iter().all(|f| f.iter().all(|x| x.is_finite())) { worst } else { f64::INFINITY }
}

#[test]
fn an_empty_batch_has_no_rows_and_the_next_solve_answers() {
    let fingers = [(-1.0, 1.0), (1.0, -1.0)]
        .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)));
    let distributor = ControlLoop::new(&Grasp::<3>::new(&fingers).unwrap(), Criterion::Max).unwrap();
    for parallel in [false, true] {
        let batch = distributor.solve_many(&[], parallel).unwrap();
        assert!(batch.status.is_empty() && batch.forces.is_empty());
        assert!(distributor.solve(&Wrench::<3>::new(0.0, -1.0, 0.0)).is_ok());
    }
}

/// Fingers on the unit sphere whose wrenches lie on the edges of true cones: the hardest of all wrenches there are.
#[test]
fn true_cones_balance_wrenches_on_their_boundary_or_say_that_they_cannot() {
    let mut random = Random(7);
    let (mut solved, mut refused) = (0, 0);
    for case in 0..300 {
        let contacts: Vec<_> = (0..3 + case % 3)
            .map(|_| {
                let p = random.direction();
                Contact::new(p, -p).cone()
            })
            .collect();
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        let mut options = DistributionOptions::default();
        options.rtol = 1e-6;
        for criterion in BOTH {
            let distributor = ControlLoop::with_options(&grasp, criterion, options.clone()).unwrap();
            for k in 0..4 {
                let mut external = Wrench::<6>::zeros();
                let mut spent = 0.0;
                for map in grasp.maps().iter().take(1 + k % 2) {
                    let (s, c) = (std::f64::consts::TAU * random.next()).sin_cos();
                    let n = 0.1 + random.next();
                    spent += n;
                    external -= map * ContactForce::new(n, 0.5 * n * c, 0.5 * n * s, 0.0);
                }
                match distributor.solve(&external) {
                    Ok(answer) => {
                        assert!(wrong(&grasp, &external, &answer) <= 1e-8, "{case}: {answer:?}");
                        assert!(
                            answer.gap <= 1e-6 && answer.sigma <= spent * (1.0 + 1e-6),
                            "{case}: {answer:?}"
                        );
                        solved += 1;
                    }
                    Err(Error::NotConverged { .. } | Error::InfeasibleWrench { .. }) => refused += 1,
                    Err(other) => panic!("{other}"),
                }
                let batch = distributor.solve_many(&[external], false).unwrap();
                if batch.status[0] == Status::Solved {
                    let forces = batch.forces.chunks(3).zip(grasp.maps());
                    let wrench: Wrench<6> =
                        forces.map(|(f, map)| map * ContactForce::new(f[0], f[1], f[2], 0.0)).sum();
                    assert!((wrench + external).amax() <= 1e-8 * (batch.sigma_sum[0] + external.amax()));
                }
            }
        }
    }
    println!("{solved} solved, {refused} refused");
    assert!(solved > 4 * refused, "{solved} solved, {refused} refused");
}

/// Families in which one direction is weaker than double precision can tell from rounding.
#[test]
fn ill_conditioned_grasps_answer_right_or_not_at_all() {
    let mut random = Random(11);
    let (mut solved, mut refused) = (0, 0);
    for case in 0..400 {
        let size = 10_f64.powf(-10.0 * random.next());
        let away = random.direction();
        let family = case % 3;
        let contacts: Vec<_> = (0..4)
            .map(|i| {
                let p = random.direction();
                let normal = -p + 0.2 * random.direction();
                let shrink = size.powf(if i == 0 { 0.0 } else { random.next() });
                let contact = Contact::new(if family == 0 { away + p * size } else { p }, normal);
                match family {
                    1 => contact.max_normal_force(shrink),
                    2 => contact.friction(0.5 * shrink),
                    _ => contact,
                }
            })
            .collect();
        let Ok(grasp) = Grasp::<6>::new(&contacts) else { continue };
        let wrenches = grasp.primitive_wrenches().unwrap().to_vec();
        for criterion in BOTH {
            let distributor = ControlLoop::new(&grasp, criterion).unwrap();
            for k in 0..12 {
                let mut external = Wrench::<6>::from_fn(|_, _| 2.0 * random.next() - 1.0);
                if k % 4 > 0 {
                    let share = |j: usize, x: f64| if j % 3 == k % 3 || k % 4 == 1 { -x } else { 0.0 };
                    external = wrenches.iter().enumerate().map(|(j, w)| w * share(j, random.next())).sum();
                }
                let many = distributor.solve_many(&[external], false).unwrap();
                match distributor.solve(&external) {
                    Ok(answer) => {
                        let context = format!("case {case}, size {size:e}, wrench {k}: {answer:?}");
                        assert!(wrong(&grasp, &external, &answer) <= 1e-6, "{context}");
                        assert!(answer.gap <= 1e-6, "{context}");
                        solved += 1;
                    }
                    Err(Error::NotConverged { .. } | Error::InfeasibleWrench { .. }) => refused += 1,
                    Err(other) => panic!("{other}"),
                }
                assert!(many.status[0] == Status::Solved || many.forces[0].is_nan());
            }
        }
    }
    println!("{solved} solved, {refused} refused");
    assert!(2 * solved > refused, "{solved} solved, {refused} refused");
}

#[test]
fn no_finger_pulls_where_another_direction_is_weak() {
    for (e, bad) in [(1e-9, 1e-7), (1e-11, 1e-5), (1e-6, 1e-5), (1e-10, 1e-6)] {
        let points = [(-1.0, e), (-1.0, -e), (1.0, e), (1.0, -e), (0.0, 1.0)];
        let normals = [(1.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (-1.0, 0.0), (0.0, -1.0)];
        let contacts: Vec<_> = points
            .iter()
            .zip(normals)
            .map(|(p, n)| {
                Contact::new(Vector3::new(p.0, p.1, 0.0), Vector3::new(n.0, n.1, 0.0)).friction(0.0)
            })
            .collect();
        let grasp = Grasp::<3>::new(&contacts).unwrap();
        for criterion in BOTH {
            let distributor = ControlLoop::new(&grasp, criterion).unwrap();
            let refused = distributor.solve(&Wrench::<3>::new(1.0, -bad, 0.0));
            assert!(matches!(refused, Err(Error::InfeasibleWrench { .. })), "{e} {bad}: {refused:?}");
            assert!(distributor.solve(&Wrench::<3>::new(1.0, bad, 0.0)).is_ok());
        }
    }
}

#[test]
fn what_cannot_be_computed_with_is_refused_and_never_solved_with_nan() {
    let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
        Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).max_normal_force(1e-100)
    });
    let distributor = ControlLoop::new(&Grasp::<3>::new(&fingers).unwrap(), Criterion::Max).unwrap();
    for load in [1e300, 1e100, 1e-310, 5e-324] {
        let refused = distributor.solve(&Wrench::<3>::new(0.0, -load, 0.0));
        assert!(
            matches!(refused, Err(Error::InvalidInput { argument: "external_wrench", .. })),
            "{refused:?}"
        );
    }
    assert!(distributor.solve(&Wrench::<3>::new(0.0, -1.0, 0.0)).is_ok());
}

#[test]
fn cones_of_any_limit_keep_forces_in_their_interior() {
    for limit in [1e-120, 1e-30, 1.0, 1e30, 1e110] {
        let contacts: Vec<_> = (0..5_u8)
            .map(|i| {
                let (s, c) = (2.4 * f64::from(i)).sin_cos();
                let p = Vector3::new(c, s, 0.4 * f64::from(i) - 0.8).normalize();
                Contact::new(p, -p).max_normal_force(limit)
            })
            .collect();
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        for criterion in BOTH {
            let distributor = ControlLoop::new(&grasp, criterion).unwrap();
            for k in 0..60 {
                let external = Wrench::<6>::from_fn(|row, _| limit * (f64::from(k) + 1.7 * row as f64).sin());
                let answer = distributor.solve(&external).unwrap();
                assert!(wrong(&grasp, &external, &answer) <= 1e-9, "{limit:e} {k}: {answer:?}");
            }
        }
    }
}

#[test]
fn true_cones_beside_general_extreme_forces_sum_up_their_coefficients() {
    let mut contacts: Vec<_> = (0..5_u8)
        .map(|i| {
            let (s, c) = (2.4 * f64::from(i)).sin_cos();
            let p = Vector3::new(c, s, 0.4 * f64::from(i) - 0.8).normalize();
            Contact::new(p, -p).friction(0.6).cone()
        })
        .collect();
    // Its normal forces are a third of its coefficients or less.
    let forces = [(0.3, 0.2, 0.0), (0.3, -0.1, 0.2), (0.2, -0.1, -0.2)];
    contacts[0].forces =
        ForceModel::Extreme(forces.map(|(n, o, t)| ContactForce::new(n, o, t, 0.0)).to_vec());
    let grasp = Grasp::<6>::new(&contacts).unwrap();
    let mut options = DistributionOptions::default();
    options.rtol = 1e-7;
    for criterion in BOTH {
        let distributor = ControlLoop::with_options(&grasp, criterion, options.clone()).unwrap();
        for k in 0..40 {
            let external = Wrench::<6>::from_fn(|row, _| (f64::from(k) + 1.7 * row as f64).sin());
            let answer = distributor.solve(&external).unwrap();
            let largest = answer.shares.iter().copied().fold(0.0, f64::max);
            assert!(close(largest, answer.sigma_max, 1e-12) && answer.gap <= 1e-7);
            assert!(close(answer.shares.iter().sum(), answer.sigma_sum, 1e-12));
            assert!(answer.shares[0] >= answer.forces[0][0] / 0.3 - 1e-9);
            assert!(wrong(&grasp, &external, &answer) <= 1e-9);
            assert!(close(value(criterion, &answer), answer.sigma, 1e-12));
        }
    }
}

/// Fingers whose preload alone sets the maximum leave the sum to the tie-break, which needs many pivots.
#[test]
fn the_tie_break_reaches_the_least_sum_however_many_pivots_it_takes() {
    let mut random = Random(3);
    let (mut ties, mut most) = (0, 0);
    for case in 0..150 {
        let contacts: Vec<_> = (0..7)
            .map(|_| {
                let p = random.direction();
                Contact::new(p, -p + 0.2 * random.direction()).edges(8)
            })
            .collect();
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        let mut bounds = vec![0.025; 7];
        bounds[case % 7] = 1.0;
        let mut options = DistributionOptions::default();
        options.min_normal.clone_from(&bounds);
        let external = -grasp
            .primitive_wrenches()
            .unwrap()
            .chunks(8)
            .zip(&bounds)
            .map(|(wrenches, bound)| wrenches[case % 8] * (bound + 0.1 * random.next()).min(1.0))
            .sum::<Wrench<6>>();
        let distributor = ControlLoop::with_options(&grasp, Criterion::Max, options.clone()).unwrap();
        let answer = distributor.solve(&external).unwrap();
        if !close(answer.sigma_max, 1.0, 1e-9) {
            continue;
        }
        ties += 1;
        most = most.max(answer.pivots);
        // The sum alone, at a maximum that cannot be less: a weight so large that nothing else counts.
        options.weight = 1e3;
        let weighed = ControlLoop::with_options(&grasp, Criterion::Max, options).unwrap();
        let least = weighed.solve(&external).unwrap();
        if close(least.sigma_max, 1.0, 1e-9) {
            assert!(
                answer.sigma_sum <= least.sigma_sum * (1.0 + 1e-8),
                "{case}: {} {}",
                answer.sigma_sum,
                least.sigma_sum
            );
        }
    }
    println!("{ties} ties, at most {most} pivots");
    assert!(ties > 50 && most > 40);
}

/// The third level must find the same forces from any basis, also where forces have many sets of coefficients.
#[test]
fn preloaded_forces_do_not_depend_on_history_on_soft_and_symmetric_grasps() {
    let mut random = Random(5);
    let mut compared = 0;
    for case in 0..60 {
        let symmetric = case % 2 == 0;
        let axes = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()];
        let contacts: Vec<_> = (0..[3, 4, 6][case % 3])
            .map(|i| {
                let p = if symmetric { axes[i] } else { random.direction() };
                let contact = Contact::new(p, -p).edges(if symmetric { 8 } else { 4 + i % 3 });
                if symmetric { contact } else { contact.torsion(0.3 * random.next()) }
            })
            .collect();
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        let wrenches = grasp.primitive_wrenches().unwrap();
        let mut options = DistributionOptions::default();
        options.min_normal = (0..contacts.len()).map(|i| [0.1, 0.25, 0.0][i % 3]).collect();
        for criterion in BOTH {
            let warm = ControlLoop::with_options(&grasp, criterion, options.clone()).unwrap();
            for _ in 0..12 {
                let grid = |x: f64| if symmetric { (4.0 * x).round() / 4.0 } else { x };
                let mut external: Wrench<6> =
                    -wrenches.iter().map(|w| w * grid(random.next()) * 0.2).sum::<Wrench<6>>();
                for (i, bound) in options.min_normal.iter().enumerate() {
                    external -= wrenches[grasp.edges(i).unwrap().start] * *bound;
                }
                let Ok(answer) = warm.solve(&external) else { continue };
                let fresh = ControlLoop::with_options(&grasp, criterion, options.clone()).unwrap();
                let fresh = fresh.solve(&external).unwrap();
                let largest = fresh.forces.iter().map(ContactForce::amax).fold(0.0, f64::max);
                for (f, g) in answer.forces.iter().zip(&fresh.forces) {
                    assert!((f - g).amax() <= 1e-6 * largest, "{case} {criterion:?}: {f} {g}");
                }
                compared += 1;
            }
        }
    }
    assert!(compared > 1000, "{compared}");
}

/// Its torques make a whole component of the wrench less than the tolerance of balance.
#[test]
fn beside_a_contact_far_away_the_dual_proves_what_the_forces_balance() {
    let mut random = Random(23);
    let (mut solved, mut left_over) = (0, 0);
    for case in 0..240 {
        let distance = 10_f64.powf(7.0 + 4.0 * random.next());
        let contacts: Vec<_> = (0..4 + case % 2)
            .map(|i| {
                let r = random.direction() * 7.0;
                let far = if i == 2 { Vector3::x() * distance } else { Vector3::zeros() };
                let limit = if i == 0 { 0.125 } else { 3.0 * random.next() + 0.1 };
                let contact =
                    Contact::new(r + far, random.direction() - 0.1 * r).friction(7.0 * random.next());
                let soft = if i % 2 == 0 { contact.torsion(3.0 * random.next()) } else { contact };
                let (soft, edges) = (soft.max_normal_force(limit), 4 + case % 9);
                if i == 2 && case % 3 > 0 { soft.cone() } else { soft.edges(edges) }
            })
            .collect();
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        let mut options = DistributionOptions::default();
        options.rtol = if grasp.is_finite() { 1e-9 } else { 1e-6 };
        let external = Wrench::<6>::from_fn(|row, _| if row < 3 { 3.0 } else { 6.0 * random.next() - 3.0 });
        for criterion in BOTH {
            let distributor = ControlLoop::with_options(&grasp, criterion, options.clone()).unwrap();
            let Ok(answer) = distributor.solve(&external) else { continue };
            assert_balanced(&grasp, &external, &answer);
            assert_proven(&grasp, &external, &answer, 2.0 * answer.gap);
            assert_reaches_one(&WrenchSet::new(&grasp, criterion), &grasp, &answer);
            solved += 1;
            let alone = -external.dot(&answer.dual);
            left_over += u32::from((alone - answer.sigma).abs() > 1e-3 * answer.sigma);
        }
    }
    println!("{solved} solved, {left_over} of them for another wrench by a share of 1e-3 of the objective");
    assert!(solved > 200 && left_over > 5, "{solved} solved, {left_over} with a residual that counts");
}

/// One edge's tangential force is rounding of a sine, and the heights differ by rounding: its torque is 1e-24.
#[test]
fn two_feet_whose_edges_lie_in_their_line_but_for_rounding_carry_their_load() {
    for edges in 4..13 {
        for height in [-6.67e-10, 3e-12, 1e-8] {
            let foot = |x: f64, z: f64| {
                Contact::new(Vector3::new(x, 0.0, z), Vector3::z()).friction(1.0).edges(edges)
            };
            let grasp = Grasp::<6>::new(&[
                foot(0.033_267_896_428_769_934, height),
                foot(-0.033_267_896_428_769_934, 0.0),
            ]);
            let grasp = grasp.unwrap();
            let external = Wrench::<6>::new(0.0, 0.0, -0.582_740_773_44, 0.0, 0.0, 0.0);
            for criterion in BOTH {
                let distributor = ControlLoop::new(&grasp, criterion).unwrap();
                let answer = distributor.solve(&external).unwrap();
                let expected = if criterion == Criterion::Max { 0.291_370_386_72 } else { 0.582_740_773_44 };
                assert!(close(answer.sigma, expected, 1e-9), "{edges} {height:e}: {answer:?}");
                assert!(wrong(&grasp, &external, &answer) <= 1e-9, "{answer:?}");
            }
        }
    }
}
