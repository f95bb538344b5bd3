//! Planning: pruning changes nothing, a batch answers row by row, and a box's bound holds at its vertices.
#![no_main]

use arbitrary::Arbitrary;
use graspforce::{
    BoxBound, CandidateSearch, Closure, Contact, Criterion, Grasp, Metric, Wrench, WrenchSet, quality_batch,
};
use graspforce_fuzz::input::{GraspInput, Triple, criterion, vector};
use graspforce_fuzz::quality::options;
use libfuzzer_sys::fuzz_target;

#[derive(Debug, Arbitrary)]
struct Input {
    grasp: GraspInput,
    sum: bool,
    moves: Vec<Triple>,
    center: u8,
}

fuzz_target!(|input: Input| if input.grasp.planar { examine::<3>(&input) } else { examine::<6>(&input) });

fn examine<const D: usize>(input: &Input) {
    let Some(grasp) = input.grasp.grasp::<D>() else { return };
    let options = options(&grasp, criterion(input.sum));
    let moves: Vec<_> = input.moves.iter().take(8).collect();
    if moves.is_empty() {
        return;
    }
    let count = moves.len();
    let contacts = input.grasp.contacts();
    let candidate = |k: usize| {
        let mut contacts: Vec<Contact> = contacts.clone();
        let at = k % contacts.len();
        let mut step = vector(moves[k]) / 8.0;
        if D == 3 {
            step.z = 0.0;
        }
        contacts[at].position += step;
        Grasp::<D>::with_options(&contacts, input.grasp.options())
    };
    let rows = quality_batch(0..count, candidate, &options, false);
    for row in &rows {
        assert_eq!(row.error.is_some(), row.rho.is_nan(), "{row:?}");
        assert!(row.error.is_some() || (row.lower <= row.rho && row.rho <= row.upper), "{row:?}");
    }
    let center = usize::from(input.center) % count;
    let [pruned, plain] = [true, false].map(|prune| {
        let mut search = CandidateSearch::new(options, prune).expect("checked options");
        [(); 2].map(|()| search.best(count, center, None, candidate))
    });
    let decided = rows.iter().all(|row| row.converged);
    for (pruned, plain) in pruned.into_iter().zip(plain) {
        match (pruned, plain) {
            (Ok(pruned), Ok(plain)) if decided && grasp.is_finite() => {
                // Within rounding of the longest wrench candidates are as good as each other.
                let scale =
                    (0..count).filter_map(|k| candidate(k).ok()).map(|g| longest(&g)).fold(0.0, f64::max);
                let tied = (pruned.rho - plain.rho).abs() <= 1e-8 * scale;
                assert!(tied || pruned.index == plain.index, "{pruned:?} {plain:?}");
            }
            (Ok(_), Ok(_)) | (Err(_), Err(_)) => {}
            (pruned, plain) => panic!("{pruned:?} {plain:?}"),
        }
    }
    let mut bound = BoxBound::new(options).expect("checked options");
    if let Ok(bounds) = bound.over(&[0.0], None, f64::NEG_INFINITY, |_| 0..count, candidate) {
        assert!(!bounds[0].is_nan());
        for row in rows.iter().filter(|row| row.error.is_none()) {
            // Partial closure may be none within the tolerance of the class, and then the bound may prove it.
            let bound = if row.closure == Some(Closure::Partial) { bounds[0].max(0.0) } else { bounds[0] };
            let slack = 1e-6 * row.lower.abs() + 1e-6 * bound.abs();
            assert!(-row.upper <= bound + slack, "{row:?} above {bounds:?}");
        }
    }
}

/// How far the grasp reaches along the axes.
fn longest<const D: usize>(grasp: &Grasp<D>) -> f64 {
    let set = WrenchSet::new(grasp, Criterion::Max);
    let unit = |axis| Wrench::from_fn(|row, _| f64::from(u8::from(row == axis)));
    let axes = (0..D).map(unit).flat_map(|axis| [axis, -axis]);
    let metric = Metric::from_length_scale(grasp.options().length_scale);
    axes.map(|z| metric.norm(&set.support(&z).wrench)).fold(0.0, f64::max)
}
