//! Forces and their certificate in plain numbers, for pickles.

use graspforce::{ContactForce, Distribution, Wrench};

/// A distribution as it is pickled.
pub struct DistributionState {
    pub forces: Vec<[f64; 4]>,
    pub shares: Vec<f64>,
    /// The multipliers and the residual.
    pub wrenches: [Vec<f64>; 2],
    /// The objective, the largest share, their sum, the gap, its tolerance, the pivots and the distance.
    pub numbers: (f64, f64, f64, f64, f64, usize, f64),
    /// Whether another solver answered, and whether the forces are unique.
    pub answers: (bool, bool),
}

impl DistributionState {
    pub fn of<const D: usize>(distribution: &Distribution<D>) -> Self {
        Self {
            forces: distribution.forces.iter().map(|&force| force.into()).collect(),
            shares: distribution.shares.clone(),
            wrenches: [distribution.dual.as_slice().to_vec(), distribution.residual.as_slice().to_vec()],
            numbers: (
                distribution.sigma,
                distribution.sigma_max,
                distribution.sigma_sum,
                distribution.gap,
                distribution.tolerance,
                distribution.pivots,
                distribution.distance,
            ),
            answers: (distribution.fell_back, distribution.unique),
        }
    }

    pub fn distribution<const D: usize>(self) -> Distribution<D> {
        let [dual, residual] = self.wrenches.map(Wrench::from_vec);
        Distribution {
            forces: self.forces.into_iter().map(ContactForce::from).collect(),
            shares: self.shares,
            sigma: self.numbers.0,
            sigma_max: self.numbers.1,
            sigma_sum: self.numbers.2,
            dual,
            gap: self.numbers.3,
            pivots: self.numbers.5,
            residual,
            distance: self.numbers.6,
            tolerance: self.numbers.4,
            fell_back: self.answers.0,
            unique: self.answers.1,
        }
    }
}
