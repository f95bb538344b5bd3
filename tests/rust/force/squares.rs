//! Least squares beside Clarabel, and the laws that one continuous answer keeps.

use graspforce::{
    Contact, ContactForce, Distribution, Error, ForceDistributor, Grasp, Metric, SquaresOptions, Wrench,
};
use nalgebra::{SMatrix, Vector3};
use support::friction_cone::slip;
use support::least_squares::least_squares;
use support::problems::{Random, ellipsoid_grasp};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Hard,
    Soft,
    Pyramid,
    SoftPolytope,
    Frictionless,
    Mixed,
}

pub(super) const KINDS: [Kind; 6] =
    [Kind::Hard, Kind::Soft, Kind::Pyramid, Kind::SoftPolytope, Kind::Frictionless, Kind::Mixed];

fn kind_of(kind: Kind, i: usize) -> Kind {
    if kind == Kind::Mixed { KINDS[i % 5] } else { kind }
}

pub(super) fn grasp(random: &mut Random, count: usize, kind: Kind) -> Grasp<6> {
    ellipsoid_grasp(random, count, |random, i, contact| match kind_of(kind, i) {
        Kind::Hard | Kind::Mixed => contact.cone(),
        Kind::Soft => contact.cone().torsion(random.within(0.01, 0.3)),
        Kind::Pyramid => contact.edges(8),
        Kind::SoftPolytope => contact.edges(6).torsion(0.1),
        Kind::Frictionless => contact.friction(0.0).cone(),
    })
}

fn planar(random: &mut Random, count: usize) -> Grasp<3> {
    let contacts: Vec<Contact> = (0..count)
        .map(|_| {
            let u = random.direction();
            let u = Vector3::new(u.x, u.y, 0.0);
            Contact::new(Vector3::new(u.x, 0.7 * u.y, 0.0), -u).friction(random.within(0.1, 0.8))
        })
        .collect();
    Grasp::new(&contacts).unwrap()
}

pub(super) fn wrench<const D: usize>(random: &mut Random, size: f64) -> Wrench<D> {
    Wrench::from_fn(|_, _| size * random.within(-1.0, 1.0))
}

pub(super) fn price(value: f64) -> Metric<6> {
    Metric::from_matrix(&(SMatrix::identity() * value)).unwrap()
}

/// References, weights, lower bounds or a price, in turn.
fn options(random: &mut Random, grasp: &Grasp<6>, turn: usize) -> (SquaresOptions<6>, Option<f64>) {
    let mut options = SquaresOptions { limits: turn.is_multiple_of(2), ..SquaresOptions::default() };
    match turn / 2 % 4 {
        0 => return (options, None),
        1 => {
            let reference = |_| {
                let mut force = ContactForce::from_fn(|_, _| random.within(-0.5, 0.5));
                force[0] += 0.5;
                force[3] *= f64::from(u8::from(grasp.force_dim() == 4));
                force
            };
            options.reference = (0..grasp.num_contacts()).map(reference).collect();
            options.weights =
                (0..grasp.num_contacts()).map(|_| 10.0_f64.powf(random.within(-1.0, 1.0))).collect();
        }
        2 => options.min_normal = vec![0.1],
        _ => {
            let value = 10.0_f64.powf(random.within(-1.0, 3.0));
            options.slack = Some(price(value));
            return (options, Some(value));
        }
    }
    (options, None)
}

pub(super) fn assert_allowed<const D: usize>(
    grasp: &Grasp<D>,
    options: &SquaresOptions<D>,
    external: &Wrench<D>,
    answer: &Distribution<D>,
) {
    let size = answer.forces.iter().map(ContactForce::norm).fold(external.amax(), f64::max);
    let resultant: Wrench<D> = answer.contact_wrenches(grasp).iter().sum();
    assert!((resultant + external - answer.residual).amax() <= 1e-12 * size.max(1.0));
    if options.slack.is_none() {
        assert!(answer.residual.amax() <= 1e-9 * size, "{:e}", answer.residual.amax());
    }
    for ((contact, force), share) in grasp.contacts().iter().zip(&answer.forces).zip(&answer.shares) {
        assert!(slip(contact, D == 3, force) <= 1e-9 * size, "{contact:?} {force}");
        assert!((force[0] / contact.max_normal_force - share).abs() <= 1e-12 * share.max(1.0));
        assert!(!options.limits || *share <= 1.0 + 1e-12);
        let least = options.min_normal.first().copied().unwrap_or(0.0);
        assert!(*share >= least - 1e-12);
    }
    assert!(answer.gap <= 1e-8 && answer.unique);
}

#[test]
fn least_squares_are_those_of_an_interior_point_solver() {
    let mut random = Random::new(41);
    let (mut compared, mut infeasible) = (0, 0);
    for kind in KINDS {
        for turn in 0..160 {
            let count = 3 + turn % 4;
            let grasp = grasp(&mut random, count, kind);
            let (options, price) = options(&mut random, &grasp, turn);
            let distributor = ForceDistributor::squares(&grasp, options.clone()).unwrap();
            let mut workspace = distributor.workspace();
            for _ in 0..3 {
                let external = wrench::<6>(&mut random, if options.limits { 2.0 } else { 1.0 });
                let found = distributor.solve(&mut workspace, &external);
                match (found, least_squares(&grasp, &options, price, &external)) {
                    (Ok(found), Ok((forces, objective))) => {
                        assert_allowed(&grasp, &options, &external, &found);
                        let scale = objective.abs().max(1e-3 * external.norm_squared());
                        assert!((found.sigma - objective).abs() <= 1e-7 * scale, "{kind:?} {options:?}");
                        let size = forces.iter().map(ContactForce::norm).fold(0.0, f64::max).max(1e-2);
                        for (ours, theirs) in found.forces.iter().zip(&forces) {
                            assert!((ours - theirs).norm() <= 3e-4 * size, "{kind:?} {ours} {theirs}");
                        }
                        compared += 1;
                    }
                    (Ok(found), Err(stopped)) => {
                        assert!(!stopped, "{kind:?} {options:?}");
                        assert_allowed(&grasp, &options, &external, &found);
                    }
                    (Err(error), theirs) => {
                        assert!(error.is_infeasible() && theirs.is_err(), "{kind:?} {options:?} {error}");
                        infeasible += 1;
                    }
                }
            }
        }
    }
    assert!(compared > 900 && infeasible > 900, "{compared} {infeasible}");
}

#[test]
fn least_squares_in_the_plane_are_those_of_an_interior_point_solver() {
    let mut random = Random::new(42);
    let mut compared = 0;
    for turn in 0..300 {
        let grasp = planar(&mut random, 2 + turn % 4);
        let options = SquaresOptions { limits: turn % 2 == 0, ..SquaresOptions::default() };
        let distributor = ForceDistributor::squares(&grasp, options.clone()).unwrap();
        let external = wrench::<3>(&mut random, 0.5);
        match (
            distributor.solve(&mut distributor.workspace(), &external),
            least_squares(&grasp, &options, None, &external),
        ) {
            (Ok(found), Ok((_, objective))) => {
                assert_allowed(&grasp, &options, &external, &found);
                assert!((found.sigma - objective).abs() <= 1e-7 * objective, "{} {objective}", found.sigma);
                compared += 1;
            }
            (Ok(found), Err(stopped)) => {
                assert!(!stopped);
                assert_allowed(&grasp, &options, &external, &found);
            }
            (Err(error), theirs) => assert!(error.is_infeasible() && theirs.is_err(), "{error}"),
        }
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn references_are_held_in_balance_however_small_the_wrench() {
    let mut random = Random::new(91);
    for turn in 0..60 {
        let grasp = grasp(&mut random, 3 + turn % 3, KINDS[turn % 6]);
        let reference = (0..grasp.num_contacts())
            .map(|_| ContactForce::new(random.within(0.5, 0.8), random.within(-0.3, 0.3), 0.1, 0.0))
            .collect();
        let distributor =
            ForceDistributor::squares(&grasp, SquaresOptions { reference, ..SquaresOptions::default() })
                .unwrap();
        let mut workspace = distributor.workspace();
        for size in [0.0, 1e-12, 1e-6, 1e-3] {
            let answer = distributor.solve(&mut workspace, &wrench::<6>(&mut random, size));
            let refused = answer.err().filter(|error| !error.is_infeasible());
            assert!(refused.is_none(), "{turn} {size:e}: {refused:?}");
        }
    }
}

#[test]
fn a_wrench_beyond_the_limits_has_a_witness() {
    let mut random = Random::new(43);
    let mut beyond = 0;
    for turn in 0..200 {
        let grasp = grasp(&mut random, 3 + turn % 4, KINDS[turn % 6]);
        let mut options = SquaresOptions { limits: true, ..SquaresOptions::default() };
        if turn % 3 == 0 {
            options.min_normal = vec![0.2];
        }
        let distributor = ForceDistributor::squares(&grasp, options).unwrap();
        let external = wrench::<6>(&mut random, 3.0);
        let Err(Error::BeyondLimits { direction }) =
            distributor.solve(&mut distributor.workspace(), &external)
        else {
            continue;
        };
        let e = Wrench::<6>::from_row_slice(&direction);
        // How far forces between the bounds reach along e.
        let set = graspforce::WrenchSet::new(&grasp, graspforce::Criterion::Max);
        let least = if turn % 3 == 0 { 0.2 } else { 0.0 };
        let reach = |i| {
            let h = set.contact_support(i, &e).value;
            h.max(least * h)
        };
        let reach: f64 = (0..grasp.num_contacts()).map(reach).sum();
        assert!(-external.dot(&e) > reach, "{} {reach}", -external.dot(&e));
        beyond += 1;
    }
    assert!(beyond > 20, "{beyond}");
}

/// Feet at nearly one height, coincident contacts, a contact at the origin, millimetres, a line of contacts.
fn degenerate(random: &mut Random, turn: usize, kind: Kind) -> Grasp<6> {
    let up = Vector3::z();
    let scale = [1.0, 1e-3, 1.0, 1e3, 1.0][turn % 5];
    let noise = [0.0, 1e-9, 1e-12, 1e-6][turn % 4];
    let mut points: Vec<(Vector3<f64>, Vector3<f64>)> = match turn % 6 {
        0 | 1 => [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
            .map(|(x, y)| (Vector3::new(0.3 * x, 0.2 * y, noise * random.within(-1.0, 1.0)), up))
            .to_vec(),
        2 => {
            let point = |x: f64| (Vector3::new(x, noise * x, 0.0), Vector3::new(-x.signum(), 0.0, 0.0));
            vec![point(0.4), point(0.4), point(-0.4), point(-0.4)]
        }
        3 => vec![
            (Vector3::zeros(), up),
            (Vector3::new(0.1, noise, 0.0), -up),
            (Vector3::new(-0.1, 0.05, 0.0), -up),
            (Vector3::new(0.0, -0.1, 0.0), up),
        ],
        4 => (0..5).map(|k| (Vector3::new(0.1 * f64::from(k) - 0.2, noise, 0.0), up)).collect(),
        _ => {
            let u = random.direction();
            let v = (random.direction() * noise - u).normalize();
            vec![(u * 0.3, -u), (v * 0.3, -v), (u.cross(&up) * 0.3, -u.cross(&up).normalize())]
        }
    };
    for (point, _) in &mut points {
        *point *= scale;
    }
    let contacts: Vec<Contact> = points
        .iter()
        .enumerate()
        .map(|(i, (p, n))| {
            let contact = Contact::new(*p, *n).friction(0.6).max_normal_force(5.0);
            match kind_of(kind, i) {
                Kind::Soft => contact.cone().torsion(0.02 * scale),
                Kind::Pyramid => contact.edges(8),
                Kind::SoftPolytope => contact.edges(8).torsion(0.02 * scale),
                Kind::Frictionless => contact.friction(0.0).cone(),
                Kind::Hard | Kind::Mixed => contact.cone(),
            }
        })
        .collect();
    Grasp::new(&contacts).unwrap()
}

#[test]
fn nearly_degenerate_contacts_have_one_certified_answer() {
    let mut random = Random::new(44);
    let (mut solved, mut refused, mut unsure) = (0, 0, 0);
    for turn in 0..1200 {
        let kind = KINDS[turn % 6];
        let grasp = degenerate(&mut random, turn / 6, kind);
        let mut options = SquaresOptions { limits: turn % 4 == 0, ..SquaresOptions::default() };
        if turn % 5 == 0 {
            options.slack = Some(Metric::from_length_scale(0.1));
        }
        let distributor = ForceDistributor::squares(&grasp, options.clone()).unwrap();
        let mut warm = distributor.workspace();
        for k in 0..4 {
            // Half of the wrenches are such as the contacts exert.
            let external: Wrench<6> = if k % 2 == 0 {
                wrench(&mut random, 1.0)
            } else {
                let mut exert = |map: &graspforce::ContactMap<6>| {
                    let n = random.within(0.0, 2.0);
                    map * ContactForce::new(n, 0.2 * n * random.within(-1.0, 1.0), 0.1 * n, 0.0)
                };
                let friction = f64::from(u8::from(kind != Kind::Frictionless && kind != Kind::Mixed));
                -grasp
                    .maps()
                    .iter()
                    .map(|map| {
                        let mut map = *map;
                        map.fixed_columns_mut::<2>(1).scale_mut(friction);
                        exert(&map)
                    })
                    .sum::<Wrench<6>>()
            };
            let again = distributor.solve(&mut distributor.workspace(), &external);
            match (distributor.solve(&mut warm, &external), again) {
                (Ok(found), Ok(cold)) => {
                    assert_allowed(&grasp, &options, &external, &found);
                    let size = found.forces.iter().map(ContactForce::norm).fold(1e-12, f64::max);
                    let apart = found.forces.iter().zip(&cold.forces).map(|(a, b)| (a - b).norm());
                    let apart = apart.fold(0.0, f64::max);
                    assert!(
                        apart <= 1e-6 * size,
                        "{turn} {kind:?} {apart:e} {size} {} {}",
                        found.pivots,
                        cold.pivots
                    );
                    solved += 1;
                }
                (Err(error), Err(_)) if error.is_infeasible() => {
                    assert!(k % 2 == 0 || options.limits, "{turn} {kind:?} {error}");
                    refused += 1;
                }
                (found, cold) => {
                    println!(
                        "{turn} {kind:?} {k} {:?} {:?}",
                        found.map(|f| f.pivots),
                        cold.map(|f| f.pivots)
                    );
                    unsure += 1;
                }
            }
        }
    }
    println!("{solved} {refused} {unsure}");
    assert!(unsure == 0 && solved > 2000, "{solved} solved, {refused} infeasible, {unsure} not converged");
}

/// The largest change of the forces between neighbours on a path of `steps` steps, by the change of what moves.
fn steepest(seed: u64, kind: Kind, steps: usize) -> f64 {
    let mut random = Random::new(seed);
    let grasp = grasp(&mut random, 4, kind);
    let ends = [wrench::<6>(&mut random, 2.5), wrench::<6>(&mut random, 2.5)];
    let mut options = SquaresOptions { limits: true, slack: Some(price(5.0)), ..SquaresOptions::default() };
    options.reference = vec![ContactForce::new(0.3, 0.1, 0.0, 0.0); 4];
    let distributor = ForceDistributor::squares(&grasp, options).unwrap();
    let mut workspace = distributor.workspace();
    let mut before: Option<Distribution<6>> = None;
    let mut most = 0.0_f64;
    for step in 0..=steps {
        let t = step as f64 / steps as f64;
        let external = ends[0] * (1.0 - t) + ends[1] * t;
        let now = distributor.solve(&mut workspace, &external).unwrap();
        if let Some(before) = before {
            let moved = (ends[1] - ends[0]).norm() / steps as f64;
            let changes = now.forces.iter().zip(&before.forces).map(|(a, b)| (a - b).norm_squared());
            most = most.max(changes.sum::<f64>().sqrt() / moved);
        }
        before = Some(now);
    }
    most
}

#[test]
fn forces_are_lipschitz_through_edges_and_limits_and_lift_off() {
    // With a price p of the residual and weights of 1 the forces move by at most p |G| for each unit of the wrench; and finer
    // steps find no jump.
    for seed in 0..60 {
        let kind = KINDS[seed as usize % 6];
        let (coarse, fine) = (steepest(seed, kind, 200), steepest(seed, kind, 20_000));
        assert!(fine <= 1.5 * coarse + 0.05, "{seed} {kind:?}: {coarse} {fine}");
        assert!(fine <= 5.0 * 4.0, "{seed} {kind:?}: {fine}");
    }
}

#[test]
fn bad_options_are_named() {
    let grasp = grasp(&mut Random::new(1), 3, Kind::Hard);
    let refused =
        |options: SquaresOptions<6>| ForceDistributor::squares(&grasp, options).unwrap_err().to_string();
    let weights = |weights: Vec<f64>| SquaresOptions { weights, ..SquaresOptions::default() };
    assert_eq!(refused(weights(vec![1.0, 2.0])), "weights: 2 weights for 3 contacts");
    assert_eq!(
        refused(weights(vec![1.0, -2.0, 1.0])),
        "weights, contact 1: -2 must be positive, within 1e-60 to 1e60"
    );
    let reference = vec![ContactForce::new(0.0, f64::NAN, 0.0, 0.0); 3];
    let refused_reference = refused(SquaresOptions { reference, ..SquaresOptions::default() });
    assert!(refused_reference.starts_with("reference, contact 0: component o: NaN"), "{refused_reference}");
    let reference = vec![ContactForce::new(0.0, 0.0, 0.0, 1.0); 3];
    let refused_reference = refused(SquaresOptions { reference, ..SquaresOptions::default() });
    assert!(refused_reference.contains("component torsion"), "{refused_reference}");
}
