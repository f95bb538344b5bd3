//! Arrays that results own.

use numpy::ndarray::Dimension;
use numpy::{Element, PyArray, PyArrayMethods};
use pyo3::prelude::*;

/// An array that a result owns: a caller who wants to change it makes a copy.
pub fn read_only<T: Element, D: Dimension>(array: Bound<'_, PyArray<T, D>>) -> Bound<'_, PyArray<T, D>> {
    // Nobody else has borrowed an array that was made just now.
    if let Ok(view) = array.try_readwrite() {
        let _ = view.make_nonwriteable();
    }
    array
}
