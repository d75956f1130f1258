//! The registers of an invented board, at made-up addresses. A real board has a crate of its maker's peripherals for them; this
//! file shows which parts of it the core needs: an interrupt for each half of the sample buffer and for each byte of the
//! serial line, a clock, and a page of flash.
//!
//! | from | to | content |
//! |---|---|---|
//! | 0x0801_8000 | 0x0801_EFFF | model, as a host deployed it |
//! | 0x0801_F000 | 0x0801_FFFF | memory, one page of flash |

use core::cell::UnsafeCell;
use core::ptr;
use core::slice;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::exception;
use rotor_edge_core::heapless::Vec;
use rotor_edge_core::memory::MEMORY_BYTES;

/// Four probes and the keyphasor.
pub const CHANNELS: usize = 5;
pub const SAMPLE_RATE_HZ: f32 = 20_000.0;

const CLOCK_HZ: u32 = 170_000_000;
const SAMPLES_PER_HALF: usize = 200;
/// Bytes of the longest request that is answered.
const REQUEST_BYTES: usize = 16;

const MODEL: *const u8 = 0x0801_8000 as *const u8;
const MODEL_BYTES: usize = 0x7000;
const MEMORY: *mut u64 = 0x0801_f000 as *mut u64;
const ERASED: u8 = 0xff;

const DMA_BUFFER: *mut u32 = 0x4002_0014 as *mut u32;
const FLASH_KEY: *mut u32 = 0x4002_2008 as *mut u32;
const FLASH_STATUS: *mut u32 = 0x4002_2010 as *mut u32;
const FLASH_CONTROL: *mut u32 = 0x4002_2014 as *mut u32;
const UART_STATUS: *mut u32 = 0x4000_441c as *mut u32;
const UART_DATA: *mut u32 = 0x4000_4424 as *mut u32;

const UNLOCK: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
const ERASE_MEMORY_PAGE: u32 = 31 << 3 | 1 << 1;
const START: u32 = 1 << 16;
const PROGRAM: u32 = 1;
const LOCK: u32 = 1 << 31;
const BUSY: u32 = 1 << 16;
const HAS_BYTE: u32 = 1 << 5;
const IS_IDLE: u32 = 1 << 4;
const HAS_ROOM: u32 = 1 << 7;

/// Written by DMA in a circle; the half that it does not write is read.
struct Buffer(UnsafeCell<[[[u16; CHANNELS]; SAMPLES_PER_HALF]; 2]>);
// SAFETY: `full_half` alone reads it, and only the half that DMA does not write.
unsafe impl Sync for Buffer {}
static SAMPLES: Buffer = Buffer(UnsafeCell::new([[[0; CHANNELS]; SAMPLES_PER_HALF]; 2]));

/// Halves that DMA has filled since the start.
static FILLED: AtomicU32 = AtomicU32::new(0);
static MILLISECONDS: AtomicU32 = AtomicU32::new(0);

/// The bytes of a request, how many have come, and whether the line has been idle after them.
static REQUEST: [AtomicU8; REQUEST_BYTES] = [const { AtomicU8::new(0) }; REQUEST_BYTES];
static RECEIVED: AtomicU32 = AtomicU32::new(0);
static IS_WHOLE: AtomicBool = AtomicBool::new(false);

#[derive(Clone, Copy)]
enum Interrupt {
    /// Half of the buffer is full.
    Dma = 11,
    /// A byte has come, or the line is idle.
    Uart = 38,
}

// SAFETY: the numbers are those of the board's interrupts, and no two are the same.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

#[exception]
unsafe fn DefaultHandler(number: i16) {
    if number == Interrupt::Dma as i16 {
        FILLED.store(FILLED.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
    } else if number == Interrupt::Uart as i16 {
        // SAFETY: registers that are read; reading the byte clears the interrupt.
        let (status, byte) = unsafe { (ptr::read_volatile(UART_STATUS), ptr::read_volatile(UART_DATA)) };
        if status & HAS_BYTE != 0 {
            let place = RECEIVED.load(Ordering::Relaxed);
            // a longer request loses its end, and its CRC is wrong
            if let Some(cell) = REQUEST.get(place as usize) {
                cell.store(byte as u8, Ordering::Relaxed);
                RECEIVED.store(place + 1, Ordering::Relaxed);
            }
        }
        if status & IS_IDLE != 0 {
            IS_WHOLE.store(true, Ordering::Release);
        }
    }
}

#[exception]
fn SysTick() {
    MILLISECONDS.store(MILLISECONDS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

pub enum Half {
    Next(&'static [[u16; CHANNELS]]),
    /// More than one half was filled since the last.
    Overrun,
}

pub struct Board {
    read: u32,
    milliseconds: u64,
}

impl Board {
    pub fn start() -> Self {
        if let Some(mut core) = cortex_m::Peripherals::take() {
            core.SYST.set_clock_source(SystClkSource::Core);
            core.SYST.set_reload(CLOCK_HZ / 1_000 - 1);
            core.SYST.enable_interrupt();
            core.SYST.enable_counter();
        }
        // SAFETY: the address of a buffer that lives for ever, and interrupts whose handler touches only atomic numbers.
        unsafe {
            ptr::write_volatile(DMA_BUFFER, SAMPLES.0.get() as u32);
            NVIC::unmask(Interrupt::Dma);
            NVIC::unmask(Interrupt::Uart);
        }
        Self { read: 0, milliseconds: 0 }
    }

    /// Time since the start, µs; it never goes back, though the counter of milliseconds wraps after 49 days.
    pub fn now_us(&mut self) -> u64 {
        let counted = MILLISECONDS.load(Ordering::Relaxed);
        self.milliseconds += u64::from(counted.wrapping_sub(self.milliseconds as u32));
        self.milliseconds * 1_000
    }

    pub fn full_half(&mut self) -> Option<Half> {
        let filled = FILLED.load(Ordering::Acquire);
        let ahead = filled.wrapping_sub(self.read);
        if ahead == 0 {
            return None;
        }
        self.read = filled;
        if ahead > 1 {
            return Some(Half::Overrun);
        }
        // SAFETY: DMA writes the other half for the next 10 ms, which is more than a loop takes.
        let halves = unsafe { &*SAMPLES.0.get() };
        let [first, second] = halves;
        Some(Half::Next(if filled % 2 == 1 { first } else { second }))
    }

    pub fn stored_model(&self) -> Option<&'static [u8]> {
        // SAFETY: mapped flash that nobody writes while this program runs.
        let bytes = unsafe { slice::from_raw_parts(MODEL, MODEL_BYTES) };
        bytes.first().filter(|first| **first != ERASED).map(|_| bytes)
    }

    pub fn stored_memory(&self) -> &[u8] {
        // SAFETY: mapped flash; `store_memory` takes the board whole, so that nobody reads meanwhile.
        unsafe { slice::from_raw_parts(MEMORY.cast(), MEMORY_BYTES) }
    }

    /// Erases the page and writes it; whether it then reads as it was written. A board that must not lose the memory in a
    /// power cut meanwhile writes two pages in turn.
    pub fn store_memory(&mut self, bytes: &[u8]) -> bool {
        let control = |value| unsafe { ptr::write_volatile(FLASH_CONTROL, value) };
        // SAFETY: the registers of the flash controller, and a page that holds no code.
        unsafe {
            UNLOCK.iter().for_each(|key| ptr::write_volatile(FLASH_KEY, *key));
            control(ERASE_MEMORY_PAGE | START);
            self.await_flash();
            control(PROGRAM);
            for (place, chunk) in bytes.chunks(8).enumerate() {
                let mut word = [ERASED; 8];
                word.iter_mut().zip(chunk).for_each(|(to, from)| *to = *from);
                ptr::write_volatile(MEMORY.add(place), u64::from_le_bytes(word));
                self.await_flash();
            }
        }
        control(LOCK);
        self.stored_memory().starts_with(bytes)
    }

    fn await_flash(&self) {
        // SAFETY: a register that is read.
        while unsafe { ptr::read_volatile(FLASH_STATUS) } & BUSY != 0 {}
    }

    /// A frame of Modbus RTU, when the line has been idle after it.
    pub fn request(&mut self) -> Option<Vec<u8, REQUEST_BYTES>> {
        if !IS_WHOLE.load(Ordering::Acquire) {
            return None;
        }
        // a master sends nothing more until it is answered or has waited in vain
        let received = RECEIVED.load(Ordering::Relaxed) as usize;
        let mut request = Vec::new();
        for byte in REQUEST.iter().take(received) {
            // there is room for every byte of the static one
            let _ = request.push(byte.load(Ordering::Relaxed));
        }
        RECEIVED.store(0, Ordering::Relaxed);
        IS_WHOLE.store(false, Ordering::Release);
        Some(request)
    }

    pub fn send(&mut self, answer: &[u8]) {
        for byte in answer {
            // SAFETY: registers of the UART.
            unsafe {
                while ptr::read_volatile(UART_STATUS) & HAS_ROOM == 0 {}
                ptr::write_volatile(UART_DATA, u32::from(*byte));
            }
        }
    }
}
