//! Gradients of least forces: laws that hold for every grasp; and batches, which give what single calls give.

use graspforce::{
    Criterion, Error, ForceDistributor, Grasp, GraspForcesOptions, SquaresOptions, Status, Wrench,
    forces_batch,
};
use nalgebra::Vector3;
use support::problems::{Random, ellipsoid_grasp};

fn grasp(random: &mut Random, kind: usize) -> Grasp<6> {
    ellipsoid_grasp(random, 5, |random, _, contact| match kind {
        0 => contact.cone(),
        1 => contact.cone().torsion(random.within(0.05, 0.3)),
        _ => contact.edges(8),
    })
}

fn distributors(grasp: &Grasp<6>) -> [ForceDistributor<6>; 3] {
    [
        ForceDistributor::new(grasp, Criterion::Max).unwrap(),
        ForceDistributor::new(grasp, Criterion::Sum).unwrap(),
        ForceDistributor::squares(grasp, SquaresOptions::default()).unwrap(),
    ]
}

#[test]
fn a_gradient_knows_that_forces_grow_with_the_wrench_and_follow_rigid_motions() {
    let mut random = Random::new(81);
    let mut seen = 0;
    for case in 0..60 {
        let grasp = grasp(&mut random, case % 3);
        let wrench = Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0));
        for (objective, distributor) in distributors(&grasp).iter().enumerate() {
            let Ok(answer) = distributor.solve(&mut distributor.workspace(), &wrench) else { continue };
            let gradient = distributor.gradient(&answer, None);
            let degree = if objective == 2 { 2.0 } else { 1.0 };
            let slope = gradient.external_wrench.dot(&wrench);
            assert!((slope - degree * answer.sigma).abs() <= 1e-7 * answer.sigma, "case {case}");
            // Contacts and wrench move together: nothing changes.
            let (force, torque) = (wrench.fixed_rows::<3>(0), wrench.fixed_rows::<3>(3));
            let axis = Vector3::from_fn(|_, _| random.within(-1.0, 1.0));
            let shift = Vector3::from_fn(|_, _| random.within(-1.0, 1.0));
            let (a, b) =
                (gradient.external_wrench.fixed_rows::<3>(0), gradient.external_wrench.fixed_rows::<3>(3));
            let mut turn = a.dot(&axis.cross(&force)) + b.dot(&axis.cross(&torque));
            let mut moved = b.dot(&shift.cross(&force));
            let mut size = answer.sigma;
            for (i, contact) in grasp.contacts().iter().enumerate() {
                turn += gradient.positions[i].dot(&axis.cross(&contact.position));
                turn += gradient.normals[i].dot(&axis.cross(&contact.normal));
                turn += gradient.spins[i] * axis.dot(&contact.normal);
                moved += gradient.positions[i].dot(&shift);
                size += gradient.positions[i].norm() + gradient.normals[i].norm();
            }
            assert!(turn.abs() <= 1e-7 * size, "case {case}: {turn:e} beside {size:e}");
            assert!(moved.abs() <= 1e-7 * size, "case {case}: {moved:e} beside {size:e}");
            seen += 1;
        }
    }
    assert!(seen > 100);
}

#[test]
fn a_batch_finds_the_same_wrenches_infeasible() {
    let mut random = Random::new(82);
    let mut infeasible = 0;
    for case in 0..30 {
        let mut grasp = grasp(&mut random, case % 2);
        if case % 3 == 0 {
            grasp = Grasp::with_options(&grasp.contacts()[..3], *grasp.options()).unwrap();
        }
        let wrenches: Vec<_> =
            (0..8).map(|_| Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0))).collect();
        for objective in 0..3 {
            let make = |grasp: &Grasp<6>| Ok(distributors(grasp)[objective].clone());
            let options = GraspForcesOptions { nearest: None, gradient: true, force_dim: grasp.force_dim() };
            let rows = forces_batch(0..1, |_| 5, |_| Ok(grasp.clone()), make, |_| &wrenches[..], &options);
            let distributor = &distributors(&grasp)[objective];
            for (k, wrench) in wrenches.iter().enumerate() {
                match distributor.solve(&mut distributor.workspace(), wrench) {
                    Ok(answer) => {
                        assert_eq!(rows[0].status[k], Status::Solved, "case {case}");
                        assert!((rows[0].sigma[k] - answer.sigma).abs() <= 1e-8 * answer.sigma);
                    }
                    Err(Error::InfeasibleWrench { .. }) => {
                        assert_eq!(rows[0].status[k], Status::Infeasible, "case {case}");
                        infeasible += 1;
                    }
                    Err(error) => panic!("{error}"),
                }
            }
        }
    }
    assert!(infeasible > 100);
}
