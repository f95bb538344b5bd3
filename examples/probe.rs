#[path = "../benches/common/mod.rs"]
mod common;
use graspforce::*;
fn main() {
    let mut small = vec![];
    for (i, g) in common::closed_grasps(7, 200, 4, 10).iter().enumerate() {
        let q = g.quality(Criterion::Sum).unwrap();
        small.push((-q.rho, i));
        if i == 14 {
            for w in g.primitive_wrenches().unwrap() {
                println!("{:?}", w.as_slice());
            }
        }
    }
    small.sort_by(|a, b| a.0.total_cmp(&b.0));
    eprintln!("{:?}", &small[..10]);
}
