//! The arguments of `Grasp(...)` and of batches of grasps: shapes, broadcasting, and contacts out of them.

use graspforce::{Contact, ContactForce, Error, ForceModel, GraspOptions, MAX_EDGES, check_room, room};
use nalgebra::Vector3;
use numpy::PyArray1;
use numpy::PyUntypedArrayMethods;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString};
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::convert::arrays::{contents, copied, float_array, large, matrix, shaped, vector};
use crate::convert::broadcast::Broadcast;
use crate::convert::raw_arguments::{NAMES, Raw};
use crate::convert::scalars::{number, shown, whole};
use crate::runtime::interrupt::reason;

/// One or many grasps of the same number of contacts, in plain memory.
pub struct Arguments {
    /// 2 or 3.
    pub dim: usize,
    /// Contacts of each grasp.
    pub contacts: usize,
    /// Number of grasps.
    pub batch: usize,
    /// What all grasps share.
    pub options: GraspOptions,
    origins: Option<Vec<f64>>,
    length_scales: Option<Vec<f64>>,
    positions: Vec<f64>,
    normals: Vec<f64>,
    tangents: Option<Broadcast>,
    friction: Broadcast,
    max_normal_force: Broadcast,
    torsion: Broadcast,
    edges: Edges,
    extreme_forces: Option<Vec<Vec<ContactForce>>>,
}

enum Edges {
    Cone,
    Each(Vec<usize>),
}

impl Arguments {
    /// Checks shapes and types; `batched` tells whether there is a leading batch axis.
    pub fn parse(raw: &Raw<'_>, batched: bool) -> Result<Self, String> {
        let positions = float_array("positions", &raw.positions)?;
        let shape = positions.shape().to_vec();
        let expected = if batched { "(B, m, 2) or (B, m, 3)" } else { "(m, 2) or (m, 3)" };
        let axes = if batched { 3 } else { 2 };
        if shape.len() != axes || !matches!(shape[axes - 1], 2 | 3) {
            return Err(format!("positions: shape {}, expected {expected}", shaped(&shape)));
        }
        let normals = float_array("normals", &raw.normals)?;
        if normals.shape() != shape {
            let (normals, positions) = (shaped(normals.shape()), shaped(&shape));
            return Err(format!("normals: shape {normals}, expected {positions}, that of positions"));
        }
        let (dim, contacts) = (shape[axes - 1], shape[axes - 2]);
        let batch = if batched { shape[0] } else { 1 };
        if contacts == 0 {
            return Err("positions: a grasp needs at least one contact".into());
        }
        let scalar = |name, value: Option<&Bound<'_, PyAny>>, default| match value {
            None => Ok(Broadcast::constant(default)),
            Some(value) => Broadcast::parse(name, value, &[batch, contacts], batched),
        };
        let tangents = match raw.optional("tangents") {
            None => None,
            Some(_) if dim == 2 => return Err("tangents: a planar contact has only one tangent".into()),
            Some(value) => Some(Broadcast::parse_vectors("tangents", value, batch, contacts, batched)?),
        };
        let (options, origins, length_scales) = parse_options(raw, dim, batched.then_some(batch))?;
        Ok(Self {
            dim,
            contacts,
            batch,
            options,
            origins,
            length_scales,
            positions: copied("positions", &positions)?,
            normals: copied("normals", &normals)?,
            tangents,
            friction: scalar("friction", raw.given("friction"), 0.5)?,
            max_normal_force: scalar("max_normal_force", raw.given("max_normal_force"), 1.0)?,
            torsion: scalar("torsion", raw.optional("torsion"), 0.0)?,
            edges: parse_edges(raw, dim, contacts)?,
            extreme_forces: raw
                .optional("extreme_forces")
                .map(|value| parse_forces(value, contacts, dim))
                .transpose()?,
        })
    }

    /// The contacts of one grasp of the batch.
    pub fn contacts_of(&self, grasp: usize) -> Result<Vec<Contact>, Error> {
        let given = self.extreme_forces.iter().flatten().map(Vec::len).sum::<usize>();
        // They are copied for the contacts here, for those of the grasp, and to leave out zeros.
        check_room("extreme_forces", 3 * given, size_of::<ContactForce>())?;
        let mut contacts = room("positions", self.contacts)?;
        contacts.extend((0..self.contacts).map(|contact| self.contact(grasp, contact)));
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

    /// (m,) friction coefficients of the first grasp.
    pub fn friction_of_each<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_each(py, &self.friction)
    }

    /// (m,) torsional friction coefficients of the first grasp.
    pub fn torsion_of_each<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_each(py, &self.torsion)
    }

    /// (m,) force limits of the first grasp.
    pub fn limit_of_each<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_each(py, &self.max_normal_force)
    }

    fn of_each<'py>(&self, py: Python<'py>, given: &Broadcast) -> PyResult<Bound<'py, PyArray1<f64>>> {
        vector(py, "result", self.contacts, (0..self.contacts).map(|contact| given.at(0, contact)))
    }

    /// The arguments that make the same grasp again, by name.
    ///
    /// `shared`: a number that all contacts have in common stands once, and so fits another number of contacts.
    pub fn to_python<'py>(&self, py: Python<'py>, shared: bool) -> PyResult<Bound<'py, PyDict>> {
        let vectors = |values: &[f64], columns| matrix(py, self.contacts, columns, values.iter().copied());
        let numbers = |given: &Broadcast| -> PyResult<Bound<'py, PyAny>> {
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
        for x in self.positions.iter().chain(&self.normals) {
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

/// Edges that are given where nobody says otherwise.
const DEFAULT_EDGES: usize = 8;

/// Planar cones have two edges, whatever is asked for: what is given is looked at and dropped.
fn parse_edges(raw: &Raw<'_>, dim: usize, contacts: usize) -> Result<Edges, String> {
    let given = given_edges(raw, dim, contacts)?;
    if dim == 3 { Ok(given) } else { all_with(raw.positions.py(), contacts, DEFAULT_EDGES) }
}

fn all_with(py: Python<'_>, contacts: usize, count: usize) -> Result<Edges, String> {
    let mut edges = large("edges", py, contacts)?;
    edges.resize(contacts, count);
    Ok(Edges::Each(edges))
}

fn given_edges(raw: &Raw<'_>, dim: usize, contacts: usize) -> Result<Edges, String> {
    let all = |count| all_with(raw.positions.py(), contacts, count);
    let value = match raw.given("edges") {
        None => return all(DEFAULT_EDGES),
        Some(value) if value.is_none() => return Ok(Edges::Cone),
        Some(value) => value,
    };
    let least = if dim == 2 { 1 } else { 3 };
    let count = |contact: usize, edges: &Bound<'_, PyAny>| {
        whole(&format!("edges, contact {contact}"), edges, least..=MAX_EDGES)
    };
    if value.call_method0("__index__").is_ok() {
        return all(count(0, value)?);
    }
    let items = if value.is_instance_of::<PyString>() { None } else { value.try_iter().ok() };
    let items = items.ok_or_else(|| {
        format!("edges: {} is no whole number, none for each contact, and not None", shown(value))
    })?;
    let items: Vec<_> = items
        .take(contacts + 1)
        .collect::<PyResult<_>>()
        .map_err(|error| format!("edges: {}", reason(value.py(), error)))?;
    if items.len() != contacts {
        return Err(format!("edges: {} numbers for {contacts} contacts", counted(items.len(), contacts)));
    }
    let edges: Result<_, _> =
        items.iter().enumerate().map(|(contact, edges)| count(contact, edges)).collect();
    Ok(Edges::Each(edges?))
}

/// How many items there are, of which one more than wanted was looked at: an iterator may have no end.
fn counted(items: usize, wanted: usize) -> String {
    if items > wanted { format!("more than {wanted}") } else { items.to_string() }
}

fn parse_forces(
    value: &Bound<'_, PyAny>,
    contacts: usize,
    dim: usize,
) -> Result<Vec<Vec<ContactForce>>, String> {
    let items =
        value.try_iter().map_err(|_| "extreme_forces: expected one array for each contact".to_string())?;
    let items: Vec<_> = items
        .take(contacts + 1)
        .collect::<PyResult<_>>()
        .map_err(|error| format!("extreme_forces: {}", reason(value.py(), error)))?;
    if items.len() != contacts {
        let items = counted(items.len(), contacts);
        return Err(format!("extreme_forces: {items} arrays for {contacts} contacts"));
    }
    let forces = items.iter().enumerate().map(|(contact, item)| {
        let name = format!("extreme_forces, contact {contact}");
        let array = float_array(&name, item)?;
        let columns = match *array.shape() {
            [_, columns] if (dim == 2 && columns == 2) || (dim == 3 && matches!(columns, 3 | 4)) => columns,
            ref given => {
                let expected = if dim == 2 { "(l, 2)" } else { "(l, 3) or (l, 4)" };
                return Err(format!("{name}: shape {}, expected {expected}", shaped(given)));
            }
        };
        let force = |row: &[f64]| match *row {
            [n, t] => ContactForce::new(n, 0.0, t, 0.0),
            _ => ContactForce::new(row[0], row[1], row[2], row.get(3).copied().unwrap_or(0.0)),
        };
        let rows = contents(&array).chunks_exact(columns);
        let mut forces = large("extreme_forces", value.py(), rows.len())?;
        forces.extend(rows.map(force));
        Ok(forces)
    });
    forces.collect()
}

fn embedded(values: &[f64]) -> Vector3<f64> {
    Vector3::new(values[0], values[1], values.get(2).copied().unwrap_or(0.0))
}
