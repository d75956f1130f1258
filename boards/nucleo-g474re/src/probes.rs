//! The proximity probes: converter, timer and DMA, and the task that makes readings of their samples.
//!
//! TIM3 starts a scan of the five inputs 20,000 times a second; DMA writes it into a ring that is read in halves of 5 ms. A
//! loop that is held up for longer than that (while flash is erased) loses samples, which ends the reading under way: timers,
//! ring and converter then begin anew together. TIM2 runs by the same clock and captures the keyphasor's marks.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, Exten, RingBufferedAdc, SampleTime};
use embassy_stm32::gpio::Pull;
use embassy_stm32::interrupt::typelevel::{self, Interrupt as _};
use embassy_stm32::pac;
use embassy_stm32::peripherals::{ADC1, DMA1_CH1, PA0, PA1, PB10, PC0, PC1, PC2, TIM2, TIM3};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::input_capture::CapturePin;
use embassy_stm32::timer::low_level::{
    FilterValue, InputCaptureMode, InputTISelection, MasterMode, RoundTo, Timer,
};
use embassy_stm32::timer::{Ch3, Channel as TimerChannel};
use embassy_stm32::{bind_interrupts, dma, triggers};
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, ThreadModeRawMutex};
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Instant, TICK_HZ, with_timeout};
use rotor_edge_boards::sampling::{
    CaptureConfig, INPUTS, LevelShift, PROBES, SamplesLost, Sampling, SamplingConfig,
};
use rotor_edge_core::can::NumberedReading;
use static_cell::StaticCell;

use crate::board::SYSTEM_HZ;
use crate::fault::{self, Cause};

const RATE_HZ: u32 = 20_000;
// Samples are counted against the time: with a remainder, samples would seem lost now and then though none are.
const _: () =
    assert!(SYSTEM_HZ % RATE_HZ == 0 && SYSTEM_HZ as u64 % TICK_HZ == 0 && 1_000_000 % RATE_HZ == 0);
/// Scans in half the ring, 5 ms: a phase II of 1.5 ms holds nobody up.
const SCANS: usize = 100;
const HALF: usize = SCANS * INPUTS;
/// A converter that is silent for so long has stopped: after an overrun of its own it asks for no more DMA.
const SILENCE: Duration = Duration::from_millis(100);
/// 247.5 cycles for the wiring's 12 kΩ, 12.5 for the conversion, at 42.5 MHz: five take 30.6 of a scan's 50 µs.
const SAMPLE_TIME: SampleTime = SampleTime::CYCLES247_5;
const CONVERSION_US: f32 = (247.5 + 12.5) / 42.5;
const SCAN_TICKS: u32 = SYSTEM_HZ / RATE_HZ;
/// TIM2 begins again after 25 s.
const LENGTH_TICKS: u32 = SCAN_TICKS * 500_000;
/// A rise counts after eight equal samples at an eighth of the clock, 0.4 µs.
const FILTER: FilterValue = FilterValue::FDTS_DIV8_N8;
const FILTER_TICKS: u32 = 8 * 8;
/// TIM3's first trigger comes at its first overflow; the converter begins three of its cycles (four ticks each) later, and the
/// third input is held after two conversions and its own sampling.
const FIRST_TICKS: u32 = SCAN_TICKS + 4 * (3 + 2 * 260) + 4 * 247 + 2 + FILTER_TICKS;
const CONFIG: SamplingConfig = SamplingConfig {
    scan_us: 1_000_000 / RATE_HZ,
    conversion_us: CONVERSION_US,
    level: LevelShift { probe_ohm: 100_000.0, reference_ohm: 13_700.0, reference_mv: 3_300.0 },
    scale_mv_um: [7.87; PROBES],
    gap_range_mv: [-18_000.0, -2_000.0],
    mark_mv: -12_000.0,
    hysteresis_mv: 2_000.0,
    captures: CaptureConfig { scan_ticks: SCAN_TICKS, length_ticks: LENGTH_TICKS, first_ticks: FIRST_TICKS },
};

const _: () = assert!(CONFIG.extraction().check().is_ok());

bind_interrupts!(struct Interrupts {
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
    TIM2 => Capture;
});

/// What TIM2 captured, on its way to the next scans: 10 ms at 48,000 rpm.
static CAPTURED: Channel<CriticalSectionRawMutex, u32, 8> = Channel::new();

/// TIM2 has captured a mark.
struct Capture;

impl typelevel::Handler<typelevel::TIM2> for Capture {
    unsafe fn on_interrupt() {
        // Reading it ends the interrupt. More than there is room for is noise.
        let _ = CAPTURED.try_send(pac::TIM2.ccr(TimerChannel::Ch3.index()).read());
    }
}

/// Readings on their way to the node.
pub static READINGS: Channel<ThreadModeRawMutex, NumberedReading, 2> = Channel::new();

/// What the probes are connected to.
pub struct Parts {
    pub adc: Peri<'static, ADC1>,
    pub timer: Peri<'static, TIM3>,
    pub dma: Peri<'static, DMA1_CH1>,
    pub bearing_1: (Peri<'static, PA0>, Peri<'static, PA1>),
    pub bearing_2: (Peri<'static, PC1>, Peri<'static, PC0>),
    pub keyphasor: Peri<'static, PC2>,
    pub capture_timer: Peri<'static, TIM2>,
    pub capture: Peri<'static, PB10>,
}

/// The converter, sampling into its ring, the timer that keeps it going, and the one that captures marks.
pub struct Probes {
    converter: RingBufferedAdc<'static, ADC1>,
    timer: Timer<'static, TIM3>,
    capture_timer: Timer<'static, TIM2>,
    _capture: CapturePin<'static, TIM2, Ch3>,
}

impl Probes {
    /// Sets everything up; [`sample`] starts it.
    pub fn new(parts: Parts) -> Self {
        static RING: StaticCell<[u16; 2 * HALF]> = StaticCell::new();
        let timer = Timer::new(parts.timer);
        timer.set_frequency(Hertz(RATE_HZ), RoundTo::Faster);
        timer.set_master_mode(MasterMode::UPDATE);
        let inputs = [
            parts.bearing_1.0.degrade_adc(),
            parts.bearing_1.1.degrade_adc(),
            parts.keyphasor.degrade_adc(),
            parts.bearing_2.0.degrade_adc(),
            parts.bearing_2.1.degrade_adc(),
        ];
        let converter = Adc::new(parts.adc, AdcConfig::default()).into_ring_buffered(
            parts.dma,
            RING.init([0; 2 * HALF]),
            Interrupts,
            inputs.into_iter().map(|input| (input, SAMPLE_TIME)),
            triggers::TIM3_TRGO,
            Exten::RISING_EDGE,
        );
        let capture = CapturePin::new(parts.capture, Pull::Down);
        let capture_timer = Timer::new(parts.capture_timer);
        capture_timer.set_max_compare_value(LENGTH_TICKS - 1);
        capture_timer.set_input_ti_selection(TimerChannel::Ch3, InputTISelection::Normal);
        capture_timer.set_input_capture_filter(TimerChannel::Ch3, FILTER);
        capture_timer.set_input_capture_mode(TimerChannel::Ch3, InputCaptureMode::Rising);
        capture_timer.enable_channel(TimerChannel::Ch3, true);
        capture_timer.enable_input_interrupt(TimerChannel::Ch3, true);
        // SAFETY: the handler only hands over what was captured.
        unsafe { typelevel::TIM2::enable() };
        Self { converter, timer, capture_timer, _capture: capture }
    }

    /// Begins anew with the first scan at the ring's beginning and both timers at 0.
    fn begin(&mut self) {
        self.timer.stop();
        self.capture_timer.stop();
        // The last scan ends.
        cortex_m::asm::delay(SCAN_TICKS);
        self.converter.stop();
        pac::DMA1.ch(0).ndtr().write(|left| left.set_ndt(2 * HALF as u16));
        self.converter.clear();
        self.converter.start();
        self.timer.reset();
        self.capture_timer.reset();
        while CAPTURED.try_receive().is_ok() {}
        cortex_m::interrupt::free(|_| {
            self.capture_timer.start();
            self.timer.start();
        });
    }
}

/// Makes readings of samples for ever.
#[embassy_executor::task]
pub async fn sample(mut probes: Probes) {
    // the compiler has checked it
    let Ok(mut sampling) = Sampling::new(CONFIG) else { return };
    let mut scans = [[0; INPUTS]; SCANS];
    probes.begin();
    loop {
        let result = match with_timeout(SILENCE, probes.converter.read(scans.as_flattened_mut())).await {
            Ok(Ok(_)) => {
                while let Ok(ticks) = CAPTURED.try_receive() {
                    sampling.captured(ticks);
                }
                sampling.take(&scans, Instant::now().as_micros(), hand_on)
            }
            Ok(Err(_)) => Err(sampling.lost()),
            // Only a reset brings scans and ring together again for certain.
            Err(_) => fault::stop(Cause::Converter, 0),
        };
        if result == Err(SamplesLost) {
            defmt::warn!("samples were lost; the reading begins anew");
            probes.begin();
        }
    }
}

fn hand_on(reading: NumberedReading) {
    if READINGS.try_send(reading).is_err() {
        defmt::warn!("reading {} is dropped: the node has not taken those before", reading.sequence);
    }
}
