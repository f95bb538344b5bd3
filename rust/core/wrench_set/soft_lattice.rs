//! The furthest wrench of a soft finger's linearised cone, from its latitude and longitude.
//!
//! The extreme forces lie on circles of latitude `psi = j pi / (2 q)`, at longitudes `theta = 2 h pi / l`, and in both poles.
//! With `n`, `(o, t)` and `r` the reach of the largest normal, tangential and torsional force along a direction, one of them
//! reaches
//!
//! `n + |(o, t)| cos psi cos(theta - atan2(t, o)) + r sin psi`.
//!
//! Whatever the latitude, the best longitude is the nearest to `atan2(t, o)`, and the best latitude is the nearest to
//! `atan2(r, |(o, t)|)`. With their neighbours these are nine wrenches instead of thousands. All others fall short by more
//! than rounding, so the answer is that of the full search to the last digit. Where the tangential reach is too small for
//! that, there is no answer.

use std::f64::consts::{PI, TAU};

use nalgebra::{SMatrix, SVector, Vector4};

use crate::grasp::Grasp;
use crate::grasp::Wrench;
use crate::grasp::contact::{ForceModel, latitudes};
use crate::tolerances::ROUNDED_POINT;
use crate::wrench_set::edge_blocks::{EdgeBlock, edge, edge_value};

/// Cones of fewer edges are searched as fast in full.
const FEWEST_EDGES: usize = 24;

/// Where the extreme wrenches of a soft finger lie.
#[derive(Debug, Clone)]
pub(crate) struct SoftLattice<const R: usize> {
    /// The wrenches of the largest normal, tangential and torsional forces.
    axes: SMatrix<f64, R, 4>,
    longitudes: usize,
    /// `q`.
    latitudes: usize,
    /// The tangential reach, relative to the direction's length, from which on neighbours differ by more than rounding.
    least: f64,
}

impl<const R: usize> SoftLattice<R> {
    /// The lattice of contact `i` of a grasp in a linear map, where it has one; `blocks` are the wrenches in it.
    pub(crate) fn of_contact<const D: usize>(
        grasp: &Grasp<D>,
        i: usize,
        map: impl Fn(&Wrench<D>) -> SVector<f64, R>,
        blocks: &[EdgeBlock<R>],
    ) -> Option<Self> {
        let contact = &grasp.contacts()[i];
        let ForceModel::Edges(longitudes) = contact.forces else { return None };
        let forces = &grasp.finite_forces()[grasp.edges(i)?];
        let latitudes = latitudes(longitudes);
        let soft = contact.friction > 0.0 && contact.torsion > 0.0;
        if !soft || longitudes < FEWEST_EDGES || forces.len() != (2 * latitudes - 1) * longitudes + 2 {
            return None;
        }
        let mut columns = SMatrix::<f64, R, 4>::zeros();
        for (k, column) in grasp.maps()[i].column_iter().enumerate() {
            columns.set_column(k, &map(&column.into_owned()));
        }
        // What the map made of the wrenches, beside what it makes of its columns.
        let off = |(number, force): (usize, &Vector4<f64>)| (edge(blocks, number) - columns * force).norm();
        let off = forces.iter().enumerate().map(off).fold(0.0, f64::max);
        let sizes = Vector4::new(1.0, contact.friction, contact.friction, contact.torsion);
        let axes = columns * SMatrix::from_diagonal(&(sizes * contact.max_normal_force));
        let longest: f64 = axes.column_iter().map(|column| column.norm()).sum();
        // Two values, each of a rounded wrench and of rounded products; as much again for angles and their cosines.
        let rounded = 4.0 * (off + ROUNDED_POINT * longest);
        // Of wrenches that are no candidates, the longitude or the latitude is off by one and a half steps or more, that of
        // the best by half a step. No cosine of a circle's latitude is less than the sine of the step.
        let (latitude, longitude) = (PI / (2 * latitudes) as f64, TAU / longitudes as f64);
        let least = rounded / (latitude.sin() * longitude.sin() * (0.5 * longitude).sin());
        Some(Self { axes, longitudes, latitudes, least })
    }

    /// How far the furthest wrench reaches along `z`, and its number: the lowest among equals.
    #[inline]
    pub(crate) fn furthest(&self, blocks: &[EdgeBlock<R>], z: &SVector<f64, R>) -> Option<(f64, usize)> {
        let reach = self.axes.tr_mul(z);
        let tangential = reach[1].hypot(reach[2]);
        // Not greater, rather than less: no number is no answer.
        if tangential.partial_cmp(&(self.least * z.norm())) != Some(std::cmp::Ordering::Greater) {
            return None;
        }
        let nearest = |angle: f64, step: f64| (angle / step).round() as isize;
        let (circles, around) = (self.latitudes as isize, self.longitudes as isize);
        let longitude = nearest(reach[2].atan2(reach[1]), TAU / self.longitudes as f64);
        let latitude = nearest(reach[3].atan2(tangential), PI / (2 * self.latitudes) as f64);
        let (mut most, mut at) = (f64::NEG_INFINITY, usize::MAX);
        let mut look = |number: isize| {
            let number = number as usize;
            let value = edge_value(blocks, number, z);
            if value > most || (value == most && number < at) {
                (most, at) = (value, number);
            }
        };
        let poles = (2 * circles - 1) * around;
        for circle in latitude - 1..=latitude + 1 {
            if circle.abs() >= circles {
                look(if circle > 0 { poles } else { poles + 1 });
                continue;
            }
            // The longitudes count from one.
            for k in longitude - 2..=longitude {
                look((circle + circles - 1) * around + k.rem_euclid(around));
            }
        }
        Some((most, at))
    }
}
