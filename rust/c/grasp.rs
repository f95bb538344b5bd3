//! `gf_grasp`: contacts, checked, with everything derived from them.

use std::ffi::c_char;
use std::ptr;

use graspforce_core as core;

use crate::boundary::{call, silence_own_panics};
use crate::contacts::{Contacts, GraspOptions, described};
use crate::fault::{Outcome, Status};
use crate::memory::{check, copy_to};

/// Contacts on an object with everything derived from them. It does not change, and threads may share it.
pub struct Grasp(pub(crate) AnyGrasp);

/// A grasp with wrenches of 3 or of 6 components.
pub(crate) enum AnyGrasp {
    Planar(core::Grasp<3>),
    Spatial(core::Grasp<6>),
}

/// Runs the same expression on a grasp of either kind.
macro_rules! with_grasp {
    ($any:expr, $grasp:ident => $body:expr) => {
        match $any {
            $crate::grasp::AnyGrasp::Planar($grasp) => $body,
            $crate::grasp::AnyGrasp::Spatial($grasp) => $body,
        }
    };
}
pub(crate) use with_grasp;

impl AnyGrasp {
    /// The grasp of a struct with its options.
    ///
    /// # Safety
    ///
    /// The pointers keep the header's rules.
    pub(crate) unsafe fn new(contacts: *const Contacts, options: *const GraspOptions) -> Outcome<Self> {
        // SAFETY: the caller's promise.
        let given = unsafe { described(contacts, options) }?;
        Ok(match given.dim {
            2 => Self::Planar(core::Grasp::with_options(&given.contacts, given.options)?),
            _ => Self::Spatial(core::Grasp::with_options(&given.contacts, given.options)?),
        })
    }
}

/// The object behind a handle.
///
/// # Safety
///
/// `grasp` is NULL or came from `gf_grasp_create` and is not destroyed during `'a`.
pub(crate) unsafe fn borrowed<'a>(grasp: *const Grasp) -> Outcome<&'a AnyGrasp> {
    check("grasp", grasp)?;
    // SAFETY: the caller's promise.
    Ok(unsafe { &(*grasp).0 })
}

/// Makes a grasp of contacts. `options` may be NULL for the defaults.
///
/// On an error `*grasp` is NULL, and the message names the argument, the contact and the value.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_grasp_create(
    contacts: *const Contacts,
    options: *const GraspOptions,
    grasp: *mut *mut Grasp,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    silence_own_panics();
    let body = || {
        check("grasp", grasp)?;
        // SAFETY: not NULL and aligned, and the header's rules.
        unsafe {
            grasp.write(ptr::null_mut());
            grasp.write(Box::into_raw(Box::new(Grasp(AnyGrasp::new(contacts, options)?))));
        }
        Ok(Status::Solved)
    };
    // SAFETY: the header's rules.
    unsafe { call(message, message_size, body) }
}

/// Ends a grasp; nothing for NULL. Distributors of it live on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_grasp_destroy(grasp: *mut Grasp) {
    let body = || {
        if !grasp.is_null() {
            // SAFETY: it came from `gf_grasp_create`, and by the header's rules nobody uses it any more.
            drop(unsafe { Box::from_raw(grasp) });
        }
        Ok(Status::Solved)
    };
    // SAFETY: no buffer.
    unsafe { call(ptr::null_mut(), 0, body) };
}

/// Number m of contacts; 0 for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_grasp_num_contacts(grasp: *const Grasp) -> usize {
    // SAFETY: the header's rules.
    unsafe { borrowed(grasp) }.map_or(0, |any| with_grasp!(any, grasp => grasp.num_contacts()))
}

/// Components k of a contact force: 2 `[n, t]` planar, 3 `[n, o, t]` hard fingers, 4 `[n, o, t, torsion]` soft ones.
/// 0 for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_grasp_force_dim(grasp: *const Grasp) -> usize {
    // SAFETY: the header's rules.
    unsafe { borrowed(grasp) }.map_or(0, |any| with_grasp!(any, grasp => grasp.force_dim()))
}

/// Components d of a wrench: 3 `[fx, fy, tau]` planar, 6 `[f, tau]` spatial. 0 for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_grasp_wrench_dim(grasp: *const Grasp) -> usize {
    // SAFETY: the header's rules.
    unsafe { borrowed(grasp) }.map_or(0, |any| match any {
        AnyGrasp::Planar(_) => 3,
        AnyGrasp::Spatial(_) => 6,
    })
}

/// Writes the grasp matrix, d x (m k): the forces of all contacts side by side, times it, are the wrench that the
/// contacts exert. `length` is d m k.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_grasp_matrix(
    grasp: *const Grasp,
    matrix: *mut f64,
    length: usize,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let entries = |any: &_| with_grasp!(any, grasp => grasp_matrix(grasp));
    // SAFETY: the header's rules.
    unsafe { write_entries(grasp, "matrix", (matrix, length), entries, (message, message_size)) }
}

/// Writes what is computed of a grasp into a caller's array.
///
/// # Safety
///
/// The pointers keep the header's rules.
unsafe fn write_entries(
    grasp: *const Grasp,
    argument: &'static str,
    (array, length): (*mut f64, usize),
    entries: impl Fn(&AnyGrasp) -> Vec<f64>,
    (message, message_size): (*mut c_char, usize),
) -> Status {
    let body = || {
        // SAFETY: the caller's promise.
        unsafe { copy_to(argument, array, length, &entries(borrowed(grasp)?)) }?;
        Ok(Status::Solved)
    };
    // SAFETY: the caller's promise.
    unsafe { call(message, message_size, body) }
}

fn grasp_matrix<const D: usize>(grasp: &core::Grasp<D>) -> Vec<f64> {
    let components = grasp.force_components();
    let mut entries = Vec::with_capacity(D * grasp.num_contacts() * components.len());
    for row in 0..D {
        for map in grasp.maps() {
            entries.extend(components.iter().map(|&column| map[(row, column)]));
        }
    }
    entries
}

/// Writes the contact frames, m x dim x dim: the rows of a frame are the axes `n, t` (planar) or `n, o, t` in the world, so
/// the components of a force times these rows sum to the force in world axes. `length` is m dim dim.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_grasp_frames(
    grasp: *const Grasp,
    frames: *mut f64,
    length: usize,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let entries = |any: &_| with_grasp!(any, grasp => contact_frames(grasp));
    // SAFETY: the header's rules.
    unsafe { write_entries(grasp, "frames", (frames, length), entries, (message, message_size)) }
}

fn contact_frames<const D: usize>(grasp: &core::Grasp<D>) -> Vec<f64> {
    let (axes, coordinates): (&[usize], &[usize]) =
        if D == 3 { (&[0, 2], &[0, 1]) } else { (&[0, 1, 2], &[0, 1, 2]) };
    let mut entries = Vec::with_capacity(grasp.num_contacts() * axes.len() * coordinates.len());
    for frame in grasp.frames() {
        for &axis in axes {
            entries.extend(coordinates.iter().map(|&row| frame[(row, axis)]));
        }
    }
    entries
}
