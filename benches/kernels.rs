//! How long each kernel takes, on seeded problems.

mod common;

use std::hint::black_box;

use criterion::{Criterion as Bench, criterion_group, criterion_main};
use graspforce::{
    Contact, Criterion, DistributionOptions, ForceDistributor, Grasp, Method, MinkowskiSum, QualityOptions,
    QualityWorkspace, Wrench, WrenchSet, quality_batch,
};
use nalgebra::Vector3;

/// The paper's size: four contacts with ten edges each, 14,640 points in the Minkowski sum.
fn paper_sized() -> Grasp<6> {
    common::closed_grasps(7, 1, 4, 10).remove(0)
}

/// A disc pressed by three fingers.
fn planar() -> Grasp<3> {
    let contacts = [0.1_f64, 2.2, 4.3].map(|angle| {
        let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
        Contact::new(outward, -outward).friction(0.4)
    });
    Grasp::new(&contacts).expect("a disc's contacts are valid")
}

fn support_query(bench: &mut Bench) {
    let grasp = paper_sized();
    let z = Wrench::<6>::from_fn(|row, _| 0.3 + 0.1 * row as f64);
    let mut group = bench.benchmark_group("one support query of 4 contacts with 10 edges");
    for criterion in [Criterion::Sum, Criterion::Max] {
        let set = WrenchSet::new(&grasp, criterion);
        group.bench_function(format!("{criterion:?}"), |b| b.iter(|| set.support(black_box(&z))));
    }
}

fn enumeration(bench: &mut Bench) {
    let grasp = paper_sized();
    bench.bench_function("enumerating 14,640 points of the Minkowski sum", |b| {
        b.iter(|| MinkowskiSum::new(black_box(&grasp)).map(|sum| sum.len()));
    });
}

fn quality(bench: &mut Bench) {
    let mut group = bench.benchmark_group("quality of one grasp");
    let (planar, spatial) = (planar(), paper_sized());
    for criterion in [Criterion::Sum, Criterion::Max] {
        let mut workspace = QualityWorkspace::default();
        let options = QualityOptions::new(criterion);
        group.bench_function(format!("3-D, 3 contacts, {criterion:?}"), |b| {
            b.iter(|| planar.quality_with(black_box(&options), &mut workspace).map(|q| q.rho));
        });
        let mut workspace = QualityWorkspace::default();
        let options = QualityOptions::new(criterion);
        group.bench_function(format!("6-D, 4 contacts with 10 edges, {criterion:?}"), |b| {
            b.iter(|| spatial.quality_with(black_box(&options), &mut workspace).map(|q| q.rho));
        });
    }
}

fn cold_force_solve(bench: &mut Bench) {
    let grasp = paper_sized();
    let mut random = common::Random::new(3);
    let wrenches: Vec<_> = (0..64).map(|_| Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0))).collect();
    let mut group = bench.benchmark_group("least maximum force, first wrench of a new distributor");
    group.sample_size(20);
    for method in [Method::Implicit, Method::Enumerated] {
        let mut options = DistributionOptions::default();
        options.method = method;
        let distributor =
            ForceDistributor::with_options(&grasp, Criterion::Max, options).expect("finite cones");
        let mut next = wrenches.iter().cycle();
        group.bench_function(format!("{method:?}"), |b| {
            b.iter(|| distributor.clone().solve(next.next().unwrap_or(&wrenches[0])).map(|d| d.sigma_max));
        });
    }
}

/// The four-finger racket of the paper's Example 1.
fn racket([p1, p2, p3, p4]: [f64; 4]) -> Vec<Contact> {
    let at = |x, y, nx, ny, mu, limit| {
        Contact::new(Vector3::new(x, y, 0.0), Vector3::new(nx, ny, 0.0)).friction(mu).max_normal_force(limit)
    };
    let (s1, c1) = p1.sin_cos();
    let (s2, c2) = p2.sin_cos();
    vec![
        at(0.12 * c1, 0.15 * s1, 0.15 * c1, 0.12 * s1, 0.1, 30.0),
        at(0.12 * c2, 0.17 * s2, 0.17 * c2, 0.12 * s2, 0.1, 30.0),
        at(0.68 * p3.powi(3) + 0.015, 0.8 * p3 * p3 - 0.315, -1.6, 2.04 * p3, 0.1, 60.0),
        at(-0.015, p4, 1.0, 0.0, 0.2, 100.0),
    ]
}

fn planning_iteration(bench: &mut Bench) {
    let steps = [0.3, 0.3, 0.1, 0.02];
    let candidates: Vec<Vec<Contact>> = (0..81_usize)
        .map(|index| {
            let offset = |axis: u32| (index / 3_usize.pow(axis) % 3) as f64 - 1.0;
            let center = [0.4, -1.2, 0.2, -0.45];
            racket(std::array::from_fn(|axis| center[axis] + steps[axis] * offset(axis as u32)))
        })
        .collect();
    let mut group = bench.benchmark_group("one iteration of the racket's plan, 81 candidates");
    for criterion in [Criterion::Sum, Criterion::Max] {
        let options = QualityOptions::<3>::new(criterion);
        group.bench_function(format!("{criterion:?}"), |b| {
            b.iter(|| quality_batch(0..81, |row| Grasp::new(&candidates[row]), &options).len());
        });
    }
}

criterion_group!(kernels, support_query, enumeration, quality, cold_force_solve, planning_iteration);
criterion_main!(kernels);
