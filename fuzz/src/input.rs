//! Grasps and questions out of bytes: mostly ordinary numbers, some that nobody means.

use std::fmt;

use arbitrary::{Arbitrary, Unstructured};
use graspforce::{Contact, ContactForce, Criterion, ForceModel, Grasp, GraspOptions, Wrench};
use nalgebra::Vector3;

/// Enough for every case distinction; more only costs time.
const MAX_CONTACTS: usize = 6;

const EXTREMES: [f64; 16] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    5e-324,
    f64::MIN_POSITIVE,
    f64::MAX,
    f64::EPSILON,
    1e-160,
    1e-139,
    1e-30,
    1e-9,
    1e9,
    1e139,
    1e150,
];

/// A number: of a coarse grid, so that symmetric grasps come up; smooth; or extreme.
#[derive(Clone, Copy, PartialEq)]
pub struct Number(pub f64);

impl fmt::Debug for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl<'a> Arbitrary<'a> for Number {
    fn arbitrary(bytes: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self(match bytes.arbitrary::<u8>()? {
            0..=159 => f64::from(bytes.arbitrary::<i8>()?) / 16.0,
            160..=223 => f64::from(bytes.arbitrary::<i32>()?) / f64::from(1 << 29),
            224..=235 => 10_f64.powi(i32::from(bytes.arbitrary::<i8>()? / 8)),
            236..=251 => EXTREMES[usize::from(bytes.arbitrary::<u8>()? % 16)],
            _ => f64::from_bits(bytes.arbitrary()?),
        }))
    }
}

pub type Triple = [Number; 3];

pub fn vector(triple: &Triple) -> Vector3<f64> {
    Vector3::from(triple.map(|number| number.0))
}

#[derive(Debug, Arbitrary)]
pub enum Model {
    Edges(u8),
    Cone,
    Extreme(Vec<[Number; 4]>),
}

#[derive(Debug, Arbitrary)]
pub struct ContactInput {
    position: Triple,
    /// `None` points to the origin, as normals of grasps mostly do.
    normal: Option<Triple>,
    tangent: Option<Triple>,
    friction: Option<Number>,
    torsion: Option<Number>,
    limit: Option<Number>,
    model: Model,
}

#[derive(Debug, Arbitrary)]
pub struct GraspInput {
    pub planar: bool,
    contacts: Vec<ContactInput>,
    origin: Option<Triple>,
    length_scale: Option<Number>,
    friction_margin: Option<Number>,
}

impl ContactInput {
    pub fn contact(&self, planar: bool) -> Contact {
        let flat = |mut v: Vector3<f64>| {
            if planar {
                v.z = 0.0;
            }
            v
        };
        let position = flat(vector(&self.position));
        let normal = self.normal.as_ref().map_or(-position, |normal| flat(vector(normal)));
        let mut contact = Contact::new(position, normal);
        contact.tangent = self.tangent.as_ref().map(vector);
        if let Some(friction) = self.friction {
            contact.friction = friction.0.abs();
        }
        if let (Some(torsion), false) = (self.torsion, planar) {
            contact.torsion = torsion.0.abs();
        }
        if let Some(limit) = self.limit {
            contact.max_normal_force = limit.0;
        }
        contact.forces = match &self.model {
            Model::Edges(edges) => ForceModel::Edges(usize::from(edges % 14)),
            Model::Cone => ForceModel::Cone,
            Model::Extreme(rows) => {
                let force = |row: &[Number; 4]| ContactForce::from(row.map(|number| number.0));
                ForceModel::Extreme(rows.iter().take(8).map(force).collect())
            }
        };
        contact
    }
}

impl GraspInput {
    pub fn contacts(&self) -> Vec<Contact> {
        self.contacts.iter().take(MAX_CONTACTS).map(|contact| contact.contact(self.planar)).collect()
    }

    pub fn options(&self) -> GraspOptions {
        let mut options = GraspOptions::default();
        if let Some(origin) = &self.origin {
            options.origin = vector(origin);
        }
        if let Some(scale) = self.length_scale {
            options.length_scale = scale.0;
        }
        if let Some(margin) = self.friction_margin {
            options.friction_margin = margin.0;
        }
        options
    }

    /// The grasp, if it is one.
    pub fn grasp<const D: usize>(&self) -> Option<Grasp<D>> {
        Grasp::with_options(&self.contacts(), self.options()).ok()
    }
}

pub fn criterion(sum: bool) -> Criterion {
    if sum { Criterion::Sum } else { Criterion::Max }
}

pub fn wrench<const D: usize>(numbers: &[Number; 6]) -> Wrench<D> {
    Wrench::from_fn(|row, _| numbers[row].0)
}
