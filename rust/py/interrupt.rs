//! Ctrl-C in long calls: computations ask for signals now and then, and end with what the handler raised.

use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use graspforce::{Interrupt, interruptible};
use pyo3::exceptions::{PyException, PyMemoryError};
use pyo3::prelude::*;

use crate::threads::pool;

/// Time between two looks for signals: a fraction of what a user notices.
const PERIOD: Duration = Duration::from_millis(50);

thread_local! {
    static LAST: Cell<Option<Instant>> = const { Cell::new(None) };
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// Whether a signal handler raised something; it is kept for [`outcome`].
fn ask() -> bool {
    let now = Instant::now();
    if LAST.get().is_some_and(|last| now - last < PERIOD) {
        return false;
    }
    LAST.set(Some(now));
    // Without an interpreter (it is shutting down) there is nobody to interrupt.
    let signals = |py: Python<'_>| py.check_signals();
    let Some(Err(raised)) = Python::try_attach(signals) else { return false };
    RAISED.set(Some(raised));
    true
}

/// What an error says, for a message of our own; Ctrl-C, missing memory and the like are kept and take its place.
pub fn reason(py: Python<'_>, error: PyErr) -> String {
    let text = error.value(py).to_string();
    if !error.is_instance_of::<PyException>(py) || error.is_instance_of::<PyMemoryError>(py) {
        keep(error);
    }
    text
}

/// Has this raised in place of the next error of our own.
pub fn keep(error: PyErr) {
    RAISED.set(Some(error));
}

/// What has to be raised before anything else.
pub fn raised() -> Option<PyErr> {
    RAISED.take()
}

fn outcome<T>(result: T) -> PyResult<T> {
    match RAISED.take() {
        None => Ok(result),
        Some(raised) => Err(raised),
    }
}

/// Runs `work` in this thread, with the interpreter lock as it is.
pub fn watched<T>(work: impl FnOnce() -> T) -> PyResult<T> {
    outcome(interruptible(Interrupt::Ask(ask), work))
}

/// Runs `work` in this thread, without the interpreter lock.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    outcome(py.detach(|| interruptible(Interrupt::Ask(ask), work)))
}

/// Runs `work`, which is parallel, on all cores without the interpreter lock, while this thread looks for signals.
pub fn on_all_cores<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = pool()?;
    let finished = py.detach(|| {
        let stop = Arc::new(AtomicBool::new(false));
        let interrupt = Interrupt::Flag(Arc::clone(&stop));
        let (sender, receiver) = channel();
        pool.in_place_scope(|scope| {
            scope.spawn(move |_| {
                // Nobody receives only where this thread panics; its panic says more.
                let _ = sender.send(interruptible(interrupt, work));
            });
            loop {
                match receiver.recv_timeout(PERIOD) {
                    Ok(result) => break result,
                    Err(RecvTimeoutError::Timeout) if stop.load(Ordering::Relaxed) => {}
                    Err(RecvTimeoutError::Timeout) => stop.store(ask(), Ordering::Relaxed),
                    // The worker panicked; the scope raises that panic, rather than this one, as soon as it has ended.
                    Err(RecvTimeoutError::Disconnected) => {
                        std::panic::resume_unwind(Box::new("a worker's panic"))
                    }
                }
            }
        })
    });
    outcome(finished)
}
