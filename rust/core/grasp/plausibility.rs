//! What contacts look like when their normals point the wrong way or some of them are in other units.
//!
//! A grasp does not know its object, so nothing here is certain: contacts on the wall of a cavity have normals that
//! point away from their centre, too.

use nalgebra::Vector3;

use crate::grasp::contact::Contact;
use crate::tolerances::AWAY_FROM_CENTRE;

/// Contacts that are farther from the others than this many times the extent of both are in other units.
const OTHER_UNIT: f64 = 100.0;

/// Contacts that a message names at most.
const MAX_NAMED: usize = 4;

/// What is implausible about contacts with unit normals, if anything is. Linear in their number.
#[must_use]
pub fn implausibility(contacts: &[Contact]) -> Option<String> {
    all_outward(contacts).or_else(|| two_units(contacts))
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

/// Two groups of contacts that are far apart beside their own extents.
fn two_units(contacts: &[Contact]) -> Option<String> {
    let first = contacts.first()?.position;
    let apart = |contact: &Contact| (contact.position - first).norm();
    let farthest = contacts.iter().map(apart).fold(0.0, f64::max);
    if contacts.len() < 3 || farthest == 0.0 {
        return None;
    }
    // If there are two such groups, half the largest distance from one contact tells them apart.
    let (near, far): (Vec<_>, Vec<_>) =
        (0..contacts.len()).partition(|&i| apart(&contacts[i]) <= farthest / 2.0);
    let boxes = [&near, &far].map(|group| Extent::of(group.iter().map(|&i| &contacts[i].position)));
    let extent = f64::max(boxes[0].diagonal(), boxes[1].diagonal());
    let gap = boxes[0].gap(&boxes[1]);
    if gap <= OTHER_UNIT * extent {
        return None;
    }
    let strangers = if far.len() <= near.len() { &far } else { &near };
    let names: Vec<_> = strangers.iter().take(MAX_NAMED).map(ToString::to_string).collect();
    let (s, more) =
        (if names.len() > 1 { "s" } else { "" }, if strangers.len() > MAX_NAMED { ", ..." } else { "" });
    Some(format!(
        "positions, contact{s} {}{more}: {:?} is {gap:.3e} m from the other contacts, which lie within {extent:.3e} m \
         of each other; are all of them in the same unit?",
        names.join(", "),
        contacts[strangers[0]].position.as_slice()
    ))
}

/// The smallest box that holds some points.
struct Extent {
    least: Vector3<f64>,
    most: Vector3<f64>,
}

impl Extent {
    fn of<'a>(points: impl Iterator<Item = &'a Vector3<f64>>) -> Self {
        let empty = Self { least: Vector3::repeat(f64::INFINITY), most: Vector3::repeat(f64::NEG_INFINITY) };
        points.fold(empty, |all, point| Self { least: all.least.inf(point), most: all.most.sup(point) })
    }

    fn diagonal(&self) -> f64 {
        (self.most - self.least).norm()
    }

    /// The distance between two boxes.
    fn gap(&self, other: &Self) -> f64 {
        let apart = (self.least - other.most).sup(&(other.least - self.most));
        apart.sup(&Vector3::zeros()).norm()
    }
}
