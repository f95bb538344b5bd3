//! Differentiable force closure (Liu et al. 2021): the norm of the wrench that unit normal forces exert. Zero is neither
//! necessary nor enough for force closure.

use crate::grasp::Grasp;
use crate::grasp::contact::ContactForce;
use crate::surrogates::{SurrogateValue, norm_of_forces};

pub(crate) fn force_closure<const D: usize>(grasp: &Grasp<D>) -> SurrogateValue {
    let normals = vec![ContactForce::new(1.0, 0.0, 0.0, 0.0); grasp.num_contacts()];
    norm_of_forces(grasp, &normals, true)
}
