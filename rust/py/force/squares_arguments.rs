//! The arguments of least squares: references, weights, the price of the residual, limits.

use graspforce::{ContactForce, Grasp, Metric, SquaresOptions};
use nalgebra::SMatrix;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use crate::convert::arrays::{contents, float_array, shaped};

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
        let reference = reference.map(|value| rows("reference", value, [m, k])).transpose()?;
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
            let diagonal = |entry: &dyn Fn(usize) -> f64| {
                (0..d).map(|r| (0..d).map(|c| if r == c { entry(r) } else { 0.0 }).collect()).collect()
            };
            match (array.shape(), contents(&array)) {
                ([], &[all]) => Ok(diagonal(&|_| all)),
                ([count], each) if *count == d => Ok(diagonal(&|r| each[r])),
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
        let force = |row: &Vec<f64>| {
            let mut force = ContactForce::zeros();
            for (&component, x) in grasp.force_components().iter().zip(row) {
                force[component] = *x;
            }
            force
        };
        let slack = self.slack.as_ref().map(|rows| {
            let matrix = SMatrix::<f64, D, D>::from_fn(|r, c| rows[r][c]);
            Metric::from_matrix(&matrix).map_err(|error| {
                let reason = error.to_string();
                let reason = reason.strip_prefix("metric: ").unwrap_or(&reason).to_owned();
                graspforce::Error::InvalidInput { argument: "slack", row: None, reason }
            })
        });
        Ok(SquaresOptions {
            reference: self.reference.iter().flatten().map(force).collect(),
            weights: self.weights.clone().unwrap_or_default(),
            slack: slack.transpose()?,
            limits: self.limits,
            min_normal,
            rtol,
        })
    }
}

fn rows(argument: &str, value: &Bound<'_, PyAny>, expected: [usize; 2]) -> Result<Vec<Vec<f64>>, String> {
    let array = float_array(argument, value)?;
    if array.shape() != expected {
        return Err(format!("{argument}: shape {}, expected {}", shaped(array.shape()), shaped(&expected)));
    }
    Ok(contents(&array).chunks(expected[1].max(1)).map(<[f64]>::to_vec).collect())
}
