//! Without the feature `union` no part is united with another: [`super::overlap`] says so.

use super::overlap::Closed;

/// There is none.
pub(super) enum Solid {}

impl Solid {
    pub(super) fn new(_: &Closed) -> Option<Self> {
        None
    }

    pub(super) fn with(&self, _: &Self) -> Option<Self> {
        match *self {}
    }

    pub(super) fn without(&self, _: &Self) -> Option<Self> {
        match *self {}
    }

    pub(super) fn common_mm3(&self, _: &Self) -> f64 {
        match *self {}
    }

    pub(super) fn volume_mm3(&self) -> f64 {
        match *self {}
    }

    pub(super) fn triangles(&self) -> Closed {
        match *self {}
    }
}
