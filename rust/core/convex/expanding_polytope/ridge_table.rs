//! Pairs new facets along their shared sub-ridges.
//!
//! Every new facet is a horizon ridge joined to the new point, so two of them are neighbours where they share
//! `D - 2` vertices of the horizon. The horizon is a cycle modulo 2: each sub-ridge occurs an even number of
//! times, and more than twice where facets are coplanar. *Toggling* an entry pairs the occurrences two by
//! two, whatever their number.

/// One side of a ridge: a facet and the slot of the vertex opposite to the ridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Side {
    pub(crate) facet: u32,
    pub(crate) slot: u32,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    key: u64,
    side: Side,
    round: u32,
    waiting: bool,
}

const EMPTY: Entry = Entry { key: 0, side: Side { facet: 0, slot: 0 }, round: 0, waiting: false };

/// An open-addressing table that is emptied in O(1) by starting a new round.
#[derive(Debug, Clone)]
pub(crate) struct RidgeTable {
    entries: Vec<Entry>,
    round: u32,
    used: usize,
    waiting: usize,
}

impl RidgeTable {
    pub(crate) fn new() -> Self {
        Self { entries: vec![EMPTY; 256], round: 0, used: 0, waiting: 0 }
    }

    /// Forgets all entries.
    pub(crate) fn clear(&mut self) {
        if self.round == u32::MAX {
            self.entries.fill(EMPTY);
            self.round = 0;
        }
        self.round += 1;
        self.used = 0;
        self.waiting = 0;
    }

    /// Whether every sub-ridge has found its partner.
    pub(crate) fn is_paired(&self) -> bool {
        self.waiting == 0
    }

    /// Returns the waiting partner of `key` and forgets it, or makes `side` wait.
    #[inline]
    pub(crate) fn toggle(&mut self, key: u64, side: Side) -> Option<Side> {
        if self.used * 2 >= self.entries.len() {
            self.grow();
        }
        let mask = self.entries.len() - 1;
        let mut at = slot_of(key, mask);
        loop {
            let entry = &mut self.entries[at];
            if entry.round != self.round {
                *entry = Entry { key, side, round: self.round, waiting: true };
                self.used += 1;
                self.waiting += 1;
                return None;
            }
            if entry.key == key {
                entry.waiting = !entry.waiting;
                if entry.waiting {
                    entry.side = side;
                    self.waiting += 1;
                    return None;
                }
                self.waiting -= 1;
                return Some(entry.side);
            }
            at = (at + 1) & mask;
        }
    }

    fn grow(&mut self) {
        let larger = vec![EMPTY; self.entries.len() * 2];
        let mask = larger.len() - 1;
        for entry in std::mem::replace(&mut self.entries, larger) {
            if entry.round == self.round {
                let mut at = slot_of(entry.key, mask);
                while self.entries[at].round == self.round {
                    at = (at + 1) & mask;
                }
                self.entries[at] = entry;
            }
        }
    }
}

#[inline]
fn slot_of(key: u64, mask: usize) -> usize {
    (key.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32) as usize & mask
}

#[cfg(test)]
mod tests {
    use super::*;

    fn side(facet: u32) -> Side {
        Side { facet, slot: 0 }
    }

    #[test]
    fn occurrences_pair_two_by_two() {
        let mut table = RidgeTable::new();
        table.clear();
        let partners: Vec<_> = (0..4).map(|facet| table.toggle(7, side(facet))).collect();
        assert_eq!(partners, [None, Some(side(0)), None, Some(side(2))]);
        assert!(table.is_paired());
    }

    #[test]
    fn entries_survive_growth_and_vanish_with_the_round() {
        let mut table = RidgeTable::new();
        table.clear();
        assert!((0..5000).all(|key| table.toggle(key, side(key as u32)).is_none()));
        assert!((0..5000).all(|key| table.toggle(key, side(0)) == Some(side(key as u32))));
        assert!(table.is_paired());
        table.toggle(1, side(1));
        assert!(!table.is_paired());
        table.clear();
        assert!(table.is_paired());
        assert_eq!(table.toggle(1, side(9)), None);
    }
}
