//! Laws of force distribution: forces balance, lie in their cones, and the dual proves them least; where there
//! are none, the witness separates.

use graspforce::{
    ContactForce, Criterion, Distribution, DistributionOptions, Error, ForceModel, Grasp, Wrench, WrenchSet,
};
use support::balance::assert_balanced;
use support::control_loop::ControlLoop;
use support::duality::{assert_proven, assert_reaches_one};
use support::friction_cone::load;

/// What rounding may cost, relative to the forces (or wrenches) at work.
const ROUNDING: f64 = 1e-6;

/// Solves and checks what came of it.
pub fn checked<const D: usize>(
    distributor: &ControlLoop<D>,
    external: &Wrench<D>,
) -> Result<Distribution<D>, Error> {
    let grasp = distributor.grasp();
    let solved = distributor.solve(external);
    match &solved {
        Ok(found) => {
            feasible(grasp, external, found);
            bounded(distributor, external, found);
        }
        Err(Error::InfeasibleWrench { direction, .. }) => {
            separates(distributor, external, &Wrench::from_column_slice(direction));
        }
        Err(_) => {}
    }
    solved
}

fn feasible<const D: usize>(grasp: &Grasp<D>, external: &Wrench<D>, found: &Distribution<D>) {
    assert!(found.forces.iter().flat_map(|force| force.iter()).all(|x| x.is_finite()), "{found:?}");
    for number in [found.sigma, found.sigma_max, found.sigma_sum, found.gap] {
        assert!(number.is_finite(), "{found:?}");
    }
    assert_balanced(grasp, external, found);
    let largest = |row: usize| found.forces.iter().map(|f| f[row].abs()).fold(0.0, f64::max);
    let (size, torque) = (largest(0), largest(3));
    for (contact, force) in grasp.contacts().iter().zip(&found.forces) {
        if matches!(contact.forces, ForceModel::Extreme(_)) {
            continue;
        }
        assert!(force[0] >= -ROUNDING * size, "pulls: {found:?}");
        // A coefficient of nearly nothing turns rounding into slip: that much of the force is left out then.
        let kept =
            |part: f64, all: f64| if part > 0.0 { (1.0 - ROUNDING * all / part).max(0.0) } else { 1.0 };
        let (along, about) = (kept(force[1].hypot(force[2]), size), kept(force[3].abs(), torque));
        let less = force.component_mul(&ContactForce::new(1.0, along, along, about));
        let slip = load(contact, D == 3, force);
        let outside = slip > force[0] + ROUNDING * size && load(contact, D == 3, &less) > force[0];
        assert!(!outside, "slips by {slip:e} at {:e}: {found:?}", force[0]);
    }
}

/// No forces need less: the dual's plane bounds the objective.
fn bounded<const D: usize>(distributor: &ControlLoop<D>, external: &Wrench<D>, found: &Distribution<D>) {
    let options = distributor.options();
    // Multipliers beyond 1e10 cannot be written down any better; the gap says so.
    assert!(found.gap <= options.rtol.max(1e-3), "{found:?}");
    if !options.min_normal.is_empty() || found.sigma == 0.0 {
        return;
    }
    assert_proven(distributor.grasp(), external, found, 2.0 * found.gap);
    if options.weight == 0.0 {
        let set = WrenchSet::new(
            distributor.grasp(),
            distributor.objective().expect("the targets minimise a criterion"),
        );
        assert_reaches_one(&set, distributor.grasp(), found);
    }
}

fn separates<const D: usize>(distributor: &ControlLoop<D>, external: &Wrench<D>, e: &Wrench<D>) {
    let grasp = distributor.grasp();
    assert!((e.norm() - 1.0).abs() < 1e-9, "direction {e:?}");
    if !distributor.options().min_normal.is_empty() {
        return;
    }
    let scaled = external / external.amax();
    assert!(-scaled.dot(e) > 0.0, "{external:?} does not go along {e:?}");
    if let Ok(wrenches) = grasp.primitive_wrenches() {
        let largest = wrenches.iter().map(Wrench::amax).fold(0.0, f64::max);
        for w in wrenches {
            let terms: f64 = w.iter().zip(e.iter()).map(|(a, b)| (a * b).abs()).sum();
            assert!(w.dot(e) <= ROUNDING * terms.max(largest * 1e-3), "{w:?} goes along {e:?}");
        }
    }
}

/// A distributor, unless the options do not suit the grasp.
pub fn distributor<const D: usize>(
    grasp: &Grasp<D>,
    criterion: Criterion,
    options: DistributionOptions,
) -> Option<ControlLoop<D>> {
    ControlLoop::with_options(grasp, criterion, options).ok()
}
