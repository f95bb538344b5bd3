//! Force distribution over second-order friction cones.
//!
//! - [`program`]: which method answers; column generation asks for the furthest force of a cone in closed form.
//! - [`newton`]: Newton's method on the optimality conditions. [`contact_status`]: what a contact does at the optimum;
//!   [`optimal_point`]: the conditions at a point; [`optimality_system`]: one step; [`start`]: the first point.
//! - [`tie_break`]: the choice among forces that are equally good; [`segment`]: how far they can move along a line;
//!   [`face_choice`]: where several directions are free; [`choice`]: whether they are unique, chosen or left open.
//! - [`interior_point_socp`]: Clarabel's answer, where column generation stalls.

pub(crate) mod choice;
pub(crate) mod contact_status;
pub(crate) mod face_choice;
pub(crate) mod interior_point_socp;
pub(crate) mod newton;
pub(crate) mod optimal_point;
pub(crate) mod optimality_system;
pub(crate) mod program;
pub(crate) mod segment;
pub(crate) mod start;
pub(crate) mod tie_break;
