//! The proximity probes: converter, timer and DMA, and the task that makes readings of their samples.
//!
//! TIM3 starts a scan of the five inputs 20,000 times a second; DMA writes it into a ring that is read in halves of 5 ms. A
//! loop that is held up for longer than that (while flash is erased) loses samples, which ends the reading under way.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, Exten, RingBufferedAdc, SampleTime};
use embassy_stm32::peripherals::{ADC1, DMA1_CH1, PA0, PA1, PC0, PC1, PC2, TIM3};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{MasterMode, RoundTo, Timer};
use embassy_stm32::{bind_interrupts, dma, triggers};
use embassy_sync::blocking_mutex::raw::ThreadModeRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Instant, TICK_HZ, with_timeout};
use rotor_edge_boards::sampling::{INPUTS, LevelShift, SamplesLost, Sampling, SamplingConfig};
use rotor_edge_core::can::NumberedReading;
use rotor_edge_core::reading::PROBES;
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
const CONFIG: SamplingConfig = SamplingConfig {
    scan_us: 1_000_000 / RATE_HZ,
    conversion_us: CONVERSION_US,
    level: LevelShift { probe_ohm: 100_000.0, reference_ohm: 13_700.0, reference_mv: 3_300.0 },
    scale_mv_um: [-7.87; PROBES],
    gap_range_mv: [-18_000.0, -2_000.0],
    mark_mv: -12_000.0,
    hysteresis_mv: 2_000.0,
};

bind_interrupts!(struct Interrupts {
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
});

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
}

/// The converter, sampling into its ring, and the timer that keeps it going.
pub struct Probes {
    converter: RingBufferedAdc<'static, ADC1>,
    _timer: Timer<'static, TIM3>,
}

impl Probes {
    /// Starts the timer; the first read of [`sample`] starts the converter.
    pub fn start(parts: Parts) -> Self {
        static RING: StaticCell<[u16; 2 * HALF]> = StaticCell::new();
        let timer = Timer::new(parts.timer);
        timer.set_frequency(Hertz(RATE_HZ), RoundTo::Faster);
        timer.set_master_mode(MasterMode::UPDATE);
        timer.start();
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
        Self { converter, _timer: timer }
    }
}

/// Makes readings of samples for ever.
#[embassy_executor::task]
pub async fn sample(mut probes: Probes) {
    let mut sampling = Sampling::new(CONFIG);
    let mut scans = [[0; INPUTS]; SCANS];
    loop {
        let result = match with_timeout(SILENCE, probes.converter.read(scans.as_flattened_mut())).await {
            Ok(Ok(_)) => sampling.take(&scans, Instant::now().as_micros(), |reading| {
                if READINGS.try_send(reading).is_err() {
                    defmt::warn!(
                        "reading {} is dropped: the node has not taken those before",
                        reading.sequence
                    );
                }
            }),
            Ok(Err(_)) => Err(sampling.lost()),
            // Only a reset brings scans and ring together again for certain.
            Err(_) => fault::stop(Cause::Converter, 0),
        };
        if result == Err(SamplesLost) {
            defmt::warn!("samples were lost; the reading begins anew");
        }
    }
}
