//! Degenerate grasps are the normal case: each is classified and bracketed.

use graspforce::{
    Closure, Contact, Criterion, Error, Grasp, Metric, Quality, QualityOptions, QualityWorkspace, Wrench,
};
use nalgebra::Vector3;
use support::reference_cases::plate;

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];

/// Contacts on the sphere around the origin, pressing inward.
fn on_sphere(points: &[[f64; 3]]) -> Vec<Contact> {
    points.iter().map(|&p| Contact::new(Vector3::from(p), -Vector3::from(p))).collect()
}

fn axes() -> Vec<Contact> {
    on_sphere(&[
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ])
}

fn tetrahedron() -> Vec<Contact> {
    on_sphere(&[[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
}

fn antipodal() -> Vec<Contact> {
    on_sphere(&[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
}

/// Two frictionless contacts on each face of a cube, off its centre: enough to hold it without friction.
fn frictionless_cube(offset: f64) -> Vec<Contact> {
    let mut contacts = Vec::new();
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            for shift in [offset, -offset] {
                let mut position = Vector3::zeros();
                position[axis] = side;
                position[(axis + 1) % 3] = shift * side;
                let mut normal = Vector3::zeros();
                normal[axis] = -side;
                contacts.push(Contact::new(position, normal).friction(0.0));
            }
        }
    }
    contacts
}

fn each(contacts: Vec<Contact>, change: impl Fn(usize, Contact) -> Contact) -> Vec<Contact> {
    contacts.into_iter().enumerate().map(|(i, contact)| change(i, contact)).collect()
}

fn scaled(contacts: Vec<Contact>, by: f64) -> Vec<Contact> {
    each(contacts, |_, mut contact| {
        contact.position *= by;
        contact
    })
}

fn check<const D: usize>(name: &str, contacts: &[Contact], expected: Closure) {
    let grasp = Grasp::<D>::new(contacts).unwrap();
    assert_eq!(grasp.closure(), Ok(expected), "{name}");
    for criterion in BOTH {
        let quality = grasp.quality(criterion).unwrap();
        assert_eq!(quality.closure, expected, "{name}");
        assert!(quality.lower <= quality.rho && quality.rho <= quality.upper, "{name}: {quality:?}");
        assert!(quality.converged, "{name}: {quality:?}");
        match expected {
            Closure::Force => assert!(quality.upper < 0.0, "{name}: {quality:?}"),
            Closure::Partial => assert_eq!(quality.rho, 0.0, "{name}"),
            Closure::None => assert!(quality.lower > 0.0, "{name}: {quality:?}"),
        }
        if expected != Closure::Force {
            // The witness: no wrench of the grasp has a positive component along the direction.
            let along = grasp.primitive_wrenches().unwrap().iter().map(|w| {
                let z = quality.metric.norm(&quality.direction);
                assert!((z - 1.0).abs() < 1e-9, "{name}");
                w.dot(&quality.direction) / w.norm()
            });
            let furthest = along.fold(f64::NEG_INFINITY, f64::max);
            assert!(furthest < 1e-9, "{name}: {furthest:e}");
        }
    }
}

#[test]
fn symmetric_and_repeated_contacts() {
    check::<6>("six on the axes", &axes(), Closure::Force);
    check::<6>("tetrahedron", &tetrahedron(), Closure::Force);
    let twice: Vec<_> = tetrahedron().into_iter().chain(tetrahedron()).collect();
    check::<6>("every contact twice", &twice, Closure::Force);
    let seven_times: Vec<_> = (0..7).map(|_| tetrahedron()[0].clone()).collect();
    check::<6>("one contact seven times", &seven_times, Closure::None);
}

#[test]
fn antipodal_pairs() {
    check::<6>("hard fingers cannot twist about their axis", &antipodal(), Closure::Partial);
    check::<6>("soft fingers can", &each(antipodal(), |_, c| c.torsion(0.2)), Closure::Force);
    check::<6>(
        "one soft finger is enough",
        &each(antipodal(), |i, c| c.torsion(0.2 * i as f64)),
        Closure::Force,
    );
    check::<3>("in the plane friction is enough", &antipodal(), Closure::Force);
    check::<3>("without friction it is not", &each(antipodal(), |_, c| c.friction(0.0)), Closure::Partial);
}

#[test]
fn frictionless_contacts() {
    let smooth = each(axes(), |_, c| c.friction(0.0));
    check::<6>("a smooth sphere turns freely", &smooth, Closure::Partial);
    check::<6>("twelve off-centre contacts hold a cube", &frictionless_cube(0.5), Closure::Force);
    check::<6>("twelve central ones do not", &frictionless_cube(0.0), Closure::Partial);
    let halves: Vec<_> = frictionless_cube(0.5).into_iter().take(4).collect();
    check::<6>("two faces of the cube", &halves, Closure::Partial);
    check::<6>("one smooth contact", &smooth[..1], Closure::None);
}

#[test]
fn friction_of_every_size() {
    for friction in [1e-6, 1e-3, 0.1, 1.5, 10.0, 1e3] {
        check::<6>(
            &format!("tetrahedron, friction {friction}"),
            &each(tetrahedron(), |_, c| c.friction(friction)),
            Closure::Force,
        );
        check::<3>(
            &format!("pair, friction {friction}"),
            &each(antipodal(), |_, c| c.friction(friction)),
            Closure::Force,
        );
    }
}

#[test]
fn rank_deficient_sets() {
    let at_origin = each(axes(), |_, mut c| {
        c.position = Vector3::zeros();
        c
    });
    check::<6>("all contacts at the origin exert no torque", &at_origin, Closure::Partial);
    let far = each(at_origin, |_, mut c| {
        c.position = Vector3::new(0.3, -0.7, 0.1);
        c
    });
    check::<6>("nor do contacts that coincide elsewhere", &far, Closure::Partial);
    let line: Vec<_> = (0..4)
        .map(|i| {
            let normal = [Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()][i];
            Contact::new(Vector3::x() * (i as f64 - 1.5), normal)
        })
        .collect();
    check::<6>("contacts on a line cannot twist about it", &line, Closure::Partial);
    let one_side = each(axes(), |_, mut c| {
        c.normal = -Vector3::z();
        c
    });
    check::<6>("all normals parallel", &one_side, Closure::None);
}

#[test]
fn scales_of_length_and_force() {
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        check::<6>(&format!("tetrahedron of {scale} m"), &scaled(tetrahedron(), scale), Closure::Force);
        check::<6>(&format!("hard pair {scale} m apart"), &scaled(antipodal(), scale), Closure::Partial);
        check::<6>(
            &format!("smooth cube of {scale} m"),
            &scaled(frictionless_cube(0.5), scale),
            Closure::Force,
        );
        let limited = each(tetrahedron(), |_, c| c.max_normal_force(scale));
        check::<6>(&format!("tetrahedron with {scale} N"), &limited, Closure::Force);
    }
    for spread in [1e-6, 1e-3, 1e3, 1e6] {
        let uneven = each(tetrahedron(), |i, c| c.max_normal_force(if i == 0 { spread } else { 1.0 }));
        check::<6>(&format!("limits 1 and {spread} N"), &uneven, Closure::Force);
        check::<6>(&format!("limits 1 and {spread} N, mm"), &scaled(uneven, 1e-3), Closure::Force);
        let pair = each(antipodal(), |i, c| c.max_normal_force(if i == 0 { spread } else { 1.0 }));
        check::<6>(&format!("hard pair, limits 1 and {spread} N"), &pair, Closure::Partial);
    }
}

#[test]
fn coplanar_contacts_and_a_far_origin() {
    let equator: Vec<_> = axes().into_iter().take(4).collect();
    check::<6>("four on the equator", &equator, Closure::Force);
    check::<6>(
        "three on the equator",
        &on_sphere(&[[1.0, 0.0, 0.0], [-0.5, 0.75_f64.sqrt(), 0.0], [-0.5, -0.75_f64.sqrt(), 0.0]]),
        Closure::Force,
    );
    let away = each(tetrahedron(), |_, mut c| {
        c.position += Vector3::new(100.0, -50.0, 20.0);
        c
    });
    check::<6>("torques about a point 100 m away", &away, Closure::Force);
}

fn about<const D: usize>(grasp: &Grasp<D>, criterion: Criterion, center: Wrench<D>) -> Quality<D> {
    let options = QualityOptions { external_wrench: Some(center), ..QualityOptions::new(criterion) };
    grasp.quality_with(&options, &mut QualityWorkspace::default()).unwrap()
}

#[test]
fn cones_of_enormous_friction_are_no_less_closed_than_others() {
    // A soft pair of unequal strength: its wrenches are all friction, and its normal forces rounding beside them.
    let x = Vector3::new(0.466_281_615_201_695_9, -0.111_052_659_400_205_4, 0.877_638_172_691_365_8);
    for friction in [0.5, 1e3, 1e4, 1e5, 1e6] {
        for limits in [[1.0, 1.0], [380.211_680_91, 1.886_797_94]] {
            let pair =
                [-1.0, 1.0].map(|side| Contact::new(x * side, -x * side).friction(friction).torsion(0.1));
            let soft = |i: usize| pair[i].clone().max_normal_force(limits[i]);
            let cones = Grasp::<6>::new(&[soft(0).cone(), soft(1).cone()]).unwrap();
            assert_eq!(cones.closure(), Ok(Closure::Force), "friction {friction}, limits {limits:?}");
            for criterion in BOTH {
                let found = cones.quality(criterion).unwrap();
                assert!(
                    found.closure == Closure::Force && found.lower < 0.0,
                    "{friction} {limits:?} {found:?}"
                );
                assert!(
                    found.lower <= found.rho && found.rho <= found.upper && found.upper <= 0.0,
                    "{found:?}"
                );
            }
        }
    }
}

#[test]
fn where_quality_converges_its_bracket_is_narrow() {
    for strong in [1.0, 1e3, 1e6, 1e9, 1e12] {
        let fingers =
            [([0.0, 0.0], [0.0, 1.0], 1.0), ([1.0, 0.0], [0.3, 1.0], strong)].map(|(r, n, limit)| {
                Contact::new(Vector3::new(r[0], r[1], 0.0), Vector3::new(n[0], n[1], 0.0))
                    .friction(0.3)
                    .max_normal_force(limit)
            });
        let grasp = Grasp::<3>::new(&fingers).unwrap();
        for criterion in BOTH {
            let found = grasp.quality(criterion).unwrap();
            assert_eq!(found.closure, Closure::None);
            let noise = 1e-14 * strong;
            assert!(found.converged, "{strong:e} {found:?}");
            assert!(found.upper - found.lower <= 1e-9 * found.rho + noise, "{strong:e} {found:?}");
        }
    }
}

#[test]
fn on_the_boundary_about_a_center_the_direction_is_a_witness() {
    let plate = plate();
    for (criterion, load) in [(Criterion::Sum, -10.0), (Criterion::Max, 0.0), (Criterion::Sum, 0.0)] {
        let center = Wrench::from_row_slice(&[0.0, 0.0, load, 0.0, 0.0, 0.0]);
        let found = about(&plate, criterion, center);
        assert!(found.rho == 0.0 && found.converged, "{criterion:?} {load} {found:?}");
        let wrenches = plate.primitive_wrenches().unwrap();
        let most = |w: &[Wrench<6>]| w.iter().map(|w| w.dot(&found.direction)).fold(0.0, f64::max);
        let reach = match criterion {
            Criterion::Sum => most(wrenches),
            Criterion::Max => wrenches.chunks(12).map(most).sum(),
        };
        let value = reach + center.dot(&found.direction);
        let longest = wrenches.iter().map(Wrench::norm).fold(0.0, f64::max);
        assert!(value <= 1e-9 * (longest + load.abs()), "{criterion:?} {load}: {value:e}");
    }
}

#[test]
fn what_cannot_be_computed_with_is_named() {
    let grasp = Grasp::<6>::new(&tetrahedron()).unwrap();
    let ask = |options| grasp.quality_with(&options, &mut QualityWorkspace::default()).unwrap_err();
    let plain = QualityOptions::new(Criterion::Max);
    let tiny = nalgebra::SMatrix::<f64, 6, 6>::identity() * 1e-300;
    if let Ok(metric) = Metric::from_matrix(&tiny) {
        let error = ask(QualityOptions { metric: Some(metric), ..plain });
        assert!(matches!(error, Error::InvalidInput { argument: "metric", .. }), "{error}");
    }
    let error = ask(QualityOptions { external_wrench: Some(Wrench::repeat(1e200)), ..plain });
    assert!(matches!(error, Error::InvalidInput { argument: "external_wrench", .. }), "{error}");
}

#[test]
fn more_forces_than_memory_holds_are_refused() {
    let soft = tetrahedron().into_iter().map(|contact| contact.torsion(0.1).edges(65_536));
    let error = Grasp::<6>::new(&soft.collect::<Vec<_>>()).unwrap_err();
    assert!(matches!(error, Error::InvalidGrasp { argument: "edges", contact: Some(0), .. }), "{error}");
}
