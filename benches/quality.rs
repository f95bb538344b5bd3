//! How long certified quality takes on random grasps, and how it grows: `cargo bench --bench quality`, and
//! `cargo bench --bench quality -- growth` for the table over contacts and edges, `-- open` for open and closed grasps alone,
//! `-- gradients` for what gradients cost.

use std::time::Instant;

use graspforce::{Contact, Criterion, Grasp, Quality, QualityOptions, QualityWorkspace, quality_batch};
use nalgebra::Vector3;

const BOTH: [Criterion; 2] = [Criterion::Max, Criterion::Sum];

fn main() {
    let asked = |name: &str| std::env::args().any(|argument| argument == name);
    if asked("growth") {
        growth();
    } else if asked("open") {
        open_and_closed();
    } else if asked("gradients") {
        gradients();
    } else {
        random_grasps();
        open_and_closed();
        gradients();
        symmetric_cones();
    }
}

/// Times of one criterion over all grasps, each asked `rounds` times after one warm-up.
struct Timing {
    median: f64,
    mean: f64,
    p99: f64,
    supports: usize,
    converged: f64,
}

fn timing(grasps: &[Grasp<6>], criterion: Criterion, rounds: usize) -> Timing {
    let mut workspace = QualityWorkspace::default();
    let options = QualityOptions::new(criterion);
    let mut ask = |grasp: &Grasp<6>| -> (f64, Quality<6>) {
        let start = Instant::now();
        let quality = grasp.quality_with(&options, &mut workspace).expect("default options are valid");
        (start.elapsed().as_secs_f64() * 1e6, quality)
    };
    for grasp in grasps.iter().take(20) {
        ask(grasp);
    }
    let answers: Vec<_> = (0..rounds).flat_map(|_| grasps).map(ask).collect();
    let mut times: Vec<_> = answers.iter().map(|(time, _)| *time).collect();
    let mut supports: Vec<_> = answers.iter().map(|(_, quality)| quality.supports).collect();
    times.sort_by(f64::total_cmp);
    supports.sort_unstable();
    let converged = answers.iter().filter(|(_, quality)| quality.converged).count();
    Timing {
        median: times[times.len() / 2],
        mean: times.iter().sum::<f64>() / times.len() as f64,
        p99: times[times.len() * 99 / 100],
        supports: supports[supports.len() / 2],
        converged: converged as f64 / answers.len() as f64,
    }
}

fn random_grasps() {
    println!("\nRandom force-closure grasps on an ellipsoid, one core:\n");
    println!("| contacts | cone | criterion | median us | mean us | p99 us | oracle calls | converged |");
    println!("|---|---|---|---|---|---|---|---|");
    for (contacts, edges) in [(4, 8), (4, 10), (8, 16), (4, 0)] {
        let grasps = support::problems::closed_grasps(7, 200, contacts, edges);
        let cone = if edges == 0 { "true, rtol 1e-6".into() } else { format!("{edges} edges, rtol 1e-9") };
        for criterion in BOTH {
            let t = timing(&grasps, criterion, if edges == 0 { 2 } else { 5 });
            println!(
                "| {contacts} | {cone} | {criterion:?} | {:.1} | {:.1} | {:.1} | {} | {:.2} % |",
                t.median,
                t.mean,
                t.p99,
                t.supports,
                100.0 * t.converged
            );
        }
    }
}

/// What a data set pays: grasps as they come, about half of them open, built and measured.
fn open_and_closed() {
    println!(
        "\nRandom grasps with 8 edges a contact, closed or not, each the fastest of 5 rounds on one core, and"
    );
    println!("a batch of them on all cores:\n");
    println!("| contacts | criterion | closed | closed: mean us | open: mean us | batch: grasps/s |");
    println!("|---|---|---|---|---|---|");
    for count in [4, 5, 6] {
        let mut random = support::problems::Random::new(7);
        let contacts: Vec<_> =
            (0..1000).map(|_| support::problems::ellipsoid_contacts(&mut random, count)).collect();
        let grasp = |row: usize| Grasp::<6>::new(&contacts[row]);
        for criterion in BOTH {
            let options = QualityOptions::new(criterion);
            let mut workspace = QualityWorkspace::default();
            let mut sums = [(0.0, 0_u32); 2];
            for row in 0..contacts.len() {
                let rounds = (0..5).map(|_| {
                    let start = Instant::now();
                    let quality = grasp(row).and_then(|grasp| grasp.quality_with(&options, &mut workspace));
                    (start.elapsed().as_secs_f64() * 1e6, quality.expect("valid").rho < 0.0)
                });
                let (time, closed) = rounds.min_by(|a, b| a.0.total_cmp(&b.0)).expect("five rounds");
                let sum = &mut sums[usize::from(closed)];
                (sum.0, sum.1) = (sum.0 + time, sum.1 + 1);
            }
            let start = Instant::now();
            let answers = quality_batch(0..contacts.len(), grasp, &options, false, 0);
            let rate = answers.len() as f64 / start.elapsed().as_secs_f64();
            let [open, closed] = sums.map(|(time, number)| time / f64::from(number));
            println!("| {count} | {criterion:?} | {} | {closed:.1} | {open:.1} | {rate:.0} |", sums[1].1);
        }
    }
}

/// What a training step pays: numbers and gradients of 1,000 grasps on all cores, the best of several rounds, asked in turn.
fn gradients() {
    println!("\n1,000 random grasps on an ellipsoid, with and without gradients, on all cores:\n");
    println!("| contacts | cone | criterion | numbers ms | numbers and gradients ms | ratio |");
    println!("|---|---|---|---|---|---|");
    for (count, edges) in [(4, 8), (8, 8), (4, 0)] {
        let mut random = support::problems::Random::new(7);
        let cone = |contact: Contact| if edges == 0 { contact.cone() } else { contact.edges(edges) };
        let contacts: Vec<Vec<_>> = (0..1000)
            .map(|_| {
                support::problems::ellipsoid_contacts(&mut random, count).into_iter().map(cone).collect()
            })
            .collect();
        let grasp = |row: usize| Grasp::<6>::new(&contacts[row]);
        for criterion in BOTH {
            let options = QualityOptions::new(criterion);
            let mut best = [f64::INFINITY; 2];
            for _ in 0..if edges == 0 { 3 } else { 15 } {
                for (gradient, best) in [false, true].into_iter().zip(&mut best) {
                    let start = Instant::now();
                    let answers = quality_batch(0..contacts.len(), grasp, &options, gradient, 0);
                    *best = best.min(start.elapsed().as_secs_f64() * 1e3);
                    assert!(answers.iter().all(|answer| answer.gradient.is_some() == gradient));
                }
            }
            let [alone, both] = best;
            let cone = if edges == 0 { "true".into() } else { format!("{edges} edges") };
            println!("| {count} | {cone} | {criterion:?} | {alone:.1} | {both:.1} | {:.2} |", both / alone);
        }
    }
}

fn symmetric_cones() {
    println!(
        "\nSymmetric grasps on the unit sphere with true cones (friction 0.5, limits 1 N), rtol 1e-6:\n"
    );
    println!("| grasp | criterion | epsilon from | to | ms | oracle calls | converged |");
    println!("|---|---|---|---|---|---|---|");
    let tetrahedron = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let equator = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
    let problems: [(&str, &[[f64; 3]], f64); 4] = [
        ("tetrahedron", &tetrahedron, 0.0),
        ("tetrahedron, soft fingers (0.2 m)", &tetrahedron, 0.2),
        ("four on the equator", &equator, 0.0),
        ("antipodal pair, soft fingers (0.3 m)", &equator[..2], 0.3),
    ];
    for (name, points, torsion) in problems {
        let contacts: Vec<_> = points
            .iter()
            .map(|&point| {
                let point = Vector3::from(point).normalize();
                Contact::new(point, -point).torsion(torsion).cone()
            })
            .collect();
        let grasp = Grasp::<6>::new(&contacts).expect("points of a sphere are valid contacts");
        for criterion in BOTH {
            let start = Instant::now();
            let quality = grasp.quality(criterion).expect("default options are valid");
            println!(
                "| {name} | {criterion:?} | {:.8} | {:.8} | {:.0} | {} | {} |",
                -quality.upper,
                -quality.lower,
                start.elapsed().as_secs_f64() * 1e3,
                quality.supports,
                if quality.converged { "yes" } else { "work limit" }
            );
        }
    }
}

fn growth() {
    println!(
        "| contacts | edges | `rho_max`: time (us) | oracle calls | `rho_sum`: time (us) | oracle calls |"
    );
    println!("|---|---|---|---|---|---|");
    for contacts in [3, 4, 5, 6, 8, 10, 12] {
        for edges in [4, 8, 16, 32, 64] {
            let grasps = support::problems::closed_grasps(11, 40, contacts, edges);
            let [max, sum] = BOTH.map(|criterion| timing(&grasps, criterion, 2));
            println!(
                "| {contacts} | {edges} | {:.1} | {} | {:.1} | {} |",
                max.median, max.supports, sum.median, sum.supports
            );
        }
    }
}
