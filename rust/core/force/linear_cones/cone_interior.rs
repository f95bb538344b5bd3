//! Forces strictly inside a linearised friction cone.
//!
//! Such a force leaves its contact's multipliers no slope, so every edge of the cone is active although the
//! force itself is determined. A few edges then serve as its coordinates, and the facets of the cone say
//! where it may go.

use std::f64::consts::PI;

use nalgebra::Vector4;

use crate::grasp::Grasp;
use crate::grasp::contact::{ForceModel, latitudes};

/// Coordinates and facets of one contact's cone.
#[derive(Debug, Clone)]
pub(crate) struct Interior {
    /// Edges, counted over all contacts, that span the contact forces: three, or four of a soft finger.
    pub(crate) edges: Vec<u32>,
    /// For each facet the weights of the coefficients: one for a purely normal force, zero on the facet.
    pub(crate) facets: Vec<[f64; 4]>,
    /// Edges of the largest face of the cone: where more are active, all are.
    most: usize,
    /// Edges of the whole cone.
    count: usize,
}

impl Interior {
    /// The interior of a spatial contact whose edges are more than their span and in a known order; `None` for any
    /// other.
    pub(crate) fn new<const D: usize>(grasp: &Grasp<D>, contact: usize) -> Option<Self> {
        let range = grasp.edges(contact)?;
        let described = &grasp.contacts()[contact];
        let ForceModel::Edges(edges) = described.forces else { return None };
        if D != 6 || described.friction == 0.0 {
            return None;
        }
        let start = range.start as u32;
        if described.torsion > 0.0 {
            return Some(soft(start, edges));
        }
        // At a limit of one: the facets do not depend on it, but its cube may not be representable.
        let force = |h: usize| grasp.finite_forces()[range.start + h % edges] / described.max_normal_force;
        (edges > 3).then(|| hard(start, edges, force))
    }

    /// The interiors of all contacts.
    pub(crate) fn of_contacts<const D: usize>(grasp: &Grasp<D>) -> Vec<Option<Self>> {
        (0..grasp.num_contacts()).map(|contact| Self::new(grasp, contact)).collect()
    }

    /// By how many the facets are more than the edges.
    pub(crate) fn surplus(&self) -> usize {
        self.facets.len().saturating_sub(self.count)
    }

    /// Whether a contact of which this many edges are active, and some more are used, may exert any force of its cone.
    pub(crate) fn holds(&self, active: usize, with_used: usize) -> bool {
        if self.edges.len() == 3 { with_used > self.most } else { active > self.most }
    }
}

/// Hard fingers: a facet between every two edges.
fn hard(start: u32, edges: usize, force: impl Fn(usize) -> Vector4<f64>) -> Interior {
    let chosen = [0, edges / 3, 2 * edges / 3];
    let facet = |h: usize| {
        let normal = force(h).xyz().cross(&force(h + 1).xyz());
        let [a, b, c] = chosen.map(|j| normal.dot(&force(j).xyz()) / normal.x);
        [a, b, c, 0.0]
    };
    let facets = (0..edges).map(facet).collect();
    Interior { edges: chosen.map(|h| start + h as u32).to_vec(), facets, most: 3, count: edges }
}

/// Soft fingers: a facet between every two edges of two neighbouring circles of latitude. In units of the largest
/// friction and torsion, circles of latitude `psi` and `psi + delta` bound facets
/// `cos(psi_m) m . y / cos(pi / l) + sin(psi_m) y_3 <= cos(delta / 2) n`, with `m` and `psi_m` halfway.
fn soft(start: u32, edges: usize) -> Interior {
    let q = latitudes(edges);
    let equator = (q - 1) * edges;
    let chosen = [0, edges / 3, 2 * edges / 3].map(|h| equator + h);
    let angle = |h: f64| 2.0 * PI * h / edges as f64;
    // Edges are counted from h = 1.
    let around = chosen.map(|edge| angle((edge - equator + 1) as f64));
    let delta = PI / (2 * q) as f64;
    let steepness = 1.0 / (PI / edges as f64).cos() / (0.5 * delta).cos();
    let band = |j: usize| (j as f64 + 0.5 - q as f64) * delta;
    let facet = |latitude: f64, h: usize| {
        let (s, c) = latitude.sin_cos();
        let middle = angle(h as f64 + 0.5);
        let [x, y, z] = around.map(|theta| 1.0 - c * steepness * (theta - middle).cos());
        [x, y, z, 1.0 - s / (0.5 * delta).cos()]
    };
    let facets = (0..2 * q).flat_map(|j| (0..edges).map(move |h| facet(band(j), h))).collect();
    let pole = (2 * q - 1) * edges;
    let edges = chosen.iter().chain([&pole]).map(|&edge| start + edge as u32).collect();
    Interior { edges, facets, most: 4, count: pole + 2 }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix4, Vector3};

    use super::*;
    use crate::grasp::contact::Contact;

    #[test]
    fn every_edge_lies_behind_all_facets_and_on_as_many_as_a_corner_has() {
        for (edges, torsion) in [(4, 0.0), (7, 0.0), (3, 0.1), (4, 0.02), (9, 0.3), (16, 0.05)] {
            let contact =
                Contact::new(Vector3::x(), -Vector3::x()).friction(0.4).torsion(torsion).edges(edges);
            let grasp = Grasp::<6>::new(&[contact.max_normal_force(3.0)]).unwrap();
            let forces = grasp.finite_forces();
            let interior = Interior::new(&grasp, 0).unwrap();
            let chosen = |k: usize| forces[*interior.edges.get(k).unwrap_or(&0) as usize];
            let mut frame = Matrix4::from_fn(|i, k| chosen(k)[i]);
            if torsion == 0.0 {
                frame.set_column(3, &Vector4::w());
            }
            let inverse = frame.try_inverse().unwrap();
            let value = |facet: &[f64; 4], f: &Vector4<f64>| Vector4::from(*facet).dot(&(inverse * f));
            for facet in &interior.facets {
                let corners = forces.iter().filter(|f| value(facet, f).abs() < 1e-12).count();
                assert!(corners >= 2 && corners <= interior.most, "{edges} {torsion}: {corners}");
                assert!(forces.iter().all(|f| value(facet, f) > -1e-12));
                assert!((value(facet, &(Vector4::x() * 3.0)) - 1.0).abs() < 1e-12);
            }
            assert!(forces.iter().all(|f| interior.facets.iter().any(|facet| value(facet, f) < 1e-12)));
        }
    }
}
