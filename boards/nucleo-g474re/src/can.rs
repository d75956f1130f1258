//! The bus: frames in and out, and the way back after bus-off.

use embassy_stm32::can::enums::BusErrorMode;
use embassy_stm32::can::{
    BufferedCan, BufferedCanReceiver, BufferedCanSender, Frame as BusFrame, RxBuf, TxBuf,
};
use embassy_stm32::pac;
use embassy_stm32::pac::can::vals::Act;
use embedded_can::{Frame as _, Id};
use rotor_edge_boards::recovery::Recovery;
use rotor_edge_boards::watchdog::{Activity, Sending, Wire};
use rotor_edge_core::can::Frame;
use static_cell::StaticCell;

/// Frames that wait while a reading is evaluated or flash erased: 45 ms of a full bus are 200, of which this node's filters
/// pass few.
const RECEIVED: usize = 64;
const WAITING: usize = 8;

/// The controller as [`buffered`] leaves it.
pub type Buffered = BufferedCan<'static, WAITING, RECEIVED>;

/// The controller with its rings.
pub struct Can {
    controller: Buffered,
    receiver: BufferedCanReceiver,
    sender: BufferedCanSender,
    /// Taken from the node, not yet by the controller.
    held: Option<BusFrame>,
    recovery: Recovery,
    sending: Sending,
}

/// Gives a started controller its rings.
pub fn buffered(can: embassy_stm32::can::Can<'static>) -> Buffered {
    static RX: StaticCell<RxBuf<RECEIVED>> = StaticCell::new();
    static TX: StaticCell<TxBuf<WAITING>> = StaticCell::new();
    can.buffered(TX.init_with(TxBuf::new), RX.init_with(RxBuf::new))
}

impl Can {
    /// Takes over a controller.
    pub fn new(controller: Buffered) -> Self {
        let (receiver, sender) = (controller.reader(), controller.writer());
        Self { controller, receiver, sender, held: None, recovery: Recovery::new(), sending: Sending::new() }
    }

    /// The next frame. Errors on the wire are the controller's to count, and [`Can::poll`]'s to act upon.
    pub async fn receive(&mut self) -> BusFrame {
        loop {
            if let Ok(envelope) = self.receiver.receive().await {
                return envelope.frame;
            }
        }
    }

    /// A frame that has arrived already.
    pub fn try_receive(&mut self) -> Option<BusFrame> {
        loop {
            if let Ok(envelope) = self.receiver.try_receive().ok()? {
                return Some(envelope.frame);
            }
        }
    }

    /// Sends what there is until the ring is full. `true` if that is progress: nothing waits, something left, or what holds it
    /// is the wire and not this program.
    pub fn send_all(&mut self, time_us: u64, mut next: impl FnMut() -> Option<Frame>) -> bool {
        let mut moved = false;
        while let Some(frame) = self.held.take().or_else(|| next().and_then(|frame| to_bus(&frame))) {
            match self.sender.try_write(frame) {
                Ok(()) => moved = true,
                Err(embassy_sync::channel::TrySendError::Full(frame)) => {
                    self.held = Some(frame);
                    if !moved {
                        return self.sending.is_held_by(time_us, self.wire());
                    }
                    break;
                }
            }
        }
        self.sending.moved();
        true
    }

    fn wire(&self) -> Wire {
        let status = pac::FDCAN1.psr().read();
        Wire {
            is_asked: pac::FDCAN1.txbrp().read().0 != 0,
            is_faulty: status.ep() || status.bo(),
            activity: match status.act() {
                Act::SYNC => Activity::Synchronising,
                Act::IDLE => Activity::Idle,
                Act::RX => Activity::Receiving,
                Act::TX => Activity::Sending,
            },
        }
    }

    /// Looks after the controller: thrown off the bus, it joins again when its wait is over.
    pub fn poll(&mut self, time_us: u64) {
        let is_off = matches!(self.controller.properties().bus_error_mode(), BusErrorMode::BusOff);
        let times_off = self.recovery.times_off();
        if self.recovery.poll(time_us, is_off) {
            // The controller then waits for 128 × 11 recessive bits by itself.
            pac::FDCAN1.cccr().modify(|control| control.set_init(false));
            defmt::info!("joining the bus again");
        }
        if self.recovery.times_off() != times_off {
            defmt::warn!("off the bus for the {}th time", self.recovery.times_off());
        }
    }
}

/// A received frame as the core knows it; extended and remote frames are none of ours.
pub fn to_core(frame: &BusFrame) -> Option<Frame> {
    match frame.id() {
        Id::Standard(id) if !frame.is_remote_frame() => Frame::standard(id.as_raw(), frame.data()),
        _ => None,
    }
}

fn to_bus(frame: &Frame) -> Option<BusFrame> {
    BusFrame::new_standard(frame.raw_id(), frame.bytes()).ok()
}
