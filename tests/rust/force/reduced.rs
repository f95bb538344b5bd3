//! The reduction of section 4.2: fewer points, the same answers.

use graspforce::{Criterion, DistributionOptions, Method, Wrench};
use support::control_loop::ControlLoop;
use support::reference_cases::close;
use support::tile::{OPTIMUM, tile, wrench};

/// The paper's samples: the wrench at t = 1..10 s and the opposite of their sum.
fn samples() -> Vec<Vec<f64>> {
    let wrenches: Vec<_> = (1..=10).map(|t| wrench(f64::from(t))).collect();
    let opposite = -wrenches.iter().sum::<Wrench<6>>();
    wrenches.iter().chain([&opposite]).map(|w| w.as_slice().to_vec()).collect()
}

#[test]
fn a_reduced_set_answers_like_the_whole_and_says_when_it_cannot() {
    let grasp = tile(OPTIMUM, 10);
    let mut options = DistributionOptions::default();
    options.method = Method::Reduced;
    options.samples = samples();
    let reduced = ControlLoop::with_options(&grasp, Criterion::Max, options).unwrap();
    let implicit = ControlLoop::new(&grasp, Criterion::Max).unwrap();
    let kept = reduced.reduced_points().unwrap().len();
    // Those on the hyperplanes of the samples; print says 275 of 14,640, with other friction.
    assert_eq!(kept, 405);
    let mut fell_back = 0;
    for k in 0..1000 {
        let external = wrench(f64::from(k) * 0.01);
        let (a, b) = (reduced.solve(&external).unwrap(), implicit.solve(&external).unwrap());
        assert!(close(a.sigma_max, b.sigma_max, 1e-9) && close(a.sigma_sum, b.sigma_sum, 1e-9));
        for (f, g) in a.forces.iter().zip(&b.forces) {
            assert!((f - g).amax() <= 1e-8, "{k}: {f} {g}");
        }
        fell_back += usize::from(a.fell_back);
    }
    // The samples are the trajectory's own: few wrenches between them need more.
    assert!(fell_back <= 40, "{fell_back}");
    println!("{kept} of 14640 points kept, {fell_back} of 1000 answers by the whole set");
    for t in 1..=10 {
        assert!(!reduced.cold().solve(&wrench(f64::from(t))).unwrap().fell_back, "sample {t}");
    }
    // Completed until the origin is interior, every wrench has an answer.
    assert!(reduced.solve(&Wrench::<6>::new(0.0, 1.0, 0.0, 0.0, 0.3, 0.0)).is_ok());
}
