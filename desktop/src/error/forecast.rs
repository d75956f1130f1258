//! Reasons why a series cannot be forecast.

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ForecastError {
    /// The track is shorter than the days before the first forecast.
    #[error(
        "the track has {days} days, a forecast that begins after {first} days needs at least {}",
        .first + 1
    )]
    ShortTrack { days: usize, first: usize },
    /// Every day of the track has the same value.
    #[error("{series} is the same on every day, expected estimates of a running machine")]
    ConstantTrack { series: String },
    /// All values that a model is fitted to are the same.
    #[error("the series is constant, so there is nothing to {purpose}")]
    ConstantSeries { purpose: &'static str },
    /// The track has no filter state to start from.
    #[error("the track has no filter state, expected a track of `track --method joint --csv`")]
    NoFilterState,
    /// The order of an ARIMA model is larger than the implementation takes.
    #[error("ARIMA({p},{d},{q}): p and q up to {largest} and d up to {most_differences} are supported")]
    ArimaOrder { p: usize, d: usize, q: usize, largest: usize, most_differences: usize },
    /// There are fewer values than the order of an ARIMA model needs.
    #[error("ARIMA({p},{d},{q}) does not fit {values} values: it needs at least {needed}")]
    ShortForArima { p: usize, d: usize, q: usize, values: usize, needed: usize },
    /// No order that was tried can be fitted.
    #[error("no ARIMA order up to (4,1,4) fits {values} values")]
    NoArimaOrder { values: usize },
    /// There are fewer days than a recurrent network learns from.
    #[error("the track has {days} days, an LSTM needs at least {needed} days")]
    ShortForLstm { needed: usize, days: usize },
}
