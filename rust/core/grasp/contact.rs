//! One contact: where it is, its frame, and the forces it can exert (Eqs. 1 to 4).
//!
//! A planar contact is a spatial one in the plane `z = 0` with `o = -e_z`, so that the tangent
//! `t = n x o = (-n_y, n_x, 0)` is the planar one and the component along `o` is always zero. Forces are
//! kept as `[f_n, f_o, f_t, torsion]` in the contact frame for every kind of contact.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3, Vector4};

use crate::error::{Error, Result, digits};
use crate::memory::room;

/// More edges than this for one cone are refused: the true cone is then both exact and cheaper.
pub const MAX_EDGES: usize = 65_536;

/// More extreme forces than this for one grasp are refused, before memory is taken for them.
pub const MAX_EXTREME_FORCES: usize = 1 << 20;

/// A force in a contact frame: `[f_n, f_o, f_t, torsion]`, in N, N, N and N m.
pub type ContactForce = Vector4<f64>;

/// Which forces a contact can exert at its limit.
#[derive(Debug, Clone, PartialEq)]
pub enum ForceModel {
    /// A friction cone linearised into this many edges (planar contacts always have their exact two).
    Edges(usize),
    /// The true second-order cone.
    Cone,
    /// The convex hull of these forces and zero, in the contact frame, instead of a friction cone. Forces of zero
    /// are dropped, and do not count where forces are numbered.
    Extreme(Vec<ContactForce>),
}

/// A contact as the caller describes it.
///
/// ```
/// use graspforce::Contact;
/// use nalgebra::Vector3;
///
/// let contact = Contact::new(Vector3::new(0.1, 0.0, 0.0), Vector3::new(-1.0, 0.0, 0.0))
///     .friction(0.4)
///     .max_normal_force(20.0)
///     .edges(8);
/// assert_eq!(contact.friction, 0.4);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Position in m (planar contacts: `z = 0`).
    pub position: Vector3<f64>,
    /// Normal into the object, of any length.
    pub normal: Vector3<f64>,
    /// Direction whose projection on the tangent plane becomes `o`; `None` for the default.
    pub tangent: Option<Vector3<f64>>,
    /// Coulomb friction coefficient `mu >= 0`.
    pub friction: f64,
    /// Torsional friction coefficient `gamma >= 0` in m; positive makes a soft finger.
    pub torsion: f64,
    /// Upper bound `f^U > 0` of the normal force in N.
    pub max_normal_force: f64,
    /// The set of extreme forces.
    pub forces: ForceModel,
}

impl Contact {
    /// A contact with friction 0.5, a limit of 1 N, and eight edges.
    pub fn new(position: Vector3<f64>, normal: Vector3<f64>) -> Self {
        Self {
            position,
            normal,
            tangent: None,
            friction: 0.5,
            torsion: 0.0,
            max_normal_force: 1.0,
            forces: ForceModel::Edges(8),
        }
    }

    /// Sets the Coulomb friction coefficient.
    #[must_use]
    pub fn friction(mut self, friction: f64) -> Self {
        self.friction = friction;
        self
    }

    /// Sets the torsional friction coefficient in m.
    #[must_use]
    pub fn torsion(mut self, torsion: f64) -> Self {
        self.torsion = torsion;
        self
    }

    /// Sets the upper bound of the normal force in N.
    #[must_use]
    pub fn max_normal_force(mut self, limit: f64) -> Self {
        self.max_normal_force = limit;
        self
    }

    /// Sets the direction of the first tangent.
    #[must_use]
    pub fn tangent(mut self, tangent: Vector3<f64>) -> Self {
        self.tangent = Some(tangent);
        self
    }

    /// Linearises the friction cone into `edges` edges.
    #[must_use]
    pub fn edges(mut self, edges: usize) -> Self {
        self.forces = ForceModel::Edges(edges);
        self
    }

    /// Keeps the true second-order cone.
    #[must_use]
    pub fn cone(mut self) -> Self {
        self.forces = ForceModel::Cone;
        self
    }

    /// Checks every value, normalises the normal, and fixes the frame.
    pub(crate) fn frame(&self, index: usize, planar: bool) -> Result<Matrix3<f64>> {
        self.check_numbers(index)?;
        if planar && (self.position.z != 0.0 || self.normal.z != 0.0) {
            return Err(Error::contact("positions", index, "a planar contact lies in the plane z = 0"));
        }
        let n = unit(&self.normal).ok_or_else(|| {
            Error::contact("normals", index, format!("the normal {} has no direction", list(&self.normal)))
        })?;
        let o = if planar { -Vector3::z() } else { self.first_tangent(index, &n)? };
        Ok(Matrix3::from_columns(&[n, o, n.cross(&o)]))
    }

    fn check_numbers(&self, index: usize) -> Result<()> {
        let finite = |argument, v: &Vector3<f64>| {
            if v.iter().all(|x| x.is_finite()) {
                return Ok(());
            }
            Err(Error::contact(argument, index, format!("{} is not finite", list(v))))
        };
        finite("positions", &self.position)?;
        finite("normals", &self.normal)?;
        if let Some(tangent) = &self.tangent {
            finite("tangents", tangent)?;
        }
        let number = |argument, x: f64, ok: bool, law: &str| {
            if ok && x.is_finite() {
                return Ok(());
            }
            Err(Error::contact(argument, index, format!("{} must be {law}", digits(x))))
        };
        number("friction", self.friction, self.friction >= 0.0, "finite and not negative")?;
        number("torsion", self.torsion, self.torsion >= 0.0, "finite and not negative")?;
        let limit = self.max_normal_force;
        number("max_normal_force", limit, limit > 0.0, "finite and positive")
    }

    fn first_tangent(&self, index: usize, n: &Vector3<f64>) -> Result<Vector3<f64>> {
        let seed = match &self.tangent {
            Some(tangent) => unit(tangent).ok_or_else(|| {
                Error::contact("tangents", index, format!("{} has no direction", list(tangent)))
            })?,
            None => default_seed(n),
        };
        let o = seed - n * n.dot(&seed);
        if o.norm() < 1e-9 {
            let reason = format!("{} is parallel to the normal {}", list(&seed), list(n));
            return Err(Error::contact("tangents", index, reason));
        }
        // A second projection removes what cancellation left along n when the tangent was nearly parallel.
        let o = o.normalize();
        Ok((o - n * n.dot(&o)).normalize())
    }

    /// Of a contact without friction: how far its first friction would let a unit normal force reach along `v`, which is
    /// given in the contact frame, for each unit of the coefficient.
    pub(crate) fn slope_of_first_friction(&self, planar: bool, v: &Vector3<f64>) -> f64 {
        match self.forces {
            ForceModel::Extreme(_) => 0.0,
            ForceModel::Edges(edges) if !planar => {
                circle(edges).map(|(c, s)| c * v[1] + s * v[2]).fold(f64::NEG_INFINITY, f64::max)
            }
            _ => v[1].hypot(v[2]),
        }
    }

    /// How many extreme forces the contact has in a grasp that accepts it; none with a true cone.
    pub fn force_count(&self, planar: bool) -> usize {
        let (smooth, hard) = (self.friction == 0.0, self.torsion == 0.0);
        match &self.forces {
            ForceModel::Extreme(forces) => forces.len(),
            _ if planar || smooth => 2 - usize::from(smooth && hard),
            ForceModel::Cone => 0,
            ForceModel::Edges(edges) if *edges > MAX_EDGES => 0,
            ForceModel::Edges(edges) if hard => *edges,
            ForceModel::Edges(edges) => (2 * latitudes(*edges) - 1).saturating_mul(*edges).saturating_add(2),
        }
    }

    /// The extreme forces of Eq. 3 in order, or `None` for a true cone.
    pub(crate) fn extreme_forces(&self, index: usize, planar: bool) -> Result<Option<Vec<ContactForce>>> {
        let limit = self.max_normal_force;
        let edges = match &self.forces {
            ForceModel::Extreme(forces) => return checked_forces(forces, index).map(Some),
            _ if planar => return Ok(Some(planar_edges(limit, self.friction))),
            _ if self.friction == 0.0 => return Ok(Some(frictionless_edges(limit, self.torsion))),
            ForceModel::Cone => return Ok(None),
            ForceModel::Edges(edges) => *edges,
        };
        if !(3..=MAX_EDGES).contains(&edges) {
            return Err(Error::contact("edges", index, format!("{edges} is not within 3 to {MAX_EDGES}")));
        }
        let count = if self.torsion == 0.0 { edges } else { (2 * latitudes(edges) - 1) * edges + 2 };
        check_count(count, index)?;
        Ok(Some(match self.torsion {
            0.0 => hard_edges(limit, self.friction, edges),
            torsion => soft_edges(limit, self.friction, torsion, edges),
        }))
    }
}

/// Eq. 3 in the plane: `f^U [1, +-mu]`, one force where there is no friction.
fn planar_edges(limit: f64, mu: f64) -> Vec<ContactForce> {
    if mu == 0.0 {
        return frictionless_edges(limit, 0.0);
    }
    [mu, -mu].map(|t| Vector4::new(1.0, 0.0, t, 0.0) * limit).to_vec()
}

/// The frictionless contact has one extreme force; with torsion its two poles.
fn frictionless_edges(limit: f64, gamma: f64) -> Vec<ContactForce> {
    if gamma == 0.0 {
        return vec![Vector4::new(limit, 0.0, 0.0, 0.0)];
    }
    poles(limit, gamma).to_vec()
}

/// Eq. 3 in space: `f^U [1, mu cos(2 h pi / l), mu sin(2 h pi / l)]`, h = 1..l.
fn hard_edges(limit: f64, mu: f64, edges: usize) -> Vec<ContactForce> {
    circle(edges).map(|(c, s)| Vector4::new(1.0, mu * c, mu * s, 0.0) * limit).collect()
}

/// A force of which only some `components` exist, as callers see them.
#[inline]
#[must_use]
pub fn contact_force(row: &[f64], components: &[usize]) -> ContactForce {
    let mut force = ContactForce::zeros();
    for (&component, x) in components.iter().zip(row) {
        force[component] = *x;
    }
    force
}

/// Which rows of `[f_n, f_o, f_t, torsion]` the `k` components are that callers see.
pub(crate) fn force_components(k: usize) -> &'static [usize] {
    match k {
        2 => &[0, 2],
        3 => &[0, 1, 2],
        _ => &[0, 1, 2, 3],
    }
}

/// Writes rows of the `components` that exist, as callers see them.
#[inline]
pub fn write_components(forces: &[ContactForce], components: &[usize], rows: &mut [f64]) {
    for (row, force) in rows.chunks_mut(components.len()).zip(forces) {
        for (x, &component) in row.iter_mut().zip(components) {
            *x = force[component];
        }
    }
}

/// Refuses a grasp with this many extreme forces up to contact `index`.
pub(crate) fn check_count(count: usize, index: usize) -> Result<()> {
    if count > MAX_EXTREME_FORCES {
        let reason =
            format!("{count} extreme forces so far, more than the {MAX_EXTREME_FORCES} of one grasp");
        return Err(Error::contact("edges", index, reason));
    }
    Ok(())
}

/// q of a soft finger's cone: half the number of its circles, rounded up.
pub(crate) fn latitudes(edges: usize) -> usize {
    (edges / 4).max(2)
}

/// The ellipsoidal cone of a soft finger: circles of latitude `psi = j pi / (2 q)`, |j| < q, then both poles.
fn soft_edges(limit: f64, mu: f64, gamma: f64, edges: usize) -> Vec<ContactForce> {
    let q = latitudes(edges);
    let latitudes = (1..2 * q).map(|j| (j as f64 - q as f64) * PI / (2 * q) as f64);
    let rings = latitudes.flat_map(|psi| {
        let (sin_psi, cos_psi) = psi.sin_cos();
        circle(edges)
            .map(move |(c, s)| Vector4::new(1.0, mu * cos_psi * c, mu * cos_psi * s, gamma * sin_psi) * limit)
    });
    rings.chain(poles(limit, gamma)).collect()
}

fn poles(limit: f64, gamma: f64) -> [ContactForce; 2] {
    [gamma, -gamma].map(|torsion| Vector4::new(1.0, 0.0, 0.0, torsion) * limit)
}

fn circle(edges: usize) -> impl Iterator<Item = (f64, f64)> {
    (1..=edges).map(move |h| {
        let (s, c) = (2.0 * h as f64 * PI / edges as f64).sin_cos();
        (c, s)
    })
}

fn checked_forces(forces: &[ContactForce], index: usize) -> Result<Vec<ContactForce>> {
    if forces.is_empty() {
        return Err(Error::contact("extreme_forces", index, "no forces given"));
    }
    if let Some((row, force)) = forces.iter().enumerate().find(|(_, f)| f.iter().any(|x| !x.is_finite())) {
        let reason = format!("row {row} is not finite: {:?}", force.as_slice());
        return Err(Error::contact("extreme_forces", index, reason));
    }
    // Zero belongs to every contact's forces already; among the extreme ones it would make the set touch the
    // origin.
    let mut extreme = room("extreme_forces", forces.len())?;
    extreme.extend(forces.iter().filter(|f| f.amax() > 0.0));
    if extreme.is_empty() {
        return Err(Error::contact("extreme_forces", index, "all forces are zero"));
    }
    Ok(extreme)
}

/// What becomes the first tangent of a contact with this unit normal, once it is projected on the tangent plane, where the
/// caller gives none.
pub(crate) fn default_seed(n: &Vector3<f64>) -> Vector3<f64> {
    if n.x.abs() > 0.7 { Vector3::y() } else { Vector3::x() }
}

/// The unit vector along `v`, safe against overflow and underflow of the squares.
fn unit(v: &Vector3<f64>) -> Option<Vector3<f64>> {
    let scale = v.amax();
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    Some((v / scale).normalize())
}

fn list(v: &Vector3<f64>) -> String {
    format!("{:?}", v.as_slice())
}
