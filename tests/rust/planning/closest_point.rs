//! Nearest points of a mesh, against every triangle in turn.

use graspforce::TriangleTree;
use nalgebra::Vector3;
use support::random::Random;

#[test]
fn the_nearest_point_is_the_nearest_of_all_triangles() {
    let mut stream = Random(7);
    let vertices: Vec<_> = (0..150).map(|_| stream.vector()).collect();
    // A degenerate triangle among them has no inside, but edges.
    let mut faces: Vec<[usize; 3]> =
        (0..300).map(|k| [k % 150, (7 * k + 1) % 150, (11 * k + 5) % 150]).collect();
    faces.push([3, 3, 4]);
    let tree = TriangleTree::new(&vertices, &faces).expect("valid");
    let alone: Vec<_> =
        faces.iter().map(|face| TriangleTree::new(&vertices, &[*face]).expect("valid")).collect();
    let queries: Vec<_> = (0..500).map(|_| stream.vector() * 2.0).collect();
    for (query, found) in queries.iter().zip(tree.closest_many(&queries).expect("finite queries")) {
        let distance = (found.point - query).norm();
        let least =
            alone.iter().map(|tree| (tree.closest(query).point - query).norm()).fold(f64::MAX, f64::min);
        assert!((distance - least).abs() <= 1e-14, "{distance} {least}");
        assert!((found.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(found.weights.iter().all(|&weight| weight >= 0.0));
    }
}

#[test]
fn no_point_of_a_triangle_is_nearer_than_the_one_found() {
    let mut stream = Random(3);
    for _ in 0..200 {
        let corners = [stream.vector(), stream.vector(), stream.vector()];
        let tree = TriangleTree::new(&corners, &[[0, 1, 2]]).expect("valid");
        let query = stream.vector() * 2.0;
        let distance = (tree.closest(&query).point - query).norm();
        for _ in 0..50 {
            let (mut u, mut v) = (stream.next(), stream.next());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let point = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
            assert!((point - query).norm() >= distance - 1e-12);
        }
    }
}

#[test]
fn meshes_that_are_none_are_refused() {
    let corners = [Vector3::zeros(), Vector3::x(), Vector3::y()];
    assert!(TriangleTree::new(&corners, &[]).is_err());
    assert!(TriangleTree::new(&corners, &[[0, 1, 3]]).is_err());
    assert!(TriangleTree::new(&[Vector3::repeat(f64::NAN); 3], &[[0, 1, 2]]).is_err());
}

#[test]
fn triangles_flat_up_to_rounding_are_their_longest_edge() {
    let mut stream = Random(11);
    for _ in 0..5_000 {
        let (along, base) = (stream.vector(), stream.vector() * 0.1);
        let places = [0.0, 3.0 * stream.next(), 3.0 * stream.next()];
        let corners = places.map(|t| base + along * t);
        let tree = TriangleTree::new(&corners, &[[0, 1, 2]]).expect("valid");
        let off = 10_f64.powf(17.0 * (stream.next() - 1.0));
        let query = base + along * (places[1].max(places[2]) * stream.next()) + stream.vector() * off;
        let far = along * places[1].max(places[2]);
        let t = ((query - base).dot(&far) / far.norm_squared()).clamp(0.0, 1.0);
        let least = (base + far * t - query).norm();
        let found = (tree.closest(&query).point - query).norm();
        assert!((found - least).abs() <= 1e-14, "{found} instead of {least}: {corners:?} {query:?}");
    }
}

#[test]
fn the_nearest_point_of_a_triangle_scales_with_it() {
    let mut stream = Random(23);
    for size in [1e-130, 1e-82, 1e-30, 1.0, 1e30, 1e78, 1e130] {
        for _ in 0..100 {
            let corners = [stream.vector(), stream.vector(), stream.vector()];
            let query = stream.vector() * 2.0;
            let weights = |size: f64| {
                let tree =
                    TriangleTree::new(&corners.map(|corner| corner * size), &[[0, 1, 2]]).expect("valid");
                tree.closest(&(query * size)).weights
            };
            for (scaled, plain) in weights(size).iter().zip(weights(1.0)) {
                assert!((scaled - plain).abs() < 1e-9, "{size:e}: {scaled} {plain}");
            }
        }
    }
}
