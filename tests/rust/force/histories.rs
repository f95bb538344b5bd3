//! One answer: the forces depend on the wrench, not on what was solved before, and move with it.

use graspforce::{Contact, Criterion, DistributionOptions, ForceDistributor, Grasp, Status, Wrench};
use nalgebra::Vector3;
use support::control_loop::ControlLoop;
use support::reference_cases::spatial_cases;

/// A square of fingers around a disc: symmetric, so that neither maximum nor sum determines the forces.
fn square(edges: usize) -> Grasp<6> {
    let contacts = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)].map(|(x, y)| {
        let position = Vector3::new(x, y, 0.0);
        Contact::new(position, -position).edges(edges).friction(0.6).max_normal_force(2.0)
    });
    Grasp::new(&contacts).unwrap()
}

/// A closed smooth path of wrenches.
fn path(t: f64) -> Wrench<6> {
    let (s, c) = t.sin_cos();
    let (s2, c2) = (2.0 * t).sin_cos();
    Wrench::<6>::new(0.4 * c, 0.5 * s, -1.0 + 0.2 * c2, 0.1 * s2, 0.1 * c, 0.15 * s)
}

fn grasps() -> Vec<Grasp<6>> {
    let reference = spatial_cases().into_iter().take(7).map(|case| Grasp::new(&case.contacts).unwrap());
    reference.chain([square(4), square(8), square(12)]).collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

#[test]
fn forces_do_not_depend_on_what_was_solved_before() {
    for (index, grasp) in grasps().iter().enumerate() {
        for criterion in [Criterion::Sum, Criterion::Max] {
            let [forth, back] = [(); 2].map(|()| ControlLoop::new(grasp, criterion).unwrap());
            let size = grasp.num_contacts() * grasp.force_dim();
            let steps: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.0157).collect();
            let solve = |distributor: &ControlLoop<6>, t: f64| {
                let mut forces = vec![0.0; size];
                distributor.solve_into(&path(t), &mut forces).unwrap();
                forces
            };
            let there: Vec<_> = steps.iter().map(|t| solve(&forth, *t)).collect();
            let mut again: Vec<_> = steps.iter().rev().map(|t| solve(&back, *t)).collect();
            again.reverse();
            for ((t, a), b) in steps.iter().zip(&there).zip(&again) {
                let cold = solve(&ControlLoop::new(grasp, criterion).unwrap(), *t);
                let scale = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                let worst = largest_difference(a, b).max(largest_difference(a, &cold));
                assert!(worst <= 1e-9 * scale, "grasp {index}, {criterion:?}, t = {t}: {worst:e} of {scale}");
            }
        }
    }
}

#[test]
fn forces_move_in_proportion_to_the_step() {
    for (index, grasp) in grasps().iter().enumerate() {
        for criterion in [Criterion::Sum, Criterion::Max] {
            let jump = |steps: u32| {
                let distributor = ControlLoop::new(grasp, criterion).unwrap();
                let size = grasp.num_contacts() * grasp.force_dim();
                let mut last = vec![0.0; size];
                distributor.solve_into(&path(0.0), &mut last).unwrap();
                let mut worst = 0.0_f64;
                for k in 1..=steps {
                    let mut forces = vec![0.0; size];
                    let t = f64::from(k) / f64::from(steps) * std::f64::consts::TAU;
                    distributor.solve_into(&path(t), &mut forces).unwrap();
                    worst = worst.max(largest_difference(&last, &forces));
                    last = forces;
                }
                worst
            };
            let (coarse, fine) = (jump(500), jump(8000));
            assert!(fine <= coarse / 8.0, "grasp {index}, {criterion:?}: {coarse} then {fine}");
        }
    }
}

#[test]
fn symmetric_forces_answer_symmetric_wrenches() {
    let grasp = square(8);
    for criterion in [Criterion::Sum, Criterion::Max] {
        let distributor = ControlLoop::new(&grasp, criterion).unwrap();
        let answer = distributor.solve(&Wrench::<6>::new(0.0, 0.0, -1.0, 0.0, 0.0, 0.0)).unwrap();
        for force in answer.world_forces(&grasp) {
            // Each carries a quarter of the weight, and all press as hard as any.
            assert!((force.z - 0.25).abs() < 1e-9, "{criterion:?}: {force}");
            assert!((force.norm() - answer.forces[0].norm()).abs() < 1e-9, "{criterion:?}: {force}");
        }
    }
}

#[test]
fn a_batch_is_its_rows_one_by_one_in_parallel_or_not() {
    for grasp in grasps() {
        let distributor = ControlLoop::new(&grasp, Criterion::Max).unwrap();
        let mut wrenches: Vec<_> = (0..1000).map(|k| path(f64::from(k) * 0.01)).collect();
        wrenches[17] = Wrench::zeros();
        wrenches[500][2] = f64::NAN;
        let (warm, parallel) = (
            distributor.solve_many(&wrenches, false).unwrap(),
            distributor.solve_many(&wrenches, true).unwrap(),
        );
        assert_eq!(warm.status, parallel.status);
        assert_eq!((warm.status[17], warm.sigma_max[17]), (Status::Solved, 0.0));
        assert_eq!(warm.status[500], Status::Invalid);
        let stride = grasp.num_contacts() * grasp.force_dim();
        for k in (0..1000).filter(|k| *k != 500) {
            let one = distributor.solve(&wrenches[k]).unwrap();
            let rows = k * stride..(k + 1) * stride;
            assert!((one.sigma_max - warm.sigma_max[k]).abs() <= 1e-9 * one.sigma_max);
            assert!((one.sigma_sum - parallel.sigma_sum[k]).abs() <= 1e-9 * one.sigma_sum);
            assert!(largest_difference(&warm.forces[rows.clone()], &parallel.forces[rows]) <= 1e-8);
        }
    }
}

#[test]
fn threads_share_a_distributor_and_each_gets_right_answers_in_its_own_workspace() {
    let distributor = ForceDistributor::new(&square(8), Criterion::Max).unwrap();
    std::thread::scope(|scope| {
        for offset in 0..4 {
            let distributor = &distributor;
            scope.spawn(move || {
                let mut workspace = distributor.workspace();
                for k in 0..5000 {
                    let external = path(f64::from(k * 4 + offset) * 0.001);
                    let answer = distributor.solve(&mut workspace, &external).unwrap();
                    let value = answer.dual.dot(&-external);
                    assert!((value - answer.sigma_max).abs() <= 1e-9 * value);
                }
            });
        }
    });
}

#[test]
fn a_workspace_of_another_distributor_changes_no_answer() {
    let mut lower_bounds = DistributionOptions::default();
    lower_bounds.min_normal = vec![0.05];
    let cones: Vec<_> = square(8).contacts().iter().map(|contact| contact.clone().cone()).collect();
    let distributors: Vec<_> = [square(8), Grasp::new(&cones).unwrap()]
        .iter()
        .flat_map(|grasp| {
            let bounded = ForceDistributor::with_options(grasp, Criterion::Max, lower_bounds.clone());
            [Criterion::Max, Criterion::Sum]
                .map(|criterion| ForceDistributor::new(grasp, criterion).unwrap())
                .into_iter()
                .chain([bounded.unwrap()])
        })
        .collect();
    let mut wandering = distributors[0].workspace();
    for k in 0..10 {
        let external = path(f64::from(k));
        for distributor in &distributors {
            let cold = distributor.solve(&mut distributor.workspace(), &external).unwrap();
            assert_eq!(distributor.solve(&mut wandering, &external).unwrap(), cold);
        }
    }
}

#[test]
fn contacts_that_slide_a_little_keep_the_answer_of_a_new_distributor() {
    let moved = |shift: f64| {
        let contacts: Vec<_> = square(8)
            .contacts()
            .iter()
            .map(|c| Contact { position: c.position + Vector3::new(0.0, shift, 0.3 * shift), ..c.clone() })
            .collect();
        Grasp::<6>::new(&contacts).unwrap()
    };
    let mut distributor = ControlLoop::new(&moved(0.0), Criterion::Max).unwrap();
    for k in 0..200 {
        let grasp = moved(0.0005 * f64::from(k));
        distributor.update(&grasp).unwrap();
        let external = path(0.02 * f64::from(k));
        let kept = distributor.solve(&external).unwrap();
        let fresh = ControlLoop::new(&grasp, Criterion::Max).unwrap().solve(&external).unwrap();
        for (a, b) in kept.forces.iter().zip(&fresh.forces) {
            assert!((a - b).amax() <= 1e-9 * fresh.sigma_max.max(1.0), "{k}: {a} {b}");
        }
    }
}
