//! What the fuzz targets share: inputs out of bytes, and the laws that every answer obeys.

#![forbid(unsafe_code)]

pub mod forces;
pub mod input;
pub mod quality;
