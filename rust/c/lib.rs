//! The C interface: convert, call, map the error. Every algorithm is in the core.
//!
//! `include/graspforce.h` is generated from this crate, with its comments. The rules that hold for all functions stand
//! at the top of the header, that is in `cbindgen.toml`.
//!
//! | file | holds |
//! |---|---|
//! | [`boundary`] | the wrapper of every function: it catches panics and returns errors as status and message |
//! | [`fault`], [`message`] | errors with their status, and their text in the caller's buffer |
//! | [`memory`] | checks and copies of the caller's arrays and structs |
//! | [`contacts`], [`grasp`], [`quality`] | contacts from arrays, grasps, and their quality |
//! | [`distributor`], [`distributor_options`], [`control_loop`], [`solution`] | least contact forces |
//! | [`heap`] | the allocator of a distributor's memory |
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
