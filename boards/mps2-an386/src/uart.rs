//! The CMSDK UART, interrupt driven: bytes wait in rings, and nothing polls.

use core::cell::RefCell;

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use cortex_m_rt::exception;
use critical_section::Mutex;
use heapless::Deque;

/// Room for the lines of two readings.
const RECEIVED_BYTES: usize = 288;
/// Room for the lines of a result and a heartbeat.
const WAITING_BYTES: usize = 256;

const DATA: usize = 0x00;
const STATE: usize = 0x04;
const CONTROL: usize = 0x08;
const INTERRUPTS: usize = 0x0c;
const DIVISOR: usize = 0x10;

const STATE_SENDING: u32 = 1 << 0;
const STATE_RECEIVED: u32 = 1 << 1;
const STATE_OVERRUN: u32 = 1 << 3;
/// Sender and receiver on, with an interrupt for each byte.
const CONTROL_ALL: u32 = 0b1111;
const CONTROL_RECEIVE_INTERRUPT: u32 = 1 << 3;
const INTERRUPT_SENT: u32 = 1 << 0;
const INTERRUPT_RECEIVED: u32 = 1 << 1;
/// The smallest that the device takes; the emulator's wire is as fast as whoever is at its other end.
const SMALLEST_DIVISOR: u32 = 16;

/// A UART of the board.
pub struct Uart {
    base: usize,
    rings: Mutex<RefCell<Rings>>,
}

struct Rings {
    received: Deque<u8, RECEIVED_BYTES>,
    waiting: Deque<u8, WAITING_BYTES>,
    overruns: u16,
}

/// The wire with SLCAN on it.
pub static UART0: Uart = Uart::at(0x4000_4000);
pub static UART1: Uart = Uart::at(0x4000_5000);

/// Number of an interrupt line.
#[derive(Clone, Copy)]
struct Line(u16);

// SAFETY: the numbers are those of lines 0 to 3 below, which this chip has.
unsafe impl InterruptNumber for Line {
    fn number(self) -> u16 {
        self.0
    }
}

/// Receiver and sender of the two UARTs, in the order of the chip's lines.
const LINES: [Line; 4] = [Line(0), Line(1), Line(2), Line(3)];

/// Starts both UARTs.
pub fn start() {
    for uart in [&UART0, &UART1] {
        uart.write_register(DIVISOR, SMALLEST_DIVISOR);
        uart.write_register(CONTROL, CONTROL_ALL);
    }
    for line in LINES {
        // SAFETY: the handlers below share data by critical sections alone.
        unsafe { NVIC::unmask(line) };
    }
}

impl Uart {
    const fn at(base: usize) -> Self {
        let rings = Rings { received: Deque::new(), waiting: Deque::new(), overruns: 0 };
        Self { base, rings: Mutex::new(RefCell::new(rings)) }
    }

    /// The next byte that arrived.
    pub fn read(&self) -> Option<u8> {
        self.with_rings(|rings| {
            let byte = rings.received.pop_front();
            self.receive(rings);
            byte
        })
    }

    /// Hands over a byte, asleep while there is no room for it.
    pub fn write(&self, byte: u8) {
        while !self.with_rings(|rings| {
            let taken = rings.waiting.push_back(byte).is_ok();
            self.send(rings);
            taken
        }) {
            cortex_m::asm::wfi();
        }
    }

    /// Whether there is room to write so many bytes without waiting.
    pub fn has_room(&self, bytes: usize) -> bool {
        self.with_rings(|rings| WAITING_BYTES - rings.waiting.len() >= bytes)
    }

    /// Bytes that arrived before the one ahead of them had been taken, and are lost.
    pub fn overruns(&self) -> u16 {
        self.with_rings(|rings| rings.overruns)
    }

    /// Writes without interrupts or rings, for when nothing else works any more.
    pub fn write_at_once(&self, byte: u8) {
        while self.read_register(STATE) & STATE_SENDING != 0 {}
        self.write_register(DATA, u32::from(byte));
    }

    fn interrupted(&self) {
        self.with_rings(|rings| {
            self.write_register(INTERRUPTS, INTERRUPT_SENT | INTERRUPT_RECEIVED);
            self.receive(rings);
            self.send(rings);
        });
    }

    /// Takes what the device holds. With a full ring it is left there and the interrupt off, so that the other end waits
    /// where it can; [`Uart::read`] comes back for it.
    fn receive(&self, rings: &mut Rings) {
        while self.read_register(STATE) & STATE_RECEIVED != 0 && !rings.received.is_full() {
            let byte = self.read_register(DATA) as u8;
            let _ = rings.received.push_back(byte);
        }
        if self.read_register(STATE) & STATE_OVERRUN != 0 {
            rings.overruns = rings.overruns.saturating_add(1);
            self.write_register(STATE, STATE_OVERRUN);
        }
        let enabled =
            if rings.received.is_full() { CONTROL_ALL & !CONTROL_RECEIVE_INTERRUPT } else { CONTROL_ALL };
        self.write_register(CONTROL, enabled);
    }

    fn send(&self, rings: &mut Rings) {
        while self.read_register(STATE) & STATE_SENDING == 0
            && let Some(byte) = rings.waiting.pop_front()
        {
            self.write_register(DATA, u32::from(byte));
        }
    }

    fn with_rings<T>(&self, work: impl FnOnce(&mut Rings) -> T) -> T {
        critical_section::with(|token| work(&mut self.rings.borrow_ref_mut(token)))
    }

    fn read_register(&self, offset: usize) -> u32 {
        // SAFETY: `base` is that of a UART of this board; its registers may be read at any time.
        unsafe { ((self.base + offset) as *const u32).read_volatile() }
    }

    fn write_register(&self, offset: usize, value: u32) {
        // SAFETY: as above; nothing written to them touches memory.
        unsafe { ((self.base + offset) as *mut u32).write_volatile(value) }
    }
}

// SAFETY: not called by anyone but the interrupt controller.
#[exception]
unsafe fn DefaultHandler(line: i16) {
    match line {
        0 | 1 => UART0.interrupted(),
        2 | 3 => UART1.interrupted(),
        _ => panic!("an interrupt that was never enabled"),
    }
}
