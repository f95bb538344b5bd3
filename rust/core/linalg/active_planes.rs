//! The active planes of a dual method with their multipliers: an orthogonal factorisation of their unit normals, updated
//! plane by plane.

use nalgebra::DVector;

/// Active planes in the order in which they joined.
#[derive(Debug, Clone)]
pub(crate) struct ActivePlanes {
    active: Vec<usize>,
    multipliers: Vec<f64>,
    /// Orthonormal axes `Q` of the span of the normals `N = Q R`.
    axes: Vec<DVector<f64>>,
    /// Columns of the upper triangular `R`, without their zeros.
    columns: Vec<Vec<f64>>,
}

impl ActivePlanes {
    pub(crate) fn new() -> Self {
        Self { active: Vec::new(), multipliers: Vec::new(), axes: Vec::new(), columns: Vec::new() }
    }

    pub(crate) fn contains(&self, plane: usize) -> bool {
        self.active.contains(&plane)
    }

    pub(crate) fn into_active(self) -> Vec<usize> {
        self.active
    }

    /// What of a vector lies beyond the span of the normals, and the coordinates of the rest along the axes.
    pub(crate) fn beyond(&self, vector: &DVector<f64>) -> (DVector<f64>, Vec<f64>) {
        let mut rest = vector.clone();
        let mut coordinates = vec![0.0; self.axes.len()];
        // Twice, for what cancellation leaves the first time.
        for _ in 0..2 {
            for (axis, coordinate) in self.axes.iter().zip(&mut coordinates) {
                let share = axis.dot(&rest);
                rest.axpy(-share, axis, 1.0);
                *coordinate += share;
            }
        }
        (rest, coordinates)
    }

    /// The coefficients of the normals in a vector with these coordinates; `None` where they are dependent.
    pub(crate) fn shares(&self, coordinates: &[f64]) -> Option<Vec<f64>> {
        let mut shares = coordinates.to_vec();
        for k in (0..shares.len()).rev() {
            let column = &self.columns[k];
            if column[k] == 0.0 {
                return None;
            }
            shares[k] /= column[k];
            let share = shares[k];
            shares[..k].iter_mut().zip(column).for_each(|(other, r)| *other -= share * r);
        }
        Some(shares)
    }

    /// The plane whose multiplier is zero first when multipliers fall by `shares`, and after how long a step.
    pub(crate) fn first_to_leave(&self, shares: &[f64]) -> Option<(usize, f64)> {
        let falling =
            shares.iter().zip(&self.multipliers).enumerate().filter(|(_, (share, _))| **share > 0.0);
        falling.map(|(k, (share, u))| (k, u / share)).min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Takes a step by which the multipliers fall.
    pub(crate) fn ease(&mut self, shares: &[f64], step: f64) {
        self.multipliers.iter_mut().zip(shares).for_each(|(u, share)| *u -= step * share);
    }

    /// Adds a plane whose unit normal is `along` and what `coordinates` say.
    pub(crate) fn join(
        &mut self,
        plane: usize,
        multiplier: f64,
        along: DVector<f64>,
        mut coordinates: Vec<f64>,
    ) {
        let length = along.norm();
        self.active.push(plane);
        self.multipliers.push(multiplier);
        self.axes.push(along / length);
        coordinates.push(length);
        self.columns.push(coordinates);
    }

    /// Removes the `k`-th plane; rotations of the axes keep `R` triangular.
    pub(crate) fn leave(&mut self, k: usize) {
        self.active.remove(k);
        self.multipliers.remove(k);
        self.columns.remove(k);
        for j in k..self.columns.len() {
            let (a, b) = (self.columns[j][j], self.columns[j][j + 1]);
            let length = a.hypot(b);
            let (c, s) = if length > 0.0 { (a / length, b / length) } else { (1.0, 0.0) };
            for column in &mut self.columns[j..] {
                let (upper, lower) = (column[j], column[j + 1]);
                (column[j], column[j + 1]) = (c * upper + s * lower, c * lower - s * upper);
            }
            self.columns[j].truncate(j + 1);
            let (upper, lower) = (self.axes[j].clone(), self.axes[j + 1].clone());
            self.axes[j] = &upper * c + &lower * s;
            self.axes[j + 1] = lower * c - upper * s;
        }
        self.axes.pop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factorisation_follows_planes_that_join_and_leave() {
        let normal = |k: usize| {
            DVector::from_fn(5, |i, _| (((k + 2) * (i + 1) * (i + k + 1)) as f64 * 0.37).sin()).normalize()
        };
        let mut planes = ActivePlanes::new();
        for (plane, leaves) in [(0, None), (1, None), (2, None), (3, Some(1)), (4, Some(0)), (5, Some(2))] {
            let (along, coordinates) = planes.beyond(&normal(plane));
            planes.join(plane, 1.0, along, coordinates);
            if let Some(k) = leaves {
                planes.leave(k);
            }
            for (k, &own) in planes.active.iter().enumerate() {
                let (beyond, coordinates) = planes.beyond(&normal(own));
                let shares = planes.shares(&coordinates).unwrap();
                assert!(beyond.norm() < 1e-14);
                assert!(
                    shares.iter().enumerate().all(|(j, s)| (s - f64::from(u8::from(j == k))).abs() < 1e-12)
                );
            }
        }
        assert_eq!(planes.into_active(), [2, 3, 5]);
    }
}
