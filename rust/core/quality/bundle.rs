//! The most critical directions of a grasp, each with its support and gradient.
//!
//! `epsilon = min_{|z| = 1} p(z)` has a kink where several directions are equally bad. Then it falls by the steepest of
//! their gradients: along a change `h` of the contacts, its derivative is the least `g . h` over the critical directions.
//! Directions that are nearly as bad tell where the next kink is. Of a polyhedral set they are normals of the facets nearest
//! to the origin. A symmetric grasp has the images of its worst direction besides.
//!
//! At a fixed `z`, the support `p(z)` of the moved grasp bounds its `epsilon` from above. It is differentiable where one
//! force of each contact reaches the supporting hyperplane. Elsewhere the gradient is that of the convex combination whose
//! wrench is nearest to `p(z) z`: where `p` has a local minimum at `z`, that of the minimum.

use std::f64::consts::TAU;

use crate::convex::expanding_polytope::nearest_facets::FacetSearch;
use crate::error::Result;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::quality::active_forces::ActiveForces;
use crate::quality::gradient::Gradient;
use crate::quality::local_minima::LocalMinima;
use crate::quality::query::QualityQuery;
use crate::quality::result::{Quality, QualityOptions, QualityWorkspace};
use crate::quality::symmetry::Symmetries;
use crate::tolerances::{ACTIVE_FACES, NEAR_SYMMETRY, QUALITY_RTOL, RIVAL_RADIUS};

/// The support beyond a facet, relative to its distance, where contacts have true cones: no facet is one of a smooth set.
const BEYOND_FACET_OF_CONES: f64 = 1e-2;

/// Directions that are nearer to each other are normals of one facet, rounded.
const APART: f64 = 1e-6;

/// The same where contacts have true cones: supports of a smooth set hardly differ over so small an angle.
const APART_OF_CONES: f64 = 0.1;

/// Facets that the polytope makes for a bundle at most, beside those of the answer: some milliseconds.
const MORE_FACETS: usize = 20_000;

/// The same of true cones, whose smooth parts no number of facets resolves.
const MORE_FACETS_OF_CONES: usize = 4_000;

/// A direction along which the grasp is weak.
#[derive(Debug, Clone, PartialEq)]
pub struct CriticalDirection<const D: usize> {
    /// `p(z)`: no less than `epsilon`.
    pub value: f64,
    /// A physical wrench of unit norm, as [`Quality::direction`].
    pub direction: Wrench<D>,
    /// How `p(z)` changes with the contacts at this direction: one element where it has a kink. It is unique where no
    /// other forces exert the nearest wrench of the face.
    pub gradient: Gradient,
}

impl<const D: usize> Grasp<D> {
    /// The answer of [`Self::quality_and_gradient`] together with the most critical directions, least support first: at most
    /// `count`, and at least the worst one. A grasp that is not force closure has that one alone.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, Grasp, QualityOptions, QualityWorkspace};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
    ///     Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5)
    /// });
    /// let (grasp, options) = (Grasp::<3>::new(&fingers)?, QualityOptions::new(Criterion::Max));
    /// let (quality, _, bundle) = grasp.quality_and_bundle(&options, 8, &mut QualityWorkspace::default())?;
    /// // Symmetric: four directions are equally bad.
    /// let worst = bundle.iter().filter(|critical| critical.value < -quality.rho + 1e-9);
    /// assert_eq!(worst.count(), 4);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn quality_and_bundle(
        &self,
        options: &QualityOptions<D>,
        count: usize,
        workspace: &mut QualityWorkspace<D>,
    ) -> Result<(Quality<D>, Gradient, Vec<CriticalDirection<D>>)> {
        let query = QualityQuery::new(self, options)?;
        let (quality, sharp, gradient) = query.differentiated(workspace)?;
        let worst = query.metric.to_euclidean(&sharp.direction);
        let value = query.value(&worst);
        let mut bundle = Vec::new();
        if sharp.rho < 0.0 {
            for (value, z) in query.weak_directions((value, worst), count, workspace) {
                bundle.push(query.critical(value, &z, &sharp)?);
            }
            bundle.sort_by(|a, b| a.value.total_cmp(&b.value));
        } else {
            bundle.push(CriticalDirection { value, direction: sharp.direction, gradient: gradient.clone() });
        }
        interrupt::check().map(|()| (quality, gradient, bundle))
    }
}

impl<const D: usize> QualityQuery<'_, D> {
    /// After [`Self::sharpened`] gave the `worst` direction: it, and others that are nearly as bad, with their supports.
    fn weak_directions(
        &self,
        worst: (f64, Wrench<D>),
        count: usize,
        workspace: &mut QualityWorkspace<D>,
    ) -> Vec<(f64, Wrench<D>)> {
        let (rtol, apart, more_facets) = if self.grasp.is_finite() {
            (QUALITY_RTOL, APART, MORE_FACETS)
        } else {
            (BEYOND_FACET_OF_CONES, APART_OF_CONES, MORE_FACETS_OF_CONES)
        };
        let mut found = vec![worst];
        if workspace.symmetric {
            for image in self.images(&worst, count) {
                if found.len() < count && found.iter().all(|(_, known)| (known - image).norm() > apart) {
                    found.push((self.value(&image), image));
                }
            }
        }
        let search = FacetSearch { count, rtol, apart, more_facets };
        workspace.polytope.nearest_facets(&search, &mut found, |z| self.support(z));
        self.move_to_minima(&mut found);
        found
    }

    /// Of true cones: moves directions to the local minima next to them, unless another direction is as near to those.
    fn move_to_minima(&self, found: &mut [(f64, Wrench<D>)]) {
        if self.grasp.is_finite() {
            return;
        }
        let Some(mut minima) = LocalMinima::new(self, found[0].0) else { return };
        for at in 1..found.len() {
            let Some(minimum) = minima.near(&found[at].1) else { continue };
            let mut others = found.iter().enumerate().filter(|(other, _)| *other != at);
            if others.all(|(_, (_, other))| (other - minimum.1).norm() > APART_OF_CONES) {
                found[at] = minimum;
            }
        }
    }

    /// What the symmetries of the set make of its worst direction.
    fn images(&self, &(value, z): &(f64, Wrench<D>), count: usize) -> Vec<Wrench<D>> {
        let symmetries = Symmetries::of(self, NEAR_SYMMETRY * value);
        let Some(rotation) = &symmetries.rotation else {
            return symmetries.maps.iter().map(|symmetry| (symmetry.map * z).normalize()).collect();
        };
        // `e^{tX} = 1 + sin(t) X + (1 - cos(t)) X^2` for the generator of rotations.
        let (once, twice) = (rotation.map * z, rotation.map * (rotation.map * z));
        let turned = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
            (z + once * sin + twice * (1.0 - cos)).normalize()
        };
        (1..count).map(turned).collect()
    }

    /// The direction `z` with its gradient.
    fn critical(&self, value: f64, z: &Wrench<D>, worst: &Quality<D>) -> Result<CriticalDirection<D>> {
        let direction = self.metric.to_physical(z);
        let there = Quality { rho: -value, direction, wrench: direction * value, ..*worst };
        // Elsewhere than at a minimum, no force of the face exerts `p(z) z`: a wider face would be another's.
        let as_bad = value <= -worst.rho * (1.0 + RIVAL_RADIUS);
        let faces = if as_bad { &ACTIVE_FACES[..] } else { &ACTIVE_FACES[..1] };
        let active = ActiveForces::within(self, &there, faces);
        let gradient = Gradient::of_forces(self.grasp, &active.functional, &active.forces, active.unique);
        gradient.check()?;
        Ok(CriticalDirection { value, direction, gradient })
    }
}
