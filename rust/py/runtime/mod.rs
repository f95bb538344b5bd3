//! Threads, signals and memory that calls share.
//!
//! - [`interrupt`]: Ctrl-C; [`thread_pool`]: the threads of this process; [`workspace`]: memory kept between calls;
//!   [`memory`]: memory that a call will take.

pub(crate) mod interrupt;
pub(crate) mod memory;
pub(crate) mod thread_pool;
pub(crate) mod workspace;
