//! Balance measured as forces and as torques, each in its own unit, however far away or strong a contact is.

use graspforce::{Distribution, Grasp, Wrench};

/// What rounding may cost, relative to the forces at work and their levers.
const ROUNDING: f64 = 1e-6;

/// The library's own allowance: a share of the whole wrench, in units of the longest lever.
const UNBALANCED: f64 = 1e-8;

pub fn assert_balanced<const D: usize>(grasp: &Grasp<D>, external: &Wrench<D>, found: &Distribution<D>) {
    let wrenches = found.contact_wrenches(grasp);
    let split = first_torque::<D>();
    for rows in [0..split, split..D] {
        let part = |w: &Wrench<D>| w.rows_range(rows.clone()).norm();
        let lever = |i: usize| grasp.maps()[i].columns(0, 3).rows_range(rows.clone()).amax();
        let effort: f64 = found.forces.iter().enumerate().map(|(i, f)| lever(i) * f.amax()).sum();
        let effort = effort + wrenches.iter().map(part).sum::<f64>() + part(external);
        let rest = part(&(wrenches.iter().sum::<Wrench<D>>() + external));
        let allowed = ROUNDING * effort + UNBALANCED * size(grasp, external, rows.start == 0);
        assert!(rest <= allowed, "unbalanced by {rest:e} of {effort:e}: {found:?}");
    }
}

/// The size of a wrench as a force, or as a torque.
fn size<const D: usize>(grasp: &Grasp<D>, external: &Wrench<D>, as_force: bool) -> f64 {
    let split = first_torque::<D>();
    let lever = |i: usize| grasp.maps()[i].columns(0, 3).rows_range(split..).amax();
    let torsion = grasp.contacts().iter().map(|contact| contact.torsion).fold(0.0, f64::max);
    let lever = (0..grasp.num_contacts()).map(lever).fold(torsion, f64::max);
    let lever = if lever > 1e-140 { lever } else { 1.0 };
    let (force, torque) = (external.rows_range(..split).norm(), external.rows_range(split..).norm());
    if as_force { force + torque / lever } else { force * lever + torque }
}

fn first_torque<const D: usize>() -> usize {
    if D == 3 { 2 } else { 3 }
}
