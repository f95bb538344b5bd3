//! What comes in a planar and a spatial kind, behind one Python class.

use graspforce::{Contact, Error, Grasp, GraspOptions};

/// Something planar (wrenches of 3 components), or its spatial twin (of 6).
#[derive(Debug, Clone)]
pub enum Dimensional<P, S> {
    Planar(P),
    Spatial(S),
}

/// A grasp of either dimension.
pub type AnyGrasp = Dimensional<Grasp<3>, Grasp<6>>;

/// Which of the two is meant.
pub type Dimension = Dimensional<(), ()>;

/// Runs the same expression on what is planar or spatial.
macro_rules! by_dimension {
    ($any:expr, $one:pat => $body:expr) => {
        match $any {
            $crate::convert::dimension::Dimensional::Planar($one) => $body,
            $crate::convert::dimension::Dimensional::Spatial($one) => $body,
        }
    };
}
pub(crate) use by_dimension;

/// Makes something of what is planar or spatial that is planar or spatial, too.
macro_rules! map_dimension {
    ($any:expr, $one:pat => $body:expr) => {
        match $any {
            $crate::convert::dimension::Dimensional::Planar($one) => {
                $crate::convert::dimension::Dimensional::Planar($body)
            }
            $crate::convert::dimension::Dimensional::Spatial($one) => {
                $crate::convert::dimension::Dimensional::Spatial($body)
            }
        }
    };
}
pub(crate) use map_dimension;

impl Dimension {
    /// That of contacts with `dim` coordinates.
    pub fn of(dim: usize) -> Result<Self, String> {
        match dim {
            2 => Ok(Self::Planar(())),
            3 => Ok(Self::Spatial(())),
            _ => Err(format!("dim: {dim} is neither 2 nor 3")),
        }
    }
}

impl<P, S> Dimensional<P, S> {
    pub fn as_ref(&self) -> Dimensional<&P, &S> {
        map_dimension!(self, one => one)
    }

    pub fn as_mut(&mut self) -> Dimensional<&mut P, &mut S> {
        map_dimension!(self, one => one)
    }

    /// Both, where they are of one dimension.
    pub fn with<P2, S2>(self, other: Dimensional<P2, S2>) -> Option<Dimensional<(P, P2), (S, S2)>> {
        match (self, other) {
            (Self::Planar(one), Dimensional::Planar(other)) => Some(Dimensional::Planar((one, other))),
            (Self::Spatial(one), Dimensional::Spatial(other)) => Some(Dimensional::Spatial((one, other))),
            _ => None,
        }
    }

    /// Components of its wrenches.
    pub fn wrench_dim(&self) -> usize {
        match self {
            Self::Planar(_) => 3,
            Self::Spatial(_) => 6,
        }
    }
}

impl AnyGrasp {
    /// A grasp of the dimension of its positions.
    pub fn new(dim: usize, contacts: &[Contact], options: GraspOptions) -> Result<Self, Error> {
        match dim {
            2 => Grasp::with_options(contacts, options).map(Self::Planar),
            _ => Grasp::with_options(contacts, options).map(Self::Spatial),
        }
    }
}
