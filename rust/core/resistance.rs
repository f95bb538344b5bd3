//! How large a wrench along given directions the limited forces can resist.

use crate::error::{Error, Result};
use crate::force_distributor::ForceDistributor;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::memory::room;
use crate::wrench_set::Criterion;

impl<const D: usize> Grasp<D> {
    /// The largest multiple of each direction, as an external wrench, that forces within their limits balance.
    ///
    /// Least forces grow in proportion to the wrench, so this is `1 / sigma(direction)`, and zero where no
    /// forces balance it however strong they are. `epsilon` is the least of it over all unit directions.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, Grasp, Wrench};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
    ///     Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5)
    /// });
    /// let down = Wrench::<3>::new(0.0, -1.0, 0.0);
    /// let most = Grasp::<3>::new(&fingers)?.resistance(&[down, 2.0 * down], Criterion::Max)?;
    /// assert!((most[0] - 1.0).abs() < 1e-12 && (most[1] - 0.5).abs() < 1e-12);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn resistance(&self, directions: &[Wrench<D>], criterion: Criterion) -> Result<Vec<f64>> {
        let distributor = ForceDistributor::new(self, criterion)?;
        let multiple = |(row, direction): (usize, &Wrench<D>)| {
            let unusable = direction.amax() == 0.0 || direction.iter().any(|x| !x.is_finite());
            if unusable {
                let reason = format!("{:?} has no direction", direction.as_slice());
                return Err(Error::InvalidInput { argument: "directions", row: Some(row), reason });
            }
            interrupt::check()?;
            match distributor.solve(direction) {
                Ok(forces) => Ok(forces.sigma.recip()),
                Err(Error::InfeasibleWrench { .. }) => Ok(0.0),
                Err(error) => Err(error),
            }
        };
        let mut multiples = room("directions", directions.len())?;
        for given in directions.iter().enumerate() {
            multiples.push(multiple(given)?);
        }
        Ok(multiples)
    }
}
