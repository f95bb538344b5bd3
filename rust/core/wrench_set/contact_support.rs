//! The support oracle of one contact: how far do your wrenches reach along `z`, where, and by which force?
//!
//! Quality and force distribution ask nobody else. A contact is finite (the convex hull of its extreme forces, Eq. 3) or a
//! true friction cone, hard or soft. Its wrenches are seen through a linear map `A`: the metric's for quality, the
//! equilibration's for force distribution. Extreme forces are numbered over all contacts of the grasp. With
//! `h = (A G_i)^T z`,
//!
//! - the finite contact reaches `h_i = max_h w_ih . z`;
//! - the true cone reaches `h_i = f^U (h_n + sqrt(mu^2 (h_o^2 + h_t^2) + gamma^2 h_torsion^2))`.

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, Wrench};
use crate::wrench_set::cone::{cone_slope, cone_support};
use crate::wrench_set::edge_blocks::{
    EdgeBlock, EdgeBlocks, edge, edge_blocks, edges_reaching, furthest_edge, furthest_value, longest_edge,
};
use crate::wrench_set::soft_lattice::SoftLattice;

/// The wrenches of one contact in a linear map, ready for products with a direction.
#[derive(Debug, Clone)]
pub(crate) enum ContactSupport<const R: usize> {
    /// The wrenches of extreme forces in blocks; these forces are `count` of those of the grasp, from `first` on. Where
    /// they lie on a lattice, few of them need a look.
    Finite { blocks: EdgeBlocks<R>, lattice: Option<Box<SoftLattice<R>>>, first: usize, count: usize },
    /// `A G_i f^U` with the limit `f^U` and the friction coefficients `mu` and `gamma`.
    Cone { map: SMatrix<f64, R, 4>, limit: f64, mu: f64, gamma: f64 },
}

impl<const R: usize> ContactSupport<R> {
    /// A contact that exerts these wrenches by extreme forces of a grasp, from number `first` on.
    pub(crate) fn finite(wrenches: impl ExactSizeIterator<Item = SVector<f64, R>>, first: usize) -> Self {
        let count = wrenches.len();
        Self::Finite { blocks: edge_blocks(wrenches), lattice: None, first, count }
    }

    /// A true cone under the map `A G_i`, with normal forces up to `limit`.
    pub(crate) fn cone(map: &SMatrix<f64, R, 4>, mu: f64, gamma: f64, limit: f64) -> Self {
        Self::Cone { map: map * limit, limit, mu, gamma }
    }

    /// Contact `i` of a grasp in the map `A`.
    pub(crate) fn of_contact<const D: usize>(
        grasp: &Grasp<D>,
        i: usize,
        map: impl Fn(&Wrench<D>) -> SVector<f64, R>,
    ) -> Self {
        if let Some(range) = grasp.edges(i) {
            let first = range.start;
            let mut contact = Self::finite(grasp.finite_wrenches()[range].iter().map(&map), first);
            if let Self::Finite { blocks, lattice, .. } = &mut contact {
                *lattice = SoftLattice::of_contact(grasp, i, map, blocks).map(Box::new);
            }
            return contact;
        }
        let contact = &grasp.contacts()[i];
        let mut mapped = SMatrix::<f64, R, 4>::zeros();
        for (k, column) in grasp.maps()[i].column_iter().enumerate() {
            mapped.set_column(k, &map(&column.into_owned()));
        }
        Self::cone(&mapped, contact.friction, contact.torsion, contact.max_normal_force)
    }

    /// `h_i(z)`, and the number of the extreme force that attains it: the lowest among equals, zero for a true cone.
    #[inline]
    pub(crate) fn furthest(&self, z: &SVector<f64, R>) -> (f64, usize) {
        match self {
            Self::Finite { blocks, lattice: None, first, .. } => {
                let (value, own) = furthest_edge(blocks, z);
                (value, first + own)
            }
            Self::Finite { blocks, lattice: Some(lattice), first, .. } => {
                let (value, own) = lattice.furthest(blocks, z).unwrap_or_else(|| furthest_edge(blocks, z));
                (value, first + own)
            }
            Self::Cone { map, mu, gamma, .. } => {
                let h = map.tr_mul(z);
                (h[0] + cone_slope(&h, *mu, *gamma), 0)
            }
        }
    }

    /// Whether the contact lists its extreme forces.
    pub(crate) fn is_finite(&self) -> bool {
        matches!(self, Self::Finite { .. })
    }

    /// The wrenches of the extreme forces; none of a true cone.
    pub(crate) fn wrenches(&self) -> impl Iterator<Item = SVector<f64, R>> {
        let (blocks, range) = self.listed();
        (0..range.len()).map(move |own| edge(blocks, own))
    }

    /// The wrenches in blocks, and the numbers of their extreme forces.
    fn listed(&self) -> (&[EdgeBlock<R>], Range<usize>) {
        match self {
            Self::Finite { blocks, first, count, .. } => (blocks, *first..first + count),
            Self::Cone { .. } => (&[], 0..0),
        }
    }

    /// The numbers of the extreme forces that reach at least `least` along `z`; none of a true cone.
    pub(crate) fn edges_reaching(&self, z: &SVector<f64, R>, least: f64) -> impl Iterator<Item = usize> {
        let (blocks, range) = self.listed();
        edges_reaching(blocks, range.len(), z, least).map(move |own| range.start + own)
    }

    /// `h_i(z)`.
    #[inline]
    pub(crate) fn value(&self, z: &SVector<f64, R>) -> f64 {
        match self {
            Self::Finite { blocks, lattice: None, .. } => furthest_value(blocks, z),
            _ => self.furthest(z).0,
        }
    }

    /// The wrench along `z`, whose extreme force has the number `at` that [`Self::furthest`] gives.
    #[inline]
    pub(crate) fn wrench(&self, z: &SVector<f64, R>, at: usize) -> SVector<f64, R> {
        match self {
            Self::Finite { blocks, first, .. } => edge(blocks, at - first),
            Self::Cone { map, mu, gamma, .. } => cone_wrench(map, z, *mu, *gamma),
        }
    }

    /// Which extreme forces of the grasp are the contact's; none of a true cone.
    pub(crate) fn range(&self) -> Range<usize> {
        self.listed().1
    }

    /// The force, in the contact frame, that exerts [`Self::wrench`], where `all` are the extreme forces of the grasp.
    pub(crate) fn force(&self, z: &SVector<f64, R>, at: usize, all: &[ContactForce]) -> ContactForce {
        match self {
            Self::Finite { .. } => all[at],
            Self::Cone { map, limit, mu, gamma } => cone_support(&map.tr_mul(z), *mu, *gamma) * *limit,
        }
    }

    /// No wrench of the contact is longer than this.
    pub(crate) fn longest(&self) -> f64 {
        match self {
            Self::Finite { blocks, .. } => longest_edge(blocks),
            Self::Cone { map, mu, gamma, .. } => {
                let lengths = ContactForce::from_fn(|column, _| map.column(column).norm());
                lengths[0] + cone_slope(&lengths, *mu, *gamma)
            }
        }
    }
}

/// The wrench of a true cone along `z`. Of its own, so that the lookup of a listed wrench is inlined.
#[inline(never)]
fn cone_wrench<const R: usize>(
    map: &SMatrix<f64, R, 4>,
    z: &SVector<f64, R>,
    mu: f64,
    gamma: f64,
) -> SVector<f64, R> {
    map * cone_support(&map.tr_mul(z), mu, gamma)
}
