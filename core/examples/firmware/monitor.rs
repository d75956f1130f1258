//! A whole firmware without CAN, for a Cortex-M4F with 128 KiB of flash: four probes and a keyphasor through a converter that
//! DMA empties into memory, a reading every 16 turns, a state and the unbalance over Modbus, and a memory in flash that survives
//! a loss of power.
//!
//! Interrupts count the halves of the buffer that are full and collect the bytes of a request; everything else happens in the
//! loop of `main`. The registers are those of an invented board ([`board`]): put yours there. `tests/foreign-firmware` builds this file for
//! `thumbv7em-none-eabihf` and asserts its size.
//!
//! The core relies on its caller for this:
//! - time never goes back, and counts on from the start: verdicts age and suspicion grows by it;
//! - the phase reference is told as it is ([`Extraction::keyphasor`]): without marks there are no vectors, and no verdict;
//! - samples follow each other without a gap: after one, [`Extractor::restart`] and [`KeyphasorDetector::restart`].
//!
//! [`Extraction::keyphasor`]: rotor_edge_core::extraction::Extraction::keyphasor

#![no_std]
#![no_main]

mod board;
mod registers;

use core::panic::PanicInfo;

use board::{Board, CHANNELS, Half};
use cortex_m_rt::entry;
use rotor_edge_core::extraction::{Converter, ExtractionConfig, Extractor, KeyphasorDetector};
use rotor_edge_core::memory::Memory;
use rotor_edge_core::monitor::{Monitor, Taken};
use rotor_edge_core::state::Reason;
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_core::track::TrackConfig;

const PROBES: usize = CHANNELS - 1;
/// A model of six basis shapes, four probes and two planes.
type MachineMonitor = Monitor<6, PROBES, 2>;

const ADDRESS: u8 = 17;
/// Between two savings when nothing of note happens: flash wears out.
const MEMORY_PERIOD_US: u64 = 3_600_000_000;

const CONFIG: ExtractionConfig<PROBES> = ExtractionConfig {
    sample_rate_hz: board::SAMPLE_RATE_HZ,
    converter: Converter::unsigned(12, [-24_000.0, 0.0]),
    ..ExtractionConfig::new()
};
const _: () = assert!(CONFIG.check().is_ok());

/// No path of the core leads here; a fault of this file resets.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

#[entry]
fn main() -> ! {
    let mut board = Board::start();
    let (Ok(monitor), Ok(extractor)) =
        (Monitor::new(TrackConfig::default(), Thresholds::DEFAULT), Extractor::new(CONFIG))
    else {
        // the settings are constants that were checked
        cortex_m::peripheral::SCB::sys_reset()
    };
    let mut machine =
        Machine { monitor, extractor, keyphasor: KeyphasorDetector::new(2_400, 200), saved_us: 0 };
    machine.start(&board);
    loop {
        match board.full_half() {
            Some(Half::Next(samples)) => machine.take(&mut board, samples),
            // the loop was late, and a half is lost
            Some(Half::Overrun) => {
                machine.extractor.restart();
                machine.keyphasor.restart();
            }
            None => (),
        }
        if let Some(request) = board.request() {
            let registers = registers::registers(&machine.monitor, board.now_us());
            if let Some(answer) = registers::answer(&request, ADDRESS, &registers) {
                board.send(&answer);
            }
        }
        // a half buffer, a byte or a millisecond ends it
        cortex_m::asm::wfi();
    }
}

struct Machine {
    monitor: MachineMonitor,
    extractor: Extractor<PROBES>,
    keyphasor: KeyphasorDetector,
    saved_us: u64,
}

impl Machine {
    /// Takes up what is stored. Without a model the state says why, and a host can write one into the flash.
    fn start(&mut self, board: &Board) {
        let model = board.stored_model().ok_or(Reason::NothingStored);
        if self.monitor.load(model).is_ok()
            && let Some(memory) = Memory::decode(board.stored_memory())
        {
            self.monitor.restore(&memory);
        }
    }

    fn take(&mut self, board: &mut Board, samples: &[[u16; CHANNELS]]) {
        for &[a, b, c, d, key] in samples {
            let mark = self.keyphasor.push(key.into());
            let Some(found) = self.extractor.push([a, b, c, d].map(i32::from), mark) else { continue };
            let time_us = board.now_us();
            let taken = self.monitor.take(time_us, &found.reading, found.keyphasor);
            let is_news = matches!(taken, Taken::Estimated(judgement) if judgement.is_news);
            let is_due = time_us.saturating_sub(self.saved_us) > MEMORY_PERIOD_US;
            if (is_news || is_due) && board.store_memory(&self.monitor.memory().encode()) {
                self.saved_us = time_us;
            }
        }
    }
}
