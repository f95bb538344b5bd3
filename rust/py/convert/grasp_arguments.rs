//! The arguments of `Grasp(...)` and of batches of grasps: shapes, broadcasting, and contacts out of them.
//!
//! Large arrays are viewed where they lie ([`Views`]); [`Arguments::parse`] copies them for whoever keeps them.

use graspforce::{Contact, ContactForce, Error, ForceModel, GraspOptions, check_room, room};
use nalgebra::Vector3;
use numpy::{PyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::borrow::Cow;
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::convert::arrays::{contents, copied, float_array, matrix, shaped, vector};
use crate::convert::broadcast::{Broadcast, kept};
use crate::convert::force_models::{Edges, parse_edges, parse_forces};
use crate::convert::raw_arguments::{NAMES, Raw};
use crate::convert::scalars::number;
use crate::convert::views::{Layout, Views};

/// One or many grasps, in plain memory.
pub struct Arguments<'a> {
    /// 2 or 3.
    pub dim: usize,
    /// Contacts of each grasp; of a ragged batch, of all grasps together.
    pub contacts: usize,
    /// Number of grasps.
    pub batch: usize,
    /// Where the contacts of each grasp of a ragged batch begin and end.
    offsets: Option<Vec<usize>>,
    /// What all grasps share.
    pub options: GraspOptions,
    origins: Option<Vec<f64>>,
    length_scales: Option<Vec<f64>>,
    positions: Cow<'a, [f64]>,
    normals: Cow<'a, [f64]>,
    tangents: Option<Broadcast<'a>>,
    pub friction: Broadcast<'a>,
    pub max_normal_force: Broadcast<'a>,
    pub torsion: Broadcast<'a>,
    edges: Edges,
    extreme_forces: Option<Vec<Vec<ContactForce>>>,
}

impl Arguments<'static> {
    /// Checks shapes and types, and copies; `batched` tells whether there is a leading batch axis.
    pub fn parse(raw: &Raw<'_>, batched: bool) -> Result<Self, String> {
        let views = Views::of(raw)?;
        let given = Arguments::of(raw, &views, if batched { Layout::Batch } else { Layout::One })?;
        let py = raw.positions.py();
        Ok(Self {
            dim: given.dim,
            contacts: given.contacts,
            batch: given.batch,
            offsets: given.offsets,
            options: given.options,
            origins: given.origins,
            length_scales: given.length_scales,
            positions: kept("positions", given.positions, py)?,
            normals: kept("normals", given.normals, py)?,
            tangents: given.tangents.map(|tangents| tangents.kept("tangents", py)).transpose()?,
            friction: given.friction.kept("friction", py)?,
            max_normal_force: given.max_normal_force.kept("max_normal_force", py)?,
            torsion: given.torsion.kept("torsion", py)?,
            edges: given.edges,
            extreme_forces: given.extreme_forces,
        })
    }
}

impl<'a> Arguments<'a> {
    /// Checks shapes and types; nothing large is copied.
    pub fn of(raw: &Raw<'_>, views: &'a Views<'_>, layout: Layout) -> Result<Self, String> {
        let Views { positions, normals, .. } = views;
        let shape = positions.shape().to_vec();
        let (batched, expected) = match layout {
            Layout::One => (false, "(m, 2) or (m, 3)"),
            Layout::Batch => (true, "(B, m, 2) or (B, m, 3)"),
            Layout::Ragged(_) => (false, "(N, 2) or (N, 3) beside offsets"),
        };
        let axes = if batched { 3 } else { 2 };
        if shape.len() != axes || !matches!(shape[axes - 1], 2 | 3) {
            return Err(format!("positions: shape {}, expected {expected}", shaped(&shape)));
        }
        if normals.shape() != shape {
            let (normals, positions) = (shaped(normals.shape()), shaped(&shape));
            return Err(format!("normals: shape {normals}, expected {positions}, that of positions"));
        }
        let (dim, contacts) = (shape[axes - 1], shape[axes - 2]);
        let offsets = match layout {
            Layout::Ragged(offsets) => Some(offsets),
            _ => None,
        };
        if contacts == 0 && offsets.is_none() {
            return Err("positions: a grasp needs at least one contact".into());
        }
        // The contacts of a ragged batch are numbered as if they were those of one grasp.
        let leading = if batched { shape[0] } else { 1 };
        let batch = offsets.as_ref().map_or(leading, |offsets| offsets.len() - 1);
        let scalar = |name, view: &'a Option<PyReadonlyArrayDyn<'_, f64>>, default| match view {
            None => Ok(Broadcast::constant(default)),
            Some(array) => Broadcast::parse(name, array, &[leading, contacts], batched),
        };
        let tangents = match &views.tangents {
            None => None,
            Some(_) if dim == 2 => return Err("tangents: a planar contact has only one tangent".into()),
            Some(array) => Some(Broadcast::parse_vectors("tangents", array, [leading, contacts], batched)?),
        };
        let each = (batched || offsets.is_some()).then_some(batch);
        let (options, origins, length_scales) = parse_options(raw, dim, each)?;
        Ok(Self {
            dim,
            contacts,
            batch,
            offsets,
            options,
            origins,
            length_scales,
            positions: contents(positions).into(),
            normals: contents(normals).into(),
            tangents,
            friction: scalar("friction", &views.friction, 0.5)?,
            max_normal_force: scalar("max_normal_force", &views.max_normal_force, 1.0)?,
            torsion: scalar("torsion", &views.torsion, 0.0)?,
            edges: parse_edges(raw, dim, contacts)?,
            extreme_forces: raw
                .optional("extreme_forces")
                .map(|value| parse_forces(value, contacts, dim))
                .transpose()?,
        })
    }

    /// Number of contacts of one grasp of the batch.
    pub fn contacts_in(&self, grasp: usize) -> usize {
        self.offsets.as_ref().map_or(self.contacts, |offsets| offsets[grasp + 1] - offsets[grasp])
    }

    /// Whether each grasp of the batch has its own number of contacts.
    pub fn is_ragged(&self) -> bool {
        self.offsets.is_some()
    }

    /// The contacts of one grasp of the batch.
    pub fn contacts_of(&self, grasp: usize) -> Result<Vec<Contact>, Error> {
        let (grasp, range) = match &self.offsets {
            None => (grasp, 0..self.contacts),
            Some(offsets) => (0, offsets[grasp]..offsets[grasp + 1]),
        };
        let forces = self.extreme_forces.as_ref().map_or(&[][..], |forces| &forces[range.clone()]);
        // They are copied for the contacts here, for those of the grasp, and to leave out zeros.
        let copies = 3 * forces.iter().map(Vec::len).sum::<usize>();
        check_room("extreme_forces", copies, size_of::<ContactForce>())?;
        let mut contacts = room("positions", range.len())?;
        contacts.extend(range.map(|contact| self.contact(grasp, contact)));
        Ok(contacts)
    }

    /// The options of one grasp of the batch.
    pub fn options_of(&self, grasp: usize) -> GraspOptions {
        let mut options = self.options;
        if let Some(origins) = &self.origins {
            options.origin = embedded(&origins[grasp * self.dim..(grasp + 1) * self.dim]);
        }
        if let Some(length_scales) = &self.length_scales {
            options.length_scale = length_scales[grasp];
        }
        options
    }

    /// Components of the forces of all grasps: 2 (planar), 3, or 4 where a contact exerts torsion.
    pub fn force_dim(&self) -> usize {
        let torsion = match &self.extreme_forces {
            Some(forces) => forces.iter().flatten().any(|force| force[3] != 0.0),
            None => self.torsion.values.iter().any(|torsion| *torsion != 0.0),
        };
        if self.dim == 2 { 2 } else { 3 + usize::from(torsion) }
    }

    /// (m,) a number of each contact of the first grasp.
    pub fn of_each<'py>(
        &self,
        py: Python<'py>,
        given: &Broadcast<'_>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        vector(py, "result", self.contacts, (0..self.contacts).map(|contact| given.at(0, contact)))
    }

    /// The arguments that make the same grasp again, by name.
    ///
    /// `shared`: a number that all contacts have in common stands once, and so fits another number of contacts.
    pub fn to_python<'py>(&self, py: Python<'py>, shared: bool) -> PyResult<Bound<'py, PyDict>> {
        let vectors = |values: &[f64], columns| matrix(py, self.contacts, columns, values.iter().copied());
        let numbers = |given: &Broadcast<'_>| -> PyResult<Bound<'py, PyAny>> {
            let mut each = (0..self.contacts).map(|contact| given.at(0, contact));
            let first = given.at(0, 0);
            if shared && each.all(|x| x == first) {
                return first.into_bound_py_any(py);
            }
            Ok(self.of_each(py, given)?.into_any())
        };
        let edges = match &self.edges {
            Edges::Cone => None,
            Edges::Each(edges) if shared && edges.iter().all(|count| *count == edges[0]) => {
                Some(edges[0].into_bound_py_any(py)?)
            }
            Edges::Each(edges) => Some(PyList::new(py, edges)?.into_any()),
        };
        let columns: &[usize] = if self.dim == 2 { &[0, 2] } else { &[0, 1, 2, 3] };
        let forces = self.extreme_forces.as_ref().map(|forces| {
            let arrays = forces.iter().map(|forces| {
                let values = forces.iter().flat_map(|force| columns.iter().map(|&row| force[row]));
                matrix(py, forces.len(), columns.len(), values)
            });
            PyList::new(py, arrays.collect::<PyResult<Vec<_>>>()?)
        });
        let GraspOptions { origin, length_scale, friction_margin } = self.options;
        let values = [
            Some(vectors(&self.positions, self.dim)?.into_any()),
            Some(vectors(&self.normals, self.dim)?.into_any()),
            Some(numbers(&self.friction)?),
            Some(numbers(&self.max_normal_force)?),
            edges,
            Some(numbers(&self.torsion)?),
            self.tangents.as_ref().map(|given| vectors(&given.values, 3)).transpose()?.map(Bound::into_any),
            Some(PyArray1::from_slice(py, &origin.as_slice()[..self.dim]).into_any()),
            Some(length_scale.into_bound_py_any(py)?),
            Some(friction_margin.into_bound_py_any(py)?),
            forces.transpose()?.map(Bound::into_any),
        ];
        let arguments = PyDict::new(py);
        for (name, value) in NAMES.iter().zip(values) {
            // Planar cones have no number of edges to choose.
            if self.dim == 2 && *name == "edges" {
                continue;
            }
            arguments.set_item(name, value)?;
        }
        Ok(arguments)
    }

    /// Whether both make the same grasp: equal contacts and options.
    pub fn same_grasp(&self, other: &Self) -> bool {
        self.dim == other.dim
            && self.options == other.options
            && self.contacts == other.contacts
            && (0..self.contacts).all(|contact| self.contact(0, contact) == other.contact(0, contact))
    }

    /// A hash that is the same for equal grasps.
    pub fn hash_of_places(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        for x in self.positions.iter().chain(self.normals.iter()) {
            // Minus zero equals zero.
            (x + 0.0).to_bits().hash(&mut hasher);
        }
        hasher.finish()
    }

    fn contact(&self, grasp: usize, contact: usize) -> Contact {
        let start = (grasp * self.contacts + contact) * self.dim;
        let vector = |values: &[f64]| embedded(&values[start..start + self.dim]);
        Contact {
            position: vector(&self.positions),
            normal: vector(&self.normals),
            tangent: self.tangents.as_ref().map(|tangents| embedded(tangents.row(grasp, contact, 3))),
            friction: self.friction.at(grasp, contact),
            torsion: self.torsion.at(grasp, contact),
            max_normal_force: self.max_normal_force.at(grasp, contact),
            forces: match (&self.extreme_forces, &self.edges) {
                (Some(forces), _) => ForceModel::Extreme(forces[contact].clone()),
                (None, Edges::Cone) => ForceModel::Cone,
                (None, Edges::Each(edges)) => ForceModel::Edges(edges[contact]),
            },
        }
    }
}

/// Options that all grasps share; origins and length scales apart where each of a batch has its own.
type Options = (GraspOptions, Option<Vec<f64>>, Option<Vec<f64>>);

fn parse_options(raw: &Raw<'_>, dim: usize, batch: Option<usize>) -> Result<Options, String> {
    let mut options = GraspOptions::default();
    if let Some(value) = raw.given("friction_margin") {
        options.friction_margin = number("friction_margin", value)?;
    }
    let (mut origins, mut length_scales) = (None, None);
    if let Some(value) = raw.optional("origin") {
        let array = float_array("origin", value)?;
        match *array.shape() {
            [d] if d == dim => options.origin = embedded(contents(&array)),
            [b, d] if batch == Some(b) && d == dim => origins = Some(copied("origin", &array)?),
            ref given => {
                let each = batch.map_or(String::new(), |batch| format!(" or ({batch}, {dim})"));
                return Err(format!("origin: shape {}, expected ({dim},){each}", shaped(given)));
            }
        }
    }
    if let Some(value) = raw.given("length_scale") {
        let array = float_array("length_scale", value)?;
        match (array.shape(), contents(&array)) {
            ([], &[length_scale]) => options.length_scale = length_scale,
            (&[b], _) if batch == Some(b) => length_scales = Some(copied("length_scale", &array)?),
            (given, _) => {
                let each = batch.map_or(String::new(), |batch| format!(" or ({batch},)"));
                return Err(format!("length_scale: shape {}, expected a number{each}", shaped(given)));
            }
        }
    }
    Ok((options, origins, length_scales))
}

fn embedded(values: &[f64]) -> Vector3<f64> {
    Vector3::new(values[0], values[1], values.get(2).copied().unwrap_or(0.0))
}
