//! What a distributor was asked, kept with its answer.

use pyo3::prelude::*;

use crate::convert::restored;
use crate::convert::scalars::choice;

/// As it is pickled: the wrench, the objective, weight, tolerance, the largest lower bound of the shares, and the limits.
pub type Pickled<'py> = (Vec<f64>, Bound<'py, PyAny>, f64, f64, f64, Vec<f64>);

/// What was asked.
pub struct ForceQuery {
    pub external_wrench: Vec<f64>,
    /// "max", "sum" or "squares".
    pub objective: &'static str,
    pub weight: f64,
    pub rtol: f64,
    /// The largest lower bound of the shares.
    pub least_share: f64,
    /// The upper bounds of the normal forces, in N.
    pub limits: Vec<f64>,
}

impl ForceQuery {
    pub fn state(&self) -> (Vec<f64>, &'static str, f64, f64, f64, Vec<f64>) {
        let (wrench, limits) = (self.external_wrench.clone(), self.limits.clone());
        (wrench, self.objective, self.weight, self.rtol, self.least_share, limits)
    }

    pub fn restored(
        (external_wrench, objective, weight, rtol, least_share, limits): Pickled<'_>,
    ) -> restored::Checked<Self> {
        restored::finite("external_wrench", &external_wrench)?;
        let objective = choice("state: objective", &objective, &["max", "sum", "squares"])?;
        restored::within("weight", weight, 0.0..=f64::MAX)?;
        restored::within("rtol", rtol, 0.0..=1.0)?;
        restored::finite("limits", &limits)?;
        restored::within("least share", least_share, 0.0..=f64::MAX)?;
        Ok(Self { external_wrench, objective, weight, rtol, least_share, limits })
    }
}
