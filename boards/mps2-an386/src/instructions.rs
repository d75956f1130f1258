//! Counting instructions: the emulator lets each last 128 ns (`-icount shift=7`), SysTick ticks every 40 ns.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// 24 bits, as long as SysTick is.
const RELOAD: u32 = 0x00ff_ffff;

/// SysTick as a counter of instructions, up to 5 million at a time.
pub struct Counter {
    /// What two readings in a row cost by themselves, ticks.
    empty: u32,
}

impl Counter {
    /// Takes over SysTick.
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        let mut counter = Self { empty: 0 };
        counter.empty = counter.ticks(|| ());
        counter
    }

    /// Instructions that `work` takes.
    #[inline(always)]
    pub fn count<T>(&self, work: impl FnOnce() -> T) -> (u32, T) {
        let mut result = None;
        let ticks = self.ticks(|| result = Some(work()));
        let Some(result) = result else { unreachable!() };
        // 3.2 ticks an instruction, to the nearest.
        (((ticks - self.empty) * 10 + 16) / 32, result)
    }

    #[inline(always)]
    fn ticks(&self, work: impl FnOnce()) -> u32 {
        cortex_m::asm::isb();
        let before = SYST::get_current();
        work();
        let after = SYST::get_current();
        before.wrapping_sub(after) & RELOAD
    }
}
