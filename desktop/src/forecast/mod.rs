//! Where the unbalance is going: forecasts of a track, measured against its own past.
//!
//! | module | holds |
//! |---|---|
//! | [`series`] | static and dynamic unbalance of a track, a value a day |
//! | [`smooth`] | robust local regression |
//! | [`known`] | the columns of a track that hold what its filter knew on each day |
//! | [`filter_state`] | level and slope of a number with their covariance on a day, and the forecast from them |
//! | [`ahead`] | mean and standard deviation of each day to come |
//! | [`arima`] | ARIMA by exact likelihood |
//! | [`backtest`] | forecasts from every day of the past, and what became of them |
//! | [`scores`] | how far off they were, and whether they said how sure they are |
//! | [`limit`] | days until a limit |
//! | [`events`] | how probable it is that something ends the forecast |
//!
//! A forecast from a day uses nothing of later days: smoothing is of the days until then, and so is
//! everything that is fitted. The naive forecast (it stays) and the drift (it goes on as on average) stand
//! beside every model: one that does not beat them is worth nothing, and that is said.

pub mod ahead;
pub mod arima;
pub mod backtest;
pub mod events;
pub mod filter_state;
pub mod known;
pub mod limit;
#[cfg(feature = "lstm")]
pub mod lstm;
pub mod scores;
pub mod series;
pub mod smooth;
