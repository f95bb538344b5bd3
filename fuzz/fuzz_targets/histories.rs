//! Answers depend on the wrench alone: a distributor with a past answers as a new one does.
#![no_main]

use arbitrary::Arbitrary;
use graspforce::{DistributionOptions, Error, Status};
use graspforce_fuzz::forces::checked;
use graspforce_fuzz::input::{GraspInput, Number, criterion, wrench};
use libfuzzer_sys::fuzz_target;
use support::control_loop::ControlLoop;

#[derive(Debug, Arbitrary)]
struct Input {
    grasp: GraspInput,
    other: Option<GraspInput>,
    sum: bool,
    wrenches: Vec<[Number; 6]>,
    /// Which wrench is asked for again, after how many others.
    again: Vec<u8>,
}

fuzz_target!(|input: Input| if input.grasp.planar { examine::<3>(&input) } else { examine::<6>(&input) });

fn examine<const D: usize>(input: &Input) {
    let Some(grasp) = input.grasp.grasp::<D>() else { return };
    let mut options = DistributionOptions::default();
    if !grasp.is_finite() {
        options.rtol = 1e-6;
    }
    let Ok(mut warm) = ControlLoop::with_options(&grasp, criterion(input.sum), options.clone()) else {
        return;
    };
    let wrenches: Vec<_> = input.wrenches.iter().take(8).map(wrench::<D>).collect();
    if wrenches.is_empty() {
        return;
    }
    let order =
        (0..wrenches.len()).chain(input.again.iter().take(16).map(|k| usize::from(*k) % wrenches.len()));
    for k in order {
        let cold = warm.cold();
        let (warm, cold) = (checked(&warm, &wrenches[k]), checked(&cold, &wrenches[k]));
        if let (Ok(warm), Ok(cold)) = (warm, cold) {
            let proven: f64 = if grasp.is_finite() { 1e-7 } else { 1e-4 };
            let tolerance = proven.max(2.0 * (warm.gap + cold.gap));
            let off = (warm.sigma - cold.sigma).abs();
            assert!(off <= tolerance * cold.sigma, "{:e} with a past, {:e} without", warm.sigma, cold.sigma);
        }
    }
    for parallel in [false, true] {
        let batch = warm.solve_many(&wrenches, parallel).expect("nobody else uses it");
        let width = batch.forces.len() / wrenches.len();
        for (row, status) in batch.status.iter().enumerate() {
            let numbers = &batch.forces[row * width..(row + 1) * width];
            match status {
                Status::Solved => assert!(numbers.iter().all(|x| x.is_finite())),
                _ => assert!(numbers.iter().all(|x| x.is_nan())),
            }
            let refused = matches!(warm.solve(&wrenches[row]), Err(Error::InvalidInput { .. }));
            assert_eq!(refused, *status == Status::Invalid);
        }
    }
    if let Some(other) = input.other.as_ref().and_then(GraspInput::grasp::<D>)
        && warm.update(&other).is_ok()
    {
        for external in &wrenches {
            drop(checked(&warm, external));
        }
    }
}
