//! Sets that are flat, or nearly so: contacts on a line, contacts without friction in a plane, thin in hard metrics.

use graspforce::{Contact, Criterion, Grasp, Metric, QualityOptions, QualityWorkspace, Wrench, WrenchSet};
use nalgebra::{SMatrix, Vector3};
use support::random::Random;

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];

/// Contacts on the x axis, off it by `offset` along y: nothing, or hardly anything, resists a torque about it.
fn on_a_line(random: &mut Random, offset: f64) -> Vec<Contact> {
    let count = 2 + (random.next() * 4.0) as usize;
    (0..count)
        .map(|k| {
            let position =
                Vector3::new(2.0 * random.next() - 1.0, if k % 2 == 1 { offset } else { 0.0 }, 0.0);
            let normal = if k < 2 {
                Vector3::new(if k == 0 { 1.0 } else { -1.0 }, 0.0, 0.0)
            } else {
                random.direction()
            };
            let contact = Contact::new(position, normal).friction(0.2 + random.next()).edges(4 + k % 5);
            if random.next() < 0.3 { contact.cone() } else { contact }
        })
        .collect()
}

/// Contacts without friction in the plane z = 0, off it by `offset`: they exert three of six components.
fn in_a_plane(random: &mut Random, offset: f64) -> Vec<Contact> {
    let count = 3 + (random.next() * 4.0) as usize;
    (0..count)
        .map(|k| {
            let angle = 6.0 * random.next();
            let height = if k % 2 == 1 { offset } else { 0.0 };
            let position = Vector3::new(angle.cos(), angle.sin(), height);
            let turn = angle + random.next() - 0.5;
            Contact::new(position, Vector3::new(-turn.cos(), -turn.sin(), 0.0)).friction(0.0)
        })
        .collect()
}

/// `Q D Q^T` with its inverse, for a condition number.
fn metric(random: &mut Random, condition: f64) -> (SMatrix<f64, 6, 6>, SMatrix<f64, 6, 6>) {
    let q = SMatrix::<f64, 6, 6>::from_fn(|_, _| 2.0 * random.next() - 1.0).qr().q();
    let grades = Wrench::<6>::from_fn(|_, _| condition.powf(-random.next()));
    let symmetric = |d: Wrench<6>| {
        let m = q * SMatrix::from_diagonal(&d) * q.transpose();
        (m + m.transpose()) * 0.5
    };
    (symmetric(grades), symmetric(grades.map(f64::recip)))
}

#[test]
fn no_ball_is_certified_in_a_set_that_is_flatter() {
    let mut random = Random(5);
    let mut workspace = QualityWorkspace::default();
    for case in 0..600 {
        let offset = if case % 3 == 0 { 0.0 } else { 10.0_f64.powf(-4.0 - 14.0 * random.next()) };
        let plane = case % 2 == 1;
        let contacts = if plane { in_a_plane(&mut random, offset) } else { on_a_line(&mut random, offset) };
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        // The functional along which the set is thin, f_z or the torque about x, and its dual norm.
        let thin = if plane { 2 } else { 3 };
        let functional = Wrench::<6>::from_fn(|row, _| f64::from(u8::from(row == thin)));
        let condition = 10.0_f64.powf(10.0 * random.next());
        let (matrix, inverse) = metric(&mut random, condition);
        let hard = case % 4 < 2;
        let norm = if hard { inverse[(thin, thin)].sqrt() } else { 1.0 };
        let metric = if hard { Metric::from_matrix(&matrix).ok() } else { None };
        let center = (case % 5 == 0).then(Wrench::<6>::zeros);
        for criterion in BOTH {
            let options =
                QualityOptions { metric, external_wrench: center, ..QualityOptions::new(criterion) };
            let found = grasp.quality_with(&options, &mut workspace).unwrap();
            let set = WrenchSet::new(&grasp, criterion);
            let reach = set.value(&functional).min(set.value(&-functional)).max(0.0);
            assert!(
                found.epsilon_lower() <= reach / norm * (1.0 + 1e-5),
                "case {case}, {criterion:?}: certified {:e} where {:e} is possible\n{contacts:?}\n{found:?}",
                found.epsilon_lower(),
                reach / norm
            );
            assert!(found.lower <= found.upper, "{found:?}");
        }
    }
}
