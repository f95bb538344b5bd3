//! What a contact does at the optimum, and its force in the coordinates of a standard second-order cone.
//!
//! The normalised force of a contact is `x = (n, y)`, `|y| <= n`: its share `n` of its limit, and its friction `y` in
//! units of the coefficients. `v = A_i^T z` is conjugate to it. With the price `p` of a share, the contact is
//!
//! | status | force | multiplier |
//! |---|---|---|
//! | idle | `x = 0` | `v_0 + \|v_y\| <= p` |
//! | sliding (on the cone) | `x = n (1, v_y / \|v_y\|)` | `v_0 + \|v_y\| = p` |
//! | sticking (inside the cone) | `x` free | `v = (p, 0)` |
//! | sliding or sticking at the level `s` of the maximum | `n = s` | `p` more than the price |

use nalgebra::{SVector, Vector4};

use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, Wrench};

/// What a contact does at the optimum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ContactStatus {
    Idle,
    /// On the cone, below the maximum.
    Sliding,
    /// Inside the cone, below the maximum.
    Sticking,
    /// On the cone, at the maximum.
    FullSliding,
    /// Inside the cone, at the maximum.
    FullSticking,
}

/// A friction cone as a standard second-order cone.
#[derive(Debug, Clone)]
pub(crate) struct StandardCone<const D: usize> {
    /// Wrenches of the unit share and of each friction component at its coefficient; zero beyond `dim`.
    pub(crate) axes: [SVector<f64, D>; 4],
    /// One for the share and one for each friction component that exists.
    pub(crate) dim: usize,
    /// Squares of the coefficients: `|f|^2 / f^U^2` is the sum of `weights[k] x[k]^2`.
    pub(crate) weights: Vector4<f64>,
    pub(crate) mu: f64,
    pub(crate) gamma: f64,
    limit: f64,
    /// Which component of a contact force each coordinate is, with its coefficient.
    components: [(usize, f64); 4],
}

impl<const D: usize> StandardCone<D> {
    /// The cone of contact `i` in the coordinates of a linear map; `None` for listed extreme forces.
    pub(crate) fn new(
        grasp: &Grasp<D>,
        i: usize,
        coordinates: impl Fn(&Wrench<D>) -> SVector<f64, D>,
    ) -> Option<Self> {
        if grasp.edges(i).is_some() {
            return None;
        }
        let contact = &grasp.contacts()[i];
        let (limit, map) = (contact.max_normal_force, &grasp.maps()[i]);
        let mut cone = Self {
            axes: [SVector::zeros(); 4],
            dim: 0,
            weights: Vector4::zeros(),
            mu: contact.friction,
            gamma: contact.torsion,
            limit,
            components: [(0, 0.0); 4],
        };
        let coefficients = [1.0, contact.friction, contact.friction, contact.torsion];
        for (component, coefficient) in coefficients.into_iter().enumerate().filter(|(_, c)| *c > 0.0) {
            let wrench = map.column(component) * (limit * coefficient);
            cone.axes[cone.dim] = coordinates(&wrench);
            cone.weights[cone.dim] = coefficient * coefficient;
            cone.components[cone.dim] = (component, coefficient);
            cone.dim += 1;
        }
        Some(cone)
    }

    /// The contact force of `x`.
    pub(crate) fn force(&self, x: &Vector4<f64>) -> ContactForce {
        self.normalised(x) * self.limit
    }

    /// The `x` of a contact force.
    pub(crate) fn coordinates(&self, force: &ContactForce) -> Vector4<f64> {
        self.coordinates_of_normalised(&(force / self.limit))
    }

    /// The contact force of `x`, relative to the contact's limit.
    #[inline]
    pub(crate) fn normalised(&self, x: &Vector4<f64>) -> ContactForce {
        let mut force = ContactForce::zeros();
        for (k, &(component, coefficient)) in self.components[..self.dim].iter().enumerate() {
            force[component] = coefficient * x[k];
        }
        force
    }

    /// The `x` of a contact force relative to the contact's limit.
    #[inline]
    pub(crate) fn coordinates_of_normalised(&self, force: &ContactForce) -> Vector4<f64> {
        let mut x = Vector4::zeros();
        for (k, &(component, coefficient)) in self.components[..self.dim].iter().enumerate() {
            x[k] = force[component] / coefficient;
        }
        x
    }

    /// `A^T z`.
    #[inline]
    pub(crate) fn conjugate(&self, z: &SVector<f64, D>) -> Vector4<f64> {
        Vector4::from_fn(|k, _| self.axes[k].dot(z))
    }

    /// The wrench of `x`.
    #[inline]
    pub(crate) fn wrench(&self, x: &Vector4<f64>) -> SVector<f64, D> {
        self.axes[0] * x[0] + self.axes[1] * x[1] + self.axes[2] * x[2] + self.axes[3] * x[3]
    }
}

/// The friction part of a vector of a standard cone.
#[inline]
pub(crate) fn friction(x: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(0.0, x[1], x[2], x[3])
}

/// Its length.
#[inline]
pub(crate) fn load(x: &Vector4<f64>) -> f64 {
    (x[1] * x[1] + x[2] * x[2] + x[3] * x[3]).sqrt()
}
