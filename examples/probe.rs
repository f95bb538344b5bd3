#[path = "../benches/common/mod.rs"]
mod common;
use graspforce::*;
use std::time::Instant;
fn main() {
    let mut random = common::Random::new(3);
    let mut n = 0;
    while n < 12 {
        let contacts = common::ellipsoid_contacts(&mut random, 4);
        let g = Grasp::<6>::new(&contacts).unwrap();
        let t = Instant::now();
        let q = g.quality(Criterion::Sum).unwrap();
        let e = t.elapsed();
        if q.rho >= 0. {
            n += 1;
            let t = Instant::now();
            g.closure();
            println!("{:?} {:?} supports {} rho {}", e, t.elapsed(), q.supports, q.rho);
        }
    }
}
