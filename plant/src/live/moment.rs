//! Moments as people write them.

use jiff::Timestamp;

/// A moment, µs since 1970, to the second in UTC.
pub fn moment(time_us: i64) -> String {
    let told = Timestamp::from_microsecond(time_us).map(|time| time.strftime("%F %T UTC").to_string());
    told.unwrap_or_else(|_| "an impossible time".into())
}

#[cfg(test)]
mod tests {
    use super::moment;

    #[test]
    fn moment_is_written_to_the_second_in_utc() {
        assert_eq!(moment(1_700_000_000_000_000), "2023-11-14 22:13:20 UTC");
        assert_eq!(moment(i64::MAX), "an impossible time");
    }
}
