//! How the forces were chosen among those that are equally good.

/// What the choice found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Choice {
    /// The objective and its tie-break determine the forces.
    Unique,
    /// The least norm chose.
    LeastNorm,
    /// Several directions are free, and cones bound them.
    Open,
}
