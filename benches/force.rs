//! How fast are contact forces? Each benchmark is named by the question it answers.
#![allow(missing_docs, reason = "a program, not an interface")]

mod common;

use std::hint::black_box;

use common::Random;
use common::tile::{OPTIMUM, tile, wrench};
use criterion::{Criterion as Bench, criterion_group, criterion_main};
use graspforce::{Criterion, DistributionOptions, ForceDistributor, Grasp, Method, MinkowskiSum, Wrench};

/// Random wrenches, each component uniform in [-1, 1].
fn wrenches(seed: u64, count: usize) -> Vec<Wrench<6>> {
    let mut random = Random::new(seed);
    (0..count).map(|_| Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0))).collect()
}

fn run(bench: &mut Bench, name: &str, grasp: &Grasp<6>, wrenches: &[Wrench<6>], fresh: bool) {
    let mut options = DistributionOptions::default();
    if !grasp.is_finite() {
        options.tolerance = 1e-6;
    }
    let distributor = ForceDistributor::with_options(grasp, Criterion::Max, options).expect("a valid grasp");
    let mut forces = vec![0.0; grasp.num_contacts() * grasp.force_dim()];
    let mut next = wrenches.iter().cycle();
    bench.bench_function(name, |b| {
        b.iter(|| {
            if fresh {
                distributor.forget();
            }
            let w = next.next().expect("a cycle does not end");
            distributor.solve_into(black_box(w), &mut forces).expect("balanced")
        });
    });
}

fn force_distribution(bench: &mut Bench) {
    let grasp = tile(OPTIMUM, 10);
    let trajectory: Vec<_> = (0..10_000).map(|k| wrench(f64::from(k) * 1e-3)).collect();
    let jumps = wrenches(7, 10_000);
    run(bench, "force/same_wrench_again", &grasp, &trajectory[..1], false);
    run(bench, "force/tile_trajectory_at_1_khz", &grasp, &trajectory, false);
    run(bench, "force/random_jumps_on_the_tile", &grasp, &jumps, false);
    run(bench, "force/cold_on_the_tile", &grasp, &jumps, true);
    let large = common::closed_grasps(3, 1, 8, 16).remove(0);
    run(bench, "force/cold_8_contacts_16_edges", &large, &jumps, true);

    let cones = tile(OPTIMUM, 0);
    run(bench, "force/true_cones_trajectory_at_1_khz", &cones, &trajectory, false);
    run(bench, "force/true_cones_cold_along_the_trajectory", &cones, &trajectory, true);

    let mut options = DistributionOptions::default();
    options.method = Method::Enumerated;
    let small = common::closed_grasps(5, 1, 4, 4).remove(0);
    let enumerated = ForceDistributor::with_options(&small, Criterion::Max, options).expect("624 points");
    bench.bench_function("force/enumerated_624_points", |b| {
        let mut next = jumps.iter().cycle();
        b.iter(|| {
            enumerated.forget();
            enumerated.solve(next.next().expect("a cycle does not end")).expect("balanced").sigma
        });
    });
    bench.bench_function("minkowski/enumerate_14640_points", |b| {
        b.iter(|| MinkowskiSum::new(black_box(&grasp)).expect("within the limit").len());
    });
}

criterion_group!(benches, force_distribution);
criterion_main!(benches);
