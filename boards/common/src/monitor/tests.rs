//! A board that is deployed to and restarted.

use std::boxed::Box;
use std::vec;
use std::vec::Vec;

use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use rotor_edge_core::can::isotp::{IsoTp, Progress};
use rotor_edge_core::can::{TYPE_TO_HOST, TYPE_TO_NODE, frame_id};
use rotor_edge_core::command::{
    ANSWER_BYTES, Answer, Command, Key, MAX_REQUEST_BYTES, Outcome, write_request,
};

use super::*;

const NODE: u8 = 7;
const KEY: Key = Key([3; 32]);
const BETTER: &[u8] = include_bytes!("../../../sample/better.bin");

/// Flash without faults; those are tested with the slots.
#[derive(Clone)]
struct Flash(Vec<u8>);

#[derive(Debug)]
struct Never;

impl NorFlashError for Never {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Flash {
    type Error = Never;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Never> {
        bytes.copy_from_slice(&self.0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = 2048;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Never> {
        self.0[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Never> {
        self.0[offset as usize..][..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

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
    let (mut monitor, started) = start(Flash(vec![0; 8192]));
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
    let (mut monitor, _) = start(Flash(vec![0; 8192]));
    let own = monitor.node.model().checksum();
    assert_eq!(deploy(&mut monitor, 5, false), Outcome::Storage);
    assert_eq!(monitor.node.model().checksum(), own);
    let flash = monitor.slots.into_flash();
    assert!(flash.0.iter().all(|&byte| byte == 0));
    assert_eq!(start(flash).1, Start { counter: 0, deployed: false });
}

#[test]
fn a_boards_own_model_is_accepted_whatever_the_flash_holds() {
    for fill in [0x00, 0xff, 0x55] {
        assert_eq!(start(Flash(vec![fill; 8192])).1, Start { counter: 0, deployed: false });
    }
}
