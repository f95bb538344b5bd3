//! Candidate search, box bounds, triangle tree.

mod closest_point;
mod search;
