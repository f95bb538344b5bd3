//! Where may the centre of mass of a body be, so that contact forces within their limits hold it?
//!
//! The wrench of the weight is affine in the horizontal position of the centre of mass, and the wrenches of limited contact
//! forces are convex: the region is convex and bounded. One linear program over the wrench set tells the furthest place
//! along a direction, with a bound that no place exceeds. The places span an inner polygon, the bounds leave an outer one,
//! and asking along the edge with the largest area in between closes both.
//!
//! T. Bretl and S. Lall, "Testing static equilibrium for legged robots", IEEE Transactions on Robotics 24 (2008) 794-807.
//!
//! | file | holds |
//! |---|---|
//! | [`load`] | what the body demands of its contacts |
//! | [`furthest`] | the linear program of one direction |
//! | [`newton`] | the same over true cones, from answers along directions nearby |
//! | [`growth`] | which direction is asked for next |
//! | [`polygon`] | convex polygons |

mod furthest;
mod growth;
mod load;
mod newton;
mod polygon;

use nalgebra::{Vector2, Vector3};

use crate::error::{Error, Result, digits};
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::wrench_set::{Criterion, WrenchSet};
use furthest::{Simplex, Start};
use load::Load;
use newton::Newton;

/// A horizontal position `(x, y)` in m.
pub type HorizontalPoint = Vector2<f64>;

/// The standard acceleration of free fall in m/s^2.
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// A region less wide than this part of the contacts' extent is a segment, or a point; a point outside by less is not told
/// from one inside: the tolerance of balance.
const RESOLUTION: f64 = 1e-9;

/// Without limits, all normal forces together may be so many times the weight. The first that the region does not depend on
/// is as good as none.
const UNLIMITED: [f64; 5] = [1e1, 1e2, 1e3, 1e4, 1e5];

/// What rounding leaves of a bound, relative to the limit.
const ROUNDED_LIMIT: f64 = 2e-13;

/// What the contacts have to hold, and how closely the region is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct SupportOptions {
    /// Weight of the body in N, along `-e_z`.
    pub weight: f64,
    /// Acceleration of the centre of mass in m/s^2.
    pub acceleration: Vector3<f64>,
    /// Free fall in m/s^2, which makes the mass of the weight.
    pub gravity: f64,
    /// Height z of the centre of mass in m. It matters with horizontal accelerations only.
    pub height: f64,
    /// Whether normal forces are limited. If not, the criterion does not matter.
    pub limits: bool,
    /// A wrench on the body beside its weight, in N and N m about the grasp's origin.
    pub external_wrench: Wrench<6>,
    /// Stop where the area between both polygons is at most this share of the outer one's.
    pub gap: f64,
    /// Directions to ask for at most.
    pub max_directions: usize,
}

impl SupportOptions {
    /// A body at rest of this weight in N, with a gap of 1e-6.
    pub fn new(weight: f64) -> Self {
        Self {
            weight,
            acceleration: Vector3::zeros(),
            gravity: STANDARD_GRAVITY,
            height: 0.0,
            limits: true,
            external_wrench: Wrench::zeros(),
            gap: 1e-6,
            max_directions: 10_000,
        }
    }

    fn check(&self) -> Result<()> {
        let wrong = |name, value: f64, law: &str| Err(Error::input(name, format!("{} {law}", digits(value))));
        for (name, value) in [("weight", self.weight), ("gravity", self.gravity)] {
            if !(value.is_finite() && value > 0.0) {
                return wrong(name, value, "must be finite and positive");
            }
            if !crate::grasp::REPRESENTABLE.contains(&value) {
                return wrong(name, value, "lies outside 1e-140 to 1e140; check the units");
            }
        }
        let vectors = [
            ("acceleration", self.acceleration.as_slice()),
            ("external_wrench", self.external_wrench.as_slice()),
            ("height", std::slice::from_ref(&self.height)),
        ];
        for (name, values) in vectors {
            if let Some(value) = values.iter().find(|x| !(x.is_finite() && x.abs() < 1e140)) {
                return wrong(name, *value, "must be finite, and below 1e140; check the units");
            }
        }
        if !(0.0..1.0).contains(&self.gap) {
            return wrong("gap", self.gap, "must be at least 0 and less than 1");
        }
        if self.max_directions < 4 {
            return Err(Error::input("max_directions", format!("{} is less than 4", self.max_directions)));
        }
        Ok(())
    }
}

/// What kind of a set a support region is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RegionShape {
    /// No forces within the limits hold the body, wherever its centre of mass is.
    Empty,
    /// One place alone.
    Point,
    /// Less wide than a billionth of the contacts' extent.
    Segment,
    /// A region with an interior.
    Polygon,
}

/// The horizontal positions of the centre of mass at which limited contact forces hold a body.
///
/// ```
/// use graspforce::{Contact, Criterion, Grasp, RegionShape, SupportOptions};
/// use nalgebra::{Vector2, Vector3};
///
/// let feet = [(0.2, 0.1), (0.2, -0.1), (-0.2, 0.1), (-0.2, -0.1)].map(|(x, y)| {
///     Contact::new(Vector3::new(x, y, 0.0), Vector3::z()).max_normal_force(100.0)
/// });
/// let region = Grasp::<6>::new(&feet)?.support_region(Criterion::Max, &SupportOptions::new(100.0))?;
/// assert_eq!(region.shape, RegionShape::Polygon);
/// assert!((region.outer_area - 0.08).abs() < 1e-12 && region.area_gap < 1e-6);
/// assert!((region.margin(&Vector2::new(0.15, 0.0)) - 0.05).abs() < 1e-12);
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SupportRegion {
    /// What kind of a set it is.
    pub shape: RegionShape,
    /// Vertices of a polygon all of whose points belong to the region, counterclockwise, in m.
    pub inner: Vec<HorizontalPoint>,
    /// Vertices of a polygon outside of which no point belongs to it.
    pub outer: Vec<HorizontalPoint>,
    /// Area of the inner polygon in m^2.
    pub inner_area: f64,
    /// Area of the outer polygon in m^2.
    pub outer_area: f64,
    /// What the inner polygon lacks of the outer one's area, as a share; zero without an interior.
    pub area_gap: f64,
    /// Whether the gap is what was asked for, or as small as rounding allows.
    pub converged: bool,
    /// Directions that were asked for.
    pub directions: usize,
    /// A point outside by less, in m, is not told from one inside.
    pub resolution: f64,
    /// Of an empty region, a direction along which the contacts reach less far than the body demands, wherever its centre
    /// of mass is.
    pub witness: Option<Wrench<6>>,
}

impl SupportRegion {
    /// How far a place is inside the inner polygon, in m; negative outside. The distance to the boundary of the region is
    /// no smaller.
    pub fn margin(&self, place: &HorizontalPoint) -> f64 {
        polygon_margin(&self.inner, place)
    }

    /// Whether the contacts are proven to hold the body with its centre of mass there.
    pub fn contains(&self, place: &HorizontalPoint) -> bool {
        self.margin(place) >= -self.resolution
    }
}

/// How far a place is inside a convex polygon with counterclockwise vertices; negative outside, and minus infinity without
/// any vertex.
pub fn polygon_margin(vertices: &[HorizontalPoint], place: &HorizontalPoint) -> f64 {
    polygon::margin(vertices, place)
}

impl Grasp<6> {
    /// The horizontal positions of the centre of mass at which contact forces within their limits hold a body.
    ///
    /// # Errors
    /// An option is unusable, the acceleration takes all weight off the contacts, or the region is not bounded without
    /// limits ([`Error::InvalidInput`]); whether any forces hold the body is not decided ([`Error::NotConverged`]).
    pub fn support_region(&self, criterion: Criterion, options: &SupportOptions) -> Result<SupportRegion> {
        let load = Load::new(self, options)?;
        let maps = load.maps(self);
        if options.limits {
            return self.region_of(&maps, criterion, &load, options).map(|(region, _)| region);
        }
        let last = UNLIMITED[UNLIMITED.len() - 1];
        for limit in UNLIMITED {
            let maps = self.with_common_limit(&maps, limit * load.force);
            let (region, reached) = self.region_of(&maps, Criterion::Sum, &load, options)?;
            let independent = reached <= RESOLUTION.max(ROUNDED_LIMIT * limit);
            if independent || (limit == last && region.shape == RegionShape::Empty) {
                return Ok(region);
            }
        }
        let reason = format!(
            "False leaves no bounded region, or one that takes normal forces above {last:e} times the weight: contacts \
             can press against each other; give their limits"
        );
        Err(Error::input("limits", reason))
    }

    /// The maps under which the longest force of each contact is so many N.
    fn with_common_limit(&self, maps: &[ContactMap<6>], limit: f64) -> Vec<ContactMap<6>> {
        let longest = |i: usize| match self.edges(i) {
            Some(range) => {
                self.finite_forces()[range].iter().map(nalgebra::Vector4::norm).fold(0.0, f64::max)
            }
            None => self.contacts()[i].max_normal_force,
        };
        let scaled = |(i, map): (usize, &ContactMap<6>)| {
            let longest = longest(i);
            map * if longest > 0.0 { limit / longest } else { 0.0 }
        };
        maps.iter().enumerate().map(scaled).collect()
    }

    /// The region of contacts with these scaled maps, and what limits contribute to its bounds.
    fn region_of(
        &self,
        maps: &[ContactMap<6>],
        criterion: Criterion,
        load: &Load,
        options: &SupportOptions,
    ) -> Result<(SupportRegion, f64)> {
        let set = WrenchSet::of_maps(self, maps, criterion);
        let resolution = RESOLUTION * load.length;
        let mut simplex = match Simplex::start(&set, load)? {
            Start::Feasible(simplex) => simplex,
            Start::Empty { z, reach } => {
                let region = SupportRegion {
                    shape: RegionShape::Empty,
                    inner: Vec::new(),
                    outer: Vec::new(),
                    inner_area: 0.0,
                    outer_area: 0.0,
                    area_gap: 0.0,
                    converged: true,
                    directions: 0,
                    resolution,
                    witness: Some(load.physical(&z)),
                };
                return Ok((region, reach / z.amax().max(1.0)));
            }
        };
        let newton = Newton::new(self, maps, criterion, load, simplex.demand());
        let grown = growth::grow(&mut simplex, newton, options)?;
        let world =
            |places: &[HorizontalPoint]| places.iter().map(|place| load.world(place)).collect::<Vec<_>>();
        let unit = load.length * load.length;
        let region = SupportRegion {
            shape: grown.shape,
            inner: world(&grown.inner),
            outer: world(&grown.outer),
            inner_area: polygon::area(&grown.inner) * unit,
            outer_area: polygon::area(&grown.outer) * unit,
            area_gap: grown.gap,
            converged: grown.converged,
            directions: grown.directions,
            resolution,
            witness: None,
        };
        Ok((region, grown.reached))
    }
}
