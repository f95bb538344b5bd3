//! What each function of the interface passes through: nothing but a status and a message leaves it.

use std::any::Any;
use std::cell::Cell;
use std::ffi::c_char;
use std::fmt::Write;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use crate::fault::{Outcome, Status};
use crate::message::Message;

thread_local! {
    static INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// Runs `body`; a fault or a panic becomes a status, with a message in the caller's buffer. Nothing is printed.
///
/// # Safety
///
/// `message` is NULL or has `size` bytes, which nobody else uses meanwhile.
pub(crate) unsafe fn call(message: *mut c_char, size: usize, body: impl FnOnce() -> Outcome) -> Status {
    // SAFETY: the caller's promise.
    let mut message = unsafe { Message::new(message, size) };
    let before = INSIDE.replace(true);
    // What a panic may leave half done is not used again: distributors forget, grasps do not change.
    let ended = panic::catch_unwind(AssertUnwindSafe(body));
    INSIDE.set(before);
    // A message that is too long for the buffer is cut off.
    match ended {
        Ok(Ok(status)) => status,
        Ok(Err(fault)) => {
            let _ = write!(message, "{fault}");
            fault.status()
        }
        Err(panic) => {
            let _ = write!(message, "internal error: {}", text(&*panic));
            Status::InternalError
        }
    }
}

fn text(panic: &(dyn Any + Send)) -> &str {
    let owned = panic.downcast_ref::<String>().map(String::as_str);
    owned.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a text")
}

/// Panics of this library print nothing; others are reported as before.
pub(crate) fn silence_own_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !INSIDE.get() {
                others(info);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use std::ffi::{CStr, c_char};

    use super::{call, silence_own_panics};
    use crate::fault::Status;

    #[test]
    fn a_panic_becomes_a_status_with_its_text() {
        silence_own_panics();
        let mut buffer = [c_char::MAX; 64];
        // SAFETY: the buffer has 64 bytes.
        let status = unsafe { call(buffer.as_mut_ptr(), 64, || panic!("row {}", 7)) };
        assert_eq!(status, Status::InternalError);
        // SAFETY: `call` closed the text with a zero.
        let text = unsafe { CStr::from_ptr(buffer.as_ptr()) };
        assert_eq!(text.to_str(), Ok("internal error: row 7"));
    }
}
