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

/// The same for the grasps of a batch, one on each thread; one of the most contacts stands for all.
pub fn check_rows(py: Python<'_>, arguments: &Arguments<'_>, threads: usize, work: Work) -> PyResult<()> {
    let Some((contacts, forces)) = largest_row(py, arguments)? else { return Ok(()) };
    let (contacts, forces) = (contacts.saturating_mul(threads), forces.saturating_mul(threads));
    let checked = [Work::Construction, work].map(|work| work.check(contacts, forces));
    checked.into_iter().collect::<Result<(), _>>().map_err(|error| to_python(py, &error))
}

/// The same where all grasps of a batch are kept at once.
pub fn check_kept_rows(py: Python<'_>, arguments: &Arguments<'_>) -> PyResult<()> {
    let Some((contacts, forces)) = largest_row(py, arguments)? else { return Ok(()) };
    let each = KEPT_GRASP_BYTES.saturating_add(Work::Construction.total(contacts, forces));
    let quality = Work::Quality.total(contacts, forces);
    let bytes = each.saturating_mul(arguments.batch).saturating_add(quality);
    check_room("contacts", 1, bytes).map_err(|error| to_python(py, &error))
}

/// Numbers of contacts and of extreme forces of a grasp of the most contacts; none of an empty batch.
fn largest_row(py: Python<'_>, arguments: &Arguments<'_>) -> PyResult<Option<(usize, usize)>> {
    let row = if arguments.is_ragged() {
        (0..arguments.batch).max_by_key(|&row| arguments.contacts_in(row))
    } else {
        (arguments.batch > 0).then_some(0)
    };
    let Some(row) = row else { return Ok(None) };
    let contacts = arguments.contacts_of(row).map_err(|error| to_python(py, &error))?;
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
