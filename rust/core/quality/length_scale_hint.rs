//! Whether a length scale suits the size of a grasp.

use nalgebra::Vector3;

use crate::grasp::Grasp;

/// A length scale this many times the extent of the contacts makes quality a matter of torques alone.
const TORQUES_ALONE: f64 = 10.0;

/// Contacts whose pairs are measured: a millisecond. Of more, the diagonal of the box that holds them is their extent.
const MOST_PAIRED: usize = 1000;

impl<const D: usize> Grasp<D> {
    /// Advice where the length scale is ten times the extent of the contacts (the largest distance between two of them)
    /// or more: torques then decide the quality alone, whatever the forces. More than 1,000 contacts count by the diagonal of
    /// the box that holds them, which is no less.
    ///
    /// ```
    /// use graspforce::{Contact, Grasp};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-0.04, 1.0), (0.04, -1.0)]
    ///     .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)));
    /// assert!(Grasp::<6>::new(&fingers)?.length_scale_hint().is_some());
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn length_scale_hint(&self) -> Option<String> {
        let positions = self.contacts().iter().map(|contact| contact.position);
        // The extent lies between the longest side of the box and its diagonal: most grasps need no pairs.
        let (mut low, mut high) = (self.contacts()[0].position, self.contacts()[0].position);
        for position in positions.clone() {
            (low, high) = (low.inf(&position), high.sup(&position));
        }
        let sides = high - low;
        let scale = self.options().length_scale;
        if sides.amax() == 0.0 || scale < TORQUES_ALONE * sides.amax() {
            return None;
        }
        let apart = |r: Vector3<f64>| positions.clone().map(move |other| (other - r).norm());
        let extent = if self.num_contacts() > MOST_PAIRED {
            sides.norm()
        } else {
            positions.clone().flat_map(apart).fold(0.0, f64::max)
        };
        (scale >= TORQUES_ALONE * extent).then(|| {
            format!(
                "the length scale of {scale} m is {:.0} times the contacts' extent of {extent:.2e} m, so torques alone \
                 decide epsilon; a length_scale near the object's radius weighs forces and torques alike",
                scale / extent
            )
        })
    }
}
