//! The options of least squares, and what a [`crate::ForceDistributor`] checks of them.

use crate::error::{Error, Result, digits};
use crate::force::solution::MAX_RTOL;
use crate::grasp::contact::ContactForce;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{Grasp, REPRESENTABLE};

/// Options of [`ForceDistributor::squares`](crate::ForceDistributor::squares), which minimises
/// `sum_i weights_i |f_i - reference_i|^2 / 2`.
#[derive(Debug, Clone, PartialEq)]
pub struct SquaresOptions<const D: usize> {
    /// Forces to stay close to, in the contact frames; empty for zero.
    pub reference: Vec<ContactForce>,
    /// Weights of the contacts, positive: one for each, one for all, or none for 1.
    pub weights: Vec<f64>,
    /// The price `S` of what stays unbalanced: `residual^T S residual / 2` is added to the objective, and every wrench
    /// has an answer. `None`: the forces balance the wrench.
    pub slack: Option<Metric<D>>,
    /// Whether cones are cut at the upper bounds `f^U` of the normal forces.
    pub limits: bool,
    /// Lower bounds of the normalised normal forces, as in
    /// [`DistributionOptions::min_normal`](crate::DistributionOptions::min_normal).
    pub min_normal: Vec<f64>,
    /// Largest relative duality gap that counts as solved.
    pub rtol: f64,
}

impl<const D: usize> Default for SquaresOptions<D> {
    fn default() -> Self {
        Self {
            reference: Vec::new(),
            weights: Vec::new(),
            slack: None,
            limits: false,
            min_normal: Vec::new(),
            rtol: 1e-9,
        }
    }
}

/// The components of a force in its contact frame.
const COMPONENTS: [&str; 4] = ["n", "o", "t", "torsion"];

/// Weights and references of all contacts, checked.
pub(crate) fn checked<const D: usize>(
    grasp: &Grasp<D>,
    options: &SquaresOptions<D>,
) -> Result<(Vec<f64>, Vec<ContactForce>)> {
    let contacts = grasp.num_contacts();
    let weights = match options.weights[..] {
        [] => vec![1.0; contacts],
        [all] => vec![all; contacts],
        _ => options.weights.clone(),
    };
    let refused = |argument, row, reason| Err(Error::InvalidInput { argument, row, reason });
    if weights.len() != contacts {
        return refused("weights", None, format!("{} weights for {contacts} contacts", weights.len()));
    }
    if let Some(row) = weights.iter().position(|weight| !(1e-60..1e60).contains(weight)) {
        let contact = (options.weights.len() > 1).then_some(row);
        let weight = digits(weights[row]);
        return refused("weights", contact, format!("{weight} must be positive, within 1e-60 to 1e60"));
    }
    let reference = match options.reference.len() {
        0 => vec![ContactForce::zeros(); contacts],
        _ => options.reference.clone(),
    };
    if reference.len() != contacts {
        return refused("reference", None, format!("{} forces for {contacts} contacts", reference.len()));
    }
    for (row, force) in reference.iter().enumerate() {
        let bad = force.iter().position(|x| !(*x == 0.0 || REPRESENTABLE.contains(&x.abs())));
        if let Some(k) = bad {
            let law = if force[k].is_finite() {
                "must be zero, or within 1e-140 to 1e140"
            } else {
                "is not finite"
            };
            let reason = format!("component {}: {} {law}", COMPONENTS[k], digits(force[k]));
            return refused("reference", Some(row), reason);
        }
        let known = grasp.force_components();
        if let Some(k) = (0..4).find(|k| force[*k] != 0.0 && !known.contains(k)) {
            return refused(
                "reference",
                Some(row),
                format!("component {}: the forces of the grasp have none", COMPONENTS[k]),
            );
        }
    }
    let rtol = options.rtol;
    if !(rtol > 0.0 && rtol <= MAX_RTOL) {
        return refused("rtol", None, format!("{} must lie above 0 and be at most {MAX_RTOL}", digits(rtol)));
    }
    Ok((weights, reference))
}
