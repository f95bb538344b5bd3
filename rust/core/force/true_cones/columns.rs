//! Columns over true friction cones: the support query has a closed form, so columns are generated as they are
//! needed and none is ever listed.
//!
//! With `v = G_i^T z`, contact i reaches `f^U (v_n + sqrt(mu^2 (v_o^2 + v_t^2) + gamma^2 v_torsion^2))`.

use nalgebra::{SMatrix, SVector};

use crate::force::equilibration::Equilibration;
use crate::force::simplex::pricing::{Column, Objective, Pricing, UNUSED};
use crate::grasp::Grasp;
use crate::grasp::contact::ContactForce;
use crate::wrench_set::{cone_slope, cone_support};

/// Marks a contact that a column uses; which force follows from the column's direction.
const USED: u32 = 0;

/// One contact in equilibrated coordinates.
#[derive(Debug, Clone)]
pub(crate) enum ConeContact<const D: usize> {
    /// `T G_i f^U` with the friction coefficients.
    Cone { map: SMatrix<f64, D, 4>, limit: f64, mu: f64, gamma: f64 },
    /// Extreme forces and their wrenches.
    Finite { wrenches: Vec<SVector<f64, D>>, forces: Vec<ContactForce> },
}

/// The wrench set of a grasp with true cones.
#[derive(Debug, Clone)]
pub(crate) struct ConeColumns<const D: usize> {
    pub(crate) objective: Objective,
    pub(crate) contacts: Vec<ConeContact<D>>,
    threshold: f64,
}

impl<const D: usize> ConeColumns<D> {
    /// `tolerance` is the relative gap at which column generation may stop.
    pub(crate) fn new(
        grasp: &Grasp<D>,
        objective: Objective,
        equilibration: &Equilibration<D>,
        tolerance: f64,
    ) -> Self {
        let contact = |i| ConeContact::new(grasp, i, equilibration);
        let contacts = (0..grasp.num_contacts()).map(contact).collect();
        Self { objective, contacts, threshold: 0.5 * tolerance * objective.unit() }
    }

    /// The same columns with another relative gap.
    pub(crate) fn with_tolerance(&self, tolerance: f64) -> Self {
        Self { threshold: 0.5 * tolerance * self.objective.unit(), ..self.clone() }
    }

    pub(crate) fn num_contacts(&self) -> usize {
        self.contacts.len()
    }

    /// How much too far a multiplier reaches.
    pub(crate) fn reach(&self, z: &SVector<f64, D>) -> f64 {
        self.objective.reach(self.contacts.iter().map(|contact| contact.support(z).0))
    }

    /// The force that contact `i` exerts in a column that was priced at `z`.
    pub(crate) fn force(&self, contact: usize, z: &SVector<f64, D>) -> ContactForce {
        self.contacts[contact].force(z)
    }
}

impl<const D: usize> ConeContact<D> {
    pub(crate) fn new(grasp: &Grasp<D>, i: usize, equilibration: &Equilibration<D>) -> Self {
        let described = &grasp.contacts()[i];
        if let Some(range) = grasp.edges(i) {
            let wrenches = &grasp.finite_wrenches()[range.clone()];
            return Self::Finite {
                wrenches: wrenches.iter().map(|w| equilibration.wrench(w)).collect(),
                forces: grasp.finite_forces()[range].to_vec(),
            };
        }
        let limit = described.max_normal_force;
        let mut map = SMatrix::<f64, D, 4>::zeros();
        for (k, column) in grasp.maps()[i].column_iter().enumerate() {
            map.set_column(k, &(equilibration.wrench(&column.into_owned()) * limit));
        }
        Self::Cone { map, limit, mu: described.friction, gamma: described.torsion }
    }

    /// The force that reaches furthest along `z`.
    pub(crate) fn force(&self, z: &SVector<f64, D>) -> ContactForce {
        match self {
            Self::Cone { map, limit, mu, gamma } => cone_support(&map.tr_mul(z), *mu, *gamma) * *limit,
            Self::Finite { wrenches, forces } => forces[best_of(wrenches, z).1],
        }
    }

    /// `h_i(z)` and the wrench that attains it.
    pub(crate) fn support(&self, z: &SVector<f64, D>) -> (f64, SVector<f64, D>) {
        match self {
            Self::Cone { map, mu, gamma, .. } => {
                let v = map.tr_mul(z);
                (v[0] + cone_slope(&v, *mu, *gamma), map * cone_support(&v, *mu, *gamma))
            }
            Self::Finite { wrenches, .. } => {
                let (value, edge) = best_of(wrenches, z);
                (value, wrenches[edge])
            }
        }
    }
}

pub(crate) fn best_of<const D: usize>(wrenches: &[SVector<f64, D>], z: &SVector<f64, D>) -> (f64, usize) {
    let values = wrenches.iter().map(|w| w.dot(z)).enumerate();
    values.fold((f64::NEG_INFINITY, 0), |best, (edge, h)| if h > best.0 { (h, edge) } else { best })
}

impl<const D: usize> Pricing<D> for ConeColumns<D> {
    fn furthest(&self, z: &SVector<f64, D>, discount: f64, edges: &mut [u32]) -> Column<D> {
        edges.fill(UNUSED);
        let weight = discount * self.objective.weight();
        let mut wrench = SVector::zeros();
        let (mut count, mut best) = (0, (f64::NEG_INFINITY, 0, SVector::zeros()));
        for (i, contact) in self.contacts.iter().enumerate() {
            let (value, point) = contact.support(z);
            if value > best.0 {
                best = (value, i, point);
            }
            if value > weight && self.objective != Objective::Sum {
                wrench += point;
                edges[i] = USED;
                count += 1;
            }
        }
        if count == 0 {
            edges[best.1] = USED;
            (wrench, count) = (best.2, 1);
        }
        Column { wrench, costs: [self.objective.costs(count)[0], 0.0], direction: *z }
    }

    fn tie_break(&self, _: &[SVector<f64, D>; 2], _: f64, _: &mut [u32]) -> Option<Column<D>> {
        None
    }

    fn optimality(&self) -> f64 {
        self.threshold
    }
}
