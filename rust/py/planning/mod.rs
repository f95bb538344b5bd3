//! What planning in Python asks of the core: [`candidate_search`], [`box_bound`], [`product_bound`],
//! [`triangle_tree`].

pub(crate) mod box_bound;
pub(crate) mod candidate_search;
pub(crate) mod product_bound;
pub(crate) mod triangle_tree;
