//! Algorithm 1: its order, its index matrices, and its limits.

use graspforce::{Contact, Criterion, Error, Grasp, MinkowskiSum, Wrench, WrenchSet};
use nalgebra::Vector3;
use proptest::prelude::*;
use support::reference_cases::seeded;

fn ragged(edges: &[usize]) -> Grasp<6> {
    let contacts: Vec<_> = edges
        .iter()
        .enumerate()
        .map(|(i, &edges)| {
            let angle = i as f64 * 2.1;
            let position = Vector3::new(angle.cos(), angle.sin(), 0.3 * i as f64);
            let contact = Contact::new(position, -position).edges(edges).max_normal_force(1.0 + i as f64);
            if edges == 1 { contact.friction(0.0) } else { contact }
        })
        .collect();
    Grasp::new(&contacts).unwrap()
}

/// The sum over a point's entries, in their order.
fn from_indices(grasp: &Grasp<6>, sum: &MinkowskiSum<6>, j: usize) -> Wrench<6> {
    let wrenches = grasp.primitive_wrenches().unwrap();
    let entries = sum.entries(j).map(|(i, h)| wrenches[grasp.edges(i).unwrap().start + h]);
    entries.reduce(|a, b| a + b).unwrap()
}

#[test]
fn points_come_in_the_order_of_the_paper() {
    let sum = MinkowskiSum::new(&ragged(&[1, 3])).unwrap();
    let points: Vec<Vec<_>> = (0..sum.len()).map(|j| sum.entries(j).collect()).collect();
    let expected = vec![
        vec![(0, 0)],
        vec![(0, 0), (1, 0)],
        vec![(0, 0), (1, 1)],
        vec![(0, 0), (1, 2)],
        vec![(1, 0)],
        vec![(1, 1)],
        vec![(1, 2)],
    ];
    assert_eq!(points, expected);
}

#[test]
fn four_contacts_with_ten_edges_have_14640_points_and_53240_ones() {
    let sum = MinkowskiSum::new(&ragged(&[10; 4])).unwrap();
    assert_eq!((sum.len(), sum.contacts().len()), (14_640, 4 * 10 * 11 * 11 * 11));
}

#[test]
fn the_size_is_told_before_anything_is_allocated() {
    let Err(Error::TooLarge { points, bytes, limit }) = MinkowskiSum::new(&ragged(&[16; 8])) else {
        panic!("7e9 points fit nowhere")
    };
    assert_eq!((points, limit), (17_u128.pow(8) - 1, graspforce::DEFAULT_MAX_POINTS));
    let entries = 8 * 16 * 17_u128.pow(7);
    assert_eq!(bytes, points * (6 * 8 + 8) + entries * 8);
    assert!(matches!(MinkowskiSum::with_limit(&ragged(&[16; 64]), u128::MAX), Err(Error::TooLarge { .. })));
    assert!(matches!(MinkowskiSum::with_limit(&ragged(&[3, 3]), 14), Err(Error::TooLarge { .. })));
    assert_eq!(MinkowskiSum::with_limit(&ragged(&[3, 3]), 15).unwrap().len(), 15);
}

#[test]
fn a_true_cone_has_no_points() {
    let cone = Contact::new(Vector3::x(), -Vector3::x()).cone();
    assert!(matches!(MinkowskiSum::new(&Grasp::<6>::new(&[cone]).unwrap()), Err(Error::InvalidGrasp { .. })));
}

proptest! {
    #![proptest_config(seeded(64))]

    #[test]
    fn every_point_is_bit_for_bit_the_sum_of_its_entries(
        edges in prop::collection::vec(prop_oneof![Just(1_usize), 3..6_usize], 1..5),
    ) {
        let grasp = ragged(&edges);
        let sum = MinkowskiSum::new(&grasp).unwrap();
        prop_assert_eq!(sum.len() + 1, edges.iter().map(|l| l + 1).product::<usize>());
        for j in 0..sum.len() {
            prop_assert_eq!(sum.wrenches()[j], from_indices(&grasp, &sum, j));
            let contacts: Vec<_> = sum.entries(j).map(|(i, _)| i).collect();
            prop_assert!(contacts.is_sorted_by(|a, b| a < b));
        }
    }

    #[test]
    fn the_enumeration_and_the_oracle_have_one_support_function(
        edges in prop::collection::vec(3..6_usize, 1..5),
        z in prop::array::uniform6(-1.0..1.0_f64),
    ) {
        let grasp = ragged(&edges);
        let z = Wrench::<6>::from(z);
        let sum = MinkowskiSum::new(&grasp).unwrap();
        let listed = sum.wrenches().iter().map(|w| w.dot(&z)).fold(f64::NEG_INFINITY, f64::max);
        let asked = WrenchSet::new(&grasp, Criterion::Max).support(&z).value;
        prop_assert!((listed - asked).abs() <= 1e-12 * (1.0 + listed.abs()));
    }
}
