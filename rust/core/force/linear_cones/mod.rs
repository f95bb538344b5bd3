//! Force distribution over finitely many extreme forces.
//!
//! - [`program`]: from a wrench to its critical region: remembered in the [`workspace`], by dual pivots, or from a cold
//!   start.
//! - [`critical_region`]: wrenches whose least forces are one linear map of the wrench; [`critical_region_builder`]
//!   builds it from an optimal basis.
//! - [`optimal_face`]: which contacts and edges are active in all optimal forces; [`force_law`]: the linear map from a
//!   wrench to these forces.
//! - [`cone_interior`]: contacts whose force lies inside its cone.
//! - [`enumerated`]: all points of the set (Eqs. 26 and 31) and the reduction of section 4.2.

pub(crate) mod cone_interior;
pub(crate) mod critical_region;
pub(crate) mod critical_region_builder;
pub(crate) mod enumerated;
pub(crate) mod force_law;
pub(crate) mod optimal_face;
pub(crate) mod program;
pub(crate) mod workspace;
