//! Support regions beside force distribution: what the contacts hold, they hold by forces.

use graspforce::{
    Contact, Criterion, Error, ForceDistributor, Grasp, HorizontalPoint, RegionShape, STANDARD_GRAVITY,
    SupportOptions, Wrench,
};
use nalgebra::Vector3;
use support::random::Random;

const WEIGHT: f64 = 100.0;

fn stance(random: &mut Random, cones: bool) -> Grasp<6> {
    let number = 1 + (5.0 * random.next()) as usize;
    let contacts: Vec<_> = (0..number)
        .map(|_| {
            let contact = Contact::new(0.3 * random.vector(), Vector3::z() + 0.4 * random.vector())
                .friction(0.3 + random.next())
                .torsion(if random.next() < 0.3 { 0.02 } else { 0.0 })
                .max_normal_force(WEIGHT * (0.3 + 2.0 * random.next()));
            if cones { contact.cone() } else { contact.edges(6) }
        })
        .collect();
    Grasp::new(&contacts).unwrap()
}

fn load(random: &mut Random) -> SupportOptions {
    SupportOptions {
        acceleration: random.vector(),
        height: random.next(),
        external_wrench: Wrench::from_fn(|_, _| 4.0 * random.next() - 2.0),
        gap: 1e-4,
        ..SupportOptions::new(WEIGHT)
    }
}

/// The wrench on the body with its centre of mass there.
fn wrench(options: &SupportOptions, place: &HorizontalPoint) -> Wrench<6> {
    let force = -Vector3::z() * WEIGHT - options.acceleration * (WEIGHT / STANDARD_GRAVITY);
    graspforce::wrench_of_force::<6>(&place.push(options.height), &force) + options.external_wrench
}

/// How much of their limits the contacts need; infinite where no forces hold the body.
fn needed(grasp: &Grasp<6>, criterion: Criterion, external: &Wrench<6>) -> f64 {
    let distributor = ForceDistributor::new(grasp, criterion).unwrap();
    match distributor.solve(&mut distributor.workspace(), external) {
        Ok(forces) => forces.sigma,
        Err(error) if error.is_infeasible() => f64::INFINITY,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn forces_hold_the_body_inside_and_no_forces_do_outside() {
    let mut random = Random(18);
    let mut polygons = 0;
    for case in 0..60 {
        let grasp = stance(&mut random, case % 2 == 0);
        let criterion = if case % 3 == 0 { Criterion::Sum } else { Criterion::Max };
        let options = load(&mut random);
        let region = grasp.support_region(criterion, &options).unwrap();
        if region.shape != RegionShape::Polygon {
            continue;
        }
        polygons += 1;
        let middle = region.inner.iter().sum::<HorizontalPoint>() / region.inner.len() as f64;
        for vertex in region.inner.iter().step_by(1 + region.inner.len() / 6) {
            let inside = middle + (vertex - middle) * (1.0 - 1e-7);
            let sigma = needed(&grasp, criterion, &wrench(&options, &inside));
            assert!(sigma <= 1.0 + 1e-8, "case {case}: {sigma}");
        }
        for vertex in region.outer.iter().step_by(1 + region.outer.len() / 6) {
            let outside = middle + (vertex - middle) * 1.001;
            let sigma = needed(&grasp, criterion, &wrench(&options, &outside));
            assert!(sigma > 1.0, "case {case}: {sigma}");
        }
    }
    assert!(polygons > 15, "{polygons}");
}

#[test]
fn an_empty_region_has_a_direction_along_which_the_contacts_reach_too_little() {
    let mut random = Random(4);
    let mut empty = 0;
    for _ in 0..40 {
        let grasp = stance(&mut random, false);
        let mut options = load(&mut random);
        options.acceleration *= 8.0;
        let region = grasp.support_region(Criterion::Max, &options).unwrap();
        let Some(z) = region.witness else { continue };
        empty += 1;
        assert_eq!(region.shape, RegionShape::Empty);
        let reach = graspforce::WrenchSet::new(&grasp, Criterion::Max).support(&z).value.max(0.0);
        for _ in 0..4 {
            let place = (10.0 * random.vector()).xy();
            assert!(reach < -wrench(&options, &place).dot(&z));
        }
    }
    assert!(empty > 5, "{empty}");
}

#[test]
fn free_fall_leaves_no_region_to_ask_for() {
    let grasp = Grasp::<6>::new(&[Contact::new(Vector3::zeros(), Vector3::z())]).unwrap();
    let falling =
        SupportOptions { acceleration: -Vector3::z() * STANDARD_GRAVITY, ..SupportOptions::new(1.0) };
    let refused = grasp.support_region(Criterion::Max, &falling).unwrap_err();
    assert!(matches!(refused, Error::InvalidInput { argument: "acceleration", .. }));
}
