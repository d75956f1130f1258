//! The node on the emulated board: SLCAN on the first UART, a log on the second.
//!
//! Everything happens in the loop of `main`; interrupts only move bytes and time. A reading is evaluated in about
//! 200,000 instructions, so a loop is never longer than that.

#![no_std]
#![no_main]

use core::fmt::Write;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use rotor_edge_boards::slots::Slots;
use rotor_edge_core::can::slcan::{ACCEPTED, Decoder, Line, REFUSED, encode};
use rotor_edge_core::command::{KEY_BYTES, Key};
use rotor_edge_core::model::{Model, ModelError};
use rotor_edge_core::node::{Node, NodeConfig, NodeError};
use rotor_edge_mps2_an386::log::LastWords;
use rotor_edge_mps2_an386::sample::{self, SHAPES};
use rotor_edge_mps2_an386::state::StateMemory;
use rotor_edge_mps2_an386::uart::{self, UART0};
use rotor_edge_mps2_an386::{clock, log, stack};
use static_cell::StaticCell;

const NUMBER: u8 = 1;
/// The key of the sample node, known to everybody: a device gets its own.
const KEY: Key = Key([0x52; KEY_BYTES]);
/// The stack is looked at for its high-water mark this often.
const STACK_PERIOD_US: u64 = 1_000_000;

type BoardNode = Node<SHAPES>;

// What the node is made of lies in static memory, made one after another: on the stack together, the start would be its
// deepest point.
static BUFFER: StaticCell<[u8; Model::<SHAPES>::max_size_bytes()]> = StaticCell::new();
static MODEL: StaticCell<Result<Model<SHAPES>, ModelError>> = StaticCell::new();
static NODE: StaticCell<Result<BoardNode, NodeError>> = StaticCell::new();

#[entry]
fn main() -> ! {
    stack::paint();
    let Some(peripherals) = cortex_m::Peripherals::take() else { unreachable!() };
    clock::start(peripherals.SYST);
    uart::start();
    // SAFETY: once, here.
    let mut slots = Slots::new(unsafe { StateMemory::take() });
    let node = start(&mut slots);
    let mut wire = Wire { decoder: Decoder::new(), open: false };
    let mut next_look_us = 0;
    let mut deepest_bytes = 0;
    loop {
        node.poll(clock::now_us());
        while let Some(byte) = UART0.read() {
            wire.take(node, byte);
            store(node, &mut slots);
            wire.send(node);
        }
        wire.send(node);
        if clock::now_us() >= next_look_us {
            next_look_us += STACK_PERIOD_US;
            let bytes = stack::high_water_bytes();
            if bytes > deepest_bytes {
                deepest_bytes = bytes;
                log!("stack {} of {} bytes", bytes, stack::size_bytes());
            }
        }
        // Every received byte and every millisecond ends it.
        cortex_m::asm::wfi();
    }
}

/// A node with what was stored last, or with the model in the firmware.
fn start(slots: &mut Slots<StateMemory>) -> &'static mut BoardNode {
    let buffer = BUFFER.init_with(|| [0; Model::<SHAPES>::max_size_bytes()]);
    let (counter, stored) = slots.load(buffer).unwrap_or_default();
    log!("start with counter {} and {} model", counter, if stored.is_some() { "the stored" } else { "its own" });
    let node = create(decode(stored.unwrap_or(sample::MODEL)));
    node.restore_counter(counter);
    node
}

#[inline(never)]
fn decode(bytes: &[u8]) -> &'static Model<SHAPES> {
    match MODEL.init_with(|| Model::decode(bytes)) {
        Ok(model) => model,
        Err(error) => panic!("the model is refused: {error:?}"),
    }
}

#[inline(never)]
fn create(model: &Model<SHAPES>) -> &'static mut BoardNode {
    let config = NodeConfig { key: Some(KEY), ..NodeConfig::new(NUMBER) };
    match NODE.init_with(|| Node::new(config, model.clone())) {
        Ok(node) => node,
        Err(error) => panic!("the node refuses to start: {error:?}"),
    }
}

#[inline(never)]
fn store(node: &mut BoardNode, slots: &mut Slots<StateMemory>) {
    if let Some(save) = node.to_save() {
        let saved = slots.save(save.counter, save.model);
        log!("stored counter {}: {:?}", save.counter, saved);
        node.saved(clock::now_us(), saved.is_ok());
    }
}

/// The adapter that SLCAN supposes between the wire and the bus.
struct Wire {
    decoder: Decoder,
    open: bool,
}

impl Wire {
    #[inline(never)]
    fn take(&mut self, node: &mut BoardNode, byte: u8) {
        let Some(line) = self.decoder.push(byte) else { return };
        let answer = match line {
            Line::Frame(frame) if self.open => {
                node.receive(clock::now_us(), &frame);
                ACCEPTED
            }
            Line::OtherFrame if self.open => ACCEPTED,
            Line::Open => {
                self.open = true;
                ACCEPTED
            }
            Line::Close => {
                self.open = false;
                ACCEPTED
            }
            Line::BitRate | Line::Setting(_) | Line::Empty => ACCEPTED,
            _ => REFUSED,
        };
        UART0.write(answer);
    }

    /// Sends what the node has to say; to a closed channel it says nothing.
    fn send(&mut self, node: &mut BoardNode) {
        while let Some(frame) = node.transmit() {
            if self.open {
                encode(&frame).iter().for_each(|&byte| UART0.write(byte));
            }
        }
    }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    let _ = write!(LastWords, "panic: {}\r\n", info);
    SCB::sys_reset()
}

// SAFETY: called by the processor alone.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    let _ = write!(LastWords, "hard fault at {:#010x}\r\n", frame.pc());
    SCB::sys_reset()
}
