//! Convex polygons in the plane, counterclockwise.

use super::HorizontalPoint as Point;

/// Twice the signed area of a triangle.
pub(super) fn turn(a: &Point, b: &Point, c: &Point) -> f64 {
    (b - a).perp(&(c - a))
}

/// The area of a convex polygon; zero of fewer than three vertices.
pub(super) fn area(vertices: &[Point]) -> f64 {
    let Some((first, rest)) = vertices.split_first() else { return 0.0 };
    0.5 * rest.windows(2).map(|pair| turn(first, &pair[0], &pair[1])).sum::<f64>().max(0.0)
}

/// The vertices of the convex hull, without those that lie less than `resolution` beyond the edge of their neighbours.
pub(super) fn hull(mut points: Vec<Point>, resolution: f64) -> Vec<Point> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup_by(|a, b| (*a - *b).norm() <= resolution);
    if points.len() < 3 {
        return points;
    }
    let mut chain = half_hull(points.iter());
    chain.pop();
    chain.extend(half_hull(points.iter().rev()));
    chain.pop();
    let mut at = 0;
    while chain.len() > 2 && at < chain.len() {
        let count = chain.len();
        let (before, here, after) = (chain[(at + count - 1) % count], chain[at], chain[(at + 1) % count]);
        let (edge, part) = (after - before, here - before);
        let between = (0.0..=edge.norm_squared()).contains(&edge.dot(&part));
        if between && turn(&before, &here, &after) <= resolution * edge.norm() {
            chain.remove(at);
        } else {
            at += 1;
        }
    }
    chain
}

fn half_hull<'a>(points: impl Iterator<Item = &'a Point>) -> Vec<Point> {
    let mut chain: Vec<Point> = Vec::new();
    for point in points {
        while let [.., before, last] = &chain[..]
            && turn(before, last, point) <= 0.0
        {
            chain.pop();
        }
        chain.push(*point);
    }
    chain
}

/// Keeps what lies in the half-plane `normal . x <= offset`.
pub(super) fn clip(vertices: &[Point], normal: &Point, offset: f64) -> Vec<Point> {
    let mut kept = Vec::with_capacity(vertices.len() + 1);
    for (at, here) in vertices.iter().enumerate() {
        let next = &vertices[(at + 1) % vertices.len()];
        let (beyond, next_beyond) = (normal.dot(here) - offset, normal.dot(next) - offset);
        if beyond <= 0.0 {
            kept.push(*here);
        }
        if (beyond < 0.0 && next_beyond > 0.0) || (beyond > 0.0 && next_beyond < 0.0) {
            kept.push(here + (next - here) * (beyond / (beyond - next_beyond)));
        }
    }
    kept
}

/// How far a point lies inside a convex polygon: its distance from the boundary, negative outside. A segment or a point
/// has no inside: there it is zero at most.
pub(super) fn margin(vertices: &[Point], point: &Point) -> f64 {
    let edge = |at: usize| (&vertices[at], &vertices[(at + 1) % vertices.len()]);
    let edges = || (0..vertices.len()).map(edge);
    let inside = vertices.len() > 2 && edges().all(|(a, b)| turn(a, b, point) >= 0.0);
    let distance = edges().map(|(a, b)| from_segment(a, b, point)).fold(f64::INFINITY, f64::min);
    if inside { distance } else { -distance }
}

fn from_segment(a: &Point, b: &Point, point: &Point) -> f64 {
    let (along, offset) = (b - a, point - a);
    let square = along.norm_squared();
    let share = if square > 0.0 { (along.dot(&offset) / square).clamp(0.0, 1.0) } else { 0.0 };
    (offset - along * share).norm()
}
