//! The C interface: convert, call, map the error. Every algorithm is in the core.
//!
//! `include/graspforce.h` is generated from this crate, with its comments. The rules that hold for all functions stand
//! at the top of the header, that is in `cbindgen.toml`.
//!
//! | file | holds |
//! |---|---|
//! | [`boundary`] | what each function passes through: panics are caught, faults become a status and a message |
//! | [`fault`], [`message`] | what can go wrong, and the text about it in the caller's buffer |
//! | [`memory`] | the caller's arrays and structs: checked, then copied |
//! | [`contacts`], [`grasp`], [`quality`] | grasps from arrays, and how good they are |
//! | [`distributor`], [`distributor_options`], [`control_loop`], [`solution`] | least contact forces |
//! | [`heap`] | the memory of a distributor |
#![allow(
    clippy::missing_safety_doc,
    reason = "the header states the rules for pointers once, for all functions"
)]
#![allow(unreachable_pub, reason = "C reaches it")]
#![warn(clippy::undocumented_unsafe_blocks, unsafe_op_in_unsafe_fn)]

mod boundary;
mod contacts;
mod control_loop;
mod distributor;
mod distributor_options;
mod fault;
mod grasp;
mod heap;
mod memory;
mod message;
mod quality;
mod solution;
