//! Rows that are no readings, counted by their reason.

/// Rows that are no readings, and why.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SkippedRows {
    pub standstill: RowCount,
    pub without_speed: RowCount,
    pub other_machines: RowCount,
    pub other_points: RowCount,
    /// Headers that stand there again, and lines below the table.
    pub no_data: RowCount,
}

impl SkippedRows {
    /// Adds those of rows further below.
    pub fn add(&mut self, below: &Self) {
        let Self { standstill, without_speed, other_machines, other_points, no_data } = self;
        for (all, below) in [
            (standstill, below.standstill),
            (without_speed, below.without_speed),
            (other_machines, below.other_machines),
            (other_points, below.other_points),
            (no_data, below.no_data),
        ] {
            all.rows += below.rows;
            all.first = all.first.or(below.first);
        }
    }
}

/// Rows of one kind, and the table and row of the first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RowCount {
    pub rows: usize,
    pub first: Option<(u32, u32)>,
}

impl RowCount {
    pub fn add(&mut self, table: u32, row: usize) {
        self.rows += 1;
        self.first.get_or_insert((table, row_number(row)));
    }
}

pub fn row_number(row: usize) -> u32 {
    u32::try_from(row).unwrap_or(u32::MAX)
}
