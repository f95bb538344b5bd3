//! The worst direction of an answer, as exact as rounding allows: gradients need it more exactly than the bracket.

use crate::convex::expanding_polytope::{Limits, Polytope, Progress, Thinnest};
use crate::grasp::Wrench;
use crate::quality::answer::FACETS_BEFORE_SYMMETRY;
use crate::quality::local_minima::LocalMinima;
use crate::quality::query::QualityQuery;
use crate::quality::result::{Quality, QualityWorkspace};
use crate::tolerances::{MINIMISER_RTOL, MINIMISER_RTOL_OF_CONES, RIVAL_DIRECTION, RIVAL_RADIUS};

/// Starts of Newton's method at most.
const MOST_STARTS: usize = 32;

impl<const D: usize> QualityQuery<'_, D> {
    /// After [`Self::answer`]: the same answer with a worst direction to [`MINIMISER_RTOL`], and whether another direction
    /// is as bad.
    pub(crate) fn sharpened(
        &self,
        quality: &Quality<D>,
        workspace: &mut QualityWorkspace<D>,
    ) -> (Quality<D>, bool) {
        if let Some(found) = self.least_local_minimum(quality, workspace) {
            return found;
        }
        // A true cone has no exact minimiser.
        let rtol = if self.grasp.is_finite() { MINIMISER_RTOL } else { MINIMISER_RTOL_OF_CONES };
        let limits = Limits { rtol: rtol.min(self.limits.rtol), ..self.limits };
        let narrow = limits.rtol * quality.rho.abs();
        // Outside, a bracket that rounding widened by some tolerances hides a search that ended as exactly.
        let widened =
            if quality.rho > 0.0 { (2.0 * self.uncertain().norm()).min(10.0 * narrow) } else { 0.0 };
        let narrow = quality.upper - quality.lower <= narrow + widened;
        let sharp = if narrow {
            *quality
        } else if let Some(grown) = self.grown(quality, &limits, workspace) {
            grown
        } else {
            Self { limits, ..self.clone() }.answer(workspace)
        };
        let sharp = self.next_local_minimum(sharp);
        // Where symmetries gave the answer, the images of the minimiser are as bad.
        let rival = workspace.symmetric || (sharp.rho < 0.0 && self.has_rival(&workspace.polytope, &sharp));
        (sharp, rival)
    }

    /// Of true cones: the least local minimum near the facets that the bracket leaves, and whether another is as low.
    /// `None` where the search fails from one of them.
    fn least_local_minimum(
        &self,
        quality: &Quality<D>,
        workspace: &QualityWorkspace<D>,
    ) -> Option<(Quality<D>, bool)> {
        if self.grasp.is_finite() || quality.rho >= 0.0 || !quality.converged || workspace.symmetric {
            return None;
        }
        let epsilon = -quality.lower;
        let mut minima = LocalMinima::new(self, epsilon)?;
        let start = self.metric.to_euclidean(&quality.direction);
        let mut found = vec![minima.near(&start)?];
        let mut starts = vec![start];
        for normal in workspace.polytope.normals_within(epsilon * (1.0 + RIVAL_RADIUS)) {
            let near = |other: &Wrench<D>| (normal - other).norm() <= RIVAL_DIRECTION;
            if found.iter().any(|(_, z)| near(z)) || starts.iter().any(near) {
                continue;
            }
            if starts.len() >= MOST_STARTS {
                return None;
            }
            found.push(minima.near(&normal)?);
            starts.push(normal);
        }
        let &(least, z) = found.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let as_low = least * (1.0 + RIVAL_RADIUS);
        let rival =
            found.iter().any(|(value, other)| *value <= as_low && (other - z).norm() > RIVAL_DIRECTION);
        Some((self.at_minimum(quality, least, &z), rival))
    }

    /// Of true cones: the answer at the local minimum beside its worst direction, where Newton's method finds that.
    fn next_local_minimum(&self, sharp: Quality<D>) -> Quality<D> {
        if self.grasp.is_finite() || sharp.rho >= 0.0 {
            return sharp;
        }
        let z = self.metric.to_euclidean(&sharp.direction);
        let found = LocalMinima::new(self, -sharp.rho).and_then(|mut minima| minima.near(&z));
        match found {
            Some((value, minimum)) if (minimum - z).norm() <= RIVAL_DIRECTION => {
                self.at_minimum(&sharp, value, &minimum)
            }
            _ => sharp,
        }
    }

    /// The polytope that gave the answer, grown on; `None` where something else gave it, or it grows too large.
    fn grown(
        &self,
        quality: &Quality<D>,
        limits: &Limits,
        workspace: &mut QualityWorkspace<D>,
    ) -> Option<Quality<D>> {
        let polytope = &mut workspace.polytope;
        let gave = self.metric.to_physical(&polytope.thinnest().direction) == quality.direction;
        if quality.rho >= 0.0 || workspace.symmetric || !gave {
            return None;
        }
        let limits = Limits { max_facets: FACETS_BEFORE_SYMMETRY.min(limits.max_facets / 2), ..*limits };
        let progress = polytope.grow(&limits, &mut |z| self.support(z));
        let Thinnest { upper, direction, .. } = *polytope.thinnest();
        matches!(progress, Progress::Done(_)).then(|| self.at_minimum(quality, upper, &direction))
    }

    /// The answer with a minimiser, and the support there.
    fn at_minimum(&self, quality: &Quality<D>, epsilon: f64, z: &Wrench<D>) -> Quality<D> {
        let (rho, direction) = (-epsilon, self.metric.to_physical(z));
        Quality { rho, lower: rho, upper: rho, direction, wrench: direction * epsilon, ..*quality }
    }

    /// After [`Self::answer`] found the origin inside: whether another direction is as bad.
    fn has_rival(&self, polytope: &Polytope<D>, quality: &Quality<D>) -> bool {
        polytope.has_rival(-quality.lower, &self.metric.to_euclidean(&quality.direction), |z| self.value(z))
    }
}
