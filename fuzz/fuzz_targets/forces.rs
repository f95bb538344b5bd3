//! Force distribution by every method and objective, one wrench at a time.
#![no_main]

use arbitrary::Arbitrary;
use graspforce::{DistributionOptions, Error, Method};
use graspforce_fuzz::forces::{checked, distributor};
use graspforce_fuzz::input::{GraspInput, Number, criterion, wrench};
use libfuzzer_sys::fuzz_target;

#[derive(Debug, Arbitrary)]
struct Input {
    grasp: GraspInput,
    sum: bool,
    method: u8,
    weight: Option<Number>,
    min_normal: Option<Vec<Number>>,
    samples: Vec<[Number; 6]>,
    wrenches: Vec<[Number; 6]>,
}

fuzz_target!(|input: Input| if input.grasp.planar { examine::<3>(&input) } else { examine::<6>(&input) });

fn examine<const D: usize>(input: &Input) {
    let Some(grasp) = input.grasp.grasp::<D>() else { return };
    let mut options = DistributionOptions::default();
    options.max_points = 1000;
    options.method = [Method::Implicit, Method::Implicit, Method::Enumerated, Method::Reduced]
        [usize::from(input.method % 4)];
    options.weight = input.weight.map_or(0.0, |weight| weight.0);
    if let Some(bounds) = &input.min_normal {
        options.min_normal = bounds.iter().map(|bound| bound.0.abs()).collect();
        options.min_normal.resize(grasp.num_contacts(), 0.0);
    }
    let sample = |numbers: &[Number; 6]| wrench::<D>(numbers).as_slice().to_vec();
    if options.method == Method::Reduced {
        options.samples = input.samples.iter().take(4).map(sample).collect();
    }
    if !grasp.is_finite() {
        options.rtol = 1e-6;
    }
    let Some(distributor) = distributor(&grasp, criterion(input.sum), options) else { return };
    let mut forces = vec![0.0; grasp.num_contacts() * grasp.force_dim()];
    for numbers in input.wrenches.iter().take(4) {
        let external = wrench::<D>(numbers);
        let found = checked(&distributor, &external);
        // The same question again, into the caller's memory.
        let again = distributor.solve_into(&external, &mut forces);
        match (found, again) {
            (Ok(found), Ok(sigma)) => {
                let off = (found.sigma - sigma).abs();
                assert!(off <= 1e-6 * found.sigma, "{sigma:e} after {:e}", found.sigma);
            }
            // What was learned on the way to no answer may lead to one.
            (Err(_), Err(_)) | (Err(Error::NotConverged { .. }), Ok(_)) => {}
            (found, again) => panic!("{found:?} and then {again:?}"),
        }
    }
}
