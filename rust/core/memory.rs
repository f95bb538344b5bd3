//! Large allocations that are tried: where memory is short they end with an error, not with the process.
//!
//! What is allocated in small pieces (bases, facets, messages) cannot be tried piece by piece. [`check_room`] tries
//! their sum instead, and gives it back.

use crate::error::{Error, Result};

/// Smaller requests are not tried: the allocator mostly has memory left for them.
const LEAST_TRIED: usize = 1 << 20;

/// What must be left beside a large allocation, for the small ones that follow it.
const MARGIN: usize = 4 << 20;

/// An empty vector with room for `count` entries, or [`Error::OutOfMemory`] that names `what` it was for.
///
/// ```
/// let room = graspforce::room::<f64>("forces", 12)?;
/// assert!(room.capacity() >= 12);
/// assert!(graspforce::room::<f64>("forces", usize::MAX / 64).is_err());
/// # Ok::<(), graspforce::Error>(())
/// ```
pub fn room<T>(what: &'static str, count: usize) -> Result<Vec<T>> {
    let mut vector = Vec::new();
    let bytes = size_of::<T>() as u128 * count as u128;
    vector.try_reserve_exact(count).map_err(|_| Error::OutOfMemory { what, bytes })?;
    if bytes >= LEAST_TRIED as u128 {
        check_room(what, 1, LEAST_TRIED)?;
    }
    Ok(vector)
}

/// `count` copies of `value`, or [`Error::OutOfMemory`].
pub(crate) fn filled<T: Clone>(what: &'static str, count: usize, value: T) -> Result<Vec<T>> {
    let mut vector = room(what, count)?;
    vector.resize(count, value);
    Ok(vector)
}

/// Refuses what would not fit: `count` small allocations of `bytes` bytes each, and some megabytes beside them.
///
/// Another thread may still take that room before it is used.
pub fn check_room(what: &'static str, count: usize, bytes: usize) -> Result<()> {
    let wanted = count.saturating_mul(bytes);
    if wanted < LEAST_TRIED {
        return Ok(());
    }
    let mut trial = Vec::<u8>::new();
    let tried = trial.try_reserve_exact(wanted.saturating_add(MARGIN));
    // An allocation that nobody looks at may be optimised away.
    std::hint::black_box(&trial);
    tried.map_err(|_| Error::OutOfMemory { what, bytes: wanted as u128 })
}
