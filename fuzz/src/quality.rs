//! Laws of quality: a bracket in order, a witness that attains it, and no direction that beats it.

use graspforce::{
    Closure, Criterion, Grasp, Metric, Quality, QualityOptions, QualityWorkspace, Wrench, WrenchSet,
};

/// What rounding may cost, relative to the longest wrench.
const ROUNDING: f64 = 1e-9;

/// Tolerance of true cones here: converging further takes a second and teaches the fuzzer nothing.
pub const CONE_RTOL: f64 = 1e-3;

pub fn options<const D: usize>(grasp: &Grasp<D>, criterion: Criterion) -> QualityOptions<D> {
    let mut options = QualityOptions::new(criterion);
    options.rtol = (!grasp.is_finite()).then_some(CONE_RTOL);
    options
}

/// Asks and checks what can be checked without another solver.
pub fn checked<const D: usize>(
    grasp: &Grasp<D>,
    options: &QualityOptions<D>,
    directions: &[Wrench<D>],
) -> Option<Quality<D>> {
    let quality = grasp.quality_with(options, &mut QualityWorkspace::default()).ok()?;
    let Quality { rho, lower, upper, .. } = quality;
    assert!(rho.is_finite() && lower.is_finite() && upper.is_finite(), "{quality:?}");
    assert!(lower <= rho && rho <= upper, "{quality:?}");
    assert!(quality.direction.iter().chain(quality.wrench.iter()).all(|x| x.is_finite()), "{quality:?}");
    let metric = quality.metric;
    let unit = metric.norm(&quality.direction);
    assert!((unit - 1.0).abs() < 1e-6, "direction of norm {unit}: {quality:?}");
    if options.external_wrench.is_none() {
        match quality.closure {
            Closure::Force => assert!(rho <= 0.0, "{quality:?}"),
            Closure::Partial => assert!(rho == 0.0, "{quality:?}"),
            Closure::None => assert!(rho >= 0.0, "{quality:?}"),
        }
        if rho < 0.0 {
            inside(grasp, options, &quality, directions);
        } else if quality.closure == Closure::None {
            outside(grasp, &quality);
        }
    }
    let gradient = grasp.gradient(options, &mut QualityWorkspace::default());
    if let Ok(gradient) = gradient {
        let vectors = gradient.positions.iter().chain(&gradient.normals).flat_map(|v| v.iter());
        assert!(vectors.chain(&gradient.spins).all(|x| x.is_finite()), "{gradient:?}");
    }
    Some(quality)
}

/// Any direction bounds epsilon from above; the worst one attains it.
fn inside<const D: usize>(
    grasp: &Grasp<D>,
    options: &QualityOptions<D>,
    quality: &Quality<D>,
    directions: &[Wrench<D>],
) {
    let set = WrenchSet::new(grasp, options.criterion);
    let axes = (0..D).map(|axis| Wrench::<D>::from_fn(|row, _| f64::from(u8::from(row == axis))));
    let axes: Vec<_> = axes.flat_map(|axis| [axis, -axis]).collect();
    let scale = axes.iter().map(|z| quality.metric.norm(&set.support(z).wrench)).fold(0.0, f64::max);
    let certified = -quality.upper;
    for functional in directions.iter().chain(&axes) {
        let Some(length) = length_of_functional(&quality.metric, functional) else { continue };
        let reach = set.value(functional) / length;
        assert!(
            reach >= certified - ROUNDING * scale.max(reach.abs()),
            "reach {reach:e} < certified {certified:e} along {functional:?}"
        );
    }
}

/// No plane has all wrenches further behind it than the distance that is reported.
fn outside<const D: usize>(grasp: &Grasp<D>, quality: &Quality<D>) {
    let Ok(wrenches) = grasp.primitive_wrenches() else { return };
    for functional in wrenches {
        let Some(length) = length_of_functional(&quality.metric, functional) else { continue };
        // What rounding may have added to a product is taken off again.
        let surely = |w: &Wrench<D>| {
            let terms = w.component_mul(functional);
            terms.sum() - ROUNDING * terms.abs().sum()
        };
        let reach = wrenches.iter().map(surely).fold(f64::INFINITY, f64::min) / length;
        assert!(reach <= quality.upper * (1.0 + ROUNDING), "all wrenches are {reach:e} away: {quality:?}");
    }
}

/// `|C^-T f|`: what `f . w` is at most over wrenches of unit norm.
fn length_of_functional<const D: usize>(metric: &Metric<D>, functional: &Wrench<D>) -> Option<f64> {
    // Diagonal metrics, the only ones with which this is called, measure axis by axis.
    let length = Wrench::<D>::from_fn(|axis, _| {
        let unit = Wrench::<D>::from_fn(|row, _| f64::from(u8::from(row == axis)));
        functional[axis] / metric.norm(&unit)
    })
    .norm();
    (length.is_finite() && length > 1e-140).then_some(length)
}
