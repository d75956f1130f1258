//! A node without the feature `mac`: it checks and sends no MACs.

use super::Node;
#[cfg(feature = "command")]
use super::Save;
use crate::can::Frame;
use crate::numerics::Numerics;

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C: Numerics<SHAPES, PROBES, PLANES>>
    Node<SHAPES, PROBES, PLANES, C>
{
    pub(super) fn is_authenticated(&self) -> bool {
        false
    }

    pub(super) fn take_authenticated(&mut self, _: u64, _: &Frame) {}

    pub(super) fn tell(&mut self, frames: &[Frame], most: usize) -> bool {
        self.queue_all(frames, most)
    }

    #[cfg(feature = "command")]
    pub(super) fn nonce_to_save(&self) -> Option<Save<'_>> {
        None
    }

    #[cfg(feature = "command")]
    pub(super) fn nonce_saved(&mut self, _: bool) -> bool {
        false
    }

    pub(super) fn is_nonce_unsaved(&self) -> bool {
        false
    }
}
