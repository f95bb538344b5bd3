//! Quality by both criteria, with external wrench and metric; the Minkowski sum as its definition.
#![no_main]

use arbitrary::Arbitrary;
use graspforce::{Closure, Criterion, Grasp, Metric, MinkowskiSum, Wrench, WrenchSet};
use graspforce_fuzz::input::{GraspInput, Number, wrench};
use graspforce_fuzz::quality::{checked, options};
use libfuzzer_sys::fuzz_target;
use nalgebra::SMatrix;

#[derive(Debug, Arbitrary)]
struct Input {
    grasp: GraspInput,
    directions: [[Number; 6]; 3],
    center: Option<[Number; 6]>,
    metric: Option<[[Number; 6]; 6]>,
}

fuzz_target!(|input: Input| if input.grasp.planar { examine::<3>(&input) } else { examine::<6>(&input) });

fn examine<const D: usize>(input: &Input) {
    let Some(grasp) = input.grasp.grasp::<D>() else { return };
    let directions = input.directions.map(|numbers| wrench::<D>(&numbers));
    let directions: Vec<_> = directions.into_iter().filter(|z| z.iter().all(|x| x.is_finite())).collect();
    let [max, sum] = [Criterion::Max, Criterion::Sum]
        .map(|criterion| checked(&grasp, &options(&grasp, criterion), &directions));
    if let (Some(max), Some(sum)) = (&max, &sum) {
        assert_eq!(max.closure, sum.closure);
        // The union is part of the Minkowski sum's hull.
        if max.closure == Closure::Force {
            let slack = 1e-9 * max.lower.abs().max(sum.lower.abs());
            assert!(max.lower <= sum.upper + slack, "{max:?} {sum:?}");
        }
    }
    let mut asked = options(&grasp, Criterion::Max);
    if let Some(center) = &input.center {
        asked.external_wrench = Some(wrench(center));
        checked(&grasp, &asked, &directions);
    }
    if let Some(entries) = &input.metric {
        let root = SMatrix::<f64, D, D>::from_fn(|i, j| entries[i][j].0);
        if let Ok(metric) = Metric::from_matrix(&(root.transpose() * root)) {
            asked.metric = Some(metric);
            if let Ok(quality) = grasp.quality_with(&asked, &mut Default::default()) {
                assert!(quality.lower <= quality.rho && quality.rho <= quality.upper, "{quality:?}");
                assert!(quality.direction.iter().all(|x| x.is_finite()), "{quality:?}");
            }
        }
    }
    minkowski(&grasp, &directions);
}

/// Every point is the sum of its entries, and the oracle finds the furthest of them.
fn minkowski<const D: usize>(grasp: &Grasp<D>, directions: &[Wrench<D>]) {
    let Ok(sum) = MinkowskiSum::with_limit(grasp, 2000) else { return };
    let wrenches = grasp.primitive_wrenches().expect("enumerated");
    for (j, point) in sum.wrenches().iter().enumerate().step_by(7) {
        let entries = sum.entries(j);
        let total: Wrench<D> =
            entries.map(|(i, h)| wrenches[grasp.edges(i).expect("finite").start + h]).sum();
        let size = wrenches.iter().map(Wrench::amax).fold(0.0, f64::max);
        assert!((point - total).amax() <= 1e-12 * size);
    }
    let set = WrenchSet::new(grasp, Criterion::Max);
    for z in directions.iter().filter(|z| (1e-100..1e100).contains(&z.amax())) {
        let listed = sum.wrenches().iter().map(|w| w.dot(z)).fold(f64::NEG_INFINITY, f64::max);
        let asked = set.value(z);
        let size: f64 = wrenches.iter().map(Wrench::amax).fold(0.0, f64::max) * z.amax();
        assert!((listed - asked).abs() <= 1e-10 * size, "{listed:e} listed, {asked:e} asked, size {size:e}");
    }
}
