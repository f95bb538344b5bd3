//! How long does one force solve take at the median and in the tail? A million calls of each kind.
#![allow(missing_docs, reason = "a program, not an interface")]

use std::hint::black_box;
use std::time::Instant;

use graspforce::{Criterion, ForceDistributor, Grasp, Wrench};
use support::problems::Random;
use support::tile::{OPTIMUM, tile, wrench};

fn main() {
    let calls = std::env::var("CALLS").ok().and_then(|n| n.parse().ok()).unwrap_or(1_000_000);
    println!(
        "{:44} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7}",
        "time of a call (us)", "mean", "p50", "p99", "p99.9", "p99.99", "pivots"
    );
    let grasp = tile(OPTIMUM, 10);
    let mut step = 0_u32;
    report("1 kHz along the tile's trajectory", &grasp, calls, move || {
        step += 1;
        wrench(f64::from(step % 10_000) * 1e-3)
    });
    let mut random = Random::new(7);
    report("random jumps, tile", &grasp, calls, move || anywhere(&mut random));
    let large = support::problems::closed_grasps(3, 1, 8, 16).remove(0);
    let mut random = Random::new(8);
    report("random jumps, 8 contacts, 16 edges", &large, calls / 10, move || anywhere(&mut random));
    for (name, torsion) in [("true cones", 0.0), ("true cones of soft fingers", 0.02)] {
        let cones = true_cones(&grasp, torsion);
        let mut step = 0_u32;
        report(&format!("1 kHz, tile, {name}"), &cones, calls / 4, move || {
            step += 1;
            wrench(f64::from(step % 10_000) * 1e-3)
        });
        let mut random = Random::new(7);
        report(&format!("random jumps, tile, {name}"), &cones, calls / 10, move || anywhere(&mut random));
    }
    let mut random = Random::new(8);
    let cones = true_cones(&large, 0.0);
    report("random jumps, 8 contacts, true cones", &cones, calls / 20, move || anywhere(&mut random));
}

/// The same contacts with second-order cones.
fn true_cones(grasp: &Grasp<6>, torsion: f64) -> Grasp<6> {
    let contacts: Vec<_> = grasp.contacts().iter().map(|c| c.clone().torsion(torsion).cone()).collect();
    Grasp::new(&contacts).expect("the contacts were valid with edges")
}

fn anywhere(random: &mut Random) -> Wrench<6> {
    Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0))
}

fn report(name: &str, grasp: &Grasp<6>, calls: usize, mut next: impl FnMut() -> Wrench<6>) {
    let distributor = ForceDistributor::new(grasp, Criterion::Max).expect("a grasp with edges");
    let mut workspace = distributor.workspace();
    let mut forces = vec![0.0; grasp.num_contacts() * grasp.force_dim()];
    let wrenches: Vec<_> = (0..calls.min(100_000)).map(|_| next()).collect();
    let mut times: Vec<u64> = Vec::with_capacity(calls);
    for w in wrenches.iter().cycle().take(calls) {
        let start = Instant::now();
        let sigma = distributor.solve_into(&mut workspace, black_box(w), &mut forces);
        times.push(start.elapsed().as_nanos() as u64);
        black_box(&sigma).as_ref().expect("the grasp balances every wrench");
    }
    // The timed call does not report them: counted on a second pass over the same wrenches.
    let pivots = wrenches
        .iter()
        .filter_map(|w| distributor.solve(&mut workspace, w).ok())
        .map(|s| s.pivots)
        .max()
        .unwrap_or(0);
    let mean = times.iter().sum::<u64>() as f64 / calls as f64;
    times.sort_unstable();
    let at = |share: f64| times[((calls - 1) as f64 * share) as usize] as f64 * 1e-3;
    println!(
        "{name:44} {:9.3} {:9.3} {:9.3} {:9.3} {:9.3} {pivots:7}",
        mean * 1e-3,
        at(0.5),
        at(0.99),
        at(0.999),
        at(0.9999)
    );
}
