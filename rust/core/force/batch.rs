//! Many wrenches in one call: warm along the rows, or in parallel chunks where they are independent.

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::force::balance::balances;
use crate::force::distributor::ForceDistributor;
use crate::force::nearest::options::NearestOptions;
use crate::force::workspace::ForceWorkspace;
use crate::grasp::Wrench;
use crate::grasp::contact::contact_force;
use crate::interrupt;
use crate::memory::filled;
use crate::status::Status;

/// Rows that one workspace solves in a parallel batch: enough to outweigh its own cold starts.
const CHUNK: usize = 256;

/// Least contact forces for many wrenches; rows that were not solved hold NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct DistributionBatch {
    /// Contact forces, row by row and contact by contact, in the components of
    /// [`Grasp::force_components`](crate::Grasp::force_components).
    pub forces: Vec<f64>,
    /// Largest normalised normal force of each row (Eq. 7).
    pub sigma_max: Vec<f64>,
    /// Sum of normalised normal forces of each row (Eq. 6).
    pub sigma_sum: Vec<f64>,
    /// What the forces of each row leave unbalanced, `w_ext + sum_i G_i f_i`.
    pub residual: Vec<f64>,
    /// The norm of each residual, in that of the grasp's length scale or the metric of
    /// [`nearest_many`](ForceDistributor::nearest_many).
    pub distance: Vec<f64>,
    /// Whether the forces of each row balance it, within the feasibility tolerance.
    pub balanced: Vec<bool>,
    /// How each row ended.
    pub status: Vec<Status>,
}

impl<const D: usize> ForceDistributor<D> {
    /// Solves for each wrench in turn. Along a trajectory each starts from the one before. `parallel` cuts the rows
    /// into chunks for all cores, each with a new workspace; the given one is not used then. Results that do not fit
    /// into memory are [`Error::OutOfMemory`], before any row is solved.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, ForceDistributor, Grasp, Status, Wrench};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)]
    ///     .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)));
    /// let distributor = ForceDistributor::new(&Grasp::<3>::new(&fingers)?, Criterion::Max)?;
    /// let weights = [1.0, 2.0, f64::NAN].map(|weight| Wrench::<3>::new(0.0, -weight, 0.0));
    /// let batch = distributor.solve_many(&mut distributor.workspace(), &weights, false)?;
    /// assert_eq!(batch.status, [Status::Solved, Status::Solved, Status::Invalid]);
    /// assert!((batch.sigma_max[1] - 2.0 * batch.sigma_max[0]).abs() < 1e-12);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn solve_many(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrenches: &[Wrench<D>],
        parallel: bool,
    ) -> Result<DistributionBatch> {
        self.many(workspace, external_wrenches, None, parallel)
    }

    /// The same with the forces that come nearest, as [`Self::nearest`] finds them.
    pub fn nearest_many(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrenches: &[Wrench<D>],
        options: &NearestOptions<D>,
        parallel: bool,
    ) -> Result<DistributionBatch> {
        self.many(workspace, external_wrenches, Some(options), parallel)
    }

    fn many(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrenches: &[Wrench<D>],
        nearest: Option<&NearestOptions<D>>,
        parallel: bool,
    ) -> Result<DistributionBatch> {
        let rows = external_wrenches.len();
        let stride = self.grasp().num_contacts() * self.grasp().force_dim();
        let mut batch = DistributionBatch {
            forces: filled("forces", rows.saturating_mul(stride), 0.0)?,
            sigma_max: filled("sigma_max", rows, 0.0)?,
            sigma_sum: filled("sigma_sum", rows, 0.0)?,
            residual: filled("residual", rows.saturating_mul(D), 0.0)?,
            distance: filled("distance", rows, 0.0)?,
            balanced: filled("balanced", rows, false)?,
            status: filled("status", rows, Status::Invalid)?,
        };
        if parallel {
            let interrupt = interrupt::current();
            let chunks = external_wrenches.par_chunks(CHUNK).zip(batch.chunks(CHUNK, stride, D));
            chunks.try_for_each(|(wrenches, rows)| {
                let workspace = &mut self.workspace();
                interrupt::inherit(interrupt.as_ref(), || self.fill(workspace, wrenches, nearest, rows))
            })?;
        } else {
            self.fill(workspace, external_wrenches, nearest, batch.whole())?;
        }
        Ok(batch)
    }

    fn fill(
        &self,
        workspace: &mut ForceWorkspace<D>,
        wrenches: &[Wrench<D>],
        nearest: Option<&NearestOptions<D>>,
        rows: BatchRows<'_>,
    ) -> Result<()> {
        let metric = nearest.copied().unwrap_or_default().metric_of(self.grasp());
        let checked =
            nearest.is_some() || self.squares_options().is_some_and(|squares| squares.slack.is_some());
        let components = self.grasp().force_components();
        let stride = self.grasp().num_contacts() * components.len();
        let forces = rows.forces.chunks_exact_mut(stride);
        let rests = rows.residual.chunks_exact_mut(D);
        for (((wrench, row), rest), k) in wrenches.iter().zip(forces).zip(rests).zip(0..) {
            interrupt::check()?;
            let solved = match nearest {
                Some(options) => self.nearest_into(workspace, wrench, options, row).map(|_| {
                    if row.iter().all(|x| *x == 0.0) { (0.0, 0.0) } else { workspace.last().forces.totals() }
                }),
                None => self.solve_into(workspace, wrench, row).map(|sigma| match sigma {
                    0.0 if row.iter().all(|x| *x == 0.0) => (0.0, 0.0),
                    _ => workspace.last().totals(&-wrench),
                }),
            };
            rows.status[k] = match &solved {
                Ok(_) => Status::Solved,
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                Err(error) => Status::of(error),
            };
            if solved.is_err() {
                // The residual is NaN where the forces are.
                row.fill(f64::NAN);
            }
            (rows.sigma_max[k], rows.sigma_sum[k]) = solved.unwrap_or((f64::NAN, f64::NAN));
            let residual = self.problem.residual_of_rows(&-wrench, row);
            rest.copy_from_slice(residual.as_slice());
            rows.distance[k] = metric.to_euclidean(&residual).norm();
            let contacts = row.chunks_exact(components.len()).map(|force| contact_force(force, components));
            let solved = rows.status[k] == Status::Solved;
            rows.balanced[k] =
                solved && (!checked || balances(self.grasp(), &-wrench, self.held(), contacts));
        }
        Ok(())
    }
}

/// Some consecutive rows of a batch.
struct BatchRows<'a> {
    forces: &'a mut [f64],
    sigma_max: &'a mut [f64],
    sigma_sum: &'a mut [f64],
    residual: &'a mut [f64],
    distance: &'a mut [f64],
    balanced: &'a mut [bool],
    status: &'a mut [Status],
}

impl DistributionBatch {
    /// The rows in chunks; a row has `stride` components of forces and `dim` of a wrench.
    fn chunks(
        &mut self,
        rows: usize,
        stride: usize,
        dim: usize,
    ) -> impl IndexedParallelIterator<Item = BatchRows<'_>> {
        self.forces
            .par_chunks_mut(rows * stride)
            .zip(self.residual.par_chunks_mut(rows * dim))
            .zip(self.sigma_max.par_chunks_mut(rows).zip(self.sigma_sum.par_chunks_mut(rows)))
            .zip(self.distance.par_chunks_mut(rows).zip(self.balanced.par_chunks_mut(rows)))
            .zip(self.status.par_chunks_mut(rows))
            .map(|((((forces, residual), (sigma_max, sigma_sum)), (distance, balanced)), status)| BatchRows {
                forces,
                sigma_max,
                sigma_sum,
                residual,
                distance,
                balanced,
                status,
            })
    }

    /// All rows.
    fn whole(&mut self) -> BatchRows<'_> {
        BatchRows {
            forces: &mut self.forces,
            sigma_max: &mut self.sigma_max,
            sigma_sum: &mut self.sigma_sum,
            residual: &mut self.residual,
            distance: &mut self.distance,
            balanced: &mut self.balanced,
            status: &mut self.status,
        }
    }
}
