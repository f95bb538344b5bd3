//! The wrench sets of a grasp: which wrenches can limited contact forces exert (Sections 3.1 and 3.2)?
//!
//! Every algorithm asks a set for its *support*: which point lies furthest along `z`, how far, and by which force of each
//! contact? The answer costs O(m l d) and never O((l+1)^m). With `h_i` how far contact i alone reaches,
//!
//! - the union has `p(z) = max_i h_i` (Eq. 14);
//! - the Minkowski sum has `p(z) = sum_i max(0, h_i)` where some `h_i > 0`, and `max_i h_i` elsewhere, because the paper's
//!   `W_-` excludes the origin (Eqs. 16 and 17).
//!
//! | file | holds |
//! |---|---|
//! | [`contact_support`] | the support oracle of one contact, finite or a true cone, in a linear map |
//! | [`cone`] | the support of a friction cone in its contact frame |
//! | [`edge_blocks`] | the furthest of many wrenches, in vector registers |
//! | [`soft_lattice`] | the furthest of a soft finger's wrenches, from its latitude and longitude |
//! | [`criterion`] | which of both sets is meant |
//! | [`minkowski_sum`] | Algorithm 1: all points of the Minkowski sum, one by one |

pub(crate) mod cone;
pub(crate) mod contact_support;
pub(crate) mod criterion;
pub(crate) mod edge_blocks;
pub(crate) mod minkowski_sum;
pub(crate) mod soft_lattice;

use std::sync::Arc;

pub use criterion::Criterion;

use crate::grasp::contact::ContactForce;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{ContactMap, Grasp, Wrench, unit};
use crate::tolerances::FLAT_SUPPORT;
use crate::wrench_set::contact_support::ContactSupport;

/// The furthest point of a set along a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support<const D: usize> {
    /// `p(z)`: how far.
    pub value: f64,
    /// A point of the set with `wrench . z = value`.
    pub wrench: Wrench<D>,
}

impl<const D: usize> Support<D> {
    /// Polyak's subgradient step on the sphere: from the unit `z` whose support this is, downhill as if the least of
    /// `p` were `target`. `None` where `p` is flat, or the step overflows.
    pub(crate) fn downhill(&self, z: &Wrench<D>, target: f64) -> Option<Wrench<D>> {
        let next = self.step_downhill(z, z, target)?.try_normalize(0.0)?;
        next.iter().all(|x| x.is_finite()).then_some(next)
    }

    /// The same step for any norm that is 1 at `z` and has the `gradient` there, before its length is made 1.
    pub(crate) fn step_downhill(
        &self,
        z: &Wrench<D>,
        gradient: &Wrench<D>,
        target: f64,
    ) -> Option<Wrench<D>> {
        let slope = self.wrench - gradient * self.value;
        let steepness = slope.norm_squared();
        if steepness <= FLAT_SUPPORT * self.wrench.norm_squared() {
            return None;
        }
        Some(z - slope * ((self.value - target) / steepness))
    }
}

/// The convex hull of the union, or of the Minkowski sum, of what the contacts can exert.
///
/// ```
/// use graspforce::{Contact, Criterion, Grasp, WrenchSet};
/// use nalgebra::Vector3;
///
/// let fingers = [(-1.0, 1.0), (1.0, -1.0)]
///     .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5));
/// let grasp = Grasp::<3>::new(&fingers)?;
/// let up = Vector3::y();
/// assert_eq!(WrenchSet::new(&grasp, Criterion::Sum).support(&up).value, 0.5);
/// assert_eq!(WrenchSet::new(&grasp, Criterion::Max).support(&up).value, 1.0);
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct WrenchSet<const D: usize> {
    criterion: Criterion,
    contacts: Vec<ContactSupport<D>>,
    /// The extreme forces of the grasp.
    forces: Arc<Vec<ContactForce>>,
}

/// The best of one contact: how far it reaches along the direction, and by which force.
#[derive(Debug, Clone, Copy)]
pub struct ContactReach<const D: usize> {
    /// `h_i`, negative where every force of the contact points away.
    pub value: f64,
    /// The wrench that reaches it.
    pub wrench: Wrench<D>,
    /// The force, in the contact frame, that exerts it.
    pub force: ContactForce,
}

impl<const D: usize> WrenchSet<D> {
    /// The wrench set of a grasp.
    pub fn new(grasp: &Grasp<D>, criterion: Criterion) -> Self {
        Self::in_map(grasp, criterion, |wrench| *wrench)
    }

    /// The wrench set in the coordinates where the metric is Euclidean.
    pub(crate) fn in_metric(grasp: &Grasp<D>, criterion: Criterion, metric: &Metric<D>) -> Self {
        Self::in_map(grasp, criterion, |wrench| metric.to_euclidean(wrench))
    }

    fn in_map(grasp: &Grasp<D>, criterion: Criterion, map: impl Fn(&Wrench<D>) -> Wrench<D>) -> Self {
        let contacts = (0..grasp.num_contacts()).map(|i| ContactSupport::of_contact(grasp, i, &map));
        Self { criterion, contacts: contacts.collect(), forces: Arc::clone(grasp.shared_forces()) }
    }

    /// The set that other maps `G_i` would give.
    pub(crate) fn of_maps(grasp: &Grasp<D>, maps: &[ContactMap<D>], criterion: Criterion) -> Self {
        let contact = |(i, map): (usize, &ContactMap<D>)| {
            if let Some(range) = grasp.edges(i) {
                let first = range.start;
                let wrenches = grasp.finite_forces()[range].iter().map(|force| map * force);
                return ContactSupport::finite(wrenches, first);
            }
            let contact = &grasp.contacts()[i];
            ContactSupport::cone(map, contact.friction, contact.torsion, contact.max_normal_force)
        };
        let contacts = maps.iter().enumerate().map(contact).collect();
        Self { criterion, contacts, forces: Arc::clone(grasp.shared_forces()) }
    }

    /// The set that other maps `G_i` would give, every wrench (of a true cone: the longest of its axes) of unit
    /// length, in the coordinates of a linear map `through`.
    pub(crate) fn of_unit_wrenches(
        grasp: &Grasp<D>,
        maps: &[ContactMap<D>],
        criterion: Criterion,
        through: impl Fn(&Wrench<D>) -> Wrench<D>,
    ) -> Self {
        let contact = |(i, map): (usize, &ContactMap<D>)| {
            if let Some(range) = grasp.edges(i) {
                let first = range.start;
                let forces = &grasp.finite_forces()[range];
                // A force of zero is a wrench of zero; it has no direction to keep.
                let unit = |force: &ContactForce| {
                    let wrench = map * force;
                    through(&if wrench.amax() > 0.0 { unit(&wrench) } else { wrench })
                };
                return ContactSupport::finite(forces.iter().map(unit), first);
            }
            let contact = &grasp.contacts()[i];
            let axes = [1.0, contact.friction, contact.friction, contact.torsion];
            let lengths = map.column_iter().zip(axes).map(|(column, by)| by * column.norm());
            let limit = lengths.fold(0.0, f64::max).recip();
            let mut mapped = *map;
            for (k, column) in map.column_iter().enumerate() {
                mapped.set_column(k, &through(&column.into_owned()));
            }
            ContactSupport::cone(&mapped, contact.friction, contact.torsion, limit)
        };
        let contacts = maps.iter().enumerate().map(contact).collect();
        Self { criterion, contacts, forces: Arc::clone(grasp.shared_forces()) }
    }

    /// Which set this is.
    pub fn criterion(&self) -> Criterion {
        self.criterion
    }

    /// Number of contacts `m`.
    pub fn num_contacts(&self) -> usize {
        self.contacts.len()
    }

    /// The support function `p(z)` and a point that attains it.
    pub fn support(&self, z: &Wrench<D>) -> Support<D> {
        if self.criterion == Criterion::Sum {
            return self.union_support(z);
        }
        let mut best = Support { value: f64::NEG_INFINITY, wrench: Wrench::zeros() };
        let mut sum = Support { value: 0.0, wrench: Wrench::zeros() };
        for contact in &self.contacts {
            let (value, edge) = contact.furthest(z);
            if value > 0.0 {
                sum.value += value;
                sum.wrench += contact.wrench(z, edge);
            } else if sum.value == 0.0 && value > best.value {
                best = Support { value, wrench: contact.wrench(z, edge) };
            }
        }
        if sum.value > 0.0 { sum } else { best }
    }

    /// The support of the union, whichever set this is.
    pub(crate) fn union_support(&self, z: &Wrench<D>) -> Support<D> {
        let (mut value, mut best) = (f64::NEG_INFINITY, None);
        for contact in &self.contacts {
            let (reach, edge) = contact.furthest(z);
            if reach > value {
                (value, best) = (reach, Some((contact, edge)));
            }
        }
        let wrench = best.map_or_else(Wrench::zeros, |(contact, edge)| contact.wrench(z, edge));
        Support { value, wrench }
    }

    /// No wrench of the set is longer than this.
    pub(crate) fn longest(&self) -> f64 {
        let each = self.contacts.iter().map(ContactSupport::longest);
        match self.criterion {
            Criterion::Sum => each.fold(0.0, f64::max),
            Criterion::Max => each.sum(),
        }
    }

    /// The value `p(z)` alone.
    pub fn value(&self, z: &Wrench<D>) -> f64 {
        let values = self.contacts.iter().map(|contact| contact.value(z));
        match self.criterion {
            Criterion::Sum => values.fold(f64::NEG_INFINITY, f64::max),
            Criterion::Max => {
                let (sum, best) = values
                    .fold((0.0, f64::NEG_INFINITY), |(sum, best), h| (sum + h.max(0.0), f64::max(best, h)));
                if sum > 0.0 { sum } else { best }
            }
        }
    }

    /// How far contact `i` alone reaches along `z`.
    pub(crate) fn contact_value(&self, i: usize, z: &Wrench<D>) -> f64 {
        self.contacts[i].value(z)
    }

    /// How far contact `i` alone reaches along `z`, and by which force.
    pub fn contact_support(&self, i: usize, z: &Wrench<D>) -> ContactReach<D> {
        let contact = &self.contacts[i];
        let (value, edge) = contact.furthest(z);
        ContactReach { value, wrench: contact.wrench(z, edge), force: contact.force(z, edge, &self.forces) }
    }
}
