//! How long does it take to find the contact forces? `cargo bench --bench force`.
#![allow(missing_docs, reason = "a program, not an interface")]

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion as Bench, criterion_group, criterion_main};
use graspforce::{Criterion, DistributionOptions, Grasp, Method, Wrench};
use support::control_loop::ControlLoop;
use support::problems::Random;
use support::tile::{OPTIMUM, tile, wrench};

/// Random wrenches, each component uniform in [-1, 1].
fn jumps(count: usize) -> Vec<Wrench<6>> {
    let mut random = Random::new(7);
    (0..count).map(|_| Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0))).collect()
}

/// One period of the tile's trajectory at 1 kHz.
fn trajectory() -> Vec<Wrench<6>> {
    (0..10_000).map(|k| wrench(f64::from(k) * 1e-3)).collect()
}

fn of(method: Method) -> DistributionOptions {
    let mut options = DistributionOptions::default();
    options.method = method;
    options
}

/// What a distributor keeps from one wrench to the next.
#[derive(Clone, Copy, PartialEq)]
enum Memory {
    Kept,
    Forgotten,
}

fn run(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    distributor: &ControlLoop<6>,
    wrenches: &[Wrench<6>],
    memory: Memory,
) {
    let grasp = distributor.grasp();
    let mut forces = vec![0.0; grasp.num_contacts() * grasp.force_dim()];
    let mut next = wrenches.iter().cycle();
    group.bench_function(name, |b| {
        b.iter(|| {
            if memory == Memory::Forgotten {
                distributor.forget();
            }
            let w = next.next().expect("a cycle does not end");
            distributor.solve_into(black_box(w), &mut forces).expect("balanced")
        });
    });
}

fn with(grasp: &Grasp<6>, objective: Criterion, options: DistributionOptions) -> ControlLoop<6> {
    ControlLoop::with_options(grasp, objective, options).expect("a valid grasp")
}

fn linearised(bench: &mut Bench) {
    use Memory::{Forgotten, Kept};
    let mut group = bench.benchmark_group("how long do the forces take");
    let (trajectory, jumps) = (trajectory(), jumps(10_000));
    let grasp = tile(OPTIMUM, 10);
    let max = with(&grasp, Criterion::Max, DistributionOptions::default());
    run(&mut group, "the same wrench again", &max, &trajectory[..1], Kept);
    run(&mut group, "tile, 1 kHz trajectory", &max, &trajectory, Kept);
    run(&mut group, "tile, random jumps", &max, &jumps, Kept);
    run(&mut group, "tile, cold", &max, &jumps, Forgotten);
    let sum = with(&grasp, Criterion::Sum, DistributionOptions::default());
    run(&mut group, "tile, 1 kHz trajectory, least sum", &sum, &trajectory, Kept);
    run(&mut group, "tile, cold, least sum", &sum, &jumps, Forgotten);
    let mut weighted = DistributionOptions::default();
    weighted.weight = 0.1;
    let weighted = with(&grasp, Criterion::Max, weighted);
    run(&mut group, "tile, 1 kHz trajectory, maximum and 0.1 of the sum", &weighted, &trajectory, Kept);
    let mut pressing = DistributionOptions::default();
    pressing.min_normal = vec![0.05; 4];
    let pressing = with(&grasp, Criterion::Max, pressing);
    run(&mut group, "tile, 1 kHz trajectory, no finger below 0.05", &pressing, &trajectory, Kept);
    let large = support::problems::closed_grasps(3, 1, 8, 16).remove(0);
    let large = with(&large, Criterion::Max, DistributionOptions::default());
    run(&mut group, "8 contacts, 16 edges, random jumps", &large, &jumps, Kept);
    run(&mut group, "8 contacts, 16 edges, cold", &large, &jumps, Forgotten);
}

fn methods(bench: &mut Bench) {
    let mut group = bench.benchmark_group("how long do the forces take by the paper's methods");
    group.sample_size(20);
    let (trajectory, jumps) = (trajectory(), jumps(64));
    let mut reduced = of(Method::Reduced);
    reduced.samples = (1..=10).map(|t| wrench(f64::from(t)).as_slice().to_vec()).collect();
    let tile = tile(OPTIMUM, 10);
    let reduced = with(&tile, Criterion::Max, reduced);
    run(&mut group, "reduced, tile, 1 kHz trajectory", &reduced, &trajectory, Memory::Kept);
    run(&mut group, "reduced, tile, cold", &reduced, &trajectory, Memory::Forgotten);
    let small = support::problems::closed_grasps(5, 1, 4, 4).remove(0);
    for (name, grasp) in [("624 points", &small), ("tile, 14640 points", &tile)] {
        let enumerated = with(grasp, Criterion::Max, of(Method::Enumerated));
        run(&mut group, &format!("enumerated, {name}"), &enumerated, &jumps, Memory::Forgotten);
    }
}

fn true_cones(bench: &mut Bench) {
    let mut group = bench.benchmark_group("how long do the forces take with true cones to 1e-6");
    let mut options = DistributionOptions::default();
    options.rtol = 1e-6;
    let hard = tile(OPTIMUM, 0);
    let soft: Vec<_> = hard.contacts().iter().map(|contact| contact.clone().torsion(0.005)).collect();
    let soft = Grasp::new(&soft).expect("valid contacts");
    for (name, grasp) in [("tile", &hard), ("tile, soft fingers", &soft)] {
        let distributor = with(grasp, Criterion::Max, options.clone());
        let (trajectory, jumps) = (trajectory(), jumps(1000));
        run(&mut group, &format!("{name}, 1 kHz trajectory"), &distributor, &trajectory, Memory::Kept);
        run(&mut group, &format!("{name}, random jumps"), &distributor, &jumps, Memory::Kept);
        run(&mut group, &format!("{name}, cold"), &distributor, &jumps, Memory::Forgotten);
    }
}

fn batches(bench: &mut Bench) {
    let mut group = bench.benchmark_group("how long do the forces of 10,000 wrenches take");
    group.sample_size(20);
    let grasp = tile(OPTIMUM, 10);
    for (name, wrenches) in [("1 kHz trajectory", trajectory()), ("random jumps", jumps(10_000))] {
        for (how, parallel) in [("in turn", false), ("on all cores", true)] {
            let distributor = with(&grasp, Criterion::Max, DistributionOptions::default());
            group.bench_function(format!("{name}, {how}"), |b| {
                b.iter(|| {
                    let batch = distributor.solve_many(black_box(&wrenches), parallel);
                    batch.map(|batch| batch.status.len())
                });
            });
        }
    }
}

fn moving_contacts(bench: &mut Bench) {
    let places = [0.0, 1e-4].map(|d| tile(OPTIMUM.map(|x| x + d), 10));
    let mut distributor = with(&places[0], Criterion::Max, DistributionOptions::default());
    let mut forces = vec![0.0; 12];
    let mut next = places.iter().cycle();
    let w = wrench(0.0);
    bench.bench_function("how long do the forces take when the contacts moved by 0.1 mm", |b| {
        b.iter(|| {
            distributor.update(next.next().expect("a cycle does not end")).expect("as many contacts");
            distributor.solve_into(black_box(&w), &mut forces).expect("balanced")
        });
    });
}

criterion_group!(
    name = force;
    config = Bench::default().warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    targets = linearised, methods, true_cones, batches, moving_contacts
);
criterion_main!(force);
