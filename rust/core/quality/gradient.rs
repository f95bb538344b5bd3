//! The gradient of `epsilon` with respect to contact positions, normals, friction and limits, by the envelope theorem.
//!
//! At a unique minimiser `z* = (a, b)` (as a functional on physical wrenches), `epsilon = p(z*)` changes as the
//! nearest boundary wrench does while `z*` stays. That wrench is `sum_i G_i F_i` with `F_i` a convex combination
//! of contact i's extreme forces that are active at `z*`. With `F_i` in world axes, `tau_i` its torsion and
//! `v_i = a + b x (r_i - origin)`,
//!
//! - `d epsilon / d r_i = F_i x b`;
//! - `d epsilon / d n_i = (F_i x v_i) x n_i + tau_i (b - n_i (n_i . b))`, the frame turning with the normal by
//!   the smallest rotation;
//! - `n_i . (F_i x v_i)` by rad that the frame spins about the normal, which edges feel and true cones do not;
//! - `d epsilon / d mu_i = F_i^t . v_i / mu_i`, with `F_i^t` the tangential part of `F_i`;
//! - `d epsilon / d f^U_i = (F_i . v_i + tau_i n_i . b) / f^U_i`, because all extreme forces grow with their limit.
//!
//! Outside, `epsilon` is minus the distance of the origin from the set, and `z*` points away from the nearest wrench: the
//! same formulas hold with the forces of the union.

use nalgebra::Vector3;

use crate::error::{Error, Result};
use crate::grasp::contact::{ContactForce, ForceModel};
use crate::grasp::derivative::ForceDerivative;
use crate::grasp::wrench::split;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::quality::active_forces::ActiveForces;
use crate::quality::query::QualityQuery;
use crate::quality::result::{Quality, QualityOptions, QualityWorkspace};

/// How `epsilon` changes as contacts change.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// Of each contact: change of `epsilon` by m of displacement (planar: the z component is zero).
    pub positions: Vec<Vector3<f64>>,
    /// Of each contact: change of `epsilon` by rad that its normal turns; orthogonal to the normal.
    pub normals: Vec<Vector3<f64>>,
    /// Of each contact: change of `epsilon` by rad that its frame spins about its normal; zero for true cones.
    pub spins: Vec<f64>,
    /// Of each contact: change of `epsilon` by its friction coefficient, as it is before the friction margin; to the right
    /// where that is zero. Zero where extreme forces are given.
    pub friction: Vec<f64>,
    /// Of each contact: change of `epsilon` by N of its limit. Zero where extreme forces are given.
    pub max_normal_force: Vec<f64>,
    /// Whether `epsilon` is differentiable here, as far as rounding can tell. Where several directions are equally bad, or
    /// several forces reach the same boundary wrench and would change otherwise, this is one element of the
    /// subdifferential.
    pub unique: bool,
}

impl<const D: usize> Grasp<D> {
    /// The gradient of the `epsilon` that [`Self::quality_with`] computes with the same options.
    ///
    /// It fails where a derivative exceeds `float64`.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, Grasp, QualityOptions, QualityWorkspace};
    /// use nalgebra::{SVector, Vector3};
    ///
    /// let fingers = [(-1.0, 0.1), (1.0, 0.0)].map(|(x, y): (f64, f64)| {
    ///     Contact::new(Vector3::new(x, y, 0.0), Vector3::new(-x, 0.0, 0.0)).friction(0.5)
    /// });
    /// let options = QualityOptions::new(Criterion::Max);
    /// let gradient = Grasp::<3>::new(&fingers)?.gradient(&options, &mut QualityWorkspace::default())?;
    /// // Bringing the fingers in line is better, and no common translation in y changes that.
    /// assert!(gradient.positions[0].y < gradient.positions[1].y);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn gradient(
        &self,
        options: &QualityOptions<D>,
        workspace: &mut QualityWorkspace<D>,
    ) -> Result<Gradient> {
        self.quality_and_gradient(options, workspace).map(|(_, gradient)| gradient)
    }

    /// The answer of [`Self::quality_with`] together with its gradient: at little more than the price of the answer.
    pub fn quality_and_gradient(
        &self,
        options: &QualityOptions<D>,
        workspace: &mut QualityWorkspace<D>,
    ) -> Result<(Quality<D>, Gradient)> {
        let (quality, _, gradient) = QualityQuery::new(self, options)?.differentiated(workspace)?;
        Ok((quality, gradient))
    }
}

impl<const D: usize> QualityQuery<'_, D> {
    /// The answer, the same with a sharper worst direction, and the gradient there.
    pub(crate) fn differentiated(
        &self,
        workspace: &mut QualityWorkspace<D>,
    ) -> Result<(Quality<D>, Quality<D>, Gradient)> {
        let quality = self.answer(workspace);
        let (sharp, rival) = self.sharpened(&quality, workspace);
        let active = ActiveForces::at(self, &sharp);
        let unique = sharp.rho != 0.0 && !rival && active.unique;
        let gradient = Gradient::of_forces(self.grasp, &active.functional, &active.forces, unique);
        interrupt::check()?;
        gradient.check().map(|()| (quality, sharp, gradient))
    }
}

impl Gradient {
    /// How the wrench of these forces changes along `functional`, as its contacts do.
    pub(crate) fn of_forces<const D: usize>(
        grasp: &Grasp<D>,
        functional: &Wrench<D>,
        forces: &[ContactForce],
        unique: bool,
    ) -> Self {
        let (a, b) = split(functional);
        let count = grasp.num_contacts();
        let mut gradient = Self {
            positions: Vec::with_capacity(count),
            normals: Vec::with_capacity(count),
            spins: Vec::with_capacity(count),
            friction: Vec::with_capacity(count),
            max_normal_force: Vec::with_capacity(count),
            unique,
        };
        for ((contact, frame), force) in grasp.contacts().iter().zip(grasp.frames()).zip(forces) {
            let change = ForceDerivative::of(grasp, gradient.spins.len(), force, functional);
            gradient.positions.push(change.position);
            gradient.normals.push(change.normal);
            gradient.spins.push(change.spin);
            let v = a + b.cross(&(contact.position - grasp.options().origin));
            let along = frame.tr_mul(&v);
            let tangential = force[1] * along[1] + force[2] * along[2];
            let torsional = force[3] * contact.normal.dot(&b);
            let by_friction = match contact.forces {
                ForceModel::Extreme(_) => 0.0,
                _ if contact.friction > 0.0 => tangential / contact.friction,
                // Beside torsion, the first friction is felt in its second power.
                _ if torsional > 0.0 => 0.0,
                _ => force[0] * contact.slope_of_first_friction(D == 3, &along),
            };
            let by_limit = match contact.forces {
                ForceModel::Extreme(_) => 0.0,
                _ => (force[0] * along[0] + tangential + torsional) / contact.max_normal_force,
            };
            gradient.friction.push(by_friction / grasp.options().friction_margin);
            gradient.max_normal_force.push(by_limit);
        }
        gradient
    }

    pub(crate) fn check(&self) -> Result<()> {
        let vectors = self.positions.iter().chain(&self.normals).flatten();
        let numbers = self.spins.iter().chain(&self.friction).chain(&self.max_normal_force);
        if vectors.chain(numbers).all(|x| x.is_finite()) {
            return Ok(());
        }
        Err(Error::grasp("positions", "the gradient of epsilon lies beyond float64; check the units"))
    }
}
