//! Nearest points of meshes, torque-limited forces, resistance along directions.
#![no_main]

use arbitrary::Arbitrary;
use graspforce::{TriangleTree, torque_limited_forces};
use graspforce_fuzz::input::{GraspInput, Number, Triple, criterion, vector, wrench};
use libfuzzer_sys::fuzz_target;

#[derive(Debug, Arbitrary)]
enum Input {
    Mesh { vertices: Vec<Triple>, faces: Vec<[u8; 3]>, points: Vec<Triple> },
    Torques { jacobian: Vec<Triple>, limits: Vec<[Number; 2]>, friction: Number, limit: Number, edges: u8 },
    Resistance { grasp: GraspInput, directions: Vec<[Number; 6]>, sum: bool },
}

fuzz_target!(|input: Input| match input {
    Input::Mesh { vertices, faces, points } => mesh(&vertices, &faces, &points),
    Input::Torques { jacobian, limits, friction, limit, edges } => {
        let columns: Vec<_> = jacobian.iter().take(5).map(vector).collect();
        let lower: Vec<_> = limits.iter().take(5).map(|pair| -pair[0].0.abs()).collect();
        let upper: Vec<_> = limits.iter().take(5).map(|pair| pair[1].0.abs()).collect();
        let edges = usize::from(edges % 12);
        if let Ok(forces) = torque_limited_forces(&columns, &lower, &upper, friction.0, limit.0, edges) {
            assert!(forces.iter().flat_map(|force| force.iter()).all(|x| x.is_finite()), "{forces:?}");
            assert!(forces.iter().all(|force| force[0] <= limit.0 * (1.0 + 1e-6)), "{forces:?}");
        }
    }
    Input::Resistance { grasp, directions, sum } => {
        if grasp.planar {
            resistance::<3>(&grasp, &directions, sum)
        } else {
            resistance::<6>(&grasp, &directions, sum)
        }
    }
});

fn mesh(vertices: &[Triple], faces: &[[u8; 3]], points: &[Triple]) {
    let vertices: Vec<_> = vertices.iter().take(64).map(vector).collect();
    let faces: Vec<_> = faces.iter().take(128).map(|face| face.map(usize::from)).collect();
    let Ok(tree) = TriangleTree::new(&vertices, &faces) else { return };
    let points: Vec<_> =
        points.iter().take(16).map(vector).filter(|p| p.iter().all(|x| x.is_finite())).collect();
    let Ok(found) = tree.closest_many(&points) else { return };
    let size = vertices.iter().chain(&points).map(|v| v.amax()).fold(0.0, f64::max);
    for (point, found) in points.iter().zip(found) {
        assert!(found.face < faces.len(), "{point:?}: {found:?}");
        assert!((found.weights.iter().sum::<f64>() - 1.0).abs() < 1e-6, "{found:?}");
        assert!(found.weights.iter().all(|w| (-1e-9..=1.0 + 1e-9).contains(w)), "{found:?}");
        let distance = (found.point - point).norm();
        let nearest =
            vertices_of(&faces, &vertices).map(|v| (v - point).norm()).fold(f64::INFINITY, f64::min);
        if distance.is_finite() && nearest.is_finite() {
            assert!(distance <= nearest + 1e-9 * size, "{distance:e} > {nearest:e}");
        }
    }
}

fn vertices_of<'a>(
    faces: &'a [[usize; 3]],
    vertices: &'a [nalgebra::Vector3<f64>],
) -> impl Iterator<Item = &'a nalgebra::Vector3<f64>> {
    faces.iter().flatten().map(|&v| &vertices[v])
}

fn resistance<const D: usize>(grasp: &GraspInput, directions: &[[Number; 6]], sum: bool) {
    let Some(grasp) = grasp.grasp::<D>() else { return };
    let directions: Vec<_> = directions.iter().take(4).map(wrench::<D>).collect();
    if let Ok(multiples) = grasp.resistance(&directions, criterion(sum), None) {
        assert!(multiples.iter().all(|multiple| *multiple >= 0.0), "{multiples:?}");
    }
}
