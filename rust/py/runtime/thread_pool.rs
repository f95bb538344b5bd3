//! The threads of parallel calls, also in a process that `fork` made.
//!
//! Threads do not survive a fork, and work that a forked process gave to its parent's would wait for ever. Each
//! process therefore has a pool of its own, made when it is first needed.

use std::num::NonZero;
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};
use std::{env, process, thread};

use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Attempts to take the lock, each after the others' threads had a turn, before a new pool is made without it.
const LOCK_ATTEMPTS: usize = 10_000;

/// Threads of a pool at most, or four for each core where that is more: with thousands, as `RAYON_NUM_THREADS` may ask
/// for, they spend their time looking for work and a call never ends.
const MAX_THREADS: usize = 64;

/// The process that made the pool, and the pool.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// This process's pool.
pub fn pool() -> PyResult<Arc<ThreadPool>> {
    let attempts = (0..LOCK_ATTEMPTS).find_map(|_| {
        let held = POOL.try_lock().ok();
        if held.is_none() {
            thread::yield_now();
        }
        held
    });
    // Whoever held the lock while the process was forked does not exist here: then a pool for this call alone.
    let Some(mut known) = attempts else { return new_pool() };
    if let Some((owner, pool)) = &*known
        && *owner == process::id()
    {
        return Ok(Arc::clone(pool));
    }
    let pool = new_pool()?;
    // The parent's pool cannot be closed from here: its threads are not ours.
    std::mem::forget(known.replace((process::id(), Arc::clone(&pool))));
    Ok(pool)
}

/// The lock, if nobody holds it. What a panic left behind is whole: the states behind these locks are replaced, never
/// half written.
pub fn lock<T>(mutex: &Mutex<T>) -> Option<MutexGuard<'_, T>> {
    match mutex.try_lock() {
        Ok(held) => Some(held),
        Err(TryLockError::WouldBlock) => None,
        Err(TryLockError::Poisoned(poisoned)) => {
            mutex.clear_poison();
            Some(poisoned.into_inner())
        }
    }
}

fn new_pool() -> PyResult<Arc<ThreadPool>> {
    let name = |index| format!("graspforce-{index}");
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    // As rayon reads it: one for each core where it is no number, or zero.
    let asked = env::var("RAYON_NUM_THREADS").ok().and_then(|asked| asked.parse().ok());
    let threads = asked.filter(|&asked| asked > 0).unwrap_or(cores).min(MAX_THREADS.max(4 * cores));
    let built = ThreadPoolBuilder::new().thread_name(name).num_threads(threads).build();
    built.map(Arc::new).map_err(|error| PyOSError::new_err(format!("no threads to compute with: {error}")))
}
