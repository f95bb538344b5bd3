//! A warm loop over wrenches whose regions are known, or over true cones, allocates nothing.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use graspforce::{
    Contact, Criterion, DistributionOptions, ForceDistributor, Grasp, NearestOptions, SquaresOptions, Wrench,
};
use nalgebra::Vector3;
use support::control_loop::ControlLoop;

/// Counts what this thread asks for; other threads of the test harness do not matter.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is handed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn fingers(cone: bool) -> Grasp<6> {
    let contacts: Vec<Contact> = (0..5_u8)
        .map(|i| {
            let (s, c) = (2.4 * f64::from(i)).sin_cos();
            let outward = Vector3::new(c, s, 0.4 * f64::from(i) - 0.8).normalize();
            let contact = Contact::new(outward, -outward).friction(0.6);
            if cone { contact.cone() } else { contact.edges(9) }
        })
        .collect();
    Grasp::new(&contacts).unwrap()
}

fn wrench(step: u16) -> Wrench<6> {
    let phase = f64::from(step) * 1e-4;
    Wrench::from_fn(|row, _| (phase + row as f64 * 1.7 + 0.4).sin())
}

/// Allocations of a thousand solves along a trajectory that was travelled once before.
fn allocations(grasp: &Grasp<6>, criterion: Criterion) -> usize {
    let mut options = DistributionOptions::default();
    options.rtol = 1e-6;
    let distributor = ControlLoop::with_options(grasp, criterion, options).unwrap();
    let mut forces = vec![0.0; grasp.num_contacts() * grasp.force_dim()];
    let mut travel = || {
        let before = COUNT.get();
        for step in 0..1000 {
            distributor.solve_into(&wrench(step), &mut forces).unwrap();
        }
        COUNT.get() - before
    };
    travel();
    travel()
}

#[test]
fn least_squares_allocate_nothing() {
    for cone in [false, true] {
        let grasp = fingers(cone);
        let distributor = ForceDistributor::squares(&grasp, SquaresOptions::default()).unwrap();
        let mut workspace = distributor.workspace();
        let mut forces = vec![0.0; grasp.num_contacts() * grasp.force_dim()];
        let before = COUNT.get();
        for step in 0..1000 {
            distributor.solve_into(&mut workspace, &wrench(step), &mut forces).unwrap();
        }
        assert_eq!(COUNT.get() - before, 0, "true cones: {cone}");
    }
}

#[test]
fn nearest_forces_allocate_nothing_from_the_first_wrench_on() {
    for cone in [false, true] {
        let grasp = fingers(cone);
        let squares = SquaresOptions { limits: true, ..SquaresOptions::default() };
        let distributors = [
            ForceDistributor::new(&grasp, Criterion::Max).unwrap(),
            ForceDistributor::new(&grasp, Criterion::Sum).unwrap(),
            ForceDistributor::squares(&grasp, squares).unwrap(),
        ];
        for mut distributor in distributors {
            let (options, mut workspace) = (NearestOptions::default(), distributor.workspace());
            distributor.prepare_nearest(&mut workspace, &options).unwrap();
            let mut forces = vec![0.0; grasp.num_contacts() * grasp.force_dim()];
            for limits in [[1.0; 5], [1.0, 0.5, 0.0, 2.0, 1.0]] {
                distributor.set_limits(&mut workspace, &limits).unwrap();
                let before = COUNT.get();
                for step in 0..1000 {
                    // Jumps, all of them beyond the limits.
                    let external = wrench(step * 61) * 30.0;
                    distributor.nearest_into(&mut workspace, &external, &options, &mut forces).unwrap();
                }
                let objective = distributor.objective();
                assert_eq!(COUNT.get() - before, 0, "{objective:?}, true cones: {cone}");
            }
        }
    }
}

#[test]
fn a_warm_loop_allocates_nothing() {
    for criterion in [Criterion::Max, Criterion::Sum] {
        for cone in [false, true] {
            assert_eq!(allocations(&fingers(cone), criterion), 0, "{criterion:?}, true cones: {cone}");
        }
    }
}
