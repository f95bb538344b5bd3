//! What a program of listed extreme forces remembers: the critical regions of earlier wrenches with their bases.

use nalgebra::SVector;

use crate::force::linear_cones::critical_region::CriticalRegion;
use crate::force::linear_cones::critical_region_builder::BuilderWorkspace;
use crate::force::simplex::basis::Basis;
use crate::force::simplex::primal::Simplex;
use crate::grasp::Wrench;
use crate::tolerances::NEGATIVE_IN_KNOWN_REGION;

/// Regions remembered for wrenches that jump, and those whose memory is taken at once.
const REMEMBERED: usize = 128;
const PREALLOCATED: usize = 16;

/// Its buffers, and what it remembers of earlier wrenches.
#[derive(Debug, Clone)]
pub(crate) struct LinearWorkspace<const D: usize> {
    pub(crate) simplex: Simplex<D>,
    pub(crate) buffers: BuilderWorkspace<D>,
    pub(crate) active: Vec<u32>,
    pub(crate) remembered: Vec<Remembered<D>>,
    /// Of each region its multipliers, and whether it is a ray: side by side, because every look-up reads them all.
    proofs: Vec<(SVector<f64, D>, bool)>,
    pub(crate) latest: usize,
    /// Whether the reduced set gave the last answer that was not known already.
    pub(crate) confirmed: bool,
    pub(crate) clock: u64,
}

#[derive(Debug, Clone)]
pub(crate) struct Remembered<const D: usize> {
    pub(crate) region: CriticalRegion<D>,
    pub(crate) basis: Basis<D>,
    pub(crate) used: u64,
}

impl<const D: usize> Remembered<D> {
    /// A region with this multiplier answers nothing, and a basis of artificial columns starts nothing.
    pub(crate) fn forget(&mut self) {
        self.region.dual = SVector::zeros();
        self.basis.artificial = [true; D];
        self.used = 0;
    }
}

impl<const D: usize> LinearWorkspace<D> {
    /// Every region is as large as `blank`.
    pub(crate) fn new(blank: CriticalRegion<D>, contacts: usize, edges: usize) -> Self {
        let unknown = Remembered { region: blank, basis: Basis::new(contacts), used: 0 };
        let mut remembered = Vec::with_capacity(REMEMBERED);
        remembered.resize(PREALLOCATED, unknown);
        let mut proofs = Vec::with_capacity(REMEMBERED);
        proofs.resize(PREALLOCATED, (SVector::zeros(), false));
        Self {
            simplex: Simplex::new(contacts),
            buffers: BuilderWorkspace::with_capacity(contacts, edges + D * contacts),
            active: Vec::new(),
            remembered,
            proofs,
            latest: 0,
            confirmed: true,
            clock: 0,
        }
    }

    /// The region of the last wrench.
    pub(crate) fn latest(&self) -> &CriticalRegion<D> {
        &self.remembered[self.latest].region
    }

    /// The region that answers `b`, if it is known. Of all known multipliers the one that proves most of `b` is its own,
    /// or the best start of the dual simplex, which then continues from there. Rays prove nothing of other wrenches.
    pub(crate) fn look_up(&mut self, b: &Wrench<D>) -> Option<usize> {
        let (mut most, mut ray) = (f64::NEG_INFINITY, None);
        for (slot, (dual, is_ray)) in self.proofs.iter().enumerate() {
            let proves = dual.dot(b);
            if *is_ray {
                if proves > 0.0 && self.remembered[slot].region.answers(b, NEGATIVE_IN_KNOWN_REGION) {
                    ray = Some(slot);
                }
            } else if proves > most {
                (self.latest, most) = (slot, proves);
            }
        }
        let latest = &self.remembered[self.latest].region;
        ray.or_else(|| latest.answers(b, NEGATIVE_IN_KNOWN_REGION).then_some(self.latest))
    }

    /// A place for a new region: one more, or that of the one that was not used for the longest time. What is written
    /// there is looked up from [`Self::settle_on`] on.
    pub(crate) fn place(&mut self, blank: impl FnOnce() -> CriticalRegion<D>) -> usize {
        let oldest = (0..self.remembered.len()).min_by_key(|&k| self.remembered[k].used).unwrap_or(0);
        if self.remembered[oldest].used == 0 || self.remembered.len() == REMEMBERED {
            self.proofs[oldest] = (SVector::zeros(), false);
            return oldest;
        }
        let basis = self.remembered[oldest].basis.clone();
        self.remembered.push(Remembered { region: blank(), basis, used: 0 });
        self.proofs.push((SVector::zeros(), false));
        self.remembered.len() - 1
    }

    /// Makes the region in this place the latest.
    pub(crate) fn settle_on(&mut self, slot: usize) {
        let known = &mut self.remembered[slot];
        known.used = self.clock;
        self.proofs[slot] = (known.region.dual, known.region.is_ray());
        self.latest = slot;
    }

    /// Drops the known regions, but not their memory.
    pub(crate) fn forget(&mut self) {
        for known in &mut self.remembered {
            known.forget();
        }
        self.proofs.fill((SVector::zeros(), false));
    }
}
