//! The arguments of least squares: references, weights, the price of the residual, limits.

use graspforce::{ContactForce, ForceDistributor, Grasp, Metric, SquaresOptions};
use nalgebra::SMatrix;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use crate::convert::arrays::{contents, float_array, refuse_not_finite, shaped};
use crate::convert::significant::significant;

/// As Python passed them, ready to pickle.
#[derive(Clone, Default)]
pub struct SquaresArguments {
    /// (m, k), row by row.
    pub reference: Option<Vec<Vec<f64>>>,
    pub weights: Option<Vec<f64>>,
    /// (d, d), row by row.
    pub slack: Option<Vec<Vec<f64>>>,
    pub limits: bool,
}

impl SquaresArguments {
    /// The arguments of a grasp with m contacts, forces of k components and wrenches of d; or what is wrong with them.
    pub fn parse(
        reference: Option<&Bound<'_, PyAny>>,
        weights: Option<&Bound<'_, PyAny>>,
        slack: Option<&Bound<'_, PyAny>>,
        limits: bool,
        [m, k, d]: [usize; 3],
    ) -> Result<Self, String> {
        let reference = reference.map(|value| reference_rows(value, [m, k])).transpose()?;
        let weights = weights.map(|value| {
            let array = float_array("weights", value)?;
            match (array.shape(), contents(&array)) {
                ([], &[all]) => Ok(vec![all]),
                ([count], each) if *count == m => Ok(each.to_vec()),
                (given, _) => Err(format!("weights: shape {}, expected a number or ({m},)", shaped(given))),
            }
        });
        let slack = slack.map(|value| {
            let array = float_array("slack", value)?;
            refuse_not_finite("slack", &array)?;
            let law = |k: usize| {
                let component =
                    if array.shape().is_empty() { String::new() } else { format!(", component {k}") };
                format!("slack{component}: {} must be positive", significant(contents(&array)[k], 6))
            };
            let refused = contents(&array).iter().position(|price| *price <= 0.0).map(law);
            let diagonal = |entry: &dyn Fn(usize) -> f64| {
                (0..d).map(|r| (0..d).map(|c| if r == c { entry(r) } else { 0.0 }).collect()).collect()
            };
            match (array.shape(), contents(&array)) {
                ([], &[all]) => refused.map_or_else(|| Ok(diagonal(&|_| all)), Err),
                ([count], each) if *count == d => refused.map_or_else(|| Ok(diagonal(&|r| each[r])), Err),
                ([a, b], all) if *a == d && *b == d => Ok(all.chunks(d).map(<[f64]>::to_vec).collect()),
                (given, _) => {
                    Err(format!("slack: shape {}, expected a number, ({d},) or ({d}, {d})", shaped(given)))
                }
            }
        });
        Ok(Self { reference, weights: weights.transpose()?, slack: slack.transpose()?, limits })
    }

    /// Refuses them beside another objective.
    pub fn refuse(
        reference: Option<&Bound<'_, PyAny>>,
        weights: Option<&Bound<'_, PyAny>>,
        slack: Option<&Bound<'_, PyAny>>,
        limits: bool,
    ) -> Result<Self, String> {
        let given = [
            ("reference", reference.is_some()),
            ("weights", weights.is_some()),
            ("slack", slack.is_some()),
            ("limits", limits),
        ];
        match given.iter().find(|(_, given)| *given) {
            None => Ok(Self::default()),
            Some((name, _)) => Err(format!("{name}: only the objective \"squares\" takes it")),
        }
    }

    pub fn options<const D: usize>(
        &self,
        grasp: &Grasp<D>,
        min_normal: Vec<f64>,
        rtol: f64,
    ) -> graspforce::Result<SquaresOptions<D>> {
        let slack = self.slack.as_ref().map(|rows| {
            let matrix = SMatrix::<f64, D, D>::from_fn(|r, c| rows[r][c]);
            Metric::from_matrix(&matrix).map_err(|error| {
                let reason = error.to_string();
                let reason = reason.strip_prefix("metric: ").unwrap_or(&reason).to_owned();
                graspforce::Error::InvalidInput { argument: "slack", row: None, reason }
            })
        });
        Ok(SquaresOptions {
            reference: references(grasp, self.reference.iter().flatten()),
            weights: self.weights.clone().unwrap_or_default(),
            slack: slack.transpose()?,
            limits: self.limits,
            min_normal,
            rtol,
        })
    }
}

/// Reference forces in all components.
pub fn references<'a, const D: usize>(
    grasp: &Grasp<D>,
    rows: impl Iterator<Item = &'a Vec<f64>>,
) -> Vec<ContactForce> {
    let force = |row: &Vec<f64>| {
        let mut force = ContactForce::zeros();
        for (&component, x) in grasp.force_components().iter().zip(row) {
            force[component] = *x;
        }
        force
    };
    rows.map(force).collect()
}

/// The reference of a distributor, (m, k) row by row; `None` for zero.
pub fn reference_of<const D: usize>(distributor: &ForceDistributor<D>) -> Option<Vec<Vec<f64>>> {
    let components = distributor.grasp().force_components();
    let reference = distributor.squares_options().map(|squares| &squares.reference);
    let row = |force: &ContactForce| components.iter().map(|&component| force[component]).collect();
    reference.filter(|rows| !rows.is_empty()).map(|rows| rows.iter().map(row).collect())
}

/// (m, k) numbers of a reference.
pub fn reference_rows(value: &Bound<'_, PyAny>, expected: [usize; 2]) -> Result<Vec<Vec<f64>>, String> {
    let array = float_array("reference", value)?;
    if array.shape() != expected {
        return Err(format!("reference: shape {}, expected {}", shaped(array.shape()), shaped(&expected)));
    }
    Ok(contents(&array).chunks(expected[1].max(1)).map(<[f64]>::to_vec).collect())
}
