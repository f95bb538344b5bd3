//! How long does each kernel of quality take? Seeded grasps; `cargo bench --bench kernels`.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion as Bench, criterion_group, criterion_main};
use graspforce::{
    Closure, Contact, Criterion, Grasp, MinkowskiSum, QualityOptions, QualityWorkspace, Wrench, WrenchSet,
    quality_batch,
};
use nalgebra::Vector3;
use support::problems::Random;

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];

/// The paper's size: four contacts with ten edges each.
fn paper_sized() -> Grasp<6> {
    support::problems::closed_grasps(7, 1, 4, 10).remove(0)
}

/// The same contacts with true cones, and as soft fingers.
fn true_cones(torsion: f64) -> Grasp<6> {
    let contacts: Vec<_> =
        paper_sized().contacts().iter().map(|contact| contact.clone().torsion(torsion).cone()).collect();
    Grasp::new(&contacts).expect("valid contacts")
}

/// A disc pressed by three fingers.
fn planar() -> Grasp<3> {
    let contacts = [0.1_f64, 2.2, 4.3].map(|angle| {
        let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
        Contact::new(outward, -outward).friction(0.4)
    });
    Grasp::new(&contacts).expect("a disc's contacts are valid")
}

/// The first grasp of a seeded sequence that is not force closure.
fn open() -> Grasp<6> {
    let mut random = Random::new(7);
    loop {
        let contacts = support::problems::ellipsoid_contacts(&mut random, 4).into_iter().map(|c| c.edges(10));
        let grasp = Grasp::new(&contacts.collect::<Vec<_>>()).expect("ellipsoid contacts are valid");
        if grasp.closure() == Ok(Closure::None) {
            return grasp;
        }
    }
}

fn making_a_grasp(bench: &mut Bench) {
    let contacts = paper_sized().contacts().to_vec();
    bench.bench_function("what does a grasp cost to make/4 contacts, 10 edges", |b| {
        b.iter(|| Grasp::<6>::new(black_box(&contacts)).map(|grasp| grasp.num_contacts()));
    });
}

fn support_query(bench: &mut Bench) {
    let z = Wrench::<6>::from_fn(|row, _| 0.3 + 0.1 * row as f64);
    let mut group = bench.benchmark_group("what does one support query cost");
    let grasps = [("10 edges", paper_sized()), ("true cones", true_cones(0.0)), ("soft", true_cones(0.2))];
    for (name, grasp) in &grasps {
        for criterion in BOTH {
            let set = WrenchSet::new(grasp, criterion);
            group.bench_function(BenchmarkId::new(format!("{criterion:?}"), name), |b| {
                b.iter(|| set.support(black_box(&z)));
            });
        }
    }
}

fn minkowski(bench: &mut Bench) {
    let mut group = bench.benchmark_group("what does listing the Minkowski sum cost");
    for edges in [4, 8, 10] {
        let grasp = support::problems::closed_grasps(7, 1, 4, edges).remove(0);
        let points = MinkowskiSum::new(&grasp).expect("within the limit").len();
        group.bench_function(format!("{points} points"), |b| {
            b.iter(|| MinkowskiSum::new(black_box(&grasp)).map(|sum| sum.len()));
        });
    }
}

fn closure_test(bench: &mut Bench) {
    let mut group = bench.benchmark_group("is it force closure");
    for (name, grasp) in [("yes", paper_sized()), ("no", open()), ("yes, true cones", true_cones(0.0))] {
        group.bench_function(name, |b| b.iter(|| black_box(&grasp).closure()));
    }
}

fn ask<const D: usize>(bench: &mut Bench, name: &str, grasp: &Grasp<D>) {
    let mut group = bench.benchmark_group("how good is one grasp");
    for criterion in BOTH {
        let mut workspace = QualityWorkspace::default();
        let options = QualityOptions::new(criterion);
        group.bench_function(BenchmarkId::new(format!("{criterion:?}"), name), |b| {
            b.iter(|| grasp.quality_with(black_box(&options), &mut workspace).map(|q| q.rho));
        });
    }
}

fn quality(bench: &mut Bench) {
    ask(bench, "3 contacts in the plane", &planar());
    ask(bench, "4 contacts, 10 edges", &paper_sized());
    ask(bench, "4 contacts, true cones", &true_cones(0.0));
    ask(bench, "4 soft fingers, true cones", &true_cones(0.2));
    ask(bench, "4 contacts, 10 edges, not force closure", &open());
    ask(bench, "8 contacts, 16 edges", &support::problems::closed_grasps(7, 1, 8, 16).remove(0));
}

fn gradient(bench: &mut Bench) {
    let mut group = bench.benchmark_group("where to move the contacts");
    for (name, grasp) in [("10 edges", paper_sized()), ("true cones", true_cones(0.0))] {
        for criterion in BOTH {
            let mut workspace = QualityWorkspace::default();
            let options = QualityOptions::new(criterion);
            group.bench_function(BenchmarkId::new(format!("{criterion:?}"), name), |b| {
                b.iter(|| grasp.gradient(black_box(&options), &mut workspace).map(|g| g.unique));
            });
        }
    }
}

fn resistance(bench: &mut Bench) {
    let grasp = paper_sized();
    let mut random = Random::new(3);
    let directions: Vec<_> =
        (0..100).map(|_| Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0))).collect();
    let mut group = bench.benchmark_group("how much is resisted along 100 directions");
    for criterion in BOTH {
        group.bench_function(format!("{criterion:?}"), |b| {
            b.iter(|| grasp.resistance(black_box(&directions), criterion, None).map(|r| r.len()));
        });
    }
}

fn batch(bench: &mut Bench) {
    let grasps = support::problems::closed_grasps(7, 200, 4, 8);
    let mut group = bench.benchmark_group("how good are 200 grasps, on all cores");
    for criterion in BOTH {
        let options = QualityOptions::<6>::new(criterion);
        group.bench_function(format!("{criterion:?}"), |b| {
            b.iter(|| quality_batch(0..200, |row| Grasp::new(grasps[row].contacts()), &options, false).len());
        });
    }
}

criterion_group!(
    name = kernels;
    config = Bench::default().warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    targets = making_a_grasp, support_query, minkowski, closure_test, quality, gradient, resistance, batch
);
criterion_main!(kernels);
