//! The arguments that say which forces contacts can exert: numbers of edges, and extreme forces.

use graspforce::{ContactForce, MAX_EDGES};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::convert::arrays::{contents, float_array, large, shaped};
use crate::convert::raw_arguments::Raw;
use crate::convert::scalars::{shown, whole};
use crate::runtime::interrupt::reason;

/// How the friction cones of the contacts are represented.
pub enum Edges {
    Cone,
    Each(Vec<usize>),
}

/// Edges that are given where nobody says otherwise.
const DEFAULT_EDGES: usize = 8;

/// Planar cones have two edges, whatever is asked for: what is given is looked at and dropped.
pub fn parse_edges(raw: &Raw<'_>, dim: usize, contacts: usize) -> Result<Edges, String> {
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

pub fn parse_forces(
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
