//! How good is a grasp? `rho = -min_{|z| = 1} p(z)` with its bracket (Eqs. 16 to 19, Propositions 1 and 2).
//!
//! The sign is the paper's: negative means force closure, smaller is better.
//!
//! | file | holds |
//! |---|---|
//! | [`result`] | options, the answer with its certificate, reused memory |
//! | [`query`] | the wrench set of a question, in the coordinates of the norm |
//! | [`answer`] | how one grasp is answered: outside first, then inside, then closure |
//! | [`set_rounding`] | what rounding may have done to the answers of the support oracle |
//! | [`closure`] | the class of Propositions 1 and 2, decided on the scaled grasp |
//! | [`gradient`] | derivatives of epsilon by positions, normals, friction and limits |
//! | [`worst_direction`] | the worst direction as exact as rounding allows, and whether it is the only one |
//! | [`local_minima`] | Newton's method for the worst direction of true cones |
//! | [`bundle`] | the most critical directions, each with its gradient |
//! | [`active_forces`] | the forces that exert the nearest boundary wrench |
//! | [`thin_sets`] | brackets of sets that are many orders longer than thick, in coordinates where they are round |
//! | [`symmetry`], [`symmetric_radius`] | rotations and mirror images of a set, and its radius by their help |
//! | [`shifted_sets`] | the same about the contacts' centre where that is not the torque origin |
//! | [`inscribed_cones`] | the symmetries of true cones, for linearised ones of many edges |
//! | [`least_friction`] | the least friction at which a grasp closes, or holds a wrench |
//! | [`batch`] | many grasps on all cores |
//! | [`singular_values`] | measures of the grasp matrix alone |
//! | [`length_scale_hint`] | whether the length scale fits the contacts |

pub(crate) mod active_forces;
pub(crate) mod answer;
pub(crate) mod batch;
pub(crate) mod bundle;
pub(crate) mod closure;
pub(crate) mod gradient;
pub(crate) mod inscribed_cones;
pub(crate) mod least_friction;
pub(crate) mod length_scale_hint;
pub(crate) mod local_minima;
pub(crate) mod query;
pub(crate) mod result;
pub(crate) mod set_rounding;
pub(crate) mod shifted_sets;
pub(crate) mod singular_values;
pub(crate) mod symmetric_radius;
pub(crate) mod symmetry;
pub(crate) mod thin_sets;
pub(crate) mod worst_direction;

pub use result::{Quality, QualityOptions, QualityWorkspace};

use crate::convex::expanding_polytope::Polytope;
use crate::error::Result;
use crate::grasp::Grasp;
use crate::interrupt;
use crate::quality::closure::{Closure, classify};
use crate::quality::query::QualityQuery;
use crate::wrench_set::Criterion;

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
        let quality = QualityQuery::new(self, options)?.answer(workspace);
        interrupt::check().map(|()| quality)
    }
}
