//! The largest wrench along given directions that limited forces can resist (Eq. 7 with `sigma <= 1`).

use crate::error::{Error, Result, Unmet};
use crate::force::distributor::ForceDistributor;
use crate::force::workspace::ForceWorkspace;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::memory::room;
use crate::tolerances::AT_LIMIT;
use crate::wrench_set::Criterion;

/// Cuts of one direction. Linearised cones need a handful; true cones converge quadratically.
const MAX_CUTS: usize = 200;

impl<const D: usize> Grasp<D> {
    /// The largest multiple of each direction, as an external wrench, that forces within their limits balance
    /// on top of a constant `external_wrench`.
    ///
    /// Alone, a direction has least forces in proportion to it, so the multiple is `1 / sigma(direction)`, and
    /// zero where no forces balance it however strong they are. `epsilon` is the least of it over all unit
    /// directions. With a constant wrench it is the largest s with `sigma(external_wrench + s direction) <= 1`:
    /// sigma is convex, and each solve's dual cuts s from above.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, Grasp, Wrench};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
    ///     Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5)
    /// });
    /// let pinch = Grasp::<3>::new(&fingers)?;
    /// let down = Wrench::<3>::new(0.0, -1.0, 0.0);
    /// let most = pinch.resistance(&[down, 2.0 * down], Criterion::Max, None)?;
    /// assert!((most[0] - 1.0).abs() < 1e-12 && (most[1] - 0.5).abs() < 1e-12);
    /// let more = pinch.resistance(&[down, -down], Criterion::Max, Some(&(0.25 * down)))?;
    /// assert!((more[0] - 0.75).abs() < 1e-9 && (more[1] - 1.25).abs() < 1e-9);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    ///
    /// # Errors
    /// A direction is zero or not finite; the constant wrench is not finite, beyond the limits
    /// ([`Error::InvalidInput`]) or beyond all forces ([`Error::InfeasibleWrench`]); a solve does not converge.
    pub fn resistance(
        &self,
        directions: &[Wrench<D>],
        criterion: Criterion,
        external_wrench: Option<&Wrench<D>>,
    ) -> Result<Vec<f64>> {
        let distributor = ForceDistributor::new(self, criterion)?;
        let mut workspace = distributor.workspace();
        let constant = external_wrench.filter(|wrench| wrench.iter().any(|&x| x != 0.0));
        if let Some(wrench) = constant {
            if wrench.iter().any(|x| !x.is_finite()) {
                let reason = format!("{:?} is not finite", wrench.as_slice());
                return Err(Error::input("external_wrench", reason));
            }
            let sigma = distributor.solve(&mut workspace, wrench)?.sigma;
            if sigma > 1.0 + AT_LIMIT {
                let reason = format!(
                    "{:?} alone needs {sigma:.6} times the limits of the contacts: nothing can be resisted on top",
                    wrench.as_slice()
                );
                return Err(Error::input("external_wrench", reason));
            }
        }
        let mut multiple = |(row, direction): (usize, &Wrench<D>)| {
            let finite = direction.iter().all(|x| x.is_finite());
            if !finite || direction.amax() == 0.0 {
                let wrong = if finite { "has no direction" } else { "is not finite" };
                let reason = format!("{:?} {wrong}", direction.as_slice());
                return Err(Error::InvalidInput { argument: "directions", row: Some(row), reason });
            }
            interrupt::check()?;
            match constant {
                None => Ok(Cut::of(&distributor, &mut workspace, direction)?.1.recip()),
                Some(wrench) => on_top(&distributor, &mut workspace, wrench, direction),
            }
        };
        let mut multiples = room("directions", directions.len())?;
        for given in directions.iter().enumerate() {
            multiples.push(multiple(given)?);
        }
        Ok(multiples)
    }
}

/// Newton's method on `sigma(constant + s direction) = 1` from above: every `s` is at least the largest multiple,
/// because each dual z proves `sigma(w) >= -w . z`, and each witness e that forces balance no w with `-w . e > 0`.
fn on_top<const D: usize>(
    distributor: &ForceDistributor<D>,
    workspace: &mut ForceWorkspace<D>,
    constant: &Wrench<D>,
    direction: &Wrench<D>,
) -> Result<f64> {
    let (mut cut, _) = Cut::of(distributor, workspace, direction)?;
    let mut most = f64::INFINITY;
    let mut excess = f64::INFINITY;
    for _ in 0..MAX_CUTS {
        interrupt::check()?;
        let next = cut.root(constant, direction);
        // Rounding alone moves it: the largest multiple, to within what the solves can tell.
        if next.is_nan() || next >= most * (1.0 - f64::EPSILON) {
            return if excess <= 1e-6 { Ok(most) } else { Err(not_converged(excess)) };
        }
        most = next.max(0.0);
        if most == 0.0 {
            return Ok(0.0);
        }
        let (next, sigma) = Cut::of(distributor, workspace, &(constant + most * direction))?;
        if sigma <= 1.0 + AT_LIMIT {
            return Ok(most);
        }
        if sigma.is_finite() {
            excess = sigma - 1.0;
        }
        cut = next;
    }
    Err(not_converged(excess))
}

fn not_converged(found: f64) -> Error {
    let unmet = Unmet::Gap { found, allowed: 1e-6 };
    Error::NotConverged { solver: "resistance on top of an external wrench", iterations: MAX_CUTS, unmet }
}

/// Wrenches w that the limited forces balance have `-w . normal <= bound`.
struct Cut<const D: usize> {
    normal: Wrench<D>,
    bound: f64,
}

impl<const D: usize> Cut<D> {
    /// What a wrench proves, and its objective: infinite where no forces balance it.
    fn of(
        distributor: &ForceDistributor<D>,
        workspace: &mut ForceWorkspace<D>,
        wrench: &Wrench<D>,
    ) -> Result<(Self, f64)> {
        match distributor.solve(workspace, wrench) {
            Ok(forces) => Ok((Self { normal: forces.dual, bound: 1.0 }, forces.sigma)),
            Err(Error::InfeasibleWrench { direction, .. }) => {
                Ok((Self { normal: Wrench::from_column_slice(&direction), bound: 0.0 }, f64::INFINITY))
            }
            Err(error) => Err(error),
        }
    }

    /// The multiple at which `constant + s direction` leaves the half-space; NaN where it runs along it.
    fn root(&self, constant: &Wrench<D>, direction: &Wrench<D>) -> f64 {
        let rate = -direction.dot(&self.normal);
        if rate > 0.0 { (self.bound + constant.dot(&self.normal)) / rate } else { f64::NAN }
    }
}
