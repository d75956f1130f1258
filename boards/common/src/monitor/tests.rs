//! A board that is deployed to and restarted.

use std::boxed::Box;

use rotor_edge_core::can::isotp::{IsoTp, Progress};
use rotor_edge_core::can::{TYPE_TO_HOST, TYPE_TO_NODE, frame_id};
use rotor_edge_core::command::{
    ANSWER_BYTES, Answer, Command, Key, MAX_REQUEST_BYTES, Outcome, write_request,
};

use super::*;

const NODE: u8 = 7;
const KEY: Key = Key([3; 32]);
const BETTER: &[u8] = include_bytes!("../../../sample/better.bin");

type Flash = crate::testing::Flash<2048>;

fn start(flash: Flash) -> (Monitor<Flash>, Start) {
    let config = NodeConfig { key: Some(KEY), ..NodeConfig::new(NODE) };
    Monitor::start(Box::leak(Box::new(Place::new())), flash, config).unwrap()
}

fn deploy(monitor: &mut Monitor<Flash>, counter: u64, may_write: bool) -> Outcome {
    let mut request = [0; MAX_REQUEST_BYTES];
    let length = write_request(&mut request, &KEY, NODE, Command::Deploy, counter, BETTER).unwrap();
    let mut host = IsoTp::<ANSWER_BYTES, MAX_REQUEST_BYTES>::new();
    host.send(0, &request[..length]).unwrap();
    while let Some(payload) = host.poll(0) {
        let frame = Frame::standard(frame_id(TYPE_TO_NODE, NODE), &payload).unwrap();
        monitor.receive(0, &frame, may_write);
        while let Some(frame) = monitor.node.transmit() {
            assert_eq!(frame.message_type(), TYPE_TO_HOST);
            if host.receive(0, frame.bytes()) == Progress::Complete {
                let (answer, confirmed) = Answer::decode(host.message(), &request[..length], &KEY).unwrap();
                assert!(confirmed);
                return answer.outcome;
            }
        }
    }
    panic!("no answer");
}

#[test]
fn a_deployed_model_and_its_counter_outlive_a_restart() {
    let (mut monitor, started) = start(Flash::new(4, || 0));
    assert_eq!(started, Start { counter: 0, deployed: false });
    let own = monitor.node.model().checksum();
    assert_eq!(deploy(&mut monitor, 5, true), Outcome::Accepted);
    let better = monitor.node.model().checksum();
    assert_ne!(own, better);
    let (mut restarted, started) = start(monitor.slots.into_flash());
    assert_eq!(started, Start { counter: 5, deployed: true });
    assert_eq!(restarted.node.model().checksum(), better);
    assert_eq!(deploy(&mut restarted, 5, true), Outcome::Replayed);
}

#[test]
fn while_the_supply_is_low_nothing_is_written_and_the_old_model_stays() {
    let (mut monitor, _) = start(Flash::new(4, || 0));
    let own = monitor.node.model().checksum();
    assert_eq!(deploy(&mut monitor, 5, false), Outcome::Storage);
    assert_eq!(monitor.node.model().checksum(), own);
    let flash = monitor.slots.into_flash();
    assert!(flash.bytes.iter().all(|&byte| byte == 0));
    assert_eq!(start(flash).1, Start { counter: 0, deployed: false });
}

#[test]
fn a_boards_own_model_is_accepted_whatever_the_flash_holds() {
    for fill in [0x00, 0xff, 0x55] {
        assert_eq!(start(Flash::new(4, || fill)).1, Start { counter: 0, deployed: false });
    }
}
