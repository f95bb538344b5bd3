//! Brackets where arithmetic ends: hard metrics, frictions of hardly more than rounding, cones that all but meet.

use graspforce::{
    Closure, Contact, Criterion, Grasp, GraspOptions, Metric, QualityOptions, QualityWorkspace,
};
use nalgebra::{Matrix3, Rotation3, Vector3};

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];

fn triangle(friction: f64) -> Grasp<3> {
    let contacts: Vec<_> = [[1.0, 0.0], [-0.5, 0.75_f64.sqrt()], [-0.5, -(0.75_f64.sqrt())]]
        .map(|[x, y]| Contact::new(Vector3::new(x, y, 0.0), Vector3::new(-x, -y, 0.0)).friction(friction))
        .to_vec();
    Grasp::new(&contacts).unwrap()
}

fn pair(friction: f64) -> Grasp<3> {
    let side =
        |x: f64| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(-x, 0.0, 0.0)).friction(friction);
    Grasp::new(&[side(-1.0), side(1.0)]).unwrap()
}

#[test]
fn a_metric_of_a_condition_of_1e12_costs_no_digits() {
    for seed in 0..20 {
        let turn = Rotation3::new(Vector3::new(0.3, -0.7, 0.2) * (1.0 + f64::from(seed)));
        let turn: &Matrix3<f64> = turn.matrix();
        let matrix = turn * Matrix3::from_diagonal(&Vector3::new(1.0, 1e-6, 1e-12)) * turn.transpose();
        let metric = Metric::from_matrix(&matrix).unwrap();
        for criterion in BOTH {
            let options = QualityOptions { metric: Some(metric), ..QualityOptions::new(criterion) };
            let found = triangle(0.5).quality_with(&options, &mut QualityWorkspace::default()).unwrap();
            assert!(found.converged && found.closure == Closure::Force, "{found:?}");
            assert!(found.upper - found.lower <= 2e-9 * -found.rho, "{found:?}");
        }
    }
}

#[test]
fn closure_belongs_to_the_grasp_whatever_the_metric() {
    for friction in [1e-12, 1e-11, 1e-10, 1e-9, 1e-6, 1e-3] {
        let grasp = pair(friction);
        assert_eq!(grasp.closure(), Ok(Closure::Force), "{friction:e}");
        for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
            for criterion in BOTH {
                let metric = Some(Metric::from_length_scale(scale));
                let options = QualityOptions { metric, ..QualityOptions::new(criterion) };
                let found = grasp.quality_with(&options, &mut QualityWorkspace::default()).unwrap();
                assert!(
                    found.closure == Closure::Force && found.rho < 0.0,
                    "{friction:e} {scale:e} {found:?}"
                );
            }
        }
        // The hull of four wrenches (1, +-mu, +-mu): by the sum, mu / sqrt(2) at a length scale of 1 m.
        let found = grasp.quality(Criterion::Sum).unwrap();
        let exact = friction / (2.0 + friction * friction).sqrt();
        assert!(found.epsilon_lower() <= exact && exact <= found.epsilon_upper(), "{exact:e} {found:?}");
    }
    let smooth = pair(0.0).quality(Criterion::Max).unwrap();
    assert!(smooth.closure == Closure::Partial && smooth.rho == 0.0, "{smooth:?}");
    assert!(smooth.lower <= 0.0 && 0.0 <= smooth.upper, "{smooth:?}");
}

#[test]
fn feet_that_all_but_close_have_a_narrow_bracket() {
    // Cones of friction 1/2 whose nearer edges point 1e-7 rad below the line between the feet, at 100 N.
    let tilt = 0.5_f64.atan() + 1e-7;
    let foot = |side: f64| {
        Contact::new(Vector3::new(0.1 * side, 0.0, 0.0), Vector3::new(-side * tilt.cos(), 0.0, tilt.sin()))
            .friction(0.5)
            .max_normal_force(100.0)
    };
    for contact in [Contact::cone, |contact: Contact| contact.edges(8)] {
        let grasp = Grasp::<6>::new(&[contact(foot(-1.0)), contact(foot(1.0))]).unwrap();
        for criterion in BOTH {
            let found = grasp.quality(criterion).unwrap();
            assert!(found.converged && found.closure == Closure::None, "{found:?}");
            // Their gap is the height of the edges, 100 N sqrt(1.25) sin(1e-7).
            let exact = 100.0 * 1.25_f64.sqrt() * 1e-7;
            assert!(found.lower <= exact && exact <= found.upper * (1.0 + 1e-8), "{found:?}");
            assert!(found.upper - found.lower <= 1e-7 * exact, "{found:?}");
        }
    }
}

#[test]
fn jaws_of_little_friction_have_force_closure_and_narrow_brackets_in_every_norm_and_with_any_limits() {
    for (k, friction) in [1e-13, 1e-11, 1e-10, 1e-8].into_iter().enumerate() {
        for limits in [[1.0; 4], [1.0, 1e3, 1e-2, 30.0]] {
            let corners = [[-0.1_f64, 0.0], [0.1, 0.0], [-0.1, 0.07], [0.1, 0.07]];
            let contacts: Vec<_> = corners
                .iter()
                .zip(limits)
                .map(|([x, y], limit)| {
                    let inward = Vector3::new(-x.signum(), 0.0, 0.0);
                    let contact = Contact::new(Vector3::new(*x, *y, 0.0), inward);
                    contact.friction(friction).max_normal_force(limit)
                })
                .collect();
            for length_scale in [1e-3, 1.0, 1e3] {
                let origin = Vector3::new(0.3, -0.2, 0.0) * k as f64;
                let options = GraspOptions { length_scale, origin, ..GraspOptions::default() };
                let grasp = Grasp::<3>::with_options(&contacts, options).unwrap();
                for criterion in BOTH {
                    let found = grasp.quality(criterion).unwrap();
                    assert!(found.closure == Closure::Force && found.converged, "{friction:e} {found:?}");
                    assert!(found.upper - found.lower < 1e-6 * -found.rho, "{friction:e} {found:?}");
                }
            }
        }
    }
}
