//! How good can a grasp be whose parameters lie in a box? The bound of branch and bound.
//!
//! Let `s_ih(phi) = w_ih(phi) . z` for a fixed unit `z`. Over a box with half-widths `h_j` it exceeds the
//! multilinear interpolant of its values at the box's vertices `v` by at most `sum_j h_j^2 M_ij / 2`, where `M_ij`
//! bounds `|d^2 w_ih / d phi_j^2|`. `p` is convex and monotone in the `s_ih`, so
//!
//! `epsilon(phi) <= p(z; phi) <= max_v p(z; v) + slack`, `slack = sum_i sum_j h_j^2 M_ij / 2`
//!
//! (for the union: the largest over i instead of the sum). `max_v p(z; v)` is the support function of the hull of
//! all vertices' wrench sets. Where none of them has a positive component along `z`, `p` is the largest `s_ih`, and
//! `max_v p(z; v) + slack` below zero proves that no grasp in the box is force closure. The expanding polytope finds the
//! direction `z` in which that hull is thinnest, and any direction it passes on the way is a valid bound already. The
//! slack shrinks with the square of the box.
//!
//! `M_ij` is the caller's to bound. A [`Stencil`] estimates it box by box from second differences along the box's
//! axes, half a box wide each: that certifies nothing by itself, but on the assumption that the largest of them
//! times a safety factor bounds the second derivatives within the box, it does.

use std::ops::Range;

use rayon::prelude::*;

use crate::convex::expanding_polytope::{Expansion, Limits, Polytope, Radius, Thinnest};
use crate::convex::min_norm_point::nearest_point;
use crate::error::{Error, Result};
use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::quality::QualityOptions;
use crate::quality::query::QualityQuery;
use crate::tolerances::BOX_BOUND_RTOL;
use crate::wrench_set::{Criterion, Support};

/// Forces that stand for a true cone where its wrenches' second differences are taken.
const CONE_SAMPLES: usize = 16;

/// Directions kept from one call to the next.
const KEPT_BOX_DIRECTIONS: usize = 100;

/// How the slack of a box is estimated from grasps on its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stencil {
    /// Number of parameters: a box has `2^axes` vertices, then its centre, then for each axis the places at -1,
    /// -1/2, 1/2 and 1 half-widths from it.
    pub axes: usize,
    /// Factor on the largest second difference.
    pub safety: f64,
}

impl Stencil {
    /// `2^axes`, where that can be counted.
    fn num_vertices(&self) -> Option<usize> {
        1_usize.checked_shl(u32::try_from(self.axes).ok()?)
    }

    /// Vertices, centre and the places on the axes.
    fn num_grasps(&self) -> Option<usize> {
        self.num_vertices()?.checked_add(self.axes.checked_mul(4)?)?.checked_add(1)
    }
}

/// Upper bounds of `epsilon` over boxes of parameters, and a memory of where grasps are weak.
///
/// ```
/// use graspforce::{BoxBound, Contact, Criterion, Grasp, QualityOptions};
/// use nalgebra::Vector3;
///
/// // Two fingers on a disc; the second somewhere between two angles, neither of them opposite to the first.
/// let grasp = |vertex: usize| {
///     let angles = [0.0, [2.8, 3.0][vertex]];
///     Grasp::<3>::new(&angles.map(|angle: f64| {
///         let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
///         Contact::new(outward, -outward)
///     }))
/// };
/// let mut bound = BoxBound::new(QualityOptions::new(Criterion::Max))?;
/// let upper = bound.over(&[0.01], None, 0.0, |_| 0..2, grasp).map_err(|(_, error)| error)?[0];
/// assert!(upper >= grasp(1)?.quality(Criterion::Max)?.rho.abs());
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug)]
pub struct BoxBound<const D: usize> {
    options: QualityOptions<D>,
    pool: Vec<Wrench<D>>,
}

impl<const D: usize> BoxBound<D> {
    /// Bounds of the quality that these options ask for.
    pub fn new(options: QualityOptions<D>) -> Result<Self> {
        options.check()?;
        Ok(Self { options, pool: Vec::new() })
    }

    /// One bound for each slack, in order, in parallel: of the box whose vertices (and stencil) are the grasps
    /// `rows(i)`. A stencil can only lower a slack.
    ///
    /// A bound is refined only until it falls below `enough`. A row that is no grasp is an error, with its number, and
    /// so is a box without vertices or with other than its stencil's number of grasps.
    pub fn over(
        &mut self,
        slacks: &[f64],
        stencil: Option<Stencil>,
        enough: f64,
        rows: impl Fn(usize) -> Range<usize> + Sync,
        grasp: impl Fn(usize) -> Result<Grasp<D>> + Sync,
    ) -> std::result::Result<Vec<f64>, (usize, Error)> {
        let (pool, options, interrupt) = (&self.pool, &self.options, interrupt::current());
        let bounds: Vec<_> = slacks
            .par_iter()
            .enumerate()
            .map_init(Polytope::new, |polytope, (index, slack)| {
                let numbered = |vertex| grasp(vertex).map_err(|error| (vertex, error));
                let rows = rows(index);
                let first = rows.start;
                let num_vertices = stencil.map_or(Some(rows.len()), |stencil| stencil.num_vertices());
                let wanted = stencil.map_or(num_vertices, |stencil| stencil.num_grasps());
                let num_vertices = num_vertices.filter(|_| wanted == Some(rows.len()) && !rows.is_empty());
                let Some(num_vertices) = num_vertices else {
                    let axes = stencil.map_or_else(String::new, |s| format!(" over {} axes", s.axes));
                    let reason = format!("{} grasps do not make a box{axes}", rows.len());
                    return Err((rows.start, Error::input("positions", reason)));
                };
                let grasps = rows.map(numbered).collect::<std::result::Result<Vec<_>, _>>()?;
                let vertices = &grasps[..num_vertices];
                let asked = |(row, grasp)| QualityQuery::new(grasp, options).map_err(|error| (row, error));
                let queries = (first..).zip(vertices).map(asked);
                let queries = queries.collect::<std::result::Result<Vec<_>, _>>()?;
                let estimate = stencil.and_then(|stencil| {
                    let axes = grasps.get(num_vertices..)?;
                    estimated_slack(axes, &stencil, queries.first()?)
                });
                let slack = slack.min(estimate.unwrap_or(f64::INFINITY));
                interrupt::inherit(interrupt.as_ref(), || {
                    interrupt::check().map_err(|error| (first, error))?;
                    Ok(bound_of(&queries, enough, pool, polytope, slack))
                })
            })
            .collect();
        let bounds = bounds.into_iter().collect::<std::result::Result<Vec<_>, _>>()?;
        // What served last is likely to serve next.
        self.pool.extend(bounds.iter().filter_map(|(_, used)| *used));
        self.keep_recent();
        Ok(bounds.into_iter().map(|(bound, _)| bound).collect())
    }

    /// Drops repetitions, and what has not served for long.
    fn keep_recent(&mut self) {
        let mut recent: Vec<Wrench<D>> = Vec::with_capacity(KEPT_BOX_DIRECTIONS);
        for z in self.pool.iter().rev() {
            if recent.len() == KEPT_BOX_DIRECTIONS {
                break;
            }
            if !recent.iter().any(|other| other.dot(z) > 1.0 - 1e-9) {
                recent.push(*z);
            }
        }
        recent.reverse();
        self.pool = recent;
    }
}

/// What interpolation between a box's vertices leaves open; `None` where the stencil is incomplete.
fn estimated_slack<const D: usize>(
    grasps: &[Grasp<D>],
    stencil: &Stencil,
    query: &QualityQuery<'_, D>,
) -> Option<f64> {
    let (center, arms) = grasps.split_first()?;
    let open = |contact: usize| -> Option<f64> {
        let here = sample_wrenches(center, contact);
        let mut open = 0.0;
        for axis in 0..stencil.axes {
            let places = arms.get(4 * axis..4 * axis + 4)?;
            let [low, left, right, high] = [0, 1, 2, 3].map(|at| sample_wrenches(&places[at], contact));
            let mut largest: f64 = 0.0;
            for (edge, middle) in here.iter().enumerate() {
                for (outer, inner) in [(&low, &left), (&high, &right)] {
                    let second = outer.get(edge)? - inner.get(edge)? * 2.0 + middle;
                    largest = largest.max(query.metric.norm(&second));
                }
            }
            // h^2 M / 2 where the difference over h / 2 is h^2 M / 4.
            open += 2.0 * stencil.safety * largest;
        }
        Some(open)
    };
    let each: Option<Vec<f64>> = (0..center.num_contacts()).map(open).collect();
    Some(match query.set.criterion() {
        Criterion::Sum => each?.into_iter().fold(0.0, f64::max),
        Criterion::Max => each?.into_iter().sum(),
    })
}

/// A contact's primitive wrenches; of a true cone, those of some of its forces.
fn sample_wrenches<const D: usize>(grasp: &Grasp<D>, contact: usize) -> Vec<Wrench<D>> {
    if let Some(edges) = grasp.edges(contact) {
        return grasp.finite_wrenches()[edges].to_vec();
    }
    let (contact, map) = (&grasp.contacts()[contact], &grasp.maps()[contact]);
    let turn = |k: usize| std::f64::consts::TAU * k as f64 / CONE_SAMPLES as f64;
    let ring = (0..CONE_SAMPLES).map(|k| {
        let (sine, cosine) = turn(k).sin_cos();
        ContactForce::new(1.0, contact.friction * cosine, contact.friction * sine, 0.0)
    });
    let poles = [contact.torsion, -contact.torsion].map(|torsion| ContactForce::new(1.0, 0.0, 0.0, torsion));
    ring.chain(poles).map(|force| map * force * contact.max_normal_force).collect()
}

/// The bound, and the direction that gave it.
fn bound_of<const D: usize>(
    queries: &[QualityQuery<'_, D>],
    enough: f64,
    pool: &[Wrench<D>],
    polytope: &mut Polytope<D>,
    slack: f64,
) -> (f64, Option<Wrench<D>>) {
    let value = |z: &Wrench<D>| queries.iter().map(|q| q.value(z)).fold(f64::NEG_INFINITY, f64::max);
    let bound = |reach: f64| {
        // Where even interpolation leaves no wrench a positive component, the whole box is open. Elsewhere the
        // Minkowski sum clamps each contact, and the argument bounds `max(0, p)`.
        if reach + slack < 0.0 { reach + slack } else { reach.max(0.0) + slack }
    };
    let mut best = (f64::INFINITY, None);
    for z in pool.iter().rev() {
        let reach = value(z);
        if reach < best.0 {
            best = (reach, Some(*z));
        }
        if bound(reach) < enough {
            return (bound(reach), Some(*z));
        }
    }
    let scale = queries.iter().map(|query| query.scale).fold(0.0, f64::max);
    let support = |z: &Wrench<D>| {
        let supports = queries.iter().map(|query| query.support(z));
        let none = Support { value: f64::NEG_INFINITY, wrench: Wrench::zeros() };
        supports.fold(none, |best, other| if other.value > best.value { other } else { best })
    };
    let limits = Limits { stop_below: enough - slack, ..Limits::new(BOX_BOUND_RTOL) };
    let (upper, direction) = match polytope.expand(1e-3 * scale, &limits, support) {
        Expansion::Radius(Radius { upper, direction, .. })
        | Expansion::Pierced(Thinnest { upper, direction, .. })
        | Expansion::Stopped(Thinnest { upper, direction, .. }) => (upper, direction),
    };
    if upper < best.0 {
        best = (upper, Some(direction));
    }
    if upper < 1e-3 * scale && bound(best.0) >= enough {
        // No ball fits; the direction that separates the origin from all vertices' wrenches, if one does.
        let nearest = nearest_point(BOX_BOUND_RTOL, 1e-12 * scale, usize::MAX, &Wrench::zeros(), support);
        if nearest.lower > 0.0 {
            let direction = nearest.witness;
            let reach = value(&direction);
            if reach < best.0 {
                best = (reach, Some(direction));
            }
        }
    }
    (bound(best.0), best.1)
}
