use graspforce::*;
use nalgebra::Vector3;
use std::time::Instant;
fn main() {
    let tetrahedron = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    for edges in [8] {
        let c: Vec<_> = tetrahedron.iter().map(|&p| { let p = Vector3::from(p).normalize(); Contact::new(p, -p).edges(edges) }).collect();
        let g = Grasp::<6>::new(&c).unwrap();
        for crit in [Criterion::Max] {
        let mut ws = QualityWorkspace::default();
        let mut t = vec![];
        let mut q = None;
        for _ in 0..3 {
            let s = Instant::now();
            q = Some(g.quality_with(&QualityOptions::new(crit), &mut ws).unwrap());
            t.push(s.elapsed().as_secs_f64() * 1e6);
        }
        t.sort_by(f64::total_cmp);
        let q = q.unwrap();
        println!("{edges} {crit:?} {:.0} us supports {} facets {} rho {}", t[1], q.supports, q.facets, q.rho);
        }
    }
}
