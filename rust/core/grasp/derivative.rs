//! How the work of a contact force changes as its contact moves, while the force stays in its frame.
//!
//! Contact i exerts the force `f`, with `F` in world axes and torsion `tau`. For a functional `z = (a, b)` on wrenches and
//! `v_i = a + b x (r_i - origin)`, the number `z . G_i f` changes by
//!
//! - `F x b` by its position `r_i`;
//! - `(F x v_i) x n_i + tau (b - n_i (n_i . b))` by its unit normal `n_i`, the frame turning by the smallest rotation;
//! - `n_i . (F x v_i)` by rad that the frame spins about the normal.

use nalgebra::{SVector, Vector3};

use crate::grasp::contact::ContactForce;
use crate::grasp::wrench::split;
use crate::grasp::{Grasp, Wrench};

/// The three derivatives of `z . G_i f`. A planar contact neither leaves its plane nor spins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ForceDerivative {
    pub(crate) position: Vector3<f64>,
    pub(crate) normal: Vector3<f64>,
    pub(crate) spin: f64,
}

impl ForceDerivative {
    pub(crate) fn of<const D: usize>(
        grasp: &Grasp<D>,
        contact: usize,
        force: &ContactForce,
        z: &Wrench<D>,
    ) -> Self {
        let (a, b) = split(z);
        let place = &grasp.contacts()[contact];
        let n = place.normal;
        let world: Vector3<f64> = grasp.frames()[contact] * force.fixed_rows::<3>(0);
        let turned = world.cross(&(a + b.cross(&(place.position - grasp.options().origin))));
        let mut position = world.cross(&b);
        let mut normal = turned.cross(&n) + force[3] * (b - n * n.dot(&b));
        if D == 3 {
            (position.z, normal.z) = (0.0, 0.0);
        }
        Self { position, normal, spin: if D == 3 { 0.0 } else { n.dot(&turned) } }
    }

    /// All of them as one vector.
    pub(crate) fn stacked(&self) -> SVector<f64, 7> {
        let (p, n) = (self.position, self.normal);
        SVector::from([p.x, p.y, p.z, n.x, n.y, n.z, self.spin])
    }
}
