//! How least forces, and the distance from balance, change with contacts and wrench (envelope theorem).
//!
//! Least forces solve `sigma = min c(f)` subject to `sum_i G_i f_i = -w_ext` and cones that move with their contacts. With
//! the multiplier `z_b` of the balance and `f_i` kept in its frame,
//!
//! - `d sigma / d w_ext = -z_b`;
//! - `d sigma / d (contact i) = -d (z_b . G_i f_i) / d (contact i)`.
//!
//! The distance `D = |w_ext + sum_i G_i f_i|` of the nearest forces has the multiplier `-y` instead of `z_b`, where
//! `y = M (w_ext + sum_i G_i f_i) / D` in the metric `M`.
//!
//! - [`active_face`]: the least face of a friction cone that holds a force.
//! - [`uniqueness`]: whether these are derivatives, or one element of many.

mod active_face;
mod uniqueness;

use nalgebra::Vector3;

use crate::force::distributor::ForceDistributor;
use crate::force::gradient::uniqueness::{Faces, Value};
use crate::force::nearest::options::NearestOptions;
use crate::force::solution::Distribution;
use crate::grasp::contact::ContactForce;
use crate::grasp::derivative::ForceDerivative;
use crate::grasp::{Grasp, Wrench};
use crate::tolerances::AT_LIMIT;

/// How the least objective, or the distance from balance, changes as contacts move and the wrench changes.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceGradient<const D: usize> {
    /// Of each contact: change by m of displacement (planar: the z component is zero).
    pub positions: Vec<Vector3<f64>>,
    /// Of each contact: change by rad that its normal turns; orthogonal to the normal.
    pub normals: Vec<Vector3<f64>>,
    /// Of each contact: change by rad that its frame spins about its normal.
    pub spins: Vec<f64>,
    /// Change by the external wrench.
    pub external_wrench: Wrench<D>,
    /// Whether this is the derivative, as far as rounding can tell. Else it is one of several: there is a kink.
    pub unique: bool,
}

impl<const D: usize> ForceGradient<D> {
    /// That of a value whose multiplier of the balance is `dual`.
    fn new(grasp: &Grasp<D>, dual: &Wrench<D>, forces: &[ContactForce], unique: bool) -> Self {
        let derivatives =
            || forces.iter().enumerate().map(|(i, force)| ForceDerivative::of(grasp, i, force, dual));
        Self {
            positions: derivatives().map(|change| -change.position).collect(),
            normals: derivatives().map(|change| -change.normal).collect(),
            spins: derivatives().map(|change| -change.spin).collect(),
            external_wrench: -dual,
            unique,
        }
    }

    /// That of a value that does not change.
    fn zero(contacts: usize, unique: bool) -> Self {
        Self {
            positions: vec![Vector3::zeros(); contacts],
            normals: vec![Vector3::zeros(); contacts],
            spins: vec![0.0; contacts],
            external_wrench: Wrench::zeros(),
            unique,
        }
    }
}

impl<const D: usize> ForceDistributor<D> {
    /// The gradient of the objective of an answer of [`Self::solve`], or of [`Self::nearest`] with these options.
    ///
    /// For nearest forces that do not balance their wrench it is zero and not unique: their objective is that of another
    /// wrench.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, ForceDistributor, Grasp, Wrench};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)]
    ///     .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)));
    /// let distributor = ForceDistributor::new(&Grasp::<3>::new(&fingers)?, Criterion::Sum)?;
    /// let answer = distributor.solve(&mut distributor.workspace(), &Wrench::<3>::new(0.0, -1.0, 0.0))?;
    /// // Two newtons of normal force lift each newton of weight.
    /// assert!((distributor.gradient(&answer, None).external_wrench[1] + 2.0).abs() < 1e-12);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn gradient(
        &self,
        answer: &Distribution<D>,
        nearest: Option<&NearestOptions<D>>,
    ) -> ForceGradient<D> {
        let grasp = self.grasp();
        let value = Value::of(&self.problem, nearest.is_some_and(|options| options.limits));
        if !value.allows_residual() && !answer.balanced(grasp, self.held()) {
            return ForceGradient::zero(grasp.num_contacts(), false);
        }
        let faces = Faces::new(grasp, self.problem.bounds(), &answer.dual, answer, value);
        // Where no forces are needed, their sum and their maximum have a corner.
        let corner = answer.sigma == 0.0 && value.has_corner();
        let unique = !corner && faces.have_one_dual() && faces.have_one_gradient();
        ForceGradient::new(grasp, &answer.dual, &answer.forces, unique)
    }

    /// The gradient of the distance of an answer of [`Self::nearest`] with these options; zero where the forces balance.
    pub fn distance_gradient(
        &self,
        answer: &Distribution<D>,
        options: &NearestOptions<D>,
    ) -> ForceGradient<D> {
        let grasp = self.grasp();
        if answer.balanced(grasp, self.held()) {
            // Inside of what the contacts can exert; on its boundary there is a kink.
            let value = Value::of(&self.problem, options.limits);
            let inside = !options.limits || answer.sigma_max < 1.0 - AT_LIMIT;
            let faces = Faces::new(grasp, self.problem.bounds(), &answer.dual, answer, value);
            return ForceGradient::zero(grasp.num_contacts(), inside && faces.have_one_dual());
        }
        let metric = options.metric_of(grasp);
        let residual = metric.to_euclidean(&answer.residual);
        let dual = -metric.functional(&(residual / residual.norm()));
        let faces = Faces::new(grasp, self.problem.bounds(), &dual, answer, Value::Distance);
        ForceGradient::new(grasp, &dual, &answer.forces, faces.have_one_gradient())
    }

    /// The largest lower bound of the shares.
    pub(crate) fn held(&self) -> f64 {
        self.options().min_normal.iter().copied().fold(0.0, f64::max)
    }
}
