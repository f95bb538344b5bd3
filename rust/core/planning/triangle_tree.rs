//! The point of a triangle mesh nearest to a given one: a tree of boxes, and the regions of a triangle.
//!
//! Planning on a mesh moves points through space and puts contacts where they project; a plan asks for hundreds
//! of thousands of projections.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::grasp::REPRESENTABLE;
use crate::interrupt;
use crate::memory::{filled, room};

/// Triangles in a leaf.
const LEAF: usize = 4;

/// Fewer queries are no task of their own for a thread.
pub const QUERIES_PER_TASK: usize = 256;

/// The nearest point of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestPoint {
    /// Where.
    pub point: Vector3<f64>,
    /// On which triangle; the lowest of those equally near.
    pub face: usize,
    /// Weights of the triangle's corners, adding up to one.
    pub weights: [f64; 3],
}

/// Stands in a result until the nearest point is known.
const UNKNOWN_POINT: ClosestPoint =
    ClosestPoint { point: Vector3::new(0.0, 0.0, 0.0), face: usize::MAX, weights: [0.0; 3] };

/// A mesh, ready to be asked for nearest points.
///
/// ```
/// use graspforce::TriangleTree;
/// use nalgebra::Vector3;
///
/// let corners = [Vector3::zeros(), Vector3::x(), Vector3::y()];
/// let tree = TriangleTree::new(&corners, &[[0, 1, 2]])?;
/// assert_eq!(tree.closest(&Vector3::new(0.25, 0.25, 3.0)).point, Vector3::new(0.25, 0.25, 0.0));
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct TriangleTree {
    /// In the order of the tree's leaves.
    triangles: Vec<([Vector3<f64>; 3], usize)>,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    low: Vector3<f64>,
    high: Vector3<f64>,
    start: usize,
    count: usize,
    /// The second child; the first one follows its parent. Zero for a leaf.
    second: usize,
}

impl TriangleTree {
    /// Builds the tree over the triangles with these corners; refuses none, and corners that are not there.
    pub fn new(vertices: &[Vector3<f64>], faces: &[[usize; 3]]) -> Result<Self> {
        if faces.is_empty() {
            return Err(Error::input("faces", "a mesh needs at least one triangle"));
        }
        if let Some((row, reason)) = vertices.iter().map(beyond).enumerate().find_map(|(i, r)| Some((i, r?)))
        {
            return Err(Error::InvalidInput { argument: "vertices", row: Some(row), reason });
        }
        if let Some(row) = faces.iter().position(|face| face.iter().any(|&v| v >= vertices.len())) {
            let reason = format!("{:?} names a corner beyond the {} there are", faces[row], vertices.len());
            return Err(Error::InvalidInput { argument: "faces", row: Some(row), reason });
        }
        let mut tree = Self { triangles: room("faces", faces.len())?, nodes: room("faces", faces.len())? };
        tree.triangles.extend(faces.iter().map(|face| face.map(|corner| vertices[corner])).zip(0..));
        tree.split(0, faces.len());
        Ok(tree)
    }

    fn split(&mut self, start: usize, count: usize) {
        let own = &mut self.triangles[start..start + count];
        let corners = || own.iter().flat_map(|(triangle, _)| triangle);
        let low = corners().fold(Vector3::repeat(f64::INFINITY), |low, v| low.inf(v));
        let high = corners().fold(Vector3::repeat(f64::NEG_INFINITY), |high, v| high.sup(v));
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, start, count, second: 0 });
        if count <= LEAF {
            return;
        }
        let axis = (high - low).imax();
        let middle =
            |(triangle, _): &([Vector3<f64>; 3], usize)| triangle.iter().map(|v| v[axis]).sum::<f64>();
        let half = count / 2;
        own.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
        self.split(start, half);
        self.nodes[node].second = self.nodes.len();
        self.split(start + half, count - half);
    }

    /// The nearest point of the mesh; squares of the coordinates must be representable.
    pub fn closest(&self, point: &Vector3<f64>) -> ClosestPoint {
        let mut best = (f64::INFINITY, ClosestPoint { point: *point, face: usize::MAX, weights: [0.0; 3] });
        let mut waiting = vec![(self.nodes[0].distance(point), 0)];
        while let Some((distance, index)) = waiting.pop() {
            if distance > best.0 {
                continue;
            }
            let node = &self.nodes[index];
            if node.second == 0 {
                for (triangle, face) in &self.triangles[node.start..node.start + node.count] {
                    let weights = closest_weights(triangle, point);
                    let there =
                        triangle[0] * weights[0] + triangle[1] * weights[1] + triangle[2] * weights[2];
                    let distance = (there - point).norm_squared();
                    if distance < best.0 || (distance == best.0 && *face < best.1.face) {
                        best = (distance, ClosestPoint { point: there, face: *face, weights });
                    }
                }
                continue;
            }
            let mut children =
                [index + 1, node.second].map(|child| (self.nodes[child].distance(point), child));
            if children[0].0 < children[1].0 {
                children.swap(0, 1);
            }
            waiting.extend(children);
        }
        best.1
    }

    /// The nearest points of many, on all cores if they are more than [`QUERIES_PER_TASK`].
    pub fn closest_many(&self, points: &[Vector3<f64>]) -> Result<Vec<ClosestPoint>> {
        let interrupt = interrupt::current();
        let closest = |(row, point): (usize, &Vector3<f64>)| {
            if let Some(reason) = beyond(point) {
                return Err(Error::InvalidInput { argument: "points", row: Some(row), reason });
            }
            interrupt::inherit(interrupt.as_ref(), interrupt::check)?;
            Ok(self.closest(point))
        };
        // Collecting results would allocate without asking.
        let mut found = filled("points", points.len(), UNKNOWN_POINT)?;
        let answer = |(given, found): ((usize, &Vector3<f64>), &mut ClosestPoint)| {
            closest(given).map(|nearest| *found = nearest)
        };
        if points.len() <= QUERIES_PER_TASK {
            points.iter().enumerate().zip(&mut found).try_for_each(answer)?;
        } else {
            let all = points.par_iter().enumerate().zip(&mut found);
            all.with_min_len(QUERIES_PER_TASK).try_for_each(answer)?;
        }
        Ok(found)
    }
}

/// What is wrong with a point with which no distances can be computed.
fn beyond(point: &Vector3<f64>) -> Option<String> {
    let list = point.as_slice();
    if point.iter().any(|x| !x.is_finite()) {
        return Some(format!("{list:?} is not finite"));
    }
    (point.amax() >= REPRESENTABLE.end).then(|| format!("{list:?} must lie below 1e140; check the units"))
}

impl Node {
    /// Squared distance of the box.
    fn distance(&self, point: &Vector3<f64>) -> f64 {
        (self.low - point).sup(&(point - self.high)).sup(&Vector3::zeros()).norm_squared()
    }
}

/// Weights of the corners at the triangle's point nearest to `p`: of a corner, an edge, or inside.
///
/// A flat triangle has no inside; one of its edges then holds the nearest point. Of one that is flat up to rounding the
/// weights inside are noise, so they must do better than the edges.
fn closest_weights([a, b, c]: &[Vector3<f64>; 3], p: &Vector3<f64>) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    // The squared area is a fourth power of lengths: in units of the longest edge it neither overflows nor vanishes.
    let unit = ab.amax().max(ac.amax());
    if !(1e-60..1e60).contains(&unit) && unit > 0.0 {
        return closest_weights(&[a, b, c].map(|corner| (corner - a) / unit), &((p - a) / unit));
    }
    let ap = p - a;
    let normal = ab.cross(&ac);
    let area = normal.norm_squared();
    let mut inside = (f64::INFINITY, [1.0, 0.0, 0.0]);
    if area > 0.0 {
        let v = ap.cross(&ac).dot(&normal) / area;
        let w = ab.cross(&ap).dot(&normal) / area;
        let u = 1.0 - v - w;
        if u >= 0.0 && v >= 0.0 && w >= 0.0 {
            inside = ((ab * v + ac * w - ap).norm_squared(), [u, v, w]);
        }
    }
    let on_edge = |from: &Vector3<f64>, to: &Vector3<f64>| {
        let along = to - from;
        let length = along.norm_squared();
        let t = if length > 0.0 { ((p - from).dot(&along) / length).clamp(0.0, 1.0) } else { 0.0 };
        ((from + along * t - p).norm_squared(), t)
    };
    let [(d0, t0), (d1, t1), (d2, t2)] = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    if inside.0 <= d0.min(d1).min(d2) {
        inside.1
    } else if d0 <= d1 && d0 <= d2 {
        [1.0 - t0, t0, 0.0]
    } else if d1 <= d2 {
        [0.0, 1.0 - t1, t1]
    } else {
        [t2, 0.0, 1.0 - t2]
    }
}
