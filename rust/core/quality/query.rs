//! A question about the quality of one grasp: its wrench set in the coordinates where the metric is Euclidean.

use std::sync::OnceLock;

use crate::convex::expanding_polytope::{DEFAULT_MAX_FACETS, Limits, POLISH};
use crate::error::{Error, Result};
use crate::grasp::wrench_norm::Metric;
use crate::grasp::wrench_rounding::of_contacts;
use crate::grasp::{Grasp, REPRESENTABLE, Wrench};
use crate::quality::result::QualityOptions;
use crate::tolerances::{QUALITY_RTOL, QUALITY_RTOL_OF_CONES, ROUNDED_QUOTIENT};
use crate::wrench_set::{Criterion, Support, WrenchSet};

/// Subgradient steps from a direction along which the set is thin.
const STEPS_DOWNHILL: usize = 40;

/// A wrench set in the coordinates where the metric is Euclidean.
#[derive(Debug, Clone)]
pub(crate) struct QualityQuery<'a, const D: usize> {
    pub(crate) grasp: &'a Grasp<D>,
    pub(crate) set: WrenchSet<D>,
    pub(crate) metric: Metric<D>,
    /// Both physical and in those coordinates.
    pub(crate) center: Option<(Wrench<D>, Wrench<D>)>,
    pub(crate) limits: Limits,
    /// No wrench is longer: what counts as large.
    pub(crate) scale: f64,
    /// [`Self::rounding`], once it is asked for: most candidates of a search are rejected before.
    pub(crate) rounding: OnceLock<(Vec<Wrench<D>>, Wrench<D>)>,
}

impl<'a, const D: usize> QualityQuery<'a, D> {
    pub(crate) fn new(grasp: &'a Grasp<D>, options: &QualityOptions<D>) -> Result<Self> {
        options.check()?;
        let rtol =
            options.rtol.unwrap_or(if grasp.is_finite() { QUALITY_RTOL } else { QUALITY_RTOL_OF_CONES });
        let metric =
            options.metric.unwrap_or_else(|| Metric::from_length_scale(grasp.options().length_scale));
        let set = WrenchSet::in_metric(grasp, options.criterion, &metric);
        let center = options.external_wrench.map(|center| (center, metric.to_euclidean(&center)));
        // Of the union, whose polytopes are small, polishing gains nothing.
        let polish = if options.criterion == Criterion::Max { POLISH } else { 0 };
        let max_facets = options.max_facets.unwrap_or(DEFAULT_MAX_FACETS);
        let limits = Limits { max_facets, polish, ..Limits::new(rtol) };
        let longest = set.longest();
        let reason = |norm: f64| {
            let size = if norm.is_finite() { format!("of norm {norm:e}") } else { "beyond float64".into() };
            format!("wrenches {size} lie outside 1e-140 to 1e140; check the units")
        };
        if !REPRESENTABLE.contains(&longest) {
            return Err(match options.metric {
                Some(_) => Error::input("metric", reason(longest)),
                None => Error::grasp("length_scale", reason(longest)),
            });
        }
        let weight = center.map_or(0.0, |(_, center)| center.norm());
        if let Some((given, _)) = center
            && weight >= REPRESENTABLE.end
        {
            let reason = format!("{:?} is longer than 1e140; check the units", given.as_slice());
            return Err(Error::input("external_wrench", reason));
        }
        let scale = longest + weight;
        Ok(Self { grasp, set, metric, center, limits, scale, rounding: OnceLock::new() })
    }

    /// What rounding may have done to each component of a contact's wrenches, and of the center.
    pub(crate) fn rounding(&self) -> &(Vec<Wrench<D>>, Wrench<D>) {
        let magnitude = |sizes: &Wrench<D>| self.metric.magnitude(sizes);
        let of_center = |(center, _): (Wrench<D>, _)| magnitude(&center.abs()) * ROUNDED_QUOTIENT;
        self.rounding.get_or_init(|| {
            (of_contacts(self.grasp, magnitude), self.center.map_or_else(Wrench::zeros, of_center))
        })
    }

    pub(crate) fn support(&self, z: &Wrench<D>) -> Support<D> {
        let support = self.set.support(z);
        let Some((_, center)) = &self.center else { return support };
        let origin = Support { value: 0.0, wrench: Wrench::zeros() };
        let Support { value, wrench } = if support.value < 0.0 { origin } else { support };
        Support { value: value + z.dot(center), wrench: wrench + center }
    }

    /// `p(z)` alone, for unit `z`.
    pub(crate) fn value(&self, z: &Wrench<D>) -> f64 {
        let value = self.set.value(z);
        self.center.map_or(value, |(_, center)| value.max(0.0) + z.dot(&center))
    }

    /// The least support value met on the way downhill from a direction, and where. No value is below `lower`.
    pub(crate) fn least_downhill(&self, from: &Wrench<D>, lower: f64) -> (f64, Wrench<D>) {
        let (mut best, mut z) = (self.support(from), *from);
        let mut drop = best.value - lower;
        for _ in 0..STEPS_DOWNHILL {
            let Some(next) = best.downhill(&z, best.value - drop) else { break };
            let there = self.support(&next);
            // A step that leads uphill was too long.
            if there.value < best.value {
                (best, z) = (there, next);
            } else {
                drop *= 0.5;
            }
        }
        (best.value, z)
    }

    /// Relative width of the bracket that counts as converged.
    pub(crate) fn rtol(&self) -> f64 {
        self.limits.rtol
    }
}
