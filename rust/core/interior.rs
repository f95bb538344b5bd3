//! Forces strictly inside a linearised friction cone.
//!
//! Such a force leaves its contact's multipliers no slope, so every edge of the cone is active although the
//! force itself is determined. Three edges then serve as its coordinates, and the facets of the cone say
//! where it may go.

use nalgebra::Vector3;

use crate::contact::{ContactForce, ForceModel};
use crate::grasp::Grasp;

/// Coordinates and facets of one contact's cone.
#[derive(Debug, Clone)]
pub(crate) struct Interior {
    /// Three edges, counted over all contacts, that span the contact forces.
    pub(crate) edges: [u32; 3],
    /// For each facet the weights of the three coefficients: one for a purely normal force, zero on the facet.
    pub(crate) facets: Vec<[f64; 3]>,
}

impl Interior {
    /// The interior of a hard spatial contact with more than three edges in order; `None` for any other.
    pub(crate) fn new<const D: usize>(
        grasp: &Grasp<D>,
        contact: usize,
        forces: &[ContactForce],
    ) -> Option<Self> {
        let range = grasp.edges(contact)?;
        let described = &grasp.contacts()[contact];
        let ordered = matches!(described.forces, ForceModel::Edges(_)) && described.torsion == 0.0;
        let count = range.len();
        if D != 6 || !ordered || count <= 3 {
            return None;
        }
        // At a limit of one: the facets do not depend on it, but its cube may not be representable.
        let force = |h: usize| -> Vector3<f64> {
            forces[range.start + h % count].fixed_rows::<3>(0) / described.max_normal_force
        };
        let chosen = [0, count / 3, 2 * count / 3];
        let facet = |h: usize| {
            let normal = force(h).cross(&force(h + 1));
            chosen.map(|j| normal.dot(&force(j)) / normal.x)
        };
        let edges = chosen.map(|h| (range.start + h) as u32);
        Some(Self { edges, facets: (0..count).map(facet).collect() })
    }
}
