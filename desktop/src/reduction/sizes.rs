//! How many shape functions a plane each use of a machine takes.
//!
//! | size | use | reason |
//! |---|---|---|
//! | `CONTROLLER` | model of the controller; paper's basis in tracking | the core's matrices are of this size |
//! | `tracking` | readings of a long record | days are solved once, so the basis need not show |
//! | `WEIGHTS` | correction weights, influence of a prior | exact to a few parts in ten thousand at every trial |
//! | `SIMULATED` | rivals and lags that a diagnosis simulates | below the differences that it looks for, one model each |
//! | `FIT` | the shaft that fits are made on | what it leaves out is far below any noise |
//! | `CHECK_MODES` | modes of `check`, beside a static shape for each support | finds every mode up to the highest asked for |

pub const CONTROLLER: usize = 6;
pub(crate) const WEIGHTS: usize = 14;
pub(crate) const SIMULATED: usize = 20;
pub(crate) const FIT: usize = 24;
/// Modes alone; the static shapes of the supports come on top.
pub(crate) const CHECK_MODES: usize = 24;

/// Shape functions for the readings of a long record, on a machine with so many bearings: every two bearings hold a rotor, which
/// bends in as many shapes as the shaft of a machine with two.
pub(crate) fn tracking(bearings: usize) -> usize {
    (6 * bearings).max(12)
}
