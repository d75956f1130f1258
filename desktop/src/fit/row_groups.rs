//! Rows of the data that share a part of the work.

use std::collections::HashMap;
use std::hash::Hash;

/// The group of each row, and the first row of each group, in the order of the rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowGroups {
    pub of_row: Vec<usize>,
    pub first: Vec<usize>,
}

impl RowGroups {
    /// Rows with the same key form a group.
    pub fn by<K: Eq + Hash>(keys: impl Iterator<Item = K>) -> Self {
        let mut known = HashMap::new();
        let mut first = Vec::new();
        let mut group = |(row, key)| {
            *known.entry(key).or_insert_with(|| {
                first.push(row);
                first.len() - 1
            })
        };
        let of_row = keys.enumerate().map(&mut group).collect();
        Self { of_row, first }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_keep_the_order_of_first_rows() {
        let groups = RowGroups::by("abacb".chars());
        assert_eq!(groups, RowGroups { of_row: vec![0, 1, 0, 2, 1], first: vec![0, 1, 3] });
    }
}
