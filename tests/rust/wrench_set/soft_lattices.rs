//! The furthest wrench of a soft finger of many edges, beside the search of all of them.

use std::f64::consts::TAU;

use graspforce::{Contact, Criterion, ForceModel, Grasp, Wrench, WrenchSet};
use nalgebra::Vector3;
use support::random::Random;

/// The sets of a contact by its lattice, and by a list of the same forces.
fn both(contact: &Contact) -> [(Grasp<6>, WrenchSet<6>); 2] {
    let lattice = Grasp::<6>::new(std::slice::from_ref(contact)).unwrap();
    let mut listed = contact.clone();
    listed.forces = ForceModel::Extreme(lattice.extreme_forces().unwrap().to_vec());
    let listed = Grasp::<6>::new(&[listed]).unwrap();
    [lattice, listed].map(|grasp| {
        let set = WrenchSet::new(&grasp, Criterion::Sum);
        (grasp, set)
    })
}

fn assert_same(contact: &Contact, sets: &[(Grasp<6>, WrenchSet<6>); 2], z: &Wrench<6>) {
    let [lattice, listed] = sets.each_ref().map(|(_, set)| set.contact_support(0, z));
    assert_eq!(lattice.value.to_bits(), listed.value.to_bits(), "{contact:?} {z:?}");
    assert_eq!((lattice.wrench, lattice.force), (listed.wrench, listed.force), "{contact:?} {z:?}");
}

#[test]
fn the_furthest_wrench_of_a_lattice_is_that_of_the_full_search() {
    let mut random = Random(41);
    for case in 0..40 {
        let edges = [24, 25, 27, 32, 50, 64, 127, 128][case % 8];
        let mut grade = |decades: f64| 10.0_f64.powf(-decades * random.next());
        let (friction, torsion, limit, far) = (grade(5.0), grade(7.0), 1e3 * grade(6.0), 1e3 * grade(6.0));
        let mut contact = Contact::new(random.vector() * far, random.direction())
            .friction(friction)
            .torsion(torsion)
            .max_normal_force(limit)
            .edges(edges);
        if case % 3 == 0 {
            let tangent = contact.normal + random.vector() * 10.0_f64.powf(-8.0 * random.next());
            contact = contact.tangent(tangent);
        }
        let sets = both(&contact);
        for _ in 0..100 {
            let grades = Wrench::<6>::from_fn(|_, _| 10.0_f64.powf(-12.0 * random.next() * random.next()));
            let z = Wrench::<6>::from_fn(|row, _| grades[row] * (2.0 * random.next() - 1.0));
            assert_same(&contact, &sets, &z);
        }
    }
}

#[test]
fn among_equals_the_lowest_wrench_of_a_lattice_wins() {
    for edges in [24, 30, 128] {
        for (friction, torsion) in [(0.5, 0.5), (1.0, 0.001)] {
            let contact =
                Contact::new(Vector3::zeros(), Vector3::z()).friction(friction).torsion(torsion).edges(edges);
            let sets = both(&contact);
            // Towards edges and midway between them, in latitude and in longitude, and to the poles.
            for k in (0..2 * edges).step_by(edges / 24) {
                let (s, c) = (TAU * k as f64 / (2 * edges) as f64).sin_cos();
                for m in 0..4 * (edges / 4) + 1 {
                    let steep = TAU / 4.0 * (m as f64 / (2 * (edges / 4)) as f64 - 1.0);
                    let twist = friction / torsion * steep.tan();
                    for scale in [1.0, 1e-9, 1e12] {
                        let z = Wrench::<6>::new(c, s, 0.3, 0.0, 0.0, twist) * scale;
                        assert_same(&contact, &sets, &z);
                    }
                }
            }
            for z in [[0.0; 6], [0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, -1.0]] {
                assert_same(&contact, &sets, &Wrench::<6>::from(z));
            }
            for z in [1e-18, 1e-14, 1e-12, 1e-10, 1e-8] {
                assert_same(&contact, &sets, &Wrench::<6>::new(z, -z / 3.0, 1.0, 0.0, 0.0, 1.0));
            }
        }
    }
}
