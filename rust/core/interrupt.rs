//! Stopping long computations from outside, by Ctrl-C for instance.
//!
//! Whoever starts a computation says when it should stop, by [`interruptible`]. Loops that can take long ask now and
//! then, end early, and what they were part of returns [`Error::Interrupted`]. The question belongs to the thread and
//! not to the arguments, so that no algorithm passes on what it does not use; parallel loops hand it to their threads.
//! Once the answer was yes it stays yes until the computation has returned.

use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

/// Polls of a loop between two questions to a function: loops poll every few microseconds.
const POLLS_BETWEEN_LOOKS: u32 = 8;

/// Who knows whether a computation should stop.
#[derive(Debug, Clone)]
pub enum Interrupt {
    /// This function, asked in the thread that computes.
    Ask(fn() -> bool),
    /// Another thread, which sets the flag.
    Flag(Arc<AtomicBool>),
}

thread_local! {
    static CURRENT: RefCell<Option<Interrupt>> = const { RefCell::new(None) };
    static PRESENT: Cell<bool> = const { Cell::new(false) };
    static STOPPED: Cell<bool> = const { Cell::new(false) };
    static POLLS: Cell<u32> = const { Cell::new(0) };
}

/// Puts back what held before, also when the computation panics.
struct Scope {
    before: Option<Interrupt>,
    stopped: bool,
}

impl Scope {
    fn enter(interrupt: Option<Interrupt>) -> Self {
        PRESENT.set(interrupt.is_some());
        Self { before: CURRENT.replace(interrupt), stopped: STOPPED.replace(false) }
    }
}

impl Drop for Scope {
    fn drop(&mut self) {
        let before = self.before.take();
        PRESENT.set(before.is_some());
        CURRENT.set(before);
        STOPPED.set(self.stopped);
    }
}

/// Runs `work`, which returns [`Error::Interrupted`] soon after `interrupt` says so.
///
/// ```
/// use graspforce::{Contact, Criterion, Error, Grasp, Interrupt, interruptible};
/// use nalgebra::Vector3;
///
/// let fingers = [(-1.0, 1.0), (1.0, -1.0)]
///     .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)));
/// let grasp = Grasp::<3>::new(&fingers)?;
/// let stopped = interruptible(Interrupt::Flag(std::sync::Arc::new(true.into())), || grasp.quality(Criterion::Max));
/// assert_eq!(stopped.unwrap_err(), Error::Interrupted);
/// # Ok::<(), graspforce::Error>(())
/// ```
pub fn interruptible<R>(interrupt: Interrupt, work: impl FnOnce() -> R) -> R {
    let _scope = Scope::enter(Some(interrupt));
    work()
}

/// What may stop this thread, for the threads that work for it.
pub(crate) fn current() -> Option<Interrupt> {
    if PRESENT.get() { CURRENT.with_borrow(Clone::clone) } else { None }
}

/// Runs `work` in a thread that works for another.
pub(crate) fn inherit<R>(interrupt: Option<&Interrupt>, work: impl FnOnce() -> R) -> R {
    let _scope = Scope::enter(interrupt.cloned());
    work()
}

/// Whether to stop; cheap enough to be asked every microsecond.
#[inline]
pub(crate) fn stopped() -> bool {
    PRESENT.get() && asked()
}

/// [`Error::Interrupted`] where the computation was stopped.
pub(crate) fn check() -> Result<()> {
    if stopped() { Err(Error::Interrupted) } else { Ok(()) }
}

#[cold]
fn asked() -> bool {
    if STOPPED.get() {
        return true;
    }
    // Released before the function runs: it may start a computation of its own.
    let answer = CURRENT.with_borrow(|current| match current {
        None => Ok(false),
        Some(Interrupt::Flag(flag)) => Ok(flag.load(Ordering::Relaxed)),
        Some(Interrupt::Ask(ask)) => Err(*ask),
    });
    let stop = match answer {
        Ok(stop) => stop,
        Err(ask) => {
            let polls = POLLS.get().wrapping_add(1);
            POLLS.set(polls);
            polls.is_multiple_of(POLLS_BETWEEN_LOOKS) && ask()
        }
    };
    STOPPED.set(stop);
    stop
}

#[cfg(test)]
mod tests {
    use super::*;

    fn yes() -> bool {
        true
    }

    #[test]
    fn a_computation_that_was_stopped_does_not_stop_the_one_around_it() {
        let no = Interrupt::Flag(Arc::new(AtomicBool::new(false)));
        interruptible(no, || {
            assert!(!stopped());
            interruptible(Interrupt::Ask(yes), || {
                assert!((0..POLLS_BETWEEN_LOOKS).any(|_| stopped()));
                assert!(stopped());
            });
            assert!(!stopped());
        });
        assert!(current().is_none());
    }

    #[test]
    fn threads_stop_with_the_one_they_work_for() {
        interruptible(Interrupt::Flag(Arc::new(AtomicBool::new(true))), || {
            let interrupt = current();
            std::thread::scope(|scope| {
                scope.spawn(|| inherit(interrupt.as_ref(), || assert!(stopped())));
                scope.spawn(|| assert!(!stopped()));
            });
        });
    }
}
