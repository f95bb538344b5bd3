//! Dynamic force distribution: contact forces that balance an external wrench with the least maximum or the
//! least sum of normalised normal forces (section 4, Eqs. 24 to 31).

use nalgebra::Vector3;

use crate::error::{Error, Result, digits};
use crate::force::slip_margin::{unused_cone, unused_friction};
use crate::grasp::contact::{ContactForce, ForceModel};
use crate::grasp::{Grasp, Wrench};
use crate::wrench_set::Criterion;
use crate::wrench_set::minkowski_sum::DEFAULT_MAX_POINTS;

/// How the linear program is solved. The answers agree; the work differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// The simplex method with implicit columns: no point of the wrench set is ever listed.
    #[default]
    Implicit,
    /// The paper's: all points of the wrench set listed offline, `z_b` of Eq. 26 by an interior-point solver
    /// online, and forces from the points on its hyperplane.
    Enumerated,
    /// The paper's reduction (section 4.2): offline, the points that sample wrenches need, completed until the
    /// origin is interior; online, the program over these alone. An answer that the whole set does not
    /// confirm is computed over the whole set.
    Reduced,
}

/// Options of a [`ForceDistributor`](crate::ForceDistributor).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DistributionOptions {
    /// How the linear program is solved.
    pub method: Method,
    /// Weight of the sum: the objective is `sigma_max + weight * sigma_sum`. Zero means
    /// the maximum alone and, among its optima, the least sum. Only with [`Criterion::Max`].
    pub weight: f64,
    /// Largest relative gap that counts as solved, above 0 and at most 1e-3; below 1e-11 it counts as 1e-11. Where doubles
    /// do not reach it, 32 digits decide.
    pub rtol: f64,
    /// Largest number of points that [`Method::Enumerated`] and [`Method::Reduced`] may list.
    pub max_points: u128,
    /// External wrenches that choose the points of [`Method::Reduced`]; none with other methods.
    pub samples: Vec<Vec<f64>>,
    /// Lower bounds `c_i >= 0` of the normalised normal forces `f_n / f_i^U`, one for each contact or one for all, so
    /// that no finger loses contact; empty for none. Only with [`Method::Implicit`], and only zero for contacts with
    /// [`ForceModel::Extreme`]. The forces are then not proportional to the wrench, even no wrench needs some,
    /// and in an [`Error::InfeasibleWrench`] the direction has
    /// `-w_ext . e > sum_i c_i max_h w_ih . e`.
    pub min_normal: Vec<f64>,
}

impl Default for DistributionOptions {
    fn default() -> Self {
        Self {
            method: Method::default(),
            weight: 0.0,
            rtol: 1e-9,
            max_points: DEFAULT_MAX_POINTS,
            samples: Vec::new(),
            min_normal: Vec::new(),
        }
    }
}

/// Least contact forces for one external wrench, with their certificate.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution<const D: usize> {
    /// Contact forces `f_i` as `[f_n, f_o, f_t, torsion]` in the contact frames, in N and N m.
    pub forces: Vec<ContactForce>,
    /// Normalised normal force of each contact: its share of its limit. With [`ForceModel::Extreme`] it is the
    /// sum of the coefficients of its extreme forces.
    pub shares: Vec<f64>,
    /// Value of the objective that was minimised.
    pub sigma: f64,
    /// Largest of the shares (Eq. 7).
    pub sigma_max: f64,
    /// Sum of the shares (Eq. 6).
    pub sigma_sum: f64,
    /// `z_b` of Eq. 26: the objective changes by `-z_b` with the wrench. For the maximum and the sum without lower bounds
    /// `sigma = (residual - w_ext) . z_b`; for least squares without reference, bounds and slack that is `2 sigma`.
    pub dual: Wrench<D>,
    /// Relative distance between `sigma` and the lower bound that `dual` proves for the wrench that the forces balance,
    /// `w_ext - residual`.
    pub gap: f64,
    /// Simplex pivots that this solve took; zero where Newton's method over true cones started from the last answer. Of
    /// least squares and nearest forces: Newton steps.
    pub pivots: usize,
    /// Whether [`Method::Reduced`] had to ask the whole set for this answer, or column generation over true cones
    /// an interior-point solver. Of least squares: whether an interior-point solver gave the start. Of nearest forces:
    /// whether 32 digits gave the answer, or nothing proves it.
    pub fell_back: bool,
    /// Whether the objective and its tie-break alone are known to determine the forces. Where they may not, the least
    /// `sum_i |f_i|^2 / f_i^U^2` does; forces that extreme forces can make in several ways count as such.
    pub unique: bool,
    /// What the forces leave unbalanced, `w_ext + sum_i G_i f_i`: rounding, or where no forces balance the wrench
    /// exactly, what [`FEASIBILITY_TOLERANCE`](crate::FEASIBILITY_TOLERANCE) allows. With a slack, or of nearest forces, it
    /// may be large.
    pub residual: Wrench<D>,
    /// The norm of the residual: in the metric of [`ForceDistributor::nearest`](crate::ForceDistributor::nearest) where it
    /// found the forces, else in that of the grasp's length scale.
    pub distance: f64,
    /// The tolerance of the relative gap in force.
    pub tolerance: f64,
}

impl<const D: usize> Distribution<D> {
    /// No force at any contact, which balances the zero wrench.
    pub(crate) fn without_forces(contacts: usize, tolerance: f64) -> Self {
        Self {
            forces: vec![ContactForce::zeros(); contacts],
            shares: vec![0.0; contacts],
            sigma: 0.0,
            sigma_max: 0.0,
            sigma_sum: 0.0,
            dual: Wrench::zeros(),
            gap: 0.0,
            pivots: 0,
            unique: true,
            fell_back: false,
            residual: Wrench::zeros(),
            distance: 0.0,
            tolerance,
        }
    }

    /// Whether every normal force keeps its upper bound, whatever the tolerance of the gap: `sigma_max <= 1 + 1e-9`.
    pub fn within_limits(&self) -> bool {
        self.sigma_max <= 1.0 + ABOVE_LIMITS
    }

    /// The wrench `G_i f_i` of each contact (Eq. 8). They sum to `-w_ext`.
    pub fn contact_wrenches(&self, grasp: &Grasp<D>) -> Vec<Wrench<D>> {
        grasp.maps().iter().zip(&self.forces).map(|(map, force)| map * force).collect()
    }

    /// The forces in world axes, in N. Torsion is not part of them.
    pub fn world_forces(&self, grasp: &Grasp<D>) -> Vec<Vector3<f64>> {
        let forces = grasp.frames().iter().zip(&self.forces);
        forces.map(|(frame, force)| frame * force.fixed_rows::<3>(0)).collect()
    }

    /// How much of each contact's friction is unused: 1 for a purely normal force, 0 on the edge of slip. With the factor
    /// `s` by which friction force and torsion may grow beside the same normal force, it is `1 - 1 / s`.
    ///
    /// The friction meant is the real one, before the grasp's `friction_margin` divided it. With [`ForceModel::Extreme`]
    /// it is the cone that the extreme forces span, whatever their limits. A contact without force keeps all of its
    /// friction; one without friction has none.
    pub fn slip_margin(&self, grasp: &Grasp<D>) -> Vec<f64> {
        let margin = grasp.options().friction_margin;
        let rounding = ROUNDED_SHARE * self.shares.iter().copied().fold(0.0, f64::max);
        let contacts = grasp.contacts().iter().zip(self.forces.iter().zip(&self.shares));
        contacts
            .map(|(contact, (force, share))| {
                // Rounding has no direction that would say anything about slip.
                let force = if *share <= rounding { &ContactForce::zeros() } else { force };
                match &contact.forces {
                    ForceModel::Extreme(extreme) => unused_cone(force, extreme),
                    _ => unused_friction(force, contact.friction * margin, contact.torsion * margin),
                }
            })
            .collect()
    }
}

/// A share this small beside the largest is rounding.
const ROUNDED_SHARE: f64 = 1e-11;

/// Part of its limit by which rounding may lift a normal force that lies at the limit.
const ABOVE_LIMITS: f64 = 1e-9;

/// Beyond it forces are not the least in any useful sense.
pub(crate) const MAX_RTOL: f64 = 1e-3;

/// Beyond it the maximum's share of the objective is within its tolerance.
const MAX_WEIGHT: f64 = 1e6;

pub(crate) fn check_options(options: &DistributionOptions, objective: Criterion) -> Result<()> {
    let (weight, rtol) = (options.weight, options.rtol);
    let wrong = |argument, reason: String| Err(Error::input(argument, reason));
    if !(weight >= 0.0 && weight.is_finite()) {
        return wrong("weight", format!("{} must be finite and not negative", digits(weight)));
    }
    if weight > MAX_WEIGHT {
        return wrong(
            "weight",
            format!("{weight:e} leaves nothing of the maximum; minimise the \"sum\" instead"),
        );
    }
    if weight > 0.0 && objective == Criterion::Sum {
        let needs = "needs the objective \"max\": it adds weight * sigma_sum to sigma_max";
        return wrong("weight", format!("{} {needs}", digits(weight)));
    }
    if !options.samples.is_empty() && options.method != Method::Reduced {
        return wrong("samples", "only the method \"reduced\" chooses points by them".into());
    }
    if !(rtol > 0.0 && rtol <= MAX_RTOL) {
        return wrong("rtol", format!("{} must lie above 0 and be at most {MAX_RTOL}", digits(rtol)));
    }
    Ok(())
}

pub(crate) fn check_wrench<const D: usize>(wrench: &Wrench<D>) -> Result<()> {
    match wrench.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(k) => {
            let reason = format!("component {k} is {}, not finite", wrench[k]);
            Err(Error::input("external_wrench", reason))
        }
    }
}
