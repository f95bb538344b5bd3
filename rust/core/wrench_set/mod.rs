//! The support oracle of the wrench sets (Eqs. 14, 16 and 17, and their true-cone limits).
//!
//! Every algorithm asks one question of a wrench set: *which point of you lies furthest along `z`, how far,
//! and from which force of each contact?* The answer costs O(m l d) and never O((l+1)^m). With `h_i` the
//! largest `w_ih . z` of contact i,
//!
//! - the union has `p(z) = max_i h_i`;
//! - the Minkowski sum has `p(z) = sum_i max(0, h_i)` where some `h_i > 0`, and `max_i h_i` elsewhere,
//!   because the paper's `W_-` excludes the origin;
//! - a true cone has `h_i = f^U (n.v + sqrt(mu^2 ((o.v)^2 + (t.v)^2) + gamma^2 (n.b)^2))`, where `v` and
//!   `n.b` are the components of `G_i^T z`.

pub(crate) mod edge_blocks;
pub(crate) mod minkowski_sum;

use crate::grasp::contact::ContactForce;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::wrench_set::edge_blocks::{EdgeBlock, edge_blocks, furthest_edge, longest_edge};

/// Which wrench set, and so which measure of the overall contact force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Criterion {
    /// The sum of normalised normal forces is limited (Eq. 6): the union of the contacts' wrenches.
    Sum,
    /// Each normalised normal force is limited (Eq. 7): the Minkowski sum.
    Max,
}

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
        let slope = self.wrench - z * self.value;
        let steepness = slope.norm_squared();
        if steepness <= 1e-20 * self.wrench.norm_squared() {
            return None;
        }
        let next = (z - slope * ((self.value - target) / steepness)).try_normalize(0.0)?;
        next.iter().all(|x| x.is_finite()).then_some(next)
    }
}

/// The wrenches of one contact, ready for products with a direction.
#[derive(Debug, Clone)]
enum ContactWrenches<const D: usize> {
    /// Extreme forces in blocks, the first of them by its number.
    Finite { blocks: Vec<EdgeBlock<D>>, start: usize },
    /// `f^U G_i` with the friction coefficients `mu` and `gamma`.
    Cone { map: ContactMap<D>, limit: f64, mu: f64, gamma: f64 },
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
    contacts: Vec<ContactWrenches<D>>,
    forces: Vec<ContactForce>,
    wrenches: Vec<Wrench<D>>,
}

/// The best of one contact: how far it reaches along the direction, and by which force.
#[derive(Debug, Clone, Copy)]
pub struct ContactSupport<const D: usize> {
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
        let limits = grasp.contacts().iter().map(|contact| contact.max_normal_force);
        let maps = grasp.maps().iter().copied().zip(limits);
        Self::assemble(grasp, criterion, grasp.finite_wrenches().to_vec(), maps)
    }

    /// The wrench set in the coordinates where the metric is Euclidean.
    pub(crate) fn in_metric(grasp: &Grasp<D>, criterion: Criterion, metric: &Metric<D>) -> Self {
        let wrenches = grasp.finite_wrenches().iter().map(|wrench| metric.to_euclidean(wrench));
        let limits = grasp.contacts().iter().map(|contact| contact.max_normal_force);
        let maps = grasp.maps().iter().map(|map| metric.to_euclidean(map)).zip(limits);
        Self::assemble(grasp, criterion, wrenches.collect(), maps)
    }

    /// The set that other maps `G_i` would give, every wrench (of a true cone: the longest of its axes) of unit
    /// length.
    pub(crate) fn of_unit_wrenches(grasp: &Grasp<D>, maps: &[ContactMap<D>], criterion: Criterion) -> Self {
        let forces = grasp.finite_forces();
        let mut wrenches = grasp.finite_wrenches().to_vec();
        for (i, map) in maps.iter().enumerate() {
            for edge in grasp.edges(i).into_iter().flatten() {
                // A force of zero is a wrench of zero; it has no direction to keep.
                wrenches[edge] = (map * forces[edge]).try_normalize(0.0).unwrap_or_else(Wrench::zeros);
            }
        }
        let maps = maps.iter().zip(grasp.contacts()).map(|(map, contact)| {
            let axes = [1.0, contact.friction, contact.friction, contact.torsion];
            let lengths = map.column_iter().zip(axes).map(|(column, by)| by * column.norm());
            (*map, lengths.fold(0.0, f64::max).recip())
        });
        Self::assemble(grasp, criterion, wrenches, maps)
    }

    fn assemble(
        grasp: &Grasp<D>,
        criterion: Criterion,
        wrenches: Vec<Wrench<D>>,
        maps: impl Iterator<Item = (ContactMap<D>, f64)>,
    ) -> Self {
        let contacts = maps.enumerate().map(|(i, (map, limit))| {
            let contact = &grasp.contacts()[i];
            let cone = || ContactWrenches::Cone { map, limit, mu: contact.friction, gamma: contact.torsion };
            grasp.edges(i).map_or_else(cone, |range| ContactWrenches::Finite {
                blocks: edge_blocks(&wrenches[range.clone()]).collect(),
                start: range.start,
            })
        });
        Self { criterion, contacts: contacts.collect(), forces: grasp.finite_forces().to_vec(), wrenches }
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
            let (value, edge) = contact.value(z);
            if value > 0.0 {
                sum.value += value;
                sum.wrench += self.wrench(contact, z, edge);
            } else if sum.value == 0.0 && value > best.value {
                best = Support { value, wrench: self.wrench(contact, z, edge) };
            }
        }
        if sum.value > 0.0 { sum } else { best }
    }

    /// The support of the union, whichever set this is.
    pub(crate) fn union_support(&self, z: &Wrench<D>) -> Support<D> {
        let (mut value, mut best) = (f64::NEG_INFINITY, None);
        for contact in &self.contacts {
            let (reach, edge) = contact.value(z);
            if reach > value {
                (value, best) = (reach, Some((contact, edge)));
            }
        }
        let wrench = best.map_or_else(Wrench::zeros, |(contact, edge)| self.wrench(contact, z, edge));
        Support { value, wrench }
    }

    /// No wrench of the set is longer than this.
    pub(crate) fn longest(&self) -> f64 {
        let longest = |contact: &ContactWrenches<D>| match contact {
            ContactWrenches::Finite { blocks, .. } => longest_edge(blocks),
            ContactWrenches::Cone { map, limit, mu, gamma } => {
                let lengths = ContactForce::from_fn(|column, _| map.column(column).norm());
                limit * (lengths[0] + cone_slope(&lengths, *mu, *gamma))
            }
        };
        let each = self.contacts.iter().map(longest);
        match self.criterion {
            Criterion::Sum => each.fold(0.0, f64::max),
            Criterion::Max => each.sum(),
        }
    }

    /// The value `p(z)` alone.
    pub fn value(&self, z: &Wrench<D>) -> f64 {
        let values = self.contacts.iter().map(|contact| contact.value(z).0);
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
        self.contacts[i].value(z).0
    }

    /// How far contact `i` alone reaches along `z`, and by which force.
    pub fn contact_support(&self, i: usize, z: &Wrench<D>) -> ContactSupport<D> {
        let contact = &self.contacts[i];
        let (value, edge) = contact.value(z);
        ContactSupport { value, wrench: self.wrench(contact, z, edge), force: self.force(contact, z, edge) }
    }

    fn wrench(&self, contact: &ContactWrenches<D>, z: &Wrench<D>, edge: usize) -> Wrench<D> {
        match contact {
            ContactWrenches::Finite { .. } => self.wrenches[edge],
            ContactWrenches::Cone { map, .. } => map * self.force(contact, z, edge),
        }
    }

    fn force(&self, contact: &ContactWrenches<D>, z: &Wrench<D>, edge: usize) -> ContactForce {
        match contact {
            ContactWrenches::Finite { .. } => self.forces[edge],
            ContactWrenches::Cone { map, limit, mu, gamma } => {
                cone_support(&map.tr_mul(z), *mu, *gamma) * *limit
            }
        }
    }
}

impl<const D: usize> ContactWrenches<D> {
    /// `h_i` and the index of the extreme force that attains it (meaningless for a true cone).
    #[inline]
    fn value(&self, z: &Wrench<D>) -> (f64, usize) {
        match self {
            Self::Finite { blocks, start } => {
                let (value, edge) = furthest_edge(blocks, z);
                (value, start + edge)
            }
            Self::Cone { map, limit, mu, gamma } => {
                let h = map.tr_mul(z);
                (limit * (h[0] + cone_slope(&h, *mu, *gamma)), 0)
            }
        }
    }
}

/// `sqrt(mu^2 (h_o^2 + h_t^2) + gamma^2 h_torsion^2)` for `h = G_i^T z`.
#[inline]
pub(crate) fn cone_slope(h: &ContactForce, mu: f64, gamma: f64) -> f64 {
    (mu * mu * (h[1] * h[1] + h[2] * h[2]) + gamma * gamma * h[3] * h[3]).sqrt()
}

/// The force of unit normal component in the cone that reaches furthest along `h`.
#[inline]
pub(crate) fn cone_support(h: &ContactForce, mu: f64, gamma: f64) -> ContactForce {
    let slope = cone_slope(h, mu, gamma);
    if slope == 0.0 {
        return ContactForce::new(1.0, 0.0, 0.0, 0.0);
    }
    let (tangential, torsional) = (mu * mu / slope, gamma * gamma / slope);
    ContactForce::new(1.0, tangential * h[1], tangential * h[2], torsional * h[3])
}
