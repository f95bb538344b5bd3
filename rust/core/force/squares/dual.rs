//! The dual function of the least squares, its gradient and Newton's matrix.

use nalgebra::{SMatrix, SVector};

use crate::force::certificate::ContactForces;
use crate::force::squares::polytope::Polytope;
use crate::force::squares::projection::{CutCone, Force, Projection};
use crate::force::squares::whitening::Whitening;
use crate::grasp::contact::{ContactForce, ForceModel};
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{Grasp, Wrench};
use crate::linalg::real::{Real, dot, norm, values};
use crate::tolerances::{ROUNDED_FORCES_BY_PRICE, SEPARATED_BY_DUAL};

/// The forces of a contact.
#[derive(Debug, Clone)]
pub(crate) enum ForceSet {
    Cone(CutCone),
    Finite(Polytope),
    /// A contact that is switched off.
    Zero,
}

/// A contact as the dual sees it.
#[derive(Debug, Clone)]
pub(crate) struct DualContact<const D: usize> {
    pub(crate) set: ForceSet,
    /// The columns of `T G_i`, zero for components that the contact does not have.
    columns: [Wrench<D>; 4],
    /// `T G_i P_i G_i^T T^T`.
    gram: SMatrix<f64, D, D>,
    /// Components of the force: 3, or 4 with torsion.
    components: usize,
    pub(crate) weight: f64,
    pub(crate) reference: ContactForce,
    /// The normal force that counts as a share of one; for extreme forces 1.
    pub(crate) unit: f64,
}

/// The dual function `phi(y) = sum_i max_f (h_i . f - weight |f - reference|^2 / 2) - b . y + y^T S^-1 y / 2` in the
/// coordinates of [`Whitening`], `h_i = (T G_i)^T y`.
#[derive(Debug, Clone)]
pub(crate) struct Dual<const D: usize> {
    pub(crate) whitening: Whitening<D>,
    pub(crate) contacts: Vec<DualContact<D>>,
    /// `T S^-1 T^T`.
    pub(crate) slack: Option<SMatrix<f64, D, D>>,
}

/// The dual function at a multiplier; the forces are beside it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DualPoint<const D: usize, R: Real = f64> {
    pub(crate) y: SVector<R, D>,
    pub(crate) value: R,
    /// `F`: what the forces leave unbalanced.
    pub(crate) gradient: SVector<R, D>,
    /// The lower triangle of an element of the generalised derivative of `F`.
    pub(crate) hessian: SMatrix<R, D, D>,
    /// The sum of the sizes of all terms of the gradient.
    pub(crate) size: f64,
    /// The same of the value.
    pub(crate) terms: f64,
}

impl<const D: usize> Dual<D> {
    /// The contacts of a grasp with weights and reference forces, without bounds; `slack` prices the residual.
    pub(crate) fn new(
        grasp: &Grasp<D>,
        weights: &[f64],
        reference: &[ContactForce],
        slack: Option<&Metric<D>>,
    ) -> Self {
        let sets: Vec<_> = (0..grasp.num_contacts()).map(|i| force_set(grasp, i)).collect();
        let free: Vec<_> = sets.iter().enumerate().map(|(i, set)| span(grasp, i, set)).collect();
        Self::over(grasp, sets, &free, weights, reference, slack)
    }

    /// The same over other sets of forces, with their bounds. The balance counts along `free`, orthonormal directions in
    /// which the forces of each contact can differ.
    pub(crate) fn over(
        grasp: &Grasp<D>,
        sets: Vec<ForceSet>,
        free: &[Vec<ContactForce>],
        weights: &[f64],
        reference: &[ContactForce],
        slack: Option<&Metric<D>>,
    ) -> Self {
        let mut wrenches = Vec::new();
        for (map, (free, weight)) in grasp.maps().iter().zip(free.iter().zip(weights)) {
            wrenches.extend(free.iter().map(|axis| map * axis / weight.sqrt()));
        }
        if let Some(price) = slack {
            wrenches.extend(price.inverse_columns());
        }
        let split = if D == 3 { 2 } else { 3 };
        let arms = grasp.maps().iter().map(|map| map.fixed_columns::<3>(0).rows_range(split..).amax());
        let whitening = Whitening::new(&wrenches, arms.fold(0.0, f64::max));
        Self::in_coordinates(grasp, whitening, sets, weights, reference, slack)
    }

    /// The same in coordinates that round nothing, with a price of the residual and weights of one.
    pub(crate) fn unrounded(grasp: &Grasp<D>, sets: Vec<ForceSet>, price: &Metric<D>) -> Self {
        let contacts = grasp.num_contacts();
        let (ones, zero) = (vec![1.0; contacts], vec![ContactForce::zeros(); contacts]);
        let mut dual =
            Self::in_coordinates(grasp, Whitening::of_price(price), sets, &ones, &zero, Some(price));
        for (contact, map) in dual.contacts.iter_mut().zip(grasp.maps()) {
            for k in 0..contact.components {
                contact.columns[k] = dual.whitening.map * map.column(k);
            }
        }
        dual
    }

    fn in_coordinates(
        grasp: &Grasp<D>,
        whitening: Whitening<D>,
        sets: Vec<ForceSet>,
        weights: &[f64],
        reference: &[ContactForce],
        slack: Option<&Metric<D>>,
    ) -> Self {
        let contact = |(i, set): (usize, ForceSet)| {
            let (map, weight) = (&grasp.maps()[i], weights[i]);
            let mut mapped = SMatrix::<f64, D, 4>::zeros();
            let mut gram = SMatrix::zeros();
            let span = span(grasp, i, &set);
            for axis in &span {
                let wrench = whitening.wrench(&(map * axis));
                mapped += wrench * axis.transpose();
                gram += wrench * wrench.transpose();
            }
            let unit = match set {
                ForceSet::Cone(_) => grasp.contacts()[i].max_normal_force,
                _ => 1.0,
            };
            let components = if span.iter().any(|axis| axis[3] != 0.0) { 4 } else { 3 };
            let columns = std::array::from_fn(|k| mapped.column(k).into_owned());
            DualContact { set, columns, gram, components, weight, reference: reference[i], unit }
        };
        let contacts = sets.into_iter().enumerate().map(contact).collect();
        let slack = slack.map(|price| {
            price.inverse_columns().fold(SMatrix::zeros(), |sum, column| {
                let mapped = whitening.map * column;
                sum + mapped * mapped.transpose()
            })
        });
        Self { whitening, contacts, slack }
    }

    /// Bounds the shares of contact `i`; an upper bound is infinite for none, and zero switches the contact off.
    pub(crate) fn bound(&mut self, i: usize, low: f64, high: f64) {
        let contact = &mut self.contacts[i];
        if high == 0.0 {
            contact.set = ForceSet::Zero;
        }
        match &mut contact.set {
            ForceSet::Cone(cone) => (cone.low, cone.high) = (low * contact.unit, high * contact.unit),
            ForceSet::Finite(polytope) => (polytope.low, polytope.high) = (low, high),
            ForceSet::Zero => {}
        }
    }

    /// What rounding of the projected points makes of the forces at `y`, relative to the largest force: the roundings of
    /// points far away outweigh the forces themselves.
    pub(crate) fn rounding(&self, y: &Wrench<D>, forces: &ContactForces) -> f64 {
        let largest = forces.forces.iter().map(ContactForce::norm).fold(0.0, f64::max);
        let rounded = |contact: &DualContact<D>| {
            let pull = contact.pull(y) / contact.weight;
            let far = f64::EPSILON * pull.norm();
            if far <= ROUNDED_FORCES_BY_PRICE * largest {
                return far;
            }
            let found = contact.project(&(contact.reference + pull));
            let free = if found.inside { 1.0 } else { 0.0 };
            far * found.shares[..found.count].iter().copied().fold(free, f64::max)
        };
        let most = self.contacts.iter().map(rounded).fold(0.0, f64::max);
        if most == 0.0 { 0.0 } else { most / largest }
    }

    /// The largest weight of a contact.
    pub(crate) fn heaviest(&self) -> f64 {
        self.contacts.iter().map(|contact| contact.weight).fold(0.0, f64::max)
    }

    /// `sum_i weight_i |f_i - reference_i|^2 / 2`.
    pub(crate) fn objective(&self, forces: &[ContactForce]) -> f64 {
        let contacts = self.contacts.iter().zip(forces);
        contacts.map(|(c, force)| 0.5 * c.weight * (force - c.reference).norm_squared()).sum()
    }

    /// The multiplier with `T^T y = z`, as far as the contacts feel it.
    pub(crate) fn of_physical(&self, z: &Wrench<D>, grasp: &Grasp<D>) -> Wrench<D> {
        let contacts = self.contacts.iter().zip(grasp.maps());
        contacts.map(|(contact, map)| contact.wrench(&map.tr_mul(z)) / contact.weight).sum()
    }

    /// `z = T^T y`.
    pub(crate) fn physical(&self, y: &Wrench<D>) -> Wrench<D> {
        self.whitening.map.tr_mul(y)
    }

    /// Whether `y` proves that no forces exert `b`: bounded forces do not reach so far along it.
    pub(crate) fn separates(&self, y: &Wrench<D>, b: &Wrench<D>) -> bool {
        let reach = |contact: &DualContact<D>| contact.reach(&contact.pull(y), f64::INFINITY);
        let reach: f64 = self.contacts.iter().map(reach).sum();
        let along = b.dot(y);
        self.slack.is_none() && along - reach > SEPARATED_BY_DUAL * (along.abs() + reach.abs())
    }

    /// Evaluates the function at `y`, and writes the forces and shares there.
    #[inline]
    pub(crate) fn at<R: Real>(
        &self,
        y: &SVector<R, D>,
        b: &Wrench<D>,
        forces: &mut [ContactForce],
        shares: &mut [f64],
    ) -> DualPoint<D, R> {
        let mut gradient = -b.map(R::from);
        let mut hessian = SMatrix::<R, D, D>::repeat(R::zero());
        let mut value = dot(&gradient, y);
        let (mut size, mut terms) = (b.norm(), value.value().abs());
        if let Some(slack) = &self.slack {
            let mut moved = SVector::<R, D>::repeat(R::zero());
            for c in 0..D {
                for r in 0..D {
                    moved[r] += y[c].times(slack[(r, c)]);
                }
            }
            gradient += moved;
            hessian += slack.map(R::from);
            let cost = dot(&moved, y);
            size += norm(&moved).value();
            value += cost.times(0.5);
            terms += cost.value();
        }
        for (contact, (force, share)) in self.contacts.iter().zip(forces.iter_mut().zip(shares)) {
            let pull = contact.pull(y);
            let inverse = 1.0 / contact.weight;
            let half = 0.5 * contact.weight;
            let reference = contact.reference.map(R::from);
            let found = contact.project(&(reference + pull.map(|pull| pull.times(inverse))));
            (*force, *share) = (values(&found.force), found.share.value());
            if found.count == 0
                && !found.inside
                && found.force.iter().all(|component| *component == R::zero())
            {
                value -= dot(&reference, &reference).times(half);
                continue;
            }
            gradient += contact.wrench(&found.force);
            let moved = found.force - reference;
            let along = dot(&pull, &found.force);
            value += along - dot(&moved, &moved).times(half);
            terms += along.value().abs();
            size += (contact.weight * force.norm_squared()).sqrt();
            let mut found = found;
            if found.inside {
                if R::ROUNDING == 1.0 {
                    let gram = contact.gram * inverse;
                    hessian += gram.map(R::from);
                    continue;
                }
                // The product in doubles would hide weak directions.
                if found.count == 0 {
                    (0..contact.components).for_each(|k| found.push_unit(k));
                }
            }
            for (axis, factor) in found.axes.iter().zip(&found.shares).take(found.count) {
                let wrench = contact.wrench(axis);
                let factor = factor.times(inverse);
                for c in 0..D {
                    let by = factor * wrench[c];
                    for r in c..D {
                        hessian[(r, c)] += wrench[r] * by;
                    }
                }
            }
        }
        DualPoint { y: *y, value, gradient, hessian, size, terms }
    }
}

impl<const D: usize> DualContact<D> {
    /// `T G_i f`.
    #[inline]
    pub(crate) fn wrench<R: Real>(&self, force: &Force<R>) -> SVector<R, D> {
        let mut sum = self.columns[0].map(|x| force[0].times(x));
        for k in 1..self.components {
            for row in 0..D {
                sum[row] += force[k].times(self.columns[k][row]);
            }
        }
        sum
    }

    /// Components of the force: 3, or 4 with torsion.
    pub(crate) fn components(&self) -> usize {
        self.components
    }

    /// How far a force of share one over `unit` reaches along `h`.
    pub(crate) fn furthest<R: Real>(&self, h: &Force<R>) -> R {
        match &self.set {
            ForceSet::Cone(cone) => {
                let [o, t, torsion] = [h[1].times(cone.mu), h[2].times(cone.mu), h[3].times(cone.gamma)];
                h[0] + (o * o + t * t + torsion * torsion).square_root()
            }
            ForceSet::Finite(polytope) => polytope.furthest(h).1,
            ForceSet::Zero => R::zero(),
        }
    }

    /// The same contact with other forces.
    pub(crate) fn with(&self, set: &ForceSet) -> Self {
        Self { set: set.clone(), ..self.clone() }
    }

    /// The bounds of the share, times `unit`.
    pub(crate) fn bounds(&self) -> (f64, f64) {
        match &self.set {
            ForceSet::Cone(cone) => (cone.low, cone.high),
            ForceSet::Finite(polytope) => (polytope.low, polytope.high),
            ForceSet::Zero => (0.0, 0.0),
        }
    }

    /// How far forces reach along `h`; those without an upper bound up to the share `strongest`.
    pub(crate) fn reach(&self, h: &ContactForce, strongest: f64) -> f64 {
        let (low, high) = self.bounds();
        let furthest = self.furthest(h);
        let most = if high.is_finite() { high } else { strongest * self.unit };
        furthest * if furthest > 0.0 { most } else { low }
    }

    /// `(T G_i)^T y`.
    #[inline]
    pub(crate) fn pull<R: Real>(&self, y: &SVector<R, D>) -> Force<R> {
        let mut pull = Force::repeat(R::zero());
        for k in 0..self.components {
            let mut sum = R::zero();
            for row in 0..D {
                sum += y[row].times(self.columns[k][row]);
            }
            pull[k] = sum;
        }
        pull
    }

    #[inline]
    pub(crate) fn project<R: Real>(&self, x: &Force<R>) -> Projection<R> {
        match &self.set {
            ForceSet::Cone(cone) => {
                let mut found = cone.project(x);
                found.share = found.force[0] / R::from(self.unit);
                found
            }
            ForceSet::Finite(polytope) => polytope.project(x),
            ForceSet::Zero => Projection::fixed(Force::repeat(R::zero()), R::zero()),
        }
    }
}

fn force_set<const D: usize>(grasp: &Grasp<D>, i: usize) -> ForceSet {
    let contact = &grasp.contacts()[i];
    if let Some(range) = grasp.edges(i) {
        let general = matches!(contact.forces, ForceModel::Extreme(_));
        return ForceSet::Finite(Polytope::new(grasp.finite_forces()[range].to_vec(), general));
    }
    ForceSet::Cone(CutCone { mu: contact.friction, gamma: contact.torsion, low: 0.0, high: f64::INFINITY })
}

/// Orthonormal forces that span the set, which is one of contact `i`.
fn span<const D: usize>(grasp: &Grasp<D>, i: usize, set: &ForceSet) -> Vec<ContactForce> {
    if let ForceSet::Finite(polytope) = set {
        return Polytope::span(&polytope.forces);
    }
    let components = if grasp.contacts()[i].torsion > 0.0 { 4 } else { 3 };
    let axis = |component| {
        let mut axis = ContactForce::zeros();
        axis[component] = 1.0;
        axis
    };
    (0..components).map(axis).collect()
}
