//! What does one step of a plan cost? Seeded problems; `cargo bench --bench planning`.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion as Bench, criterion_group, criterion_main};
use graspforce::{BoxBound, CandidateSearch, Contact, Criterion, Grasp, QualityOptions, TriangleTree};
use nalgebra::Vector3;
use support::problems::Random;
use support::tile::{OPTIMUM, tile};

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];
const CANDIDATES: usize = 81;
const CENTER: usize = 40;

/// The four-finger racket of the paper's Example 1.
fn racket([p1, p2, p3, p4]: [f64; 4]) -> Grasp<3> {
    let at = |x, y, nx, ny, mu, limit| {
        Contact::new(Vector3::new(x, y, 0.0), Vector3::new(nx, ny, 0.0)).friction(mu).max_normal_force(limit)
    };
    let (s1, c1) = p1.sin_cos();
    let (s2, c2) = p2.sin_cos();
    let contacts = [
        at(0.12 * c1, 0.15 * s1, 0.15 * c1, 0.12 * s1, 0.1, 30.0),
        at(0.12 * c2, 0.17 * s2, 0.17 * c2, 0.12 * s2, 0.1, 30.0),
        at(0.68 * p3.powi(3) + 0.015, 0.8 * p3 * p3 - 0.315, -1.6, 2.04 * p3, 0.1, 60.0),
        at(-0.015, p4, 1.0, 0.0, 0.2, 100.0),
    ];
    Grasp::new(&contacts).expect("the racket's contacts are valid")
}

/// Every combination of one step down, none and one step up.
fn candidates<const D: usize>(
    center: [f64; 4],
    steps: [f64; 4],
    grasp: impl Fn([f64; 4]) -> Grasp<D>,
) -> Vec<Grasp<D>> {
    let offset = |index: usize, axis: usize| (index / 3_usize.pow(axis as u32) % 3) as f64 - 1.0;
    (0..CANDIDATES)
        .map(|index| grasp(std::array::from_fn(|axis| center[axis] + steps[axis] * offset(index, axis))))
        .collect()
}

fn iteration<const D: usize>(bench: &mut Bench, name: &str, candidates: &[Grasp<D>]) {
    let mut group = bench.benchmark_group(format!("which of 81 candidates is best, {name}"));
    for criterion in BOTH {
        let options = QualityOptions::<D>::new(criterion);
        for (kind, prune) in [("every candidate measured", false), ("pruned, in a later iteration", true)] {
            let mut search = CandidateSearch::new(options, prune).expect("default options are valid");
            group.bench_function(format!("{criterion:?}, {kind}"), |b| {
                b.iter(|| {
                    let grasp = |index: usize| Grasp::new(candidates[index].contacts());
                    search.best(CANDIDATES, CENTER, None, grasp).map(|winner| winner.index)
                });
            });
        }
        group.bench_function(format!("{criterion:?}, pruned, in the first iteration"), |b| {
            b.iter(|| {
                let mut search = CandidateSearch::new(options, true).expect("default options are valid");
                let grasp = |index: usize| Grasp::new(candidates[index].contacts());
                search.best(CANDIDATES, CENTER, None, grasp).map(|winner| winner.index)
            });
        });
    }
}

fn planning_iteration(bench: &mut Bench) {
    iteration(bench, "racket", &candidates([0.4, -1.2, 0.2, -0.45], [0.3, 0.3, 0.1, 0.02], racket));
    iteration(bench, "tile", &candidates(OPTIMUM, [0.01; 4], |c| tile(c, 10)));
}

fn box_bound(bench: &mut Bench) {
    let corner = |vertex: usize| {
        let side = |axis: usize| if vertex >> axis & 1 == 0 { -0.01 } else { 0.01 };
        tile(std::array::from_fn(|axis| OPTIMUM[axis] + side(axis)), 10)
    };
    let corners: Vec<_> = (0..16).map(corner).collect();
    let mut group = bench.benchmark_group("how good can a box of plans be, 16 corners of the tile's");
    for criterion in BOTH {
        let mut bound =
            BoxBound::<6>::new(QualityOptions::new(criterion)).expect("default options are valid");
        group.bench_function(format!("{criterion:?}"), |b| {
            b.iter(|| {
                bound
                    .over(&[0.0], None, 0.0, |_| 0..16, |row| Grasp::<6>::new(corners[row].contacts()))
                    .map(|u| u[0])
            });
        });
    }
}

/// A sphere of 2 x 64 x 64 triangles.
fn sphere() -> TriangleTree {
    let (rows, columns) = (64, 64);
    let vertex = |k: usize| {
        let (polar, angle) = (
            std::f64::consts::PI * (k / columns) as f64 / rows as f64,
            std::f64::consts::TAU * (k % columns) as f64 / columns as f64,
        );
        Vector3::new(polar.sin() * angle.cos(), polar.sin() * angle.sin(), polar.cos())
    };
    let vertices: Vec<_> = (0..(rows + 1) * columns).map(vertex).collect();
    let faces: Vec<_> = (0..rows * columns)
        .flat_map(|k| {
            let beside = k / columns * columns + (k + 1) % columns;
            [[k, k + columns, beside], [beside, k + columns, beside + columns]]
        })
        .collect();
    TriangleTree::new(&vertices, &faces).expect("a valid mesh")
}

fn projection(bench: &mut Bench) {
    let tree = sphere();
    let mut random = Random::new(3);
    let points: Vec<_> = (0..1024).map(|_| random.direction() * random.within(0.9, 1.1)).collect();
    let mut next = points.iter().cycle();
    bench.bench_function("where on a mesh does a contact project, 8192 triangles", |b| {
        b.iter(|| tree.closest(black_box(next.next().expect("a cycle does not end"))).face);
    });
}

criterion_group!(
    name = planning;
    config = Bench::default().warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    targets = planning_iteration, box_bound, projection
);
criterion_main!(planning);
