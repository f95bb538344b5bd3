//! Grasp quality: `rho = -min_{|z| = 1} p(z)` with its bracket (Eqs. 16 to 19, Propositions 1 and 2).
//!
//! The sign is the paper's: negative means force closure, smaller is better. Inside, the expanding polytope
//! brackets the radius; outside, Wolfe's algorithm brackets the distance. Outside, the Minkowski sum is no
//! nearer than the union (every point of it is a sum of wrenches on the far side of the separating plane), so
//! `rho_max = rho_sum` there and the union serves both.

use std::cmp::Ordering;

use crate::closure::{Closure, classify};
use crate::error::{Error, Result};
use crate::grasp::{Grasp, REPRESENTABLE, Wrench};
use crate::interrupt;
use crate::metric::Metric;
use crate::nearest_point::nearest_point;
use crate::polytope::{Expansion, Limits, NOISE, Polytope, Radius};
use crate::wrench_set::{Criterion, Support, WrenchSet};

/// How quality is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QualityOptions<const D: usize> {
    /// Which measure of the overall contact force is limited.
    pub criterion: Criterion,
    /// Relative width of the bracket; `None` for 1e-9, or 1e-6 where a contact has its true cone.
    pub rtol: Option<f64>,
    /// An external wrench that acts all the time, such as the weight: `epsilon` is then the largest disturbance
    /// that can be resisted on top of it. The set includes the origin.
    pub center: Option<Wrench<D>>,
    /// The norm of wrenches; `None` for the grasp's length scale.
    pub metric: Option<Metric<D>>,
    /// Stop as soon as `epsilon` is known to lie below this value.
    pub stop_below: f64,
}

impl<const D: usize> QualityOptions<D> {
    /// The default questions about a criterion.
    pub fn new(criterion: Criterion) -> Self {
        Self { criterion, rtol: None, center: None, metric: None, stop_below: f64::NEG_INFINITY }
    }

    /// Refuses a tolerance outside (0, 1) and a center that is not finite.
    pub fn check(&self) -> Result<()> {
        if let Some(rtol) = self.rtol
            && !(rtol > 0.0 && rtol < 1.0)
        {
            return Err(Error::input("rtol", format!("{rtol} must lie between 0 and 1")));
        }
        if let Some(center) = &self.center
            && center.iter().any(|x| !x.is_finite())
        {
            return Err(Error::input("center", format!("{:?} is not finite", center.as_slice())));
        }
        Ok(())
    }
}

/// The quality of a grasp, with its certificate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality<const D: usize> {
    /// `-epsilon`: negative for force closure, zero for partial closure, positive outside.
    pub rho: f64,
    /// `lower <= rho`.
    pub lower: f64,
    /// `rho <= upper`.
    pub upper: f64,
    /// Whether the bracket is as narrow as asked for.
    pub converged: bool,
    /// The class of the grasp itself, whatever the `center`.
    pub closure: Closure,
    /// The worst direction, a physical wrench of unit norm: a disturbance is hardest to resist along its
    /// opposite. Where `rho >= 0` the grasp exerts no wrench that points along it.
    pub direction: Wrench<D>,
    /// The nearest boundary wrench, `-rho * direction`.
    pub wrench: Wrench<D>,
    /// Calls of the support oracle.
    pub supports: usize,
    /// Facets made on the way; zero where the answer did not need a polytope.
    pub facets: usize,
    /// The norm in which all this is measured.
    pub metric: Metric<D>,
}

/// The memory of quality computations, to be reused: after a few grasps it no longer allocates.
#[derive(Debug, Clone)]
pub struct QualityWorkspace<const D: usize> {
    pub(crate) polytope: Polytope<D>,
}

impl<const D: usize> Default for QualityWorkspace<D> {
    fn default() -> Self {
        Self { polytope: Polytope::new() }
    }
}

impl<const D: usize> Grasp<D> {
    /// The class of Propositions 1 and 2.
    pub fn closure(&self) -> Result<Closure> {
        let verdict = classify(self, &mut Polytope::new());
        interrupt::check().map(|()| verdict.closure)
    }

    /// Quality by a criterion, to the default tolerance.
    ///
    /// ```
    /// use graspforce::{Closure, Contact, Criterion, Grasp};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
    ///     Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5)
    /// });
    /// let quality = Grasp::<3>::new(&fingers)?.quality(Criterion::Max)?;
    /// assert_eq!(quality.closure, Closure::Force);
    /// assert!((quality.rho + 1.0 / 3.0_f64.sqrt()).abs() < 1e-9);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn quality(&self, criterion: Criterion) -> Result<Quality<D>> {
        self.quality_with(&QualityOptions::new(criterion), &mut QualityWorkspace::default())
    }

    /// Quality by all options, in reused memory.
    pub fn quality_with(
        &self,
        options: &QualityOptions<D>,
        workspace: &mut QualityWorkspace<D>,
    ) -> Result<Quality<D>> {
        let quality = Question::new(self, options)?.answer(&mut workspace.polytope);
        interrupt::check().map(|()| quality)
    }
}

/// What looking at a grasp with an incumbent in mind yields.
pub(crate) enum Examination<const D: usize> {
    /// `epsilon <= upper`, too little; along the unit `direction` (in Euclidean coordinates).
    Below { upper: f64, direction: Wrench<D> },
    /// The quality, as if there were no incumbent.
    Answer(Box<Quality<D>>),
}

/// A wrench set in the coordinates where the metric is Euclidean.
pub(crate) struct Question<'a, const D: usize> {
    pub(crate) grasp: &'a Grasp<D>,
    pub(crate) set: WrenchSet<D>,
    pub(crate) metric: Metric<D>,
    pub(crate) center: Option<Wrench<D>>,
    limits: Limits,
    /// Length of the longest wrench: what counts as large.
    pub(crate) scale: f64,
}

impl<'a, const D: usize> Question<'a, D> {
    pub(crate) fn new(grasp: &'a Grasp<D>, options: &QualityOptions<D>) -> Result<Self> {
        options.check()?;
        let rtol = options.rtol.unwrap_or(if grasp.is_finite() { 1e-9 } else { 1e-6 });
        let set = WrenchSet::new(grasp, options.criterion);
        let metric =
            options.metric.unwrap_or_else(|| Metric::from_length_scale(grasp.options().length_scale));
        let limits = Limits { stop_below: options.stop_below, ..Limits::new(rtol) };
        let mut question = Self { grasp, set, metric, center: options.center, limits, scale: 0.0 };
        question.scale = question.largest_wrench();
        if !REPRESENTABLE.contains(&question.scale) {
            let reason =
                format!("wrenches of norm {:e} are beyond what can be computed with", question.scale);
            return Err(Error::grasp("length_scale", reason));
        }
        Ok(question)
    }

    fn largest_wrench(&self) -> f64 {
        let axes = (0..D).map(|axis| Wrench::<D>::from_fn(|row, _| f64::from(u8::from(row == axis))));
        axes.flat_map(|axis| [axis, -axis]).map(|z| self.support(&z).wrench.norm()).fold(0.0, f64::max)
    }

    pub(crate) fn support(&self, z: &Wrench<D>) -> Support<D> {
        let functional = self.metric.functional(z);
        let Support { mut value, wrench } = self.set.support(&functional);
        let mut wrench = self.metric.to_euclidean(&wrench);
        if let Some(center) = &self.center {
            if value < 0.0 {
                (value, wrench) = (0.0, Wrench::zeros());
            }
            value += functional.dot(center);
            wrench += self.metric.to_euclidean(center);
        }
        Support { value, wrench }
    }

    /// `p(z)` alone, for unit `z`.
    pub(crate) fn value(&self, z: &Wrench<D>) -> f64 {
        let functional = self.metric.functional(z);
        let value = self.set.value(&functional);
        self.center.map_or(value, |center| value.max(0.0) + functional.dot(&center))
    }

    /// Relative width of the bracket that counts as converged.
    pub(crate) fn rtol(&self) -> f64 {
        self.limits.rtol
    }

    pub(crate) fn answer(&self, polytope: &mut Polytope<D>) -> Quality<D> {
        let first = polytope.expand(self.first_size(), &self.limits, |z| self.support(z));
        self.conclude(first, polytope)
    }

    /// The answer, unless `epsilon` turns out to lie below `stop_below` on the way.
    pub(crate) fn examine(&self, stop_below: f64, polytope: &mut Polytope<D>) -> Examination<D> {
        let limits = Limits { stop_below, ..self.limits };
        let first = polytope.expand(self.first_size(), &limits, |z| self.support(z));
        match first {
            Expansion::Pierced { upper, direction } if upper < stop_below => {
                Examination::Below { upper, direction }
            }
            Expansion::Radius(Radius { converged: false, upper, direction, .. }) if upper < stop_below => {
                Examination::Below { upper, direction }
            }
            _ => Examination::Answer(Box::new(self.conclude(first, polytope))),
        }
    }

    /// A set that holds a ball of a thousandth of its size holds the origin well inside: the usual case.
    fn first_size(&self) -> f64 {
        1e-3 * self.scale
    }

    fn conclude(&self, first: Expansion<D>, polytope: &mut Polytope<D>) -> Quality<D> {
        let size = self.first_size();
        if let (Expansion::Radius(radius), None) = (first, self.center) {
            return self.inside(&radius, Closure::Force);
        }
        let verdict = classify(self.grasp, polytope);
        let closure = verdict.closure;
        match (first, self.center) {
            (Expansion::Radius(radius), _) => self.inside(&radius, closure),
            (Expansion::Pierced { direction, .. }, Some(_)) => {
                match self.small_radius(size, 1e-12 * self.scale, polytope) {
                    Ok(radius) => self.inside(&radius, closure),
                    Err(_) => self.outside(closure, &direction),
                }
            }
            (Expansion::Pierced { .. }, None) if closure == Closure::Force => {
                let radius = self.small_radius(size, 1e-18 * self.scale, polytope);
                self.inside(&radius.unwrap_or_else(|unresolved| unresolved), closure)
            }
            (Expansion::Pierced { .. }, None) => {
                self.outside(closure, &self.metric.unit_of_functional(&verdict.direction))
            }
        }
    }

    /// After [`Self::answer`] found the origin inside: whether another direction is as bad.
    pub(crate) fn has_rival(&self, polytope: &Polytope<D>, quality: &Quality<D>) -> bool {
        polytope
            .has_rival(-quality.rho, &self.metric.to_euclidean(&quality.direction), |z| self.support(z).value)
    }

    /// The radius of a set that is thin for its size: from ever smaller simplices. Where even a `negligible` one
    /// does not fit, what is known of it.
    fn small_radius(
        &self,
        mut size: f64,
        negligible: f64,
        polytope: &mut Polytope<D>,
    ) -> std::result::Result<Radius<D>, Radius<D>> {
        loop {
            match polytope.expand(size, &self.limits, |z| self.support(z)) {
                Expansion::Radius(radius) => return Ok(radius),
                Expansion::Pierced { upper, direction } => {
                    size = 1e-3 * size.min(upper);
                    // Not greater, rather than less: a size that is no number ends the search, too.
                    if size.partial_cmp(&negligible) != Some(Ordering::Greater) {
                        let upper = upper.max(0.0);
                        return Err(Radius {
                            lower: 0.0,
                            upper,
                            direction,
                            converged: false,
                            supports: 0,
                            facets: 0,
                        });
                    }
                }
            }
        }
    }

    fn inside(&self, radius: &Radius<D>, closure: Closure) -> Quality<D> {
        let direction = self.metric.to_physical(&radius.direction);
        Quality {
            rho: -radius.upper,
            lower: -radius.upper,
            upper: -radius.lower,
            converged: radius.converged,
            closure,
            direction,
            wrench: direction * radius.upper,
            supports: radius.supports,
            facets: radius.facets,
            metric: self.metric,
        }
    }

    /// The distance of the origin from the set; `z` witnesses that the origin is not inside.
    fn outside(&self, closure: Closure, z: &Wrench<D>) -> Quality<D> {
        if self.center.is_none() && closure == Closure::Partial {
            return self.at_distance(0.0, 0.0, z, closure, (0, true));
        }
        let nearest = nearest_point(self.limits.rtol.min(1e-9), 1e-12 * self.scale, |z| self.support(z));
        if self.center.is_some() && nearest.upper <= 1e-12 * self.scale {
            return self.at_distance(0.0, 0.0, z, closure, (nearest.supports, true));
        }
        // A distance that is all rounding has no direction of its own.
        let z = if nearest.upper > NOISE * self.scale { nearest.point / -nearest.upper } else { *z };
        self.at_distance(
            nearest.upper,
            nearest.lower.max(0.0),
            &z,
            closure,
            (nearest.supports, nearest.converged),
        )
    }

    fn at_distance(
        &self,
        rho: f64,
        lower: f64,
        z: &Wrench<D>,
        closure: Closure,
        (supports, converged): (usize, bool),
    ) -> Quality<D> {
        let direction = self.metric.to_physical(z);
        Quality {
            rho,
            lower,
            upper: rho,
            converged,
            closure,
            direction,
            wrench: direction * -rho,
            supports,
            facets: 0,
            metric: self.metric,
        }
    }
}
