//! Numbers in lists.

/// The numbers of the probes in a mask, from 1.
pub fn probe_numbers(mask: u8) -> Vec<u8> {
    (0..8).filter(|probe| mask >> probe & 1 == 1).map(|probe| probe + 1).collect()
}

/// Numbers as in "1, 2 and 3".
pub(super) fn listed(numbers: &[u8]) -> String {
    let words: Vec<String> = numbers.iter().map(u8::to_string).collect();
    match words.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => String::new(),
    }
}
