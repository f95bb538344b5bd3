//! The loop of `examples/cpp/control_loop.cpp` in Rust: four fingers move a cup of 0.5 kg at 1 kHz. Prints how long the
//! ticks took; arguments: ticks, microseconds of each.

use std::thread;
use std::time::{Duration, Instant};

use graspforce::{Contact, Criterion, ForceDistributor, Grasp, Wrench};
use nalgebra::Vector3;

fn main() -> Result<(), graspforce::Error> {
    let argument =
        |k: usize, default| std::env::args().nth(k).and_then(|n| n.parse().ok()).unwrap_or(default);
    let (ticks, period) = (argument(1, 5000), Duration::from_micros(argument(2, 1000)));
    let fingers = [
        ([0.04, 0.0, 0.0], [-1.0, 0.0, 0.1]),
        ([0.0, 0.04, 0.01], [0.0, -1.0, 0.0]),
        ([-0.04, 0.0, 0.02], [1.0, 0.0, 0.0]),
        ([0.0, -0.04, -0.01], [0.0, 1.0, 0.1]),
    ];
    let contacts = fingers.map(|(position, normal)| {
        Contact::new(Vector3::from(position), Vector3::from(normal)).friction(0.6).max_normal_force(20.0)
    });
    let grasp = Grasp::<6>::new(&contacts)?;
    let distributor = ForceDistributor::new(&grasp, Criterion::Max)?;
    let mut workspace = distributor.workspace();
    let mut forces = [0.0; 12];
    let mut latency = Vec::new();
    let mut tick = Instant::now();
    for k in 0..ticks {
        tick += period;
        thread::sleep(tick.saturating_duration_since(Instant::now()));
        let start = Instant::now();
        let t = 1e-3 * k as f64;
        let acceleration = Vector3::new(2.0 * (3.0 * t).sin(), 2.0 * (5.0 * t).sin(), (2.0 * t).cos());
        let force = (Vector3::new(0.0, 0.0, -9.81) - acceleration) * 0.5;
        let torque = Vector3::new(0.02 * (3.0 * t).cos(), 0.02 * (2.0 * t).sin(), 0.03 * (4.0 * t).sin());
        let external = Wrench::<6>::from_iterator(force.iter().chain(&torque).copied());
        distributor.solve_into(&mut workspace, &external, &mut forces)?;
        latency.push(start.elapsed().as_secs_f64() * 1e6);
    }
    latency.sort_unstable_by(f64::total_cmp);
    print!("{:6} {ticks:7}", "Rust");
    for share in [0.5, 0.99, 0.999, 1.0] {
        print!(" {:9.3}", latency[((ticks.max(1) - 1) as f64 * share) as usize]);
    }
    println!();
    Ok(())
}
