//! Bearings and probes as people count them, from 1.

/// The number of a bearing.
pub fn bearing_number(bearing: u8) -> u8 {
    bearing + 1
}

/// The numbers of the probes in a mask.
pub fn probe_numbers(mask: u8) -> Vec<u8> {
    (0..8).filter(|probe| mask >> probe & 1 == 1).map(|probe| probe + 1).collect()
}
