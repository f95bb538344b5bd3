//! Memory that a call will take, tried beforehand: where it is short the call raises instead of ending the process.
//!
//! The core allocates most of it in pieces that cannot be tried one by one. [`Work`] bounds their sum by the numbers
//! of contacts, extreme forces and points. The bounds were measured as peaks of the address space, on Linux, for
//! 15 to 200,000 contacts with up to a million extreme forces.

use graspforce::{Error, Grasp, check_room};
use pyo3::prelude::*;

use crate::convert::errors::to_python;
use crate::convert::grasp_arguments::Arguments;

/// What is kept of each grasp of a batch beside its contacts and extreme forces.
const KEPT_GRASP_BYTES: usize = 5 << 10;

/// A computation about a grasp.
#[derive(Debug, Clone, Copy)]
pub enum Work {
    /// A grasp made of contacts, beside what the core tries itself.
    Construction,
    /// The quality or the closure of a grasp.
    Quality,
    /// The gradient of its quality.
    Gradient,
    /// A force distributor and its workspace.
    Distributor,
    /// One solve of a distributor that is there.
    Solve,
    /// The forces nearest to balance, of a distributor that is there.
    Nearest,
    /// Vectors and matrices with some rows for each contact.
    Arrays,
}

impl Work {
    /// Bytes for each contact and for each extreme force.
    const fn bytes(self) -> (usize, usize) {
        match self {
            Self::Construction => (768, 192),
            Self::Quality => (1280, 96),
            Self::Gradient => (2560, 192),
            Self::Distributor => (6400, 1152),
            Self::Solve => (512, 0),
            Self::Nearest => (1536, 96),
            Self::Arrays => (256, 0),
        }
    }

    /// Bytes for this many contacts and extreme forces.
    const fn total(self, contacts: usize, forces: usize) -> usize {
        let (each_contact, each_force) = self.bytes();
        contacts.saturating_mul(each_contact).saturating_add(forces.saturating_mul(each_force))
    }

    /// Refuses work about this many contacts and extreme forces that does not fit.
    fn check(self, contacts: usize, forces: usize) -> Result<(), Error> {
        check_room("contacts", 1, self.total(contacts, forces))
    }
}

/// Raises `TooLargeError` where work about a grasp does not fit.
pub fn check_work<const D: usize>(py: Python<'_>, grasp: &Grasp<D>, work: Work) -> PyResult<()> {
    work.check(grasp.num_contacts(), num_forces(grasp)).map_err(|error| to_python(py, &error))
}

/// The same for the grasps of a batch, one on each thread; the first stands for all.
pub fn check_rows(py: Python<'_>, arguments: &Arguments, threads: usize) -> PyResult<()> {
    check_rows_of(py, arguments, threads, &[Work::Construction, Work::Quality])
}

/// The same for other work.
pub fn check_rows_of(py: Python<'_>, arguments: &Arguments, threads: usize, works: &[Work]) -> PyResult<()> {
    let Some((contacts, forces)) = first_row(py, arguments)? else { return Ok(()) };
    let (contacts, forces) = (contacts.saturating_mul(threads), forces.saturating_mul(threads));
    let checked = works.iter().map(|work| work.check(contacts, forces));
    checked.collect::<Result<(), _>>().map_err(|error| to_python(py, &error))
}

/// The same where all grasps of a batch are kept at once.
pub fn check_kept_rows(py: Python<'_>, arguments: &Arguments) -> PyResult<()> {
    let Some((contacts, forces)) = first_row(py, arguments)? else { return Ok(()) };
    let each = KEPT_GRASP_BYTES.saturating_add(Work::Construction.total(contacts, forces));
    let quality = Work::Quality.total(contacts, forces);
    let bytes = each.saturating_mul(arguments.batch).saturating_add(quality);
    check_room("contacts", 1, bytes).map_err(|error| to_python(py, &error))
}

/// Numbers of contacts and of extreme forces of the first grasp; none of an empty batch.
fn first_row(py: Python<'_>, arguments: &Arguments) -> PyResult<Option<(usize, usize)>> {
    if arguments.batch == 0 {
        return Ok(None);
    }
    let contacts = arguments.contacts_of(0).map_err(|error| to_python(py, &error))?;
    let planar = arguments.dim == 2;
    let forces = contacts.iter().fold(0, |sum: usize, one| sum.saturating_add(one.force_count(planar)));
    Ok(Some((contacts.len(), forces)))
}

/// Raises `TooLargeError` where the points of the Minkowski sum, `each` and `entry` bytes for a point and one of its
/// entries, do not fit. More points than `limit` are refused elsewhere.
pub fn check_points<const D: usize>(
    py: Python<'_>,
    grasp: &Grasp<D>,
    limit: u128,
    (each, entry): (usize, usize),
) -> PyResult<()> {
    let edges = (0..grasp.num_contacts()).filter_map(|contact| grasp.edges(contact));
    let points = edges.fold(1_u128, |points, range| points.saturating_mul(range.len() as u128 + 1));
    if points > limit {
        return Ok(());
    }
    let bytes = each + entry.saturating_mul(grasp.num_contacts());
    check_room("points", points as usize, bytes).map_err(|error| to_python(py, &error))
}

/// Extreme forces of all contacts: they are numbered contact by contact.
fn num_forces<const D: usize>(grasp: &Grasp<D>) -> usize {
    (0..grasp.num_contacts()).rev().find_map(|contact| grasp.edges(contact)).map_or(0, |range| range.end)
}
