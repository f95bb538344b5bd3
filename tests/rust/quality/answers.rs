//! Quality against the reference answers.

use graspforce::{Closure, Criterion, Grasp};
use support::reference_cases::spatial_cases;

fn name(closure: Closure) -> &'static str {
    match closure {
        Closure::Force => "force",
        Closure::Partial => "partial",
        Closure::None => "none",
    }
}

#[test]
fn reference_grasps_have_their_class_and_quality() {
    for case in spatial_cases() {
        let grasp = Grasp::<6>::new(&case.contacts).unwrap();
        for (criterion, rho) in [(Criterion::Sum, case.rho_sum), (Criterion::Max, case.rho_max)] {
            let found = grasp.quality(criterion).unwrap();
            println!(
                "{:55} {criterion:?} {:18.15} {:18.15} {:8.1e} supports {} {}",
                case.name,
                found.rho,
                rho,
                (found.rho - rho) / rho,
                found.supports,
                found.converged
            );
            assert_eq!(name(found.closure), case.closure, "{}", case.name);
            assert!((found.rho - rho).abs() <= 1e-8 * rho.abs(), "{}: {found:?}, not {rho}", case.name);
            assert!(found.lower <= found.rho && found.rho <= found.upper, "{}: {found:?}", case.name);
            assert!(found.converged, "{}: {found:?}", case.name);
        }
    }
}
