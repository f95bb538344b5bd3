//! Answers are proven or refused: no tolerance of the gap breaks a limit, and nothing lies between solved and infeasible.

use graspforce::{
    Contact, ContactForce, Criterion, DistributionOptions, Error, ForceDistributor, Grasp, Metric,
    NearestOptions, SquaresOptions, Wrench,
};
use nalgebra::{SMatrix, Vector3};
use support::problems::{Random, ellipsoid_grasp};

fn two_fingers() -> Grasp<3> {
    let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
        Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5).max_normal_force(4.0)
    });
    Grasp::new(&fingers).unwrap()
}

fn squares<const D: usize>(grasp: &Grasp<D>, options: SquaresOptions<D>) -> ForceDistributor<D> {
    ForceDistributor::squares(grasp, options).unwrap()
}

#[test]
fn least_squares_ignore_torques_that_are_rounding_of_normals_through_the_origin() {
    let mut random = Random::new(91);
    for turn in 0..100 {
        let contacts: Vec<_> = (0..4 + turn % 5)
            .map(|_| random.direction())
            .map(|u| Contact::new(u, -u).friction(0.0))
            .map(|contact| if turn % 2 == 0 { contact } else { contact.cone() })
            .collect();
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        let mut external = Wrench::<6>::zeros();
        for map in grasp.maps() {
            external -= map.column(0) * random.within(0.0, 1.0);
        }
        external.rows_range_mut(3..).fill(0.0);
        let distributor = squares(&grasp, SquaresOptions::default());
        let found = distributor.solve(&mut distributor.workspace(), &external);
        assert!(found.is_ok(), "{turn} {:?}", found.err());
    }
    let points = [(1.0, 0.0), (-0.5, 0.8), (-0.5, -0.8)].map(|(x, y)| Vector3::new(x, y, 0.0));
    let contacts = points.map(|p| Contact::new(p, -p).friction(0.0));
    let distributor = squares(&Grasp::<6>::new(&contacts).unwrap(), SquaresOptions::default());
    let external = Wrench::<6>::new(0.0, 0.1, 0.0, 0.0, 0.0, 0.0);
    let found = distributor.solve(&mut distributor.workspace(), &external).unwrap();
    for (force, expected) in found.forces.iter().zip([0.0625, 0.117_924_764, 0.0]) {
        assert!((force[0] - expected).abs() < 1e-8, "{force}");
    }
}

#[test]
fn a_loose_gap_breaks_no_limit() {
    let mut options = DistributionOptions::default();
    options.rtol = 1e-3;
    let distributor = ForceDistributor::with_options(&two_fingers(), Criterion::Max, options).unwrap();
    let weight = Wrench::<3>::new(0.0, -4.0 * 1.0009, 0.0);
    let found =
        distributor.nearest(&mut distributor.workspace(), &weight, &NearestOptions::default()).unwrap();
    assert!(found.within_limits() && (found.distance - 0.0036).abs() < 1e-9, "{}", found.distance);
}

#[test]
fn nothing_lies_between_solved_and_beyond_the_limits() {
    let options = SquaresOptions { limits: true, ..SquaresOptions::default() };
    let distributor = squares(&two_fingers(), options);
    for above in [1e-12, 1e-11, 1e-10, 3e-10, 5e-10, 9e-10, 1e-9, 1.1e-9, 3e-9] {
        let weight = Wrench::<3>::new(0.0, -4.0 * (1.0 + above), 0.0);
        match distributor.solve(&mut distributor.workspace(), &weight) {
            Ok(found) => assert!(found.within_limits()),
            Err(Error::BeyondLimits { .. }) => assert!(above > 8e-10, "{above:e}"),
            Err(error) => panic!("{above:e}: {error}"),
        }
    }
}

#[test]
fn wrenches_far_beyond_the_limits_have_an_answer_at_a_high_price() {
    let mut random = Random::new(92);
    for turn in 0..300 {
        let cone = turn % 2 == 0;
        let grasp =
            ellipsoid_grasp(
                &mut random,
                3 + turn % 4,
                |_, _, contact| {
                    if cone { contact.cone() } else { contact.edges(16) }
                },
            );
        let slack = Some(Metric::from_matrix(&(SMatrix::<f64, 6, 6>::identity() * 1e8)).unwrap());
        let distributor =
            squares(&grasp, SquaresOptions { limits: true, slack, ..SquaresOptions::default() });
        let external = Wrench::<6>::from_fn(|_, _| random.within(-60.0, 60.0));
        let found = distributor.solve(&mut distributor.workspace(), &external);
        assert!(found.as_ref().is_ok_and(|found| found.gap <= 1e-9), "{turn} {:?}", found.err());
    }
}

#[test]
fn a_frictionless_finger_never_pulls() {
    let contact = Contact::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 1.0)).friction(0.0).cone();
    let grasp = Grasp::<6>::new(&[contact]).unwrap();
    let slack = Some(Metric::from_matrix(&SMatrix::<f64, 6, 6>::identity()).unwrap());
    let distributor = squares(&grasp, SquaresOptions { slack, ..SquaresOptions::default() });
    let pulling = Wrench::<6>::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    let found = distributor.solve(&mut distributor.workspace(), &pulling).unwrap();
    assert_eq!(found.forces[0][0], 0.0);
}

#[test]
fn coefficients_that_underflow_are_refused_by_name() {
    for (friction, torsion, named) in
        [(1e-200, 0.01, "friction"), (0.5, 1e-200, "torsion"), (1e-61, 0.0, "friction")]
    {
        let contact = Contact::new(Vector3::x(), -Vector3::x()).friction(friction).torsion(torsion).cone();
        let error = Grasp::<6>::new(&[contact]).unwrap_err().to_string();
        assert!(
            error.starts_with(&format!("{named}, contact 0:")) && error.ends_with("or at least 1e-60"),
            "{error}"
        );
    }
    let contact = Contact::new(Vector3::x(), -Vector3::x()).friction(1e-60).torsion(0.01).cone();
    assert!(Grasp::<6>::new(&[contact]).is_ok());
}

/// Least squares towards a reference far away, where Newton's method alone gives up.
#[test]
fn the_nearest_forces_are_the_least_where_solve_needs_its_last_resort() {
    let points = [[-0.75, -0.25, -0.25], [0.25, 0.75, -0.25], [-0.75, 1.25, -0.25]].map(Vector3::from);
    let normals = [[1.0, 1.0, 1.0], [0.0, -2.0, 1.0], [2.0, 0.0, 0.0]].map(Vector3::from);
    let friction = [0.149_661_668_036_724_4, 0.685_545_652_910_320_3, 0.454_603_137_292_208_1];
    let limits = [40.131_678_208_207_67, 0.426_441_673_909_333_1, 97.853_100_139_056_65];
    let contacts: Vec<_> = (0..3)
        .map(|i| {
            let contact = Contact::new(points[i], normals[i]).friction(friction[i]);
            contact.max_normal_force(limits[i]).cone()
        })
        .collect();
    let reference = [
        [-0.040_222_599_644_850_976, -0.003_486_175_528_398_962, 1.625_420_555_664_183_9, 0.0],
        [-0.674_317_302_961_646_7, 2.204_688_628_315_247_5, 1.424_918_638_590_719_3, 0.0],
        [0.619_025_360_075_683_1, -0.048_856_470_710_902_72, 0.227_891_653_349_313_63, 0.0],
    ]
    .map(ContactForce::from);
    let weights = vec![45.756_261_360_810_825, 79.774_242_579_970_67, 0.020_150_155_556_614_317];
    let options = SquaresOptions { reference: reference.to_vec(), weights, ..SquaresOptions::default() };
    let distributor = squares(&Grasp::<6>::new(&contacts).unwrap(), options);
    let external = Wrench::<6>::new(
        -10.000_397_018_175_89,
        -9.996_006_895_517_445,
        -10.002_592_079_505_114,
        -0.000_548_765_332_305_675_3,
        -4.999_649_743_755_642,
        5.001_296_039_752_558,
    );
    let solved = distributor.solve(&mut distributor.workspace(), &external).unwrap();
    let nearest = NearestOptions { limits: false, ..NearestOptions::default() };
    let found = distributor.nearest(&mut distributor.workspace(), &external, &nearest).unwrap();
    let allowed = (1e-6 + found.gap.min(1e-3)) * solved.sigma;
    assert!(
        (found.sigma - solved.sigma).abs() <= allowed,
        "{} {} {:e}",
        found.sigma,
        solved.sigma,
        found.gap
    );
}
