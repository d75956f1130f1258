//! Deployment in numbered parts over buses that lose, repeat, delay and damage frames, in simulated time.

use rotor_edge::bus::{BusConfig, VirtualBus};
use rotor_edge::deploy::{PartsClient, Standing};
use rotor_edge_core::command::{Answer, Outcome};

use super::deployment::{KEY, Lab};
use super::scene::{HOST, MONITOR, NODE};

/// What a deployment by a client led to, and after how long.
fn deploy(lab: &mut Lab, faults: BusConfig) -> (Option<Answer>, Standing, u64) {
    let request = lab.request(&KEY, NODE, lab.node.command_counter() + 1);
    let mut bus = VirtualBus::new(faults, 2);
    bus.wait_until(lab.now_us);
    let mut client = PartsClient::new(bus.now_us(), NODE, &request).unwrap();
    let (mut answer, begun_us) = (None, bus.now_us());
    while answer.is_none() && client.standing(bus.now_us()) == Standing::UnderWay {
        while let Some(frame) = client.poll(bus.now_us()) {
            bus.send(HOST, frame);
        }
        if bus.transmit_one().is_none() {
            bus.wait_until(bus.now_us() + 1_000);
        }
        while let Some((time_us, frame)) = bus.receive(MONITOR) {
            lab.node.receive(time_us, &frame);
            lab.poll(time_us);
        }
        lab.poll(bus.now_us());
        while let Some(frame) = lab.node.transmit() {
            bus.send(MONITOR, frame);
        }
        while let Some((time_us, frame)) = bus.receive(HOST) {
            let whole =
                client.receive(time_us, &frame).and_then(|bytes| Answer::decode(bytes, &request, &KEY));
            match whole {
                Some((own, true)) => answer = Some(own),
                Some(_) => client.distrust(time_us),
                None => {}
            }
        }
    }
    lab.now_us = bus.now_us();
    (answer, client.standing(bus.now_us()), bus.now_us() - begun_us)
}

#[test]
fn ten_thousand_deployments_at_5_percent_loss_are_confirmed() {
    let mut lab = Lab::new();
    let mut longest_us = 0;
    for seed in 0..10_000 {
        let old = lab.old.clone();
        lab.node.replace_model(lab.now_us, old).unwrap();
        let faults = BusConfig { loss: 0.05, repetition: 0.05, seed, ..BusConfig::default() };
        let (answer, standing, time_us) = deploy(&mut lab, faults);
        assert_eq!(answer.map(|a| a.outcome), Some(Outcome::Accepted), "seed {seed}: {standing:?}");
        assert_eq!(lab.node.model(), Some(&lab.better), "seed {seed}");
        longest_us = longest_us.max(time_us);
    }
    println!("the longest took {:.1} s", longest_us as f64 * 1e-6);
    assert_eq!(lab.node.counters().accepted, 10_000, "each is carried out once");
}

#[test]
fn deployment_with_retries_over_bad_bus_is_atomic() {
    let mut accepted = 0;
    for seed in 0..100 {
        let mut lab = Lab::new();
        let faults = BusConfig {
            loss: 0.2,
            repetition: 0.2,
            flip: 0.001,
            longest_delay_us: 3_000,
            seed,
            ..BusConfig::default()
        };
        let (answer, standing, _) = deploy(&mut lab, faults);
        let changed = lab.node.command_counter() == 1;
        assert_eq!(lab.node.model(), Some(if changed { &lab.better } else { &lab.old }), "seed {seed}");
        let is_told = answer.is_some_and(|answer| answer.outcome == Outcome::Accepted);
        assert!(changed || !is_told, "seed {seed}: told as accepted");
        assert!(is_told || standing != Standing::UnderWay, "seed {seed}: it ends");
        accepted += usize::from(is_told);
    }
    println!(
        "{accepted} of 100 at 20 % loss, 20 % repetition, a flipped bit in a thousand and 3 ms of disorder"
    );
    assert!(accepted > 80, "{accepted}");
}
