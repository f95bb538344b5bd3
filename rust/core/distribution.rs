//! Dynamic force distribution: contact forces that balance an external wrench with the least maximum or the
//! least sum of normalised normal forces (section 4, Eqs. 24 to 31).

use std::sync::Mutex;

use nalgebra::{SVector, Vector3};

use crate::columns::{ImplicitColumns, Objective, UNUSED};
use crate::contact::{ContactForce, ForceModel};
use crate::enumerated::Enumeration;
use crate::equilibration::Equilibration;
use crate::error::{Error, Result};
use crate::grasp::{Grasp, Wrench};
use crate::minkowski::DEFAULT_MAX_POINTS;
use crate::simplex::{Outcome, Simplex, Target};
use crate::wrench_set::Criterion;

/// How much of a wrench may be left unbalanced, relative to the whole: rounding of whoever computed it.
const UNBALANCED: f64 = 1e-10;

/// How the linear program is solved. The answers agree; the work differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// The simplex method with implicit columns: no point of the wrench set is ever listed.
    #[default]
    Implicit,
    /// The paper's: all points of the wrench set listed offline, `z_b` of Eq. 26 by an interior-point solver
    /// online, and forces from the points on its hyperplane.
    Enumerated,
}

/// Options of a [`ForceDistributor`].
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DistributionOptions {
    /// How the linear program is solved.
    pub method: Method,
    /// What the sum weighs beside the maximum: the objective is `sigma_max + weight * sigma_sum`. Zero means
    /// the maximum alone and, among its optima, the least sum. Only with [`Criterion::Max`].
    pub weight: f64,
    /// Largest relative gap that counts as solved.
    pub tolerance: f64,
    /// Largest number of points that [`Method::Enumerated`] may list.
    pub max_points: u128,
}

impl Default for DistributionOptions {
    fn default() -> Self {
        Self { method: Method::default(), weight: 0.0, tolerance: 1e-9, max_points: DEFAULT_MAX_POINTS }
    }
}

/// Least contact forces for one external wrench, with their certificate.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution<const D: usize> {
    /// Contact forces `f_i` as `[f_n, f_o, f_t, torsion]` in the contact frames, in N and N m.
    pub forces: Vec<ContactForce>,
    /// Value of the objective that was minimised.
    pub sigma: f64,
    /// Largest normalised normal force (Eq. 7).
    pub sigma_max: f64,
    /// Sum of normalised normal forces (Eq. 6).
    pub sigma_sum: f64,
    /// `z_b` of Eq. 26: `sigma = -w_ext . z_b`, so the objective changes by `-z_b` with the wrench.
    pub dual: Wrench<D>,
    /// Relative distance between `sigma` and the lower bound that `dual` proves.
    pub gap: f64,
    /// Simplex pivots that this solve took.
    pub pivots: usize,
    /// Whether no other forces are as good in every respect that the linear program knows.
    pub unique: bool,
}

impl<const D: usize> Distribution<D> {
    /// Whether every normal force keeps its upper bound: `sigma_max <= 1`.
    pub fn within_limits(&self) -> bool {
        self.sigma_max <= 1.0
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

    /// How much of each contact's friction is unused: 1 for a purely normal force, 0 on the edge of slip.
    ///
    /// The friction meant is the real one, before the grasp's `friction_margin` divided it. A contact
    /// without force keeps all of it; one without friction has none; one with general extreme forces
    /// has no friction cone and so gives NaN.
    pub fn slip_margin(&self, grasp: &Grasp<D>) -> Vec<f64> {
        let margin = grasp.options().friction_margin;
        let contacts = grasp.contacts().iter().zip(&self.forces);
        contacts
            .map(|(contact, force)| match contact.forces {
                ForceModel::Extreme(_) => f64::NAN,
                _ => unused_friction(force, contact.friction * margin, contact.torsion * margin),
            })
            .collect()
    }
}

fn unused_friction(force: &ContactForce, mu: f64, gamma: f64) -> f64 {
    if mu == 0.0 && gamma == 0.0 {
        return 0.0;
    }
    if force[0] <= 0.0 {
        return 1.0;
    }
    let share = |load: f64, coefficient: f64| if load == 0.0 { 0.0 } else { load / coefficient };
    let used = share(force[1].hypot(force[2]), mu).hypot(share(force[3], gamma));
    1.0 - used / force[0]
}

/// Computes least contact forces for one grasp and any number of external wrenches.
///
/// ```
/// use graspforce::{Contact, Criterion, ForceDistributor, Grasp, Wrench};
/// use nalgebra::Vector3;
///
/// // Two fingers squeeze a disc of radius 1 from left and right and carry 1 N of weight.
/// let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
///     Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5).max_normal_force(4.0)
/// });
/// let grasp = Grasp::<3>::new(&fingers)?;
/// let distributor = ForceDistributor::new(&grasp, Criterion::Max)?;
/// let answer = distributor.solve(&Wrench::<3>::new(0.0, -1.0, 0.0))?;
/// // Each finger lifts 0.5 N by friction and presses with 1 N of its 4 N.
/// assert!((answer.sigma_max - 0.25).abs() < 1e-12);
/// assert!((answer.forces[0][0] - 1.0).abs() < 1e-12);
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug)]
pub struct ForceDistributor<const D: usize> {
    grasp: Grasp<D>,
    options: DistributionOptions,
    equilibration: Equilibration<D>,
    columns: ImplicitColumns<D>,
    enumeration: Option<Enumeration<D>>,
    workspace: Mutex<Workspace<D>>,
}

/// What changes while solving.
#[derive(Debug, Clone)]
struct Workspace<const D: usize> {
    simplex: Simplex<D>,
    active: Vec<u32>,
}

impl<const D: usize> ForceDistributor<D> {
    /// Minimises the maximum (then the sum) or the sum of normalised normal forces of a grasp.
    pub fn new(grasp: &Grasp<D>, objective: Criterion) -> Result<Self> {
        Self::with_options(grasp, objective, DistributionOptions::default())
    }

    /// A distributor with its method, weight and limits.
    pub fn with_options(
        grasp: &Grasp<D>,
        objective: Criterion,
        options: DistributionOptions,
    ) -> Result<Self> {
        check_options(&options, objective)?;
        let wrenches = grasp.primitive_wrenches()?;
        let equilibration = Equilibration::new(grasp, wrenches);
        let objective = Objective::new(objective, options.weight);
        let mapped = wrenches.iter().map(|w| equilibration.wrench(w)).collect();
        let enumeration = match options.method {
            Method::Implicit => None,
            Method::Enumerated => {
                Some(Enumeration::new(grasp, objective, &equilibration, options.max_points)?)
            }
        };
        Ok(Self {
            columns: ImplicitColumns::new(objective, ImplicitColumns::<D>::ranges(grasp), mapped),
            workspace: Mutex::new(Workspace {
                simplex: Simplex::new(grasp.num_contacts()),
                active: Vec::new(),
            }),
            grasp: grasp.clone(),
            options,
            equilibration,
            enumeration,
        })
    }

    /// The grasp whose forces are distributed.
    pub fn grasp(&self) -> &Grasp<D> {
        &self.grasp
    }

    /// The options in force.
    pub fn options(&self) -> &DistributionOptions {
        &self.options
    }

    /// Least contact forces that balance `external_wrench`: `sum_i G_i f_i = -w_ext` (Eq. 11).
    pub fn solve(&self, external_wrench: &Wrench<D>) -> Result<Distribution<D>> {
        check_wrench(external_wrench)?;
        let mut workspace = self.workspace.try_lock().map_err(|_| Error::Busy)?;
        let scale = external_wrench.amax();
        if scale == 0.0 {
            return Ok(self.nothing_to_balance());
        }
        let mapped = self.equilibration.any(&(-external_wrench / scale));
        let Some((target, size)) = self.target(&mapped)? else { return Ok(self.nothing_to_balance()) };
        let Workspace { simplex, active } = &mut *workspace;
        let outcome = match &self.enumeration {
            None => simplex.cold(&self.columns, &target),
            Some(enumeration) => enumeration.solve(simplex, &target, active),
        };
        match outcome {
            Outcome::Optimal => self.distribution(simplex, scale * size),
            Outcome::Infeasible(z) => Err(self.infeasible(&z)),
            Outcome::Stalled => {
                Err(Error::NotConverged { solver: "simplex", iterations: simplex.pivots, gap: f64::INFINITY })
            }
        }
    }

    /// The part of a mapped wrench that the grasp can act on, and its size; `None` if there is nothing to
    /// balance, an error if what the grasp cannot act on is more than rounding.
    fn target(&self, mapped: &SVector<f64, D>) -> Result<Option<(Target<D>, f64)>> {
        let rank = self.equilibration.rank;
        let unscaled = self.equilibration.prescaled_norm(mapped);
        let mut wrench = *mapped;
        if let Some(k) = (rank..D).max_by(|&a, &b| mapped[a].abs().total_cmp(&mapped[b].abs())) {
            if mapped[k].abs() > UNBALANCED * unscaled {
                let mut z = SVector::zeros();
                z[k] = mapped[k].signum();
                return Err(self.infeasible(&z));
            }
            wrench.rows_range_mut(rank..).fill(0.0);
        }
        let size = wrench.amax();
        if size == 0.0 {
            return Ok(None);
        }
        // Rounding in the wrench grows where a weak direction was strengthened.
        let rounding = 4.0 * f64::EPSILON * unscaled / self.equilibration.weakest();
        let tolerance = UNBALANCED + rounding / size;
        Ok(Some((Target { wrench: wrench / size, rank, tolerance }, size)))
    }

    fn infeasible(&self, multiplier: &SVector<f64, D>) -> Error {
        let direction = self.equilibration.dual(multiplier);
        // Scaled before its length is taken: the square of a component may not be representable.
        let direction = (direction / direction.amax()).normalize();
        Error::InfeasibleWrench { direction: direction.as_slice().to_vec() }
    }

    fn nothing_to_balance(&self) -> Distribution<D> {
        Distribution {
            forces: vec![ContactForce::zeros(); self.grasp.num_contacts()],
            sigma: 0.0,
            sigma_max: 0.0,
            sigma_sum: 0.0,
            dual: Wrench::zeros(),
            gap: 0.0,
            pivots: 0,
            unique: true,
        }
    }

    /// Forces from the levels (Eq. 31) and the certificate from the multipliers.
    fn distribution(&self, simplex: &Simplex<D>, scale: f64) -> Result<Distribution<D>> {
        let extreme_forces = self.grasp.extreme_forces()?;
        let mut forces = vec![ContactForce::zeros(); self.grasp.num_contacts()];
        let mut normals = vec![0.0; forces.len()];
        for (row, level) in simplex.levels.iter().enumerate() {
            let level = level.max(0.0);
            for (contact, &edge) in simplex.basis.edges(row).iter().enumerate().filter(|(_, e)| **e != UNUSED)
            {
                forces[contact] += extreme_forces[edge as usize] * (level * scale);
                normals[contact] += level * scale;
            }
        }
        let sigma_max: f64 = normals.iter().copied().fold(0.0, f64::max);
        let sigma_sum: f64 = normals.iter().sum();
        let weight = self.columns.objective.weight();
        let sigma = match self.columns.objective {
            Objective::Sum => sigma_sum,
            _ => sigma_max + weight * sigma_sum,
        };
        let z = &simplex.multipliers[0];
        let reach = self.columns.value(z, weight);
        // With a weight the bound is not homogeneous in z, and only multipliers that reach too far may shrink.
        let shrink = if weight > 0.0 { reach.max(1.0) } else { reach };
        let lower = simplex.target.dot(z) / shrink * scale;
        let gap = ((sigma - lower) / sigma).abs();
        // Multipliers that large cannot be written down in double precision any better.
        let tolerance = self.options.tolerance.max(32.0 * f64::EPSILON * z.lp_norm(1));
        if gap.is_nan() || gap > tolerance {
            return Err(Error::NotConverged { solver: "simplex", iterations: simplex.pivots, gap });
        }
        let dual = self.equilibration.dual(z);
        Ok(Distribution {
            forces,
            sigma,
            sigma_max,
            sigma_sum,
            dual,
            gap,
            pivots: simplex.pivots,
            unique: false,
        })
    }
}

impl<const D: usize> Clone for ForceDistributor<D> {
    /// An independent distributor: it shares no workspace with this one.
    fn clone(&self) -> Self {
        let workspace = Workspace { simplex: Simplex::new(self.grasp.num_contacts()), active: Vec::new() };
        Self {
            grasp: self.grasp.clone(),
            options: self.options.clone(),
            equilibration: self.equilibration.clone(),
            columns: self.columns.clone(),
            enumeration: self.enumeration.clone(),
            workspace: Mutex::new(workspace),
        }
    }
}

fn check_options(options: &DistributionOptions, objective: Criterion) -> Result<()> {
    let weight = options.weight;
    if !(weight >= 0.0 && weight.is_finite()) {
        return Err(Error::input("weight", format!("{weight} must be finite and not negative")));
    }
    if weight > 0.0 && objective == Criterion::Sum {
        let reason = format!("{weight} weighs the sum beside the maximum; it needs the objective \"max\"");
        return Err(Error::input("weight", reason));
    }
    let tolerance = options.tolerance;
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(Error::input("tol", format!("{tolerance} must be finite and positive")));
    }
    Ok(())
}

fn check_wrench<const D: usize>(wrench: &Wrench<D>) -> Result<()> {
    match wrench.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(k) => {
            let reason = format!("component {k} is {}, not finite", wrench[k]);
            Err(Error::input("external_wrench", reason))
        }
    }
}
