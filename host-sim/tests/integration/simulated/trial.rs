//! Models on trial at a monitor that is read to meanwhile: confirmed, taken back, or left alone by a host that died.

use std::time::Duration;

use rotor_edge::bus::CanBus;
use rotor_edge::bus::mac::AuthenticatedBus;
use rotor_edge::deploy::trial::{Candidate, TrialResult, TrialVerdict, median, run};
use rotor_edge::deploy::{Authority, HEARTBEAT_TIME};
use rotor_edge::edge::encoded;
use rotor_edge::watch::words::Words;
use rotor_edge_desktop::machine::drawing::Rotor;

use super::lab::{Lab, NODE, checksum, identified, model, worse};
use crate::program::assert_says;

fn candidate(rotor: &Rotor) -> Candidate {
    let edge = model(rotor);
    Candidate { bytes: encoded(&edge).unwrap(), checksum: edge.checksum() }
}

/// As `deploy --trial` does it.
fn try_out(
    bus: &mut dyn CanBus,
    mut authority: Authority,
    candidate: &Candidate,
    time: Duration,
) -> anyhow::Result<TrialResult> {
    let mut bus = AuthenticatedBus::listen(bus, authority.checker(), HEARTBEAT_TIME)?;
    run(&mut authority, &mut bus, candidate, time, |_| ())
}

/// The same by the main program with the next counter.
fn trial(lab: &mut Lab, rotor: &Rotor, seconds: u64) -> anyhow::Result<TrialResult> {
    let authority = lab.authority();
    try_out(&mut lab.bus.join(), authority, &candidate(rotor), Duration::from_secs(seconds))
}

#[test]
fn trial_of_better_model_is_confirmed_and_survives_power_loss() {
    let mut lab = Lab::new();
    let node = lab.node(Some(&worse()));
    let before = checksum(&lab.seen());
    let traffic = lab.traffic();
    let result = trial(&mut lab, &identified(), 2).unwrap();
    assert_eq!(result.verdict, TrialVerdict::NoWorse);
    let json = result.json();
    assert_eq!((&json["outcome"], &json["compared"]), (&"confirmed".into(), &true.into()));
    assert!(median(&result.during.ratios) < 0.5 * median(&result.before.ratios), "{json}");
    assert_says(&result.sentence("better.toml").unwrap(), &["Monitor 1 keeps the model of better.toml"]);
    traffic.kill();
    let better = checksum(&lab.seen());
    assert_eq!((better, better == before), (result.checksum, false));
    let said = node.kill().join("\n");
    assert_says(&said, &[" is on trial; unless it is confirmed", " was confirmed and is stored."]);
    let _node = lab.node(Some(&worse()));
    assert_eq!(checksum(&lab.seen()), better, "it is stored");
}

#[test]
fn trial_of_worse_model_is_taken_back_and_cannot_be_replayed() {
    let mut lab = Lab::new();
    let node = lab.node(Some(&identified()));
    let better = checksum(&lab.seen());
    let _traffic = lab.traffic();
    let result = trial(&mut lab, &worse(), 2).unwrap();
    assert_eq!((result.verdict, result.checksum, result.is_back), (TrialVerdict::Worse, better, true));
    let json = result.json();
    assert_eq!((&json["outcome"], &json["compared"]), (&"reverted".into(), &true.into()));
    let sentence = result.sentence("worse.toml").unwrap_err().to_string();
    let parts = ["monitor 1 returned to the old model", "% of the vibration", "readings"];
    assert_says(&sentence, &parts);
    assert_eq!(checksum(&lab.seen()), better);

    let authority = lab.authority();
    let again = || {
        let time = Duration::from_secs(2);
        try_out(&mut lab.bus.join(), authority.clone(), &candidate(&worse()), time)
    };
    assert_eq!(again().unwrap().verdict, TrialVerdict::Worse);
    assert_says(&again().unwrap_err().to_string(), &["has accepted command"]);
    let said = node.kill().join("\n");
    assert_eq!(said.matches(" is on trial").count(), 2, "{said}");
    let back = format!("model {better:08x}, the one before, is in use again");
    assert_eq!(said.matches(&back).count(), 2, "{said}");
}

#[test]
fn trial_of_a_host_that_dies_ends_by_the_monitors_clock() {
    let mut lab = Lab::new();
    let _node = lab.node(Some(&identified()));
    let before = checksum(&lab.seen());
    let _traffic = lab.traffic();
    let authority = lab.authority();
    let host = lab.bus.start(move |mut bus| {
        try_out(&mut bus, authority, &candidate(&worse()), Duration::from_secs(3)).map(|_| ())
    });
    let is_on_trial = |monitor: &rotor_edge::watch::monitor::Monitor| {
        monitor.model().is_some_and(|model| model.on_trial && model.checksum != before)
    };
    lab.await_seen(Duration::from_secs(20), is_on_trial);
    host.kill().unwrap_err();
    let killed = lab.bus.now();
    let watch = lab.watch();
    let words = Words::of(NODE, watch.monitor(NODE).unwrap(), watch.now_us());
    assert_says(&words.state, &["its model is on trial"]);
    let second = trial(&mut lab, &worse(), 1).unwrap_err().to_string();
    assert_says(&second, &["has a model on trial already", "nothing was sent"]);

    lab.await_seen(Duration::from_secs(40), |monitor| !is_on_trial(monitor));
    assert_eq!(checksum(&lab.seen()), before);
    // three seconds, one more, and fifteen that a confirmation may take; begun up to a look of `seen` before
    let lasted_s = (lab.bus.now() - killed).as_secs_f64();
    assert!((15.0..24.0).contains(&lasted_s), "{lasted_s}");
}

#[test]
fn trial_of_the_model_in_use_sends_nothing_and_says_so() {
    let mut lab = Lab::new();
    let _node = lab.node(Some(&identified()));
    let before = checksum(&lab.seen());
    let _traffic = lab.traffic();
    let result = trial(&mut lab, &identified(), 1).unwrap();
    assert_eq!((result.verdict, result.checksum), (TrialVerdict::Unchanged, before));
    assert_eq!(result.json()["outcome"], "unchanged");
    assert_says(&result.sentence("same.toml").unwrap(), &["runs the model of same.toml already"]);
    assert_eq!(lab.seen().counters().unwrap().accepted, 0);
}

#[test]
fn trial_without_readings_sends_nothing() {
    let mut lab = Lab::new();
    let _node = lab.node(Some(&worse()));
    let silent = trial(&mut lab, &identified(), 1).unwrap_err().to_string();
    assert_says(&silent, &["judged 0 readings", "at least 9", "nothing was sent", "--trial"]);
    assert_eq!(lab.seen().counters().unwrap().accepted, 0);
}

#[test]
fn trial_whose_readings_end_is_taken_back_without_comparison() {
    let mut lab = Lab::new();
    let _node = lab.node(Some(&worse()));
    let before = checksum(&lab.seen());
    let (traffic, authority) = (lab.traffic(), lab.authority());
    let host = lab.bus.start(move |mut bus| {
        try_out(&mut bus, authority, &candidate(&identified()), Duration::from_secs(6)).unwrap()
    });
    // the readings end while the model before is listened to
    lab.bus.pass(HEARTBEAT_TIME + Duration::from_secs(1));
    traffic.kill();
    let result = host.end();
    assert_eq!(result.verdict, TrialVerdict::TooFewReadings);
    let json = result.json();
    assert_eq!((&json["outcome"], &json["compared"]), (&"reverted".into(), &false.into()));
    let sentence = result.sentence("x.toml").unwrap_err().to_string();
    assert_says(&sentence, &["judged 0 readings", "at least 9", "a longer time"]);
    assert_eq!(checksum(&lab.seen()), before);
}

#[test]
fn trial_at_a_monitor_that_restarts_is_given_up() {
    let mut lab = Lab::new();
    let node = lab.node(Some(&worse()));
    let before = checksum(&lab.seen());
    let (_traffic, authority) = (lab.traffic(), lab.authority());
    let host = lab.bus.start(move |mut bus| {
        try_out(&mut bus, authority, &candidate(&identified()), Duration::from_secs(5)).map(|_| ())
    });
    lab.await_seen(Duration::from_secs(20), |monitor| monitor.model().is_some_and(|model| model.on_trial));
    node.kill();
    let _node = lab.node(Some(&worse()));
    let restarted = lab.bus.now();
    assert_says(&host.end().unwrap_err().to_string(), &["restarted during the trial"]);
    assert!(lab.bus.now() - restarted < Duration::from_secs(2), "at its next heartbeat");
    assert_eq!(checksum(&lab.seen()), before);
}
