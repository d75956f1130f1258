//! Time since the start, from SysTick.

use core::cell::Cell;

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use cortex_m_rt::exception;
use critical_section::Mutex;

const TICKS_PER_US: u32 = 25;
/// SysTick interrupts this often, which also ends every sleep.
const PERIOD_US: u32 = 1_000;
const PERIOD_TICKS: u32 = TICKS_PER_US * PERIOD_US;

static PERIODS: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));

/// Starts the clock at zero.
pub fn start(mut timer: SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(PERIOD_TICKS - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
}

/// Time since the start, µs; never goes back.
pub fn now_us() -> u64 {
    let (periods, ticks) = critical_section::with(|token| {
        let periods = PERIODS.borrow(token).get();
        let ticks = SYST::get_current();
        // A period that ended but whose interrupt waits is not counted yet, and the ticks may be of either.
        if SCB::is_pendst_pending() { (periods + 1, SYST::get_current()) } else { (periods, ticks) }
    });
    periods * u64::from(PERIOD_US) + u64::from((PERIOD_TICKS - 1 - ticks) / TICKS_PER_US)
}

#[exception]
fn SysTick() {
    critical_section::with(|token| {
        let periods = PERIODS.borrow(token);
        periods.set(periods.get() + 1);
    });
}
