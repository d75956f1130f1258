//! A node without the feature `command`: it takes no commands.

use super::{Node, Save};
use crate::numerics::Numerics;

/// The place of the one with the feature `command`.
#[derive(Debug, Clone)]
pub(super) struct CommandHandler;

impl CommandHandler {
    pub fn new() -> Self {
        Self
    }

    pub fn poll_at(&self) -> Option<u64> {
        None
    }

    pub fn trial_until_us(&self) -> Option<u64> {
        None
    }
}

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C: Numerics<SHAPES, PROBES, PLANES>>
    Node<SHAPES, PROBES, PLANES, C>
{
    /// What is to be stored now. The board stores it and calls [`Node::saved`].
    pub fn to_save(&self) -> Option<Save<'_>> {
        self.memory_to_save()
    }

    /// Whether what [`Node::to_save`] gave is stored.
    pub fn saved(&mut self, time_us: u64, stored: bool) {
        self.memory_saved(time_us, stored);
        self.save_scheduler.poll(time_us);
        self.announce(time_us);
    }

    pub(super) fn transfer(&mut self, _: u64, _: &[u8]) {}

    pub(super) fn offered(&mut self, _: &[u8]) {}

    pub(super) fn part(&mut self, _: u64, _: &[u8]) {}

    pub(super) fn poll_transfer(&mut self, _: u64) {}
}
