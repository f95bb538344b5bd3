//! Convex polygons in the plane, counterclockwise.

use std::collections::VecDeque;

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

/// Keeps what lies in the half-planes `normal . x <= offset`, but for those that leave nothing: rounding, where a region
/// has no interior.
pub(super) fn clipped(vertices: &[Point], mut half_planes: Vec<(Point, f64)>) -> Vec<Point> {
    // In the order of angles, each cuts near the last one.
    half_planes.sort_by(|(a, _), (b, _)| a.y.atan2(a.x).total_cmp(&b.y.atan2(b.x)));
    let mut ring: VecDeque<Point> = vertices.iter().copied().collect();
    for (normal, offset) in half_planes {
        let beyond = |point: &Point| normal.dot(point) - offset;
        climb(&mut ring, beyond);
        let count = ring.len();
        let ahead = ring.iter().take_while(|point| beyond(point) > 0.0).count();
        if ahead == 0 || ahead == count {
            continue;
        }
        let last = count - 1 - ring.iter().rev().take_while(|point| beyond(point) > 0.0).count();
        let crossing = |kept: Point, cut: Point| {
            let (inside, outside) = (beyond(&kept), beyond(&cut));
            (inside < 0.0).then(|| kept + (cut - kept) * (inside / (inside - outside)))
        };
        let corners =
            [crossing(ring[last], ring[(last + 1) % count]), crossing(ring[ahead], ring[ahead - 1])];
        ring.truncate(last + 1);
        ring.drain(..ahead);
        ring.extend(corners.into_iter().flatten());
    }
    ring.into()
}

/// Turns a convex ring until its furthest vertex comes first: step by step, or by a look at all where no step leads beyond.
fn climb(ring: &mut VecDeque<Point>, beyond: impl Fn(&Point) -> f64) {
    let count = ring.len();
    for _ in 0..count {
        let [behind, first, ahead] = [count - 1, 0, 1 % count].map(|at| beyond(&ring[at]));
        if ahead > first {
            ring.rotate_left(1);
        } else if behind > first {
            ring.rotate_right(1);
        } else {
            break;
        }
    }
    if ring.front().is_some_and(|first| beyond(first) <= 0.0) {
        let furthest = (0..count).max_by(|&a, &b| beyond(&ring[a]).total_cmp(&beyond(&ring[b])));
        ring.rotate_left(furthest.unwrap_or(0));
    }
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
