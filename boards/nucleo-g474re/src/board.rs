//! The board's parts: clocks, pins, filters, flash, probes.

use embassy_stm32::can::config::{GlobalFilter, TxBufferMode};
use embassy_stm32::can::filter::{Action, FilterType, StandardFilter, StandardFilterSlot};
use embassy_stm32::can::{CanConfigurator, IT0InterruptHandler, IT1InterruptHandler, OperatingMode};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::peripherals::{FDCAN1, IWDG};
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, pac, rcc, uid};
use rotor_edge_boards::filter::filters;

use crate::probes::Probes;
use crate::state::State;
use crate::{can, probes, supply};

pub const SYSTEM_HZ: u32 = 170_000_000;
const BIT_RATE: u32 = 500_000;
/// Longer than anything the loop does, the erasure of two pages (45 ms) included.
const WATCHDOG_US: u32 = 500_000;
/// A crystal swings after 2 ms or so.
const CRYSTAL_MS: u32 = 100;

bind_interrupts!(struct Interrupts {
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
});

/// What the program uses of the board.
pub struct Board {
    pub can: can::Buffered,
    /// Where model, thresholds and counter are kept.
    pub slots: State,
    /// Where memory is kept.
    pub journal: State,
    /// LD2.
    pub light: Output<'static>,
    pub probes: Probes,
    /// What the clocks come from.
    pub oscillator: Oscillator,
}

/// What the clocks come from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Oscillator {
    /// The board's, good to some 1e-5.
    Crystal,
    /// The chip's own, good to 1 % between 0 and 85 °C: outside what CAN tolerates (0.3 % with one quantum of 17 to
    /// resynchronise by), and a speed that is wrong by 1 % near a critical one is a wrong verdict.
    Internal,
}

/// Starts the watchdog: to be called before anything that can fail or wait.
pub fn watchdog() -> IndependentWatchdog<'static, IWDG> {
    // SAFETY: its only user.
    let mut watchdog = IndependentWatchdog::new(unsafe { IWDG::steal() }, WATCHDOG_US);
    watchdog.unleash();
    watchdog
}

/// The chip's own number.
pub fn serial_number() -> u64 {
    let bytes = uid::uid();
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().fold(0, |number, word| number << 24 ^ u64::from(u32::from_le_bytes(*word)))
}

/// Whether the crystal swings.
pub fn crystal_swings() -> bool {
    pac::RCC.cr().read().hserdy()
}

impl Board {
    /// Starts everything but the watchdog; without a crystal with the chip's own oscillator, and then only listening on the bus.
    /// Not inlined: its stack is free again when the loop runs.
    #[inline(never)]
    pub fn start(node: u8) -> Self {
        let oscillator = find_oscillator();
        let parts = embassy_stm32::init(clocks(oscillator));
        // A crystal that stops then ends the program, and one that does not start is still tried.
        pac::RCC.cr().modify(|control| match oscillator {
            Oscillator::Crystal => control.set_csson(true),
            Oscillator::Internal => control.set_hseon(true),
        });
        supply::start();
        let mut can = CanConfigurator::new(parts.FDCAN1, parts.PA11, parts.PA12, Interrupts);
        can.set_bitrate(BIT_RATE);
        let settings = can
            .config()
            .set_global_filter(GlobalFilter::reject_all())
            // The frames of a reading leave in their order.
            .set_tx_buffer_mode(TxBufferMode::Fifo)
            // Ours waits longer each time.
            .set_automatic_bus_off_recovery(false);
        can.set_config(settings);
        let filter_slots = [StandardFilterSlot::_0, StandardFilterSlot::_1];
        for (slot, filter) in filter_slots.into_iter().zip(filters(node)) {
            let filter = FilterType::BitMask { filter: filter.id, mask: filter.mask };
            can.properties()
                .set_standard_filter(slot, StandardFilter { filter, action: Action::StoreInFifo0 });
        }
        let (slots, journal) = State::take(parts.FLASH);
        Self {
            can: can::buffered(can.start(match oscillator {
                Oscillator::Crystal => OperatingMode::NormalOperationMode,
                Oscillator::Internal => OperatingMode::BusMonitoringMode,
            })),
            slots,
            journal,
            light: Output::new(parts.PA5, Level::Low, Speed::Low),
            probes: Probes::new(probes::Parts {
                adc: parts.ADC1,
                timer: parts.TIM3,
                dma: parts.DMA1_CH1,
                bearing_1: (parts.PA0, parts.PA1),
                bearing_2: (parts.PC1, parts.PC0),
                keyphasor: parts.PC2,
                capture_timer: parts.TIM2,
                capture: parts.PB10,
            }),
            oscillator,
        }
    }
}

/// Waits for the crystal, but not for ever.
fn find_oscillator() -> Oscillator {
    pac::RCC.cr().modify(|control| control.set_hseon(true));
    let waits = (0..CRYSTAL_MS).any(|_| {
        cortex_m::asm::delay(rcc::HSI_FREQ.0 / 1_000);
        crystal_swings()
    });
    if waits { Oscillator::Crystal } else { Oscillator::Internal }
}

/// [`SYSTEM_HZ`] from the board's crystal of 24 MHz or the chip's oscillator of 16 MHz.
fn clocks(oscillator: Oscillator) -> Config {
    let mut config = Config::default();
    let (source, prediv) = match oscillator {
        Oscillator::Crystal => (rcc::PllSource::HSE, rcc::PllPreDiv::DIV6),
        Oscillator::Internal => (rcc::PllSource::HSI, rcc::PllPreDiv::DIV4),
    };
    if oscillator == Oscillator::Crystal {
        config.rcc.hse = Some(rcc::Hse { freq: Hertz(24_000_000), mode: rcc::HseMode::Oscillator });
    }
    config.rcc.hsi48 = None;
    config.rcc.pll = Some(rcc::Pll {
        source,
        prediv,
        mul: rcc::PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(rcc::PllRDiv::DIV2),
    });
    config.rcc.sys = rcc::Sysclk::PLL1_R;
    config.rcc.boost = true;
    config.rcc.mux.fdcansel = rcc::mux::Fdcansel::PCLK1;
    // 42.5 MHz after the converter's own prescaler; without a choice it has no clock.
    config.rcc.mux.adc12sel = rcc::mux::Adcsel::SYS;
    config
}
