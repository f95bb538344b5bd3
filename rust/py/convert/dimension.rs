//! A grasp of either dimension, behind one Python class.

use graspforce::{Contact, Error, Grasp, GraspOptions};

/// A grasp of either wrench dimension.
#[derive(Debug, Clone)]
pub enum AnyGrasp {
    Planar(Grasp<3>),
    Spatial(Grasp<6>),
}

/// Runs the same expression on a grasp of either dimension.
macro_rules! with_grasp {
    ($any:expr, $grasp:ident => $body:expr) => {
        match $any {
            $crate::convert::dimension::AnyGrasp::Planar($grasp) => $body,
            $crate::convert::dimension::AnyGrasp::Spatial($grasp) => $body,
        }
    };
}
pub(crate) use with_grasp;

impl AnyGrasp {
    /// A grasp of the dimension of its positions.
    pub fn new(dim: usize, contacts: &[Contact], options: GraspOptions) -> Result<Self, Error> {
        match dim {
            2 => Grasp::with_options(contacts, options).map(Self::Planar),
            _ => Grasp::with_options(contacts, options).map(Self::Spatial),
        }
    }
}
