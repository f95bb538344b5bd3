//! Algorithm 1: the Minkowski sum of the contacts' wrenches, point by point.
//!
//! `P` holds the points `w_j` in the paper's order; the sparse matrix `Q` with `P = W Q` is kept as the two
//! index matrices of section 4.2: `A` says where in `B` the entries of a point start and end, `B` says which
//! contact and which extreme force each entry is. Contacts may have different numbers of edges.

use std::collections::TryReserveError;

use crate::error::{Error, Result};
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;

/// Points that [`MinkowskiSum::new`] enumerates at most: about 200 MB in six dimensions.
pub const DEFAULT_MAX_POINTS: u128 = 2_000_000;

/// Points listed before asking whether to stop: some ten microseconds.
const POINTS_BETWEEN_LOOKS: usize = 256;

/// The points of `W_-^M`, and which extreme forces make each of them.
///
/// ```
/// use graspforce::{Contact, Grasp, MinkowskiSum};
/// use nalgebra::Vector3;
///
/// let fingers = [(-1.0, 1.0), (1.0, -1.0)]
///     .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)));
/// let grasp = Grasp::<3>::new(&fingers)?;
/// let sum = MinkowskiSum::new(&grasp)?;
/// assert_eq!(sum.len(), 3 * 3 - 1);
/// // The third point is the first force of the second contact added to the first of the first.
/// let entries: Vec<_> = sum.entries(2).collect();
/// assert_eq!(entries, [(0, 0), (1, 0)]);
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct MinkowskiSum<const D: usize> {
    wrenches: Vec<Wrench<D>>,
    starts: Vec<u32>,
    ends: Vec<u32>,
    contacts: Vec<u32>,
    edges: Vec<u32>,
}

impl<const D: usize> MinkowskiSum<D> {
    /// Enumerates the Minkowski sum of a grasp, up to [`DEFAULT_MAX_POINTS`].
    pub fn new(grasp: &Grasp<D>) -> Result<Self> {
        Self::with_limit(grasp, DEFAULT_MAX_POINTS)
    }

    /// Enumerates the Minkowski sum, refusing with [`Error::TooLarge`] past `limit` points.
    ///
    /// Nothing is allocated before the size is known to fit. Indices take four bytes, so whatever the limit,
    /// there are never more than 2^31 - 1 entries.
    pub fn with_limit(grasp: &Grasp<D>, limit: u128) -> Result<Self> {
        let wrenches = grasp.primitive_wrenches()?;
        let size = Size::of(grasp);
        if size.points > limit || size.entries > i32::MAX as u128 {
            return Err(Error::TooLarge { points: size.points, bytes: size.bytes::<D>(), limit });
        }
        let too_large = |_| Error::TooLarge { points: size.points, bytes: size.bytes::<D>(), limit };
        let mut sum = Self::with_capacity(size.points as usize, size.entries as usize).map_err(too_large)?;
        for (i, range) in (0..grasp.num_contacts()).filter_map(|i| Some((i, grasp.edges(i)?))) {
            sum.add_contact(i as u32, &wrenches[range])?;
        }
        Ok(sum)
    }

    /// Room for all of them, or an error where the machine has none.
    fn with_capacity(points: usize, entries: usize) -> std::result::Result<Self, TryReserveError> {
        fn room<T>(size: usize) -> std::result::Result<Vec<T>, TryReserveError> {
            let mut vector = Vec::new();
            vector.try_reserve_exact(size).map(|()| vector)
        }
        Ok(Self {
            wrenches: room(points)?,
            starts: room(points)?,
            ends: room(points)?,
            contacts: room(entries)?,
            edges: room(entries)?,
        })
    }

    /// One pass of the algorithm's outer loop: every point so far plus each new wrench, then those alone.
    fn add_contact(&mut self, contact: u32, wrenches: &[Wrench<D>]) -> Result<()> {
        let points = self.len();
        for (h, wrench) in (0_u32..).zip(wrenches) {
            for j in 0..points {
                if j % POINTS_BETWEEN_LOOKS == 0 {
                    interrupt::check()?;
                }
                let (start, end) = (self.starts[j] as usize, self.ends[j] as usize);
                self.starts.push(self.contacts.len() as u32);
                self.contacts.extend_from_within(start..end);
                self.edges.extend_from_within(start..end);
                self.close_point(contact, h, self.wrenches[j] + wrench);
            }
        }
        for (h, wrench) in (0_u32..).zip(wrenches) {
            self.starts.push(self.contacts.len() as u32);
            self.close_point(contact, h, *wrench);
        }
        Ok(())
    }

    fn close_point(&mut self, contact: u32, edge: u32, wrench: Wrench<D>) {
        self.contacts.push(contact);
        self.edges.push(edge);
        self.ends.push(self.contacts.len() as u32);
        self.wrenches.push(wrench);
    }

    /// Number of points `n = prod(l_i + 1) - 1`.
    pub fn len(&self) -> usize {
        self.wrenches.len()
    }

    /// Never true: a grasp has at least one contact and a contact at least one extreme force.
    pub fn is_empty(&self) -> bool {
        self.wrenches.is_empty()
    }

    /// The points, columns of `P`. Each is the sum of its primitive wrenches from the first contact on.
    pub fn wrenches(&self) -> &[Wrench<D>] {
        &self.wrenches
    }

    /// First row of `A`: where in `B` the entries of each point start.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Second row of `A`: where they end, exclusive.
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }

    /// First row of `B`: the contact of each entry.
    pub fn contacts(&self) -> &[u32] {
        &self.contacts
    }

    /// Second row of `B`: the extreme force of each entry, counted within its contact.
    pub fn edges(&self) -> &[u32] {
        &self.edges
    }

    /// The (contact, edge) pairs whose wrenches sum to point `j`.
    pub fn entries(&self, j: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let range = self.starts[j] as usize..self.ends[j] as usize;
        range.map(|k| (self.contacts[k] as usize, self.edges[k] as usize))
    }
}

/// How large an enumeration will be, saturating where even 128 bits do not hold it.
struct Size {
    points: u128,
    entries: u128,
}

impl Size {
    fn of<const D: usize>(grasp: &Grasp<D>) -> Self {
        let mut size = Self { points: 0, entries: 0 };
        for edges in (0..grasp.num_contacts()).filter_map(|i| grasp.edges(i)) {
            let count = edges.len() as u128;
            let added = size.points.saturating_add(1).saturating_mul(count);
            size.entries = size.entries.saturating_mul(count + 1).saturating_add(added);
            size.points = size.points.saturating_add(added);
        }
        size
    }

    fn bytes<const D: usize>(&self) -> u128 {
        let point = (size_of::<Wrench<D>>() + 2 * size_of::<u32>()) as u128;
        let entry = 2 * size_of::<u32>() as u128;
        self.points.saturating_mul(point).saturating_add(self.entries.saturating_mul(entry))
    }
}
