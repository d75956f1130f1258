//! Several participants in one process, in real time, joined by channels.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use anyhow::{Result, bail};
use rotor_edge_core::can::Frame;

use super::can_bus::CanBus;

/// One participant; every frame goes to all the others.
pub struct LocalPort {
    number: usize,
    others: Vec<Sender<Frame>>,
    incoming: Receiver<Frame>,
}

/// The participants of a new bus.
pub fn local_bus(participants: usize) -> Vec<LocalPort> {
    let (senders, receivers): (Vec<_>, Vec<_>) = (0..participants).map(|_| channel()).unzip();
    let port = |(number, incoming)| {
        let others =
            senders.iter().enumerate().filter(|(i, _)| *i != number).map(|(_, s): (_, &Sender<_>)| s.clone());
        LocalPort { number, others: others.collect(), incoming }
    };
    receivers.into_iter().enumerate().map(port).collect()
}

impl CanBus for LocalPort {
    fn send(&mut self, frame: &Frame) -> Result<()> {
        // a participant that left hears nothing, as on a wire
        self.others.retain(|other| other.send(*frame).is_ok());
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>> {
        match self.incoming.recv_timeout(timeout) {
            Ok(frame) => Ok(Some(frame)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => bail!("{}: all others left", self.description()),
        }
    }

    fn description(&self) -> String {
        format!("in-process bus, participant {}", self.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_goes_to_all_others_in_order_and_never_back() {
        let [mut a, mut b, mut c] = <[_; 3]>::try_from(local_bus(3)).ok().unwrap();
        let frames: Vec<_> = (0..3).map(|id| Frame::standard(id, &[id as u8]).unwrap()).collect();
        frames.iter().for_each(|frame| a.send(frame).unwrap());
        for port in [&mut b, &mut c] {
            let heard: Vec<_> = std::iter::from_fn(|| port.receive(Duration::ZERO).unwrap()).collect();
            assert_eq!(heard, frames);
        }
        assert_eq!(a.receive(Duration::ZERO).unwrap(), None);
    }

    #[test]
    fn leaving_participant_disturbs_nobody_and_last_is_told() {
        let [mut a, b, c] = <[_; 3]>::try_from(local_bus(3)).ok().unwrap();
        drop(b);
        a.send(&Frame::standard(1, &[]).unwrap()).unwrap();
        assert_eq!(a.receive(Duration::ZERO).unwrap(), None);
        drop(c);
        assert!(a.receive(Duration::ZERO).unwrap_err().to_string().contains("all others left"));
    }
}
