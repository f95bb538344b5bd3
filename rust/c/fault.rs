//! What can go wrong in a call, and the status that says so.

use std::ffi::{CStr, c_char};
use std::fmt;

use graspforce_core::Error;

/// How a call ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum Status {
    /// The answer is there, within the tolerance asked for.
    Solved = 0,
    /// No forces inside the friction cones, or within the limits that were asked for, balance the external wrench.
    Infeasible = 1,
    /// An argument cannot be used; the message names the argument, the contact and the value.
    Invalid = 2,
    /// The tolerance was not met. The bracket of a quality is valid, but wider than asked for.
    NotConverged = 3,
    /// A pointer is NULL where an object or an array is needed, or is not aligned.
    NullPointer = 16,
    /// An array has another length than the grasp needs.
    WrongLength = 17,
    /// The system has no memory for the object or for a search.
    OutOfMemory = 18,
    /// Another thread uses the distributor.
    Busy = 19,
    /// The library is at fault. The call had no effect; please report the message.
    InternalError = 20,
}

/// Why a call has no answer.
#[derive(Debug)]
pub(crate) enum Fault {
    Core(Error),
    /// An argument that the core never sees.
    Argument(&'static str, &'static str),
    /// The same, of which the value is a whole number.
    Number(&'static str, i128, &'static str),
    /// A struct whose size was not set.
    Size(&'static str, usize),
    NullPointer(&'static str),
    Misaligned(&'static str),
    WrongLength {
        argument: &'static str,
        found: usize,
        expected: usize,
    },
    OutOfMemory,
    Busy,
}

/// What a function of the interface returns inside.
pub(crate) type Outcome<T = Status> = Result<T, Fault>;

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::Core(error)
    }
}

impl Fault {
    pub(crate) fn status(&self) -> Status {
        match self {
            Self::Core(Error::InvalidGrasp { .. } | Error::InvalidInput { .. })
            | Self::Argument(..)
            | Self::Number(..)
            | Self::Size(..) => Status::Invalid,
            Self::Core(error) if error.is_infeasible() => Status::Infeasible,
            Self::Core(Error::TooLarge { .. } | Error::OutOfMemory { .. }) | Self::OutOfMemory => {
                Status::OutOfMemory
            }
            Self::Core(_) => Status::NotConverged,
            Self::NullPointer(_) | Self::Misaligned(_) => Status::NullPointer,
            Self::WrongLength { .. } => Status::WrongLength,
            Self::Busy => Status::Busy,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Core(error) => error.fmt(f),
            Self::Argument(argument, reason) => write!(f, "{argument}: {reason}"),
            Self::Number(argument, number, reason) => write!(f, "{argument}: {number} {reason}"),
            Self::Size(argument, size) => {
                write!(f, "{argument}: its size is {size}; initialise the struct by its init function")
            }
            Self::NullPointer(argument) => write!(f, "{argument}: the pointer is NULL"),
            Self::Misaligned(argument) => write!(f, "{argument}: the pointer is not aligned for its type"),
            Self::WrongLength { argument, found, expected } => {
                write!(f, "{argument}: {found} numbers, expected {expected}")
            }
            Self::OutOfMemory => f.write_str("the system has no memory for a distributor of this grasp"),
            Self::Busy => {
                f.write_str("distributor: in use by another thread; give each thread one of its own")
            }
        }
    }
}

/// The name of a status, such as "SOLVED"; "UNKNOWN" for other numbers.
#[unsafe(no_mangle)]
pub extern "C" fn gf_status_name(status: i32) -> *const c_char {
    let names: [(Status, &CStr); 9] = [
        (Status::Solved, c"SOLVED"),
        (Status::Infeasible, c"INFEASIBLE"),
        (Status::Invalid, c"INVALID"),
        (Status::NotConverged, c"NOT_CONVERGED"),
        (Status::NullPointer, c"NULL_POINTER"),
        (Status::WrongLength, c"WRONG_LENGTH"),
        (Status::OutOfMemory, c"OUT_OF_MEMORY"),
        (Status::Busy, c"BUSY"),
        (Status::InternalError, c"INTERNAL_ERROR"),
    ];
    let found = names.iter().find(|(named, _)| *named as i32 == status);
    found.map_or(c"UNKNOWN", |(_, name)| *name).as_ptr()
}

/// The version of the library, such as "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn gf_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => c"",
        };
    VERSION.as_ptr()
}
