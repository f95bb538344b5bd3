//! Force distribution: laws, certificates, histories.

mod force_certificates;
mod force_cones;
mod force_histories;
mod force_laws;
mod force_preload;
mod force_reduced;
mod force_reference;
mod gradients;
mod limits;
mod nearest;
mod proven_answers;
mod squares;
mod third_level;
mod true_cone_newton;
