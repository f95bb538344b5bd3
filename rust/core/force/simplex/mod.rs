//! The simplex method with columns that are priced, not listed (Eqs. 24 and 26).
//!
//! - [`pricing`]: what columns cost, and what the simplex asks of them.
//! - [`columns`]: the best column for given multipliers, by one call of the support oracle.
//! - [`basis`]: the basic columns and the inverse of their matrix.
//! - [`primal`]: the cold start; [`dual`]: the warm start from the last basis.

pub(crate) mod basis;
pub(crate) mod columns;
pub(crate) mod dual;
pub(crate) mod pricing;
pub(crate) mod primal;
