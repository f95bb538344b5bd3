//! What contacts look like when their normals point the wrong way or one of them is in other units.
//!
//! A grasp does not know its object, so nothing here is certain: contacts on the wall of a cavity have normals that
//! point away from their centre, too.

use nalgebra::Vector3;

use crate::grasp::contact::Contact;
use crate::tolerances::AWAY_FROM_CENTRE;

/// A contact that is farther from the others than this many times their own extent is in other units.
const OTHER_UNIT: f64 = 100.0;

/// What is implausible about contacts with unit normals, if anything is. Linear in their number, unless one of them
/// is far from the others.
#[must_use]
pub fn implausibility(contacts: &[Contact]) -> Option<String> {
    all_outward(contacts).or_else(|| one_far_away(contacts))
}

fn all_outward(contacts: &[Contact]) -> Option<String> {
    let centre =
        contacts.iter().map(|contact| contact.position / contacts.len() as f64).sum::<Vector3<f64>>();
    let away = |contact: &Contact| {
        let inward = centre - contact.position;
        contact.normal.dot(&inward) < AWAY_FROM_CENTRE * inward.norm()
    };
    contacts.iter().all(away).then(|| {
        "normals: all of them point away from the contacts' centre; they must point into the object, so turn them \
         round, unless the contacts press from inside a cavity"
            .to_string()
    })
}

fn one_far_away(contacts: &[Contact]) -> Option<String> {
    if contacts.len() < 3 {
        return None;
    }
    let apart = |i: usize, j: usize| (contacts[i].position - contacts[j].position).norm();
    // The one that is far away from all others is far away from the first, or is the first itself.
    let (mut far, mut distance) = (1, apart(0, 1));
    for i in 2..contacts.len() {
        let from_first = apart(0, i);
        if from_first > distance {
            (far, distance) = (i, from_first);
        }
    }
    let first_is_far = (1..contacts.len()).all(|i| apart(0, i) > distance / 2.0);
    let suspects = [Some(far), first_is_far.then_some(0)];
    suspects.into_iter().flatten().find_map(|far| {
        let others = || (0..contacts.len()).filter(move |&i| i != far);
        let gap = others().map(|i| apart(far, i)).fold(f64::INFINITY, f64::min);
        let one = usize::from(far == 0);
        let reach = others().map(|i| apart(one, i)).fold(0.0, f64::max);
        // The extent is at least the reach from any one of them, and the quadratic count is for the rare suspect.
        if reach == 0.0 || gap <= OTHER_UNIT * reach {
            return None;
        }
        let extent = others().flat_map(|i| others().map(move |j| (i, j))).map(|(i, j)| apart(i, j));
        let extent = extent.fold(0.0, f64::max);
        (gap > OTHER_UNIT * extent).then(|| {
            format!(
                "positions, contact {far}: {:?} is {gap:.3e} m from the other contacts, which lie within \
                 {extent:.3e} m of each other; are all of them in the same unit?",
                contacts[far].position.as_slice()
            )
        })
    })
}
