//! The board's parts: clocks, pins, filters, flash, probes.

use core::cell::RefCell;

use cortex_m_rt::exception;
use embassy_embedded_hal::flash::partition::BlockingPartition;
use embassy_stm32::can::config::{GlobalFilter, TxBufferMode};
use embassy_stm32::can::filter::{Action, FilterType, StandardFilter, StandardFilterSlot};
use embassy_stm32::can::{CanConfigurator, IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::peripherals::{FDCAN1, IWDG};
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, pac, rcc};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use rotor_edge_boards::filter::filters;
use static_cell::StaticCell;

use crate::probes::Probes;
use crate::{can, probes, supply};

pub const SYSTEM_HZ: u32 = 170_000_000;
const BIT_RATE: u32 = 500_000;
/// Longer than anything the loop does, the erasure of two pages (45 ms) included.
const WATCHDOG_US: u32 = 500_000;
/// The last pages of the second bank, two for each slot.
const STATE_BYTES: u32 = 8 * 1024;
const STATE_START: u32 = 512 * 1024 - STATE_BYTES;

type WholeFlash = Mutex<NoopRawMutex, RefCell<Flash<'static, Blocking>>>;
/// Where model and counter are kept.
pub type State = BlockingPartition<'static, NoopRawMutex, Flash<'static, Blocking>>;

bind_interrupts!(struct Interrupts {
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
});

/// What the program uses of the board.
pub struct Board {
    pub can: can::Buffered,
    pub state: State,
    /// LD2.
    pub light: Output<'static>,
    pub watchdog: IndependentWatchdog<'static, IWDG>,
    pub probes: Probes,
}

impl Board {
    /// Starts everything but the watchdog.
    pub fn start(node: u8) -> Self {
        let parts = embassy_stm32::init(clocks());
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
        let slots = [StandardFilterSlot::_0, StandardFilterSlot::_1];
        for (slot, filter) in slots.into_iter().zip(filters(node)) {
            let filter = FilterType::BitMask { filter: filter.id, mask: filter.mask };
            can.properties()
                .set_standard_filter(slot, StandardFilter { filter, action: Action::StoreInFifo0 });
        }
        static FLASH: StaticCell<WholeFlash> = StaticCell::new();
        let flash = FLASH.init(Mutex::new(RefCell::new(Flash::new_blocking(parts.FLASH))));
        Self {
            can: can::buffered(can.into_normal_mode()),
            state: BlockingPartition::new(flash, STATE_START, STATE_BYTES),
            light: Output::new(parts.PA5, Level::Low, Speed::Low),
            watchdog: IndependentWatchdog::new(parts.IWDG, WATCHDOG_US),
            probes: Probes::start(probes::Parts {
                adc: parts.ADC1,
                timer: parts.TIM3,
                dma: parts.DMA1_CH1,
                bearing_1: (parts.PA0, parts.PA1),
                bearing_2: (parts.PC1, parts.PC0),
                keyphasor: parts.PC2,
            }),
        }
    }
}

/// [`SYSTEM_HZ`] from the board's crystal of 24 MHz.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(rcc::Hse { freq: Hertz(24_000_000), mode: rcc::HseMode::Oscillator });
    config.rcc.pll = Some(rcc::Pll {
        source: rcc::PllSource::HSE,
        prediv: rcc::PllPreDiv::DIV6,
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

/// A word of flash that lost power while it was written has no valid error code, and reading it ends here: the mark is
/// cleared, and the slot's checksum does the rest.
// SAFETY: called by the processor alone.
#[exception]
unsafe fn NonMaskableInt() {
    let mark = pac::FLASH.eccr().read();
    if !mark.eccd() && !mark.eccd2() {
        defmt::panic!("an interrupt that cannot be masked, and not by flash");
    }
    pac::FLASH.eccr().modify(|mark| {
        mark.set_eccd(true);
        mark.set_eccd2(true);
    });
}
