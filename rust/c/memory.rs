//! The caller's memory: pointers are checked, what they point at is copied.

use crate::fault::{Fault, Outcome};

/// More numbers than this in one array are a mistake.
const MAX_NUMBERS: usize = 1 << 32;

/// Structs smaller or larger than this were not initialised.
const SIZES: std::ops::RangeInclusive<usize> = 16..=4096;

/// A struct of the interface that begins with its size in bytes, so that later versions can append fields: a shorter
/// struct, of an older header, keeps the defaults of what it does not have.
///
/// # Safety
///
/// The type is `repr(C)`, begins with a `usize`, and any bytes are a value of it.
pub(crate) unsafe trait SizedStruct: Copy + Default {
    /// The argument's name.
    const NAME: &'static str;
}

/// The size that the caller wrote into a struct.
///
/// # Safety
///
/// `value` is NULL or points at a struct that begins with its size.
unsafe fn size_of_struct<T: SizedStruct>(value: *const T) -> Outcome<usize> {
    check(T::NAME, value)?;
    // SAFETY: not NULL, aligned, and it begins with a `usize`.
    let size = unsafe { value.cast::<usize>().read() };
    if SIZES.contains(&size) { Ok(size) } else { Err(Fault::Size(T::NAME, size)) }
}

/// A copy of a struct, as far as the caller's header knows it.
///
/// # Safety
///
/// `value` is NULL or points at as many bytes as the struct says.
pub(crate) unsafe fn read<T: SizedStruct>(value: *const T) -> Outcome<T> {
    // SAFETY: the caller's promise.
    let size = unsafe { size_of_struct(value) }?;
    let mut copy = T::default();
    // SAFETY: both have this many bytes, and any bytes are a `T`.
    unsafe {
        let bytes = size.min(size_of::<T>());
        (&raw mut copy).cast::<u8>().copy_from_nonoverlapping(value.cast::<u8>(), bytes);
    }
    Ok(copy)
}

/// The same, or the defaults for NULL.
///
/// # Safety
///
/// As for [`read`].
pub(crate) unsafe fn read_or_default<T: SizedStruct>(value: *const T) -> Outcome<T> {
    if value.is_null() {
        return Ok(T::default());
    }
    // SAFETY: the caller's promise.
    unsafe { read(value) }
}

/// Fills a struct but for its size, as far as the caller's header knows it.
///
/// # Safety
///
/// `target` is NULL or points at as many bytes as the struct says.
pub(crate) unsafe fn write<T: SizedStruct>(target: *mut T, value: &T) -> Outcome<()> {
    // SAFETY: the caller's promise.
    let size = unsafe { size_of_struct(target.cast_const()) }?;
    let (first, bytes) = (size_of::<usize>(), size.min(size_of::<T>()));
    // SAFETY: both have this many bytes; `SIZES` makes `bytes` larger than `first`.
    unsafe {
        let source = (&raw const *value).cast::<u8>().add(first);
        target.cast::<u8>().add(first).copy_from_nonoverlapping(source, bytes - first);
    }
    Ok(())
}

/// Writes the defaults and the size; nothing for NULL or a size that no version has.
///
/// # Safety
///
/// `target` is NULL or points at `size` bytes.
pub(crate) unsafe fn initialise<T: SizedStruct>(target: *mut T, size: usize) {
    if check(T::NAME, target).is_ok() && SIZES.contains(&size) {
        // SAFETY: it has `size` bytes, of which the first are a `usize`.
        unsafe {
            target.cast::<u8>().write_bytes(0, size);
            target.cast::<usize>().write(size);
            let _ = write(target, &T::default());
        }
    }
}

/// A view of an array, or `None` for NULL.
///
/// # Safety
///
/// `array` is NULL or points at `length` values that nobody changes during `'a`.
pub(crate) unsafe fn optional<'a, T>(
    argument: &'static str,
    array: *const T,
    length: usize,
) -> Outcome<Option<&'a [T]>> {
    if array.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    unsafe { required(argument, array, length) }.map(Some)
}

/// A view of an array.
///
/// # Safety
///
/// As for [`optional`].
pub(crate) unsafe fn required<'a, T>(
    argument: &'static str,
    array: *const T,
    length: usize,
) -> Outcome<&'a [T]> {
    check(argument, array)?;
    if length > MAX_NUMBERS {
        return Err(Fault::Number(argument, length as i128, "numbers are more than 2^32"));
    }
    // SAFETY: not NULL, aligned, and of `length` values.
    Ok(unsafe { std::slice::from_raw_parts(array, length) })
}

/// Copies an answer into the caller's array, whose `length` must be that of the answer.
///
/// # Safety
///
/// `array` is NULL or has room for `length` values, which nobody else uses meanwhile.
pub(crate) unsafe fn copy_to(
    argument: &'static str,
    array: *mut f64,
    length: usize,
    answer: &[f64],
) -> Outcome<()> {
    check(argument, array)?;
    check_length(argument, length, answer.len())?;
    // SAFETY: it has room for `length` values; the answer lies in memory of the library.
    unsafe { array.copy_from_nonoverlapping(answer.as_ptr(), length) };
    Ok(())
}

/// Refuses an array of another length.
pub(crate) fn check_length(argument: &'static str, found: usize, expected: usize) -> Outcome<()> {
    if found == expected { Ok(()) } else { Err(Fault::WrongLength { argument, found, expected }) }
}

/// Refuses NULL and what is not aligned.
pub(crate) fn check<T>(argument: &'static str, pointer: *const T) -> Outcome<()> {
    if pointer.is_null() {
        return Err(Fault::NullPointer(argument));
    }
    if pointer.is_aligned() { Ok(()) } else { Err(Fault::Misaligned(argument)) }
}
