//! Which measure of the overall contact force is limited (Eqs. 6 and 7), and so which wrench set is meant.

/// Which wrench set, and so which measure of the overall contact force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Criterion {
    /// The sum of normalised normal forces is limited (Eq. 6): the union of the contacts' wrenches.
    Sum,
    /// Each normalised normal force is limited (Eq. 7): the Minkowski sum.
    Max,
}
