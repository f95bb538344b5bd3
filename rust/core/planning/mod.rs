//! Where should the contacts go? What planning in Python asks of the core (section 3.4).
//!
//! - [`candidate_search`]: the best of many candidate grasps, most of them rejected by one call of the oracle.
//! - [`box_bound`]: how good any grasp of a box of parameters can be.
//! - [`product_bound`]: the same where contacts have parameters of their own.
//! - [`triangle_tree`]: closest points on a triangle mesh.

pub(crate) mod box_bound;
pub(crate) mod candidate_search;
pub(crate) mod product_bound;
pub(crate) mod triangle_tree;
