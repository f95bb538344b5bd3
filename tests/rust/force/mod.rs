//! Force distribution: laws, certificates, histories.

mod allocations;
mod certificates;
mod cones;
mod gradients;
mod histories;
mod laws;
mod limits;
mod nearest;
mod preload;
mod priced_squares;
mod proven_answers;
mod reduced;
mod reference;
mod squares;
mod third_level;
mod true_cone_newton;
