//! A text in the buffer of the caller.

use std::ffi::c_char;
use std::fmt;

/// Writes UTF-8 that ends with a zero; what does not fit is cut off between two characters.
pub(crate) struct Message {
    next: *mut c_char,
    /// Bytes that are left, the closing zero among them.
    left: usize,
}

impl Message {
    /// An empty text. Without a buffer nothing is written.
    ///
    /// # Safety
    ///
    /// `buffer` is NULL or has `size` bytes, which nobody else uses while this lives.
    pub(crate) unsafe fn new(buffer: *mut c_char, size: usize) -> Self {
        let message = Self { next: buffer, left: if buffer.is_null() { 0 } else { size } };
        message.close();
        message
    }

    fn close(&self) {
        if self.left > 0 {
            // SAFETY: at least one byte is left.
            unsafe { self.next.write(0) };
        }
    }
}

impl fmt::Write for Message {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        if text.len() < self.left {
            self.append(text);
            return Ok(());
        }
        let fits = (0..self.left).rev().find(|&end| text.is_char_boundary(end));
        self.append(&text[..fits.unwrap_or(0)]);
        self.left = 0;
        Err(fmt::Error)
    }
}

impl Message {
    /// Appends a text that is shorter than what is left.
    fn append(&mut self, text: &str) {
        if self.left > 0 {
            // SAFETY: the text and the closing zero fit into what is left.
            unsafe {
                self.next.cast::<u8>().copy_from_nonoverlapping(text.as_ptr(), text.len());
                self.next = self.next.add(text.len());
            }
            self.left -= text.len();
            self.close();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::{CStr, c_char};
    use std::fmt::Write;

    use super::Message;

    #[test]
    fn a_text_is_cut_between_characters_and_ends_with_a_zero() {
        for size in 0..12 {
            let mut buffer = [c_char::MAX; 12];
            // SAFETY: the buffer has 12 bytes.
            let mut message = unsafe { Message::new(buffer.as_mut_ptr(), size) };
            for part in ["a\u{b5}", "-", "bc"] {
                let _ = message.write_str(part);
            }
            assert!(buffer[size..].iter().all(|&byte| byte == c_char::MAX), "{size}");
            if size > 0 {
                // SAFETY: the buffer has a zero.
                let text = unsafe { CStr::from_ptr(buffer.as_ptr()) }.to_str().unwrap();
                assert!("a\u{b5}-bc".starts_with(text) && text.len() + 2 >= size.min(7), "{size} {text}");
            }
        }
    }
}
