//! Messages of all public errors.

use std::collections::BTreeSet;
use std::error::Error;
use std::string::{String, ToString};

use crate::extraction::ExtractionError;
use crate::model::ModelError;
use crate::residual::ResidualError;
use crate::response::ResponseError;
use crate::thresholds::ThresholdError;
use crate::track::TrackError;

/// All variants of an error without fields; a variant that is not listed does not compile.
macro_rules! variants {
    ($error:ident: $($variant:ident)+) => {{
        let _is_complete = |error: $error| match error {
            $($error::$variant => (),)+
        };
        [$($error::$variant),+]
    }};
}

#[track_caller]
fn assert_all_distinct<E: Error>(errors: &[E]) {
    let messages: BTreeSet<String> = errors.iter().map(ToString::to_string).collect();
    assert_eq!(messages.len(), errors.len(), "{messages:?}");
    assert!(messages.iter().all(|message| !message.is_empty()), "{messages:?}");
}

#[test]
fn errors_of_models_and_readings_have_distinct_messages() {
    assert_all_distinct(&variants![ModelError:
        NotFinite Planes Supports Asymmetric Mass SpeedRange UnbalanceFloor Response Schema BasisSize Encoding Space
        IllConditioned Probes Knots Mount Noise ProbeGain Bearing NotHeld Forcings
    ]);
    assert_all_distinct(&variants![ResponseError: Singular NotFinite]);
    assert_all_distinct(&variants![ResidualError: NotFinite]);
    assert_all_distinct(&variants![TrackError: Incomplete Speed Response Undetermined ProbeCount]);
}

#[test]
fn threshold_errors_have_distinct_messages() {
    assert_all_distinct(&variants![ThresholdError:
        Encoding Rise RatioLimit RatioFloor Floor Average Persistence Level Learning Growth AgeLimit GapRange
    ]);
}

#[test]
fn extraction_errors_have_distinct_messages() {
    assert_all_distinct(&variants![ExtractionError:
        SampleRate Converter Scale GapRange Revolutions Drift LongestTurn
    ]);
}

#[cfg(feature = "can")]
#[test]
fn errors_of_the_bus_have_distinct_messages() {
    use crate::can::CanError;
    use crate::can::isotp::TransferError;
    assert_all_distinct(&variants![CanError: UnknownType WrongLength BadValue]);
    assert_all_distinct(&variants![TransferError:
        Sequence Timeout Length Interrupted FlowControl Busy Checksum
    ]);
}

#[cfg(feature = "mac")]
#[test]
fn mac_errors_have_distinct_messages() {
    use crate::can::mac::MacError;
    assert_all_distinct(&variants![MacError: Incomplete Forged Replayed]);
}

#[cfg(feature = "can")]
#[test]
fn node_error_names_the_refused_part_and_its_error() {
    use crate::node::NodeError;
    let errors = [
        NodeError::Node,
        NodeError::Thresholds(ThresholdError::Rise),
        NodeError::Model(ModelError::Mass),
        NodeError::Model(ModelError::Mount),
    ];
    assert_all_distinct(&errors);
    assert_eq!(errors[0].to_string(), "the node's number is above 30");
    assert_eq!(errors[1].to_string(), "the thresholds are refused: rise must be from 0 to 100");
}
