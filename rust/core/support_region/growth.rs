//! Which direction is asked for next: across the edge of the inner polygon with the largest area beyond it.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::furthest::{Furthest, Simplex};
use super::newton::{Newton, Optimum};
use super::polygon::{area, clipped, hull, turn};
use super::{HorizontalPoint as Point, RESOLUTION, RegionShape, SupportOptions};
use crate::error::Result;

/// What bounds leave open along the boundary, as a share of the gap.
const BOUNDARY: f64 = 1e-2;

/// Areas below this, in units of the region's squared extent, are rounding.
const ROUNDED_AREA: f64 = 1e-14;

/// Triangles are no longer divided once their area is this share of the gap.
const LEAST_SHARE: f64 = 0.3;

/// Gaps that are no wider are as narrow as rounding allows.
const ROUNDED_GAP: f64 = 1e-9;

/// Without limits, bounds come so near to their places: what is left could be due to the limit that stands in.
const UNLIMITED_ENOUGH: f64 = 1e-10;

/// Places that span less, in units of the region's squared extent, may lie on a line.
const FLAT_AREA: f64 = 1e-7;

/// Corners that reach less far beyond their edge, in units of the region's extent, are rounding.
const ROUNDED_GAIN: f64 = 1e-11;

/// Points nearer than this, in units of the region's extent, are one vertex.
const SAME_VERTEX: f64 = 1e-12;

/// Both polygons in the coordinates of the load.
pub(super) struct Grown {
    pub shape: RegionShape,
    pub inner: Vec<Point>,
    pub outer: Vec<Point>,
    pub gap: f64,
    pub converged: bool,
    pub directions: usize,
    /// What the limits of the forces contribute to the bound along any direction.
    pub reached: f64,
    /// The outer area beside the extent of the region.
    width: f64,
}

/// What was asked for.
struct Asked {
    direction: Point,
    found: Furthest,
    optimum: Option<Optimum>,
}

/// Asks for the furthest places: of true cones by Newton's method, where that fails by the simplex.
struct Oracle<'s, 'a> {
    simplex: &'s mut Simplex<'a>,
    newton: &'s mut Option<Newton>,
    asked: Vec<Asked>,
}

impl Oracle<'_, '_> {
    /// Asks along a direction, which may lie between two that were asked for.
    fn ask(&mut self, direction: Point, ends: Option<[usize; 2]>, enough: f64) -> Result<Furthest> {
        let known =
            |at: usize| self.asked[at].optimum.as_ref().map(|optimum| (&self.asked[at].direction, optimum));
        let ends = ends.and_then(|[a, b]| Some([known(a)?, known(b)?]));
        let near = self
            .newton
            .as_mut()
            .zip(ends)
            .and_then(|(newton, ends)| newton.between(&direction, ends, enough));
        let (found, optimum) = if let Some((found, optimum)) = near {
            (found, Some(optimum))
        } else {
            let found = self.simplex.furthest(&direction, enough)?;
            let newton = self.newton.as_mut();
            let polished = newton.and_then(|newton| self.simplex.polish(newton, &direction, enough));
            polished.map_or((found, None), |(found, optimum)| (found, Some(optimum)))
        };
        self.asked.push(Asked { direction, found, optimum });
        Ok(found)
    }
}

/// What is not known yet: the triangle between two neighbouring places and the corner of their bounds.
struct Open {
    places: [Point; 2],
    directions: [Point; 2],
    /// Numbers of the directions among those asked for.
    asked: [usize; 2],
    corner: Point,
    area: f64,
}

impl Open {
    fn new(places: [Point; 2], directions: [Point; 2], asked: [usize; 2], corner: Point) -> Self {
        let area = 0.5 * turn(&places[0], &corner, &places[1]).abs();
        Self { places, directions, asked, corner, area }
    }

    /// How much further than the edge a point lies along a direction.
    fn beyond(&self, direction: &Point, point: &Point) -> f64 {
        self.places.iter().map(|place| direction.dot(&(point - place))).fold(f64::INFINITY, f64::min)
    }

    /// Outward across the edge; between both directions where the edge has none.
    fn across(&self, size: f64) -> Option<Point> {
        let edge = self.places[1] - self.places[0];
        let outward = if edge.norm() > SAME_VERTEX * size {
            Point::new(edge.y, -edge.x)
        } else {
            self.directions[0] + self.directions[1]
        };
        outward.try_normalize(0.0)
    }

    /// Where the line towards a place leaves `direction . x <= bound`.
    fn cut(&self, end: usize, direction: &Point, bound: f64) -> Point {
        let (from, to) = (self.places[end], self.corner);
        let (start, rise) = (direction.dot(&from), direction.dot(&(to - from)));
        let share = if rise > 0.0 { ((bound - start) / rise).clamp(0.0, 1.0) } else { 1.0 };
        from + (to - from) * share
    }

    fn split(&self, direction: &Point, found: &Furthest, at: usize) -> [Self; 2] {
        [0, 1].map(|end| {
            let corner = self.cut(end, direction, found.bound);
            let (mut places, mut directions, mut asked) = (self.places, self.directions, self.asked);
            places[1 - end] = found.place;
            directions[1 - end] = *direction;
            asked[1 - end] = at;
            Self::new(places, directions, asked, corner)
        })
    }
}

/// By area: the heap gives the largest first.
impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.area.total_cmp(&other.area)
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

/// The region where it is a point or a segment: where places span a line, and the bounds across it leave no width.
fn flat(simplex: &mut Simplex<'_>, found: &[Asked], size: f64) -> Result<Option<Grown>> {
    let enough = (0.1 * RESOLUTION).max(simplex.rounding());
    let places: Vec<Point> = found.iter().map(|one| one.found.place).collect();
    let described = |shape, inner, outer, directions, more: f64| {
        let reached = most_reached(found).max(more);
        Some(Grown { shape, inner, outer, gap: 0.0, converged: true, directions, reached, width: 0.0 })
    };
    if size <= RESOLUTION + 4.0 * simplex.rounding() {
        return Ok(described(
            RegionShape::Point,
            places[..1].to_vec(),
            places[..1].to_vec(),
            found.len(),
            0.0,
        ));
    }
    if area(&hull(places.clone(), 0.0)) > FLAT_AREA * size * size {
        return Ok(None);
    }
    let chords = places.iter().enumerate().flat_map(|(at, a)| places[..at].iter().map(move |b| a - b));
    let chord = chords.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_else(Point::zeros);
    let Some(along) = chord.try_normalize(RESOLUTION) else { return Ok(None) };
    let across = Point::new(along.y, -along.x);
    let mut ask = |direction: Point| simplex.furthest(&direction, enough);
    let (over, under) = (ask(across)?, ask(-across)?);
    let (above, below) = (over.bound, under.bound);
    if above + below > RESOLUTION * chord.norm() + 2.0 * enough {
        return Ok(None);
    }
    let (last, first) = (ask(along)?, ask(-along)?);
    let middle = across * (0.5 * (above - below));
    let outer = vec![middle - along * first.bound, middle + along * last.bound];
    let reached = [over, under, last, first].iter().map(|one| one.reached).fold(0.0, f64::max);
    Ok(described(RegionShape::Segment, vec![first.place, last.place], outer, found.len() + 4, reached))
}

/// Grows both polygons until the area between them is at most the share `gap` of the outer one's.
pub(super) fn grow(
    simplex: &mut Simplex<'_>,
    mut newton: Option<Newton>,
    options: &SupportOptions,
) -> Result<Grown> {
    // What the bounds leave open along the boundary is a small part of the gap.
    let closest = if options.limits { f64::INFINITY } else { UNLIMITED_ENOUGH };
    let mut enough = (BOUNDARY * options.gap).min(closest);
    let mut grown = grow_once(simplex, &mut newton, options, enough, options.max_directions)?;
    loop {
        // The area of a thin or small region is small beside its boundary.
        let finer = (BOUNDARY * options.gap * grown.width).max(simplex.rounding()).min(closest);
        let left = options.max_directions - grown.directions.min(options.max_directions);
        if grown.converged || enough < 2.0 * finer || left < 4 {
            return Ok(grown);
        }
        let next = grow_once(simplex, &mut newton, options, finer, left)?;
        let directions = grown.directions + next.directions;
        // With few directions left, the earlier polygons may be the nearer ones.
        if next.converged || next.gap < grown.gap || grown.inner.len() < 3 {
            grown = next;
        }
        (enough, grown.directions) = (finer, directions);
    }
}

/// The same with bounds that are as near as `enough` to their places.
fn grow_once(
    simplex: &mut Simplex<'_>,
    newton: &mut Option<Newton>,
    options: &SupportOptions,
    enough: f64,
    max_directions: usize,
) -> Result<Grown> {
    let gap = options.gap;
    let axes = [Point::x(), Point::y(), -Point::x(), -Point::y()];
    let mut oracle = Oracle { simplex, newton, asked: Vec::with_capacity(64) };
    for axis in axes {
        oracle.ask(axis, None, enough)?;
    }
    let [right, top, left, bottom] = [0, 1, 2, 3].map(|at: usize| oracle.asked[at].found.bound);
    let bounds = [(right, top), (-left, top), (-left, -bottom), (right, -bottom)];
    let corners = bounds.map(|(x, y)| Point::new(x, y));
    let size = (right + left).max(top + bottom);
    let mut open: BinaryHeap<Open> = (0..4)
        .map(|at| {
            let next = (at + 1) % 4;
            let places = [at, next].map(|at| oracle.asked[at].found.place);
            Open::new(places, [axes[at], axes[next]], [at, next], corners[at])
        })
        .collect();
    let least = (ROUNDED_GAIN * size).max(2.0 * enough) + 4.0 * oracle.simplex.rounding();
    if let Some(flat) = flat(oracle.simplex, &oracle.asked, size)? {
        return Ok(flat);
    }
    let mut inside = area(&hull(oracle.asked.iter().map(|one| one.found.place).collect(), 0.0));
    let mut between = open.iter().map(|triangle| triangle.area).sum::<f64>();
    let (mut converged, mut share, mut last) = (true, 0.999, None);
    while let Some(triangle) = open.pop() {
        if between <= (share * gap * (inside + between)).max(ROUNDED_AREA * size * size) {
            // Bounds that are not sharp leave the polygons a little further apart than their triangles.
            let grown = polygons(&oracle.asked, &corners, converged, size);
            if grown.gap <= gap || share < LEAST_SHARE {
                last = Some(grown);
                break;
            }
            share *= 0.8;
        }
        // Triangles that are too flat to be asked stay between the polygons.
        let Some(direction) =
            triangle.across(size).filter(|across| triangle.beyond(across, &triangle.corner) > least)
        else {
            continue;
        };
        if oracle.asked.len() >= max_directions {
            converged = false;
            break;
        }
        let at = oracle.asked.len();
        let next = oracle.ask(direction, Some(triangle.asked), enough)?;
        inside += 0.5 * turn(&triangle.places[0], &next.place, &triangle.places[1]).abs();
        let halves = triangle.split(&direction, &next, at);
        between += halves[0].area + halves[1].area - triangle.area;
        // Where no place lies beyond, the edge is found, as sharp as its bound is.
        if triangle.beyond(&direction, &next.place) > least {
            open.extend(halves);
        }
    }
    let mut grown = last.unwrap_or_else(|| polygons(&oracle.asked, &corners, converged, size));
    // The boundary is at most four extents long, and known to the resolution. Fewer vertices are no polygon: closer bounds
    // tell what it is.
    grown.converged &= grown.inner.len() >= 3
        && (grown.gap <= gap.max(ROUNDED_GAP) || grown.gap * grown.width <= 4.0 * RESOLUTION);
    Ok(grown)
}

/// Both polygons of what was found, the first four along the axes.
fn polygons(found: &[Asked], corners: &[Point], converged: bool, size: f64) -> Grown {
    let outer = clipped(corners, found[4..].iter().map(|one| (one.direction, one.found.bound)).collect());
    let inner = hull(found.iter().map(|one| one.found.place).collect(), 0.1 * SAME_VERTEX * size);
    let (inside, outside) = (area(&inner), area(&outer));
    let (directions, reached) = (found.len(), most_reached(found));
    let gap = if outside > 0.0 { ((outside - inside) / outside).max(0.0) } else { 0.0 };
    let outer = without_repetitions(outer, 0.1 * SAME_VERTEX * size);
    let width = outside / size;
    Grown { shape: RegionShape::Polygon, inner, outer, gap, converged, directions, reached, width }
}

fn most_reached(found: &[Asked]) -> f64 {
    found.iter().map(|one| one.found.reached).fold(0.0, f64::max)
}

fn without_repetitions(mut vertices: Vec<Point>, nearest: f64) -> Vec<Point> {
    vertices.dedup_by(|a, b| (*a - *b).norm() <= nearest);
    if vertices.len() > 1 && (vertices[0] - vertices[vertices.len() - 1]).norm() <= nearest {
        vertices.pop();
    }
    vertices
}
