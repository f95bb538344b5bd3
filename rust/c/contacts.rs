//! Contacts from arrays.

use std::ptr;

use graspforce_core as core;
use graspforce_core::{Contact, ContactForce, ForceModel, MAX_EXTREME_FORCES, contact_force};
use nalgebra::Vector3;

use crate::fault::{Fault, Outcome};
use crate::memory::{self, SizedStruct, optional, required};

/// Contacts of a grasp, as arrays that are read during the call only. Initialise it by `gf_contacts_init`.
///
/// `dim` is 2 (planar, wrenches of 3 components) or 3 (spatial, wrenches of 6). Arrays are row-major, one row for each of
/// the `count` contacts. NULL is the default, where one is named.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Contacts {
    /// Bytes of this struct; `gf_contacts_init` sets it.
    size: usize,
    /// Number of contacts.
    count: usize,
    /// Components of a position: 2 or 3.
    dim: usize,
    /// count x dim, in m.
    positions: *const f64,
    /// count x dim, into the object, of any length.
    normals: *const f64,
    /// count x dim: projected on the tangent planes they become the first tangents `o`. NULL: chosen by the library.
    tangents: *const f64,
    /// count Coulomb friction coefficients. NULL: 0.5.
    friction: *const f64,
    /// count upper bounds of the normal forces, in N. NULL: 1.
    max_normal_force: *const f64,
    /// count coefficients of torsional friction, in m; positive makes a soft finger. NULL: 0.
    torsion: *const f64,
    /// count numbers of edges of the linearised friction cones, at least 3; 0 keeps the true cone. NULL: 8. Planar
    /// cones have two edges, whatever stands here.
    edges: *const u32,
    /// count numbers of rows of `extreme_forces`; 0 for a contact with a friction cone. NULL: all have friction cones.
    num_extreme_forces: *const u32,
    /// Rows `[n, t]` (planar) or `[n, o, t, torsion]` (spatial) in the contact frames, in N and N m, contact by
    /// contact: the contact exerts their convex hull with zero, instead of a friction cone.
    extreme_forces: *const f64,
}

// SAFETY: `repr(C)`, the first field is a `usize`, the others are numbers and raw pointers.
unsafe impl SizedStruct for Contacts {
    const NAME: &'static str = "contacts";
}

impl Default for Contacts {
    fn default() -> Self {
        Self {
            size: size_of::<Self>(),
            count: 0,
            dim: 3,
            positions: ptr::null(),
            normals: ptr::null(),
            tangents: ptr::null(),
            friction: ptr::null(),
            max_normal_force: ptr::null(),
            torsion: ptr::null(),
            edges: ptr::null(),
            num_extreme_forces: ptr::null(),
            extreme_forces: ptr::null(),
        }
    }
}

/// What a grasp is measured about and with. Initialise it by `gf_grasp_options_init`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct GraspOptions {
    /// Bytes of this struct; `gf_grasp_options_init` sets it.
    size: usize,
    /// Point about which torques are taken, in m; planar grasps use the first two numbers.
    origin: [f64; 3],
    /// Length in m that makes torques comparable with forces in the norm of quality.
    length_scale: f64,
    /// Factor of at least 1 that divides every friction coefficient.
    friction_margin: f64,
}

// SAFETY: `repr(C)`, the first field is a `usize`, the others are numbers.
unsafe impl SizedStruct for GraspOptions {
    const NAME: &'static str = "options";
}

impl Default for GraspOptions {
    fn default() -> Self {
        let core::GraspOptions { origin, length_scale, friction_margin } = core::GraspOptions::default();
        Self { size: size_of::<Self>(), origin: origin.into(), length_scale, friction_margin }
    }
}

/// Writes the defaults: no contacts, spatial, every array NULL. `size` is `sizeof(gf_contacts)`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_contacts_init(contacts: *mut Contacts, size: usize) {
    // SAFETY: the header's rules.
    unsafe { memory::initialise(contacts, size) };
}

/// Writes the defaults: origin zero, length scale 1 m, friction margin 1. `size` is `sizeof(gf_grasp_options)`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_grasp_options_init(options: *mut GraspOptions, size: usize) {
    // SAFETY: the header's rules.
    unsafe { memory::initialise(options, size) };
}

/// A grasp as the core takes it.
pub(crate) struct Described {
    /// 2 or 3.
    pub(crate) dim: usize,
    pub(crate) contacts: Vec<Contact>,
    pub(crate) options: core::GraspOptions,
}

/// The contacts of a struct with its options.
///
/// # Safety
///
/// The pointers keep the header's rules.
pub(crate) unsafe fn described(
    contacts: *const Contacts,
    options: *const GraspOptions,
) -> Outcome<Described> {
    // SAFETY: the caller's promise.
    let (given, options) = unsafe { (memory::read(contacts)?, memory::read_or_default(options)?) };
    let (count, dim) = (given.count, given.dim);
    if !matches!(dim, 2 | 3) {
        return Err(Fault::Number("dim", dim as i128, "is neither 2 nor 3"));
    }
    if count > MAX_EXTREME_FORCES {
        return Err(Fault::Number("count", count as i128, "is more than a grasp may have"));
    }
    let mut options_of_grasp = core::GraspOptions::default();
    options_of_grasp.origin.as_mut_slice()[..dim].copy_from_slice(&options.origin[..dim]);
    options_of_grasp.length_scale = options.length_scale;
    options_of_grasp.friction_margin = options.friction_margin;
    // SAFETY: the caller's promise: the arrays have the lengths that the struct's comments say.
    let contacts = if count == 0 { Vec::new() } else { unsafe { given.contacts(count, dim) }? };
    Ok(Described { dim, contacts, options: options_of_grasp })
}

impl Contacts {
    /// # Safety
    ///
    /// Each array is NULL or has the length that its comment says.
    unsafe fn contacts(&self, count: usize, dim: usize) -> Outcome<Vec<Contact>> {
        let numbers = |argument, array| {
            // SAFETY: the caller's promise.
            unsafe { optional(argument, array, count) }
        };
        // SAFETY: the caller's promise.
        let (positions, normals) = unsafe {
            (
                required("positions", self.positions, count * dim)?,
                required("normals", self.normals, count * dim)?,
            )
        };
        // SAFETY: the caller's promise.
        let (tangents, edges) = unsafe {
            (optional("tangents", self.tangents, count * dim)?, optional("edges", self.edges, count)?)
        };
        if tangents.is_some() && dim == 2 {
            return Err(Fault::Argument("tangents", "a planar contact has only one tangent"));
        }
        let friction = numbers("friction", self.friction)?;
        let limits = numbers("max_normal_force", self.max_normal_force)?;
        let torsion = numbers("torsion", self.torsion)?;
        // SAFETY: the caller's promise.
        let mut extreme = unsafe { self.extreme_forces(count, dim) }?;
        let row = |array: &[f64], i: usize| {
            let mut vector = Vector3::zeros();
            vector.as_mut_slice()[..dim].copy_from_slice(&array[i * dim..][..dim]);
            vector
        };
        let contact = |i: usize| {
            let mut contact = Contact::new(row(positions, i), row(normals, i));
            contact.tangent = tangents.map(|tangents| row(tangents, i));
            contact.friction = friction.map_or(contact.friction, |friction| friction[i]);
            contact.max_normal_force = limits.map_or(contact.max_normal_force, |limits| limits[i]);
            contact.torsion = torsion.map_or(contact.torsion, |torsion| torsion[i]);
            match edges.map(|edges| edges[i]) {
                Some(0) => contact.forces = ForceModel::Cone,
                Some(edges) => contact.forces = ForceModel::Edges(edges as usize),
                None => {}
            }
            if let Some(forces) = extreme.get_mut(i).filter(|forces| !forces.is_empty()) {
                contact.forces = ForceModel::Extreme(std::mem::take(forces));
            }
            contact
        };
        Ok((0..count).map(contact).collect())
    }

    /// The extreme forces of each contact; nothing where all have friction cones.
    ///
    /// # Safety
    ///
    /// As for [`Self::contacts`].
    unsafe fn extreme_forces(&self, count: usize, dim: usize) -> Outcome<Vec<Vec<ContactForce>>> {
        // SAFETY: the caller's promise.
        let Some(rows) = unsafe { optional("num_extreme_forces", self.num_extreme_forces, count) }? else {
            return Ok(Vec::new());
        };
        let all = rows.iter().map(|&rows| rows as usize).sum::<usize>();
        if all == 0 {
            return Ok(Vec::new());
        }
        if all > MAX_EXTREME_FORCES {
            return Err(Fault::Number(
                "num_extreme_forces",
                all as i128,
                "rows in all are more than a grasp may have",
            ));
        }
        let components: &[usize] = if dim == 2 { &[0, 2] } else { &[0, 1, 2, 3] };
        // SAFETY: the caller's promise.
        let numbers = unsafe { required("extreme_forces", self.extreme_forces, all * components.len()) }?;
        let mut forces = numbers.chunks_exact(components.len()).map(|row| contact_force(row, components));
        Ok(rows.iter().map(|&rows| forces.by_ref().take(rows as usize).collect()).collect())
    }
}
