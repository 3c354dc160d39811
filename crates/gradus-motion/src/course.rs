//! An axis as a line sees it before it starts.

use crate::gains::Gains;

/// What a line has to know of an axis.
#[derive(Clone, Copy, Debug)]
pub struct Course<'a> {
    /// Distance to its target by the short way.
    pub(crate) distance: i32,
    pub(crate) gains: &'a Gains,
}
