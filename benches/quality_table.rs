mod common;
use graspforce::*;
use std::time::Instant;
fn main() {
    for (m, l) in [(4, 10), (4, 8), (8, 16), (4, 0)] {
        let grasps = common::closed_grasps(7, 200, m, l);
        for criterion in [Criterion::Max, Criterion::Sum] {
            let mut ws = QualityWorkspace::default();
            let mut times = vec![];
            let mut sup = vec![];
            let mut conv = 0;
            for _ in 0..if l == 0 { 1 } else { 5 } {
                for g in &grasps {
                    let t = Instant::now();
                    let q = g.quality_with(&QualityOptions::new(criterion), &mut ws).unwrap();
                    times.push(t.elapsed().as_secs_f64());
                    sup.push(q.supports);
                    conv += usize::from(q.converged);
                }
            }
            times.sort_by(f64::total_cmp);
            sup.sort();
            println!(
                "m {m} l {l} {criterion:?} median {:.1} us mean {:.1} p99 {:.1} supports {} converged {}",
                times[times.len() / 2] * 1e6,
                times.iter().sum::<f64>() / times.len() as f64 * 1e6,
                times[times.len() * 99 / 100] * 1e6,
                sup[sup.len() / 2],
                conv as f64 / times.len() as f64
            );
        }
    }
}
