//! Seeded problems that the benchmarks share.

use graspforce::{Contact, Grasp};
use nalgebra::Vector3;

/// A small deterministic generator (xorshift64*): benchmarks need repeatable numbers, not good ones.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = Vector3::from_fn(|_, _| self.within(-1.0, 1.0));
            if (0.01..1.0).contains(&v.norm()) {
                return v.normalize();
            }
        }
    }
}

/// Contacts at random points of an ellipsoid with semi-axes 1, 0.8 and 1.3, friction 0.5.
pub fn ellipsoid_contacts(random: &mut Random, count: usize) -> Vec<Contact> {
    let axes = Vector3::new(1.0, 0.8, 1.3);
    let contact = |_| {
        let u = random.direction();
        Contact::new(u.component_mul(&axes), -u.component_div(&axes)).friction(0.5)
    };
    (0..count).map(contact).collect()
}

/// A grasp at random points of the same ellipsoid, with random friction and limits; `kind` says what contact i is.
pub fn ellipsoid_grasp(
    random: &mut Random,
    count: usize,
    kind: impl Fn(&mut Random, usize, Contact) -> Contact,
) -> Grasp<6> {
    let axes = Vector3::new(1.0, 0.8, 1.3);
    let contact = |i| {
        let u = random.direction();
        let contact = Contact::new(u.component_mul(&axes), -u.component_div(&axes))
            .friction(random.within(0.2, 0.9))
            .max_normal_force(random.within(0.5, 3.0));
        kind(random, i, contact)
    };
    let contacts: Vec<_> = (0..count).map(contact).collect();
    Grasp::new(&contacts).expect("ellipsoid contacts are valid")
}

/// The first `number` force-closure grasps of a seeded sequence, with `edges` edges, or true cones for 0.
pub fn closed_grasps(seed: u64, number: usize, contacts: usize, edges: usize) -> Vec<Grasp<6>> {
    let mut random = Random::new(seed);
    let mut grasps = Vec::with_capacity(number);
    while grasps.len() < number {
        let contacts = ellipsoid_contacts(&mut random, contacts);
        let contacts: Vec<_> = match edges {
            0 => contacts.into_iter().map(Contact::cone).collect(),
            edges => contacts.into_iter().map(|contact| contact.edges(edges)).collect(),
        };
        let grasp = Grasp::new(&contacts).expect("ellipsoid contacts are valid");
        if grasp.quality(graspforce::Criterion::Sum).is_ok_and(|q| q.rho < 0.0) {
            grasps.push(grasp);
        }
    }
    grasps
}
