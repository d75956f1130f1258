//! A node that knows of no seals: what it would do with the feature `seal`.

use super::Node;
#[cfg(feature = "command")]
use super::Save;
use crate::can::Frame;
use crate::numerics::Numerics;

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C: Numerics<SHAPES, PROBES, PLANES>>
    Node<SHAPES, PROBES, PLANES, C>
{
    pub(super) fn is_sealed(&self) -> bool {
        false
    }

    pub(super) fn take_sealed(&mut self, _: u64, _: &Frame) {}

    pub(super) fn tell<const COUNT: usize>(&mut self, frames: impl IntoIterator<Item = Frame>) -> bool {
        self.queue_all::<COUNT>(frames)
    }

    #[cfg(feature = "command")]
    pub(super) fn freshness_to_save(&self) -> Option<Save<'_>> {
        None
    }

    #[cfg(feature = "command")]
    pub(super) fn freshness_saved(&mut self, _: bool) -> bool {
        false
    }
}
