//! How long does a controller wait for its forces, and how long for Clarabel's? One run, the same problems for both.
#![allow(missing_docs, reason = "a program, not an interface")]

use std::hint::black_box;
use std::time::Instant;

use graspforce::{ForceDistributor, Grasp, NearestOptions, SquaresOptions, Wrench};
use support::least_squares::least_squares;
use support::problems::Random;
use support::tile::{OPTIMUM, tile, wrench};

/// Calls whose median is printed; Clarabel's are fewer.
const CALLS: usize = 100_000;
const CLARABEL_CALLS: usize = 500;

fn main() {
    let grasp = tile(OPTIMUM, 0);
    let mut random = Random::new(7);
    let along: Vec<_> = (0..CALLS).map(|step| wrench((step % 10_000) as f64 * 1e-3)).collect();
    let jumps: Vec<_> = (0..CALLS).map(|_| Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0))).collect();
    let beyond: Vec<_> = jumps.iter().map(|w| w * 60.0).collect();
    // Twice the strongest pull of one finger lies beyond all of them along this path.
    let far: Vec<_> = along.iter().map(|w| w * 60.0 + Wrench::<6>::repeat(40.0)).collect();
    println!(
        "{:48} {:>9} {:>9} {:>11} {:>7}",
        "median time of a call (us)", "ours", "p99", "Clarabel", "ratio"
    );
    let free = SquaresOptions::default();
    row("squares, 1 kHz along the tile's trajectory", &grasp, &free, None, &along);
    row("squares, random jumps", &grasp, &free, None, &jumps);
    let limited = SquaresOptions { limits: true, ..SquaresOptions::default() };
    row("squares within limits, along the trajectory", &grasp, &limited, None, &along);
    row("nearest of squares beyond limits, along a path", &grasp, &limited, Some(1e6), &far);
    row("nearest of squares beyond limits, random jumps", &grasp, &limited, Some(1e6), &beyond);
}

/// With a price, `nearest` is asked; Clarabel then solves the least squares with this price.
fn row(
    name: &str,
    grasp: &Grasp<6>,
    options: &SquaresOptions<6>,
    price: Option<f64>,
    wrenches: &[Wrench<6>],
) {
    let squares = ForceDistributor::squares(grasp, options.clone()).expect("a grasp");
    let mut workspace = squares.workspace();
    let mut forces = vec![0.0; grasp.num_contacts() * grasp.force_dim()];
    let nearest = NearestOptions::default();
    let calls = if price.is_some() { CLARABEL_CALLS * 4 } else { wrenches.len() };
    let mut ours: Vec<u128> = Vec::with_capacity(calls);
    for w in &wrenches[..calls] {
        let start = Instant::now();
        let found = match price {
            None => squares.solve_into(&mut workspace, black_box(w), &mut forces),
            Some(_) => squares.nearest_into(&mut workspace, black_box(w), &nearest, &mut forces),
        };
        ours.push(start.elapsed().as_nanos());
        black_box(found).expect("an answer for every wrench");
    }
    let mut theirs: Vec<u128> = Vec::with_capacity(CLARABEL_CALLS);
    for w in wrenches.iter().step_by(wrenches.len() / CLARABEL_CALLS) {
        let start = Instant::now();
        let _ = black_box(least_squares(grasp, options, price, black_box(w)));
        theirs.push(start.elapsed().as_nanos());
    }
    let at = |times: &mut Vec<u128>, share: f64| {
        times.sort_unstable();
        times[((times.len() - 1) as f64 * share) as usize] as f64 * 1e-3
    };
    let (median, tail, clarabel) = (at(&mut ours, 0.5), at(&mut ours, 0.99), at(&mut theirs, 0.5));
    println!("{name:48} {median:9.2} {tail:9.2} {clarabel:11.1} {:7.0}", clarabel / median);
}
