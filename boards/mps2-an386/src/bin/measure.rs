//! Counts instructions over the whole record and prints them beside their limits and what arithmetic alone would take.
//!
//! A multiply-add counts as one, as on paper. The compiler makes it two instructions (it does not contract, so that
//! results equal the host's to the bit), and operands must be loaded and stored.

#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;
use rotor_edge_board_numerics::{BoardModel, Fast, PROBES, SHAPES};
use rotor_edge_core::detector::Growth;
use rotor_edge_core::extraction::{ExtractionConfig, Extractor, KeyphasorDetector};
use rotor_edge_core::heapless::Vec;
use rotor_edge_core::model::{Description, MAX_PLANES, MAX_SUPPORTS};
use rotor_edge_core::numerics::Numerics;
use rotor_edge_core::reading::{Keyphasor, Reading, rad_s};
use rotor_edge_core::response::SupportAmplitudes;
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_core::track::{TrackConfig, Tracker};
use rotor_edge_mps2_an386::instructions::Counter;
use rotor_edge_mps2_an386::sample;
use static_cell::StaticCell;

const RESPONSE_LIMIT: u32 = 5_500;
const SEAL_RESPONSE_LIMIT: u32 = 8_500;
const PHASE_TWO_LIMIT: u32 = 20_000;
const WORST_PHASE_TWO_LIMIT: u32 = 60_000;
const HARDENING_LIMIT: u32 = 100_000;
/// Of the bearings of the hardening model, 1/µm²: at 30 µm a hundredth of the stiffness.
const HARDENING_PER_UM2: f32 = 1e-5;
const DAY_US: u64 = 86_400_000_000;
/// Of a 170 MHz core at 20 kHz: a quarter of the time between two samples on average, all of it at most.
const SAMPLE_LIMIT: u32 = 170_000_000 / 20_000 / 4;
const LONGEST_SAMPLE_LIMIT: u32 = 4 * SAMPLE_LIMIT;
/// Instructions of the calibration, and by how many the counter may err.
const KNOWN: u32 = 1_000;
const SLACK: u32 = 3;

static MODEL: StaticCell<BoardModel> = StaticCell::new();

/// One row of the table.
struct Row {
    what: &'static str,
    instructions: u32,
    limit: u32,
    /// `None`: not arithmetic in the main.
    multiply_adds: Option<u32>,
}

impl Row {
    fn plain(what: &'static str, instructions: u32, limit: u32) -> Self {
        Self { what, instructions, limit, multiply_adds: None }
    }

    fn print(&self) -> bool {
        let Self { what, instructions, limit, multiply_adds } = *self;
        let verdict = if instructions <= limit { "" } else { "  TOO MANY" };
        match multiply_adds {
            Some(least) => {
                let tenths = instructions * 10 / least;
                let (whole, tenth) = (tenths / 10, tenths % 10);
                hprintln!(
                    "{:<44}{:>9}{:>9}{:>9}{:>6}.{}{}",
                    what,
                    instructions,
                    limit,
                    least,
                    whole,
                    tenth,
                    verdict
                );
            }
            None => hprintln!("{:<44}{:>9}{:>9}{:>9}{:>8}{}", what, instructions, limit, "", "", verdict),
        }
        instructions <= limit
    }
}

/// Multiply-adds of one solution in the shaft's modes, every support alike in no two directions: the modes' answers to each
/// support, the flexibility between them, its product with their stiffness, the factors of that in blocks of two, the forces
/// and the motion of each plane, the read-out of probes in pairs.
fn response_multiply_adds(supports: u32) -> u32 {
    let (n, planes, probes) = (SHAPES as u32, 2, PROBES as u32);
    let pairs = supports * (supports + 1) / 2;
    let products: u32 = (0..supports).map(|below| below + below * below).sum();
    let small = 3 * n * supports + 3 * n * pairs + 12 * supports * supports + 32 * products + 24 * supports;
    let plane = (n + 4) * supports + 16 * supports * supports + n + 6 * n * supports;
    let read = probes / 2 * 4 * n + 8 * probes;
    small + planes * (plane + read)
}

/// Multiply-adds of one sample: the phase one step on (8), its vector's square (4), each probe's product with the vector (2).
fn sample_multiply_adds() -> u32 {
    8 + 4 + PROBES as u32 * 2
}

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else { unreachable!() };
    let counter = Counter::new(peripherals.SYST);
    // SAFETY: does nothing, a thousand times.
    let (known, ()) = counter.count(|| unsafe { core::arch::asm!(".rept 1000", "nop", ".endr") });
    hprintln!("instructions                                     counted    limit multiply-adds ratio");
    let mut within = known.abs_diff(KNOWN) <= SLACK;
    if !within {
        hprintln!("the counter is wrong: {} for {} instructions", known, KNOWN);
    }
    let model = MODEL.init_with(|| decoded(sample::BETTER));
    within &= solve(&counter, "Z solve and H, with the seal", SEAL_RESPONSE_LIMIT, model);
    *model = decoded(sample::MODEL);
    within &= solve(&counter, "Z solve and H, sample", RESPONSE_LIMIT, model);
    let (mean, worst) = phase_two(&counter, model);
    within &= Row::plain("phase II, mean of the record", mean, PHASE_TWO_LIMIT).print();
    within &= Row::plain("phase II, its worst reading", worst, WORST_PHASE_TWO_LIMIT).print();
    *model = hardened(model);
    let (_, worst) = phase_two(&counter, model);
    within &= Row::plain("phase II on hardening bearings, worst", worst, HARDENING_LIMIT).print();
    within &= extraction(&counter);
    debug::exit(if within { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

#[inline(never)]
fn hardened(model: &BoardModel) -> BoardModel {
    let description = model.description();
    let mut supports: Vec<_, MAX_SUPPORTS> = description.supports.iter().cloned().collect();
    for support in &mut supports {
        support.hardening_per_um2 = HARDENING_PER_UM2;
    }
    BoardModel::new(&Description { supports: &supports, ..description })
        .unwrap_or_else(|error| panic!("hardening bearings: {error}"))
}

fn decoded(bytes: &[u8]) -> BoardModel {
    BoardModel::decode(bytes).unwrap_or_else(|_| panic!("the sample's models are refused"))
}

/// The worst of the speed range.
#[inline(never)]
fn solve(counter: &Counter, what: &'static str, limit: u32, model: &BoardModel) -> bool {
    let mut instructions = 0;
    for speed_rpm in (1_000..=12_000).step_by(1_000) {
        let speed = rad_s(speed_rpm as f32);
        let at_rest = SupportAmplitudes::default();
        // Left where it was made: what is counted is not how a result comes out of the counter.
        let (count, is_solved) = counter.count(|| {
            black_box(&Fast::response(black_box(model), black_box(speed), black_box(&at_rest))).is_ok()
        });
        assert!(is_solved);
        instructions = count.max(instructions);
    }
    let multiply_adds = response_multiply_adds(model.description().supports.len() as u32);
    Row { what, instructions, limit, multiply_adds: Some(multiply_adds) }.print()
}

/// The mean and the worst of the record, one reading a day.
#[inline(never)]
fn phase_two(counter: &Counter, model: &BoardModel) -> (u32, u32) {
    let (config, thresholds) = (TrackConfig::default(), Thresholds::DEFAULT);
    let (mut tracker, mut growth) = (Tracker::new(model), Growth::default());
    let mut deviation_g_mm = [f32::NAN; MAX_PLANES];
    let (mut sum, mut most, mut readings) = (0, 0, 0);
    for (day, reading) in (0..).zip(sample::readings().filter(Reading::is_complete)) {
        let last_g_mm = tracker.last_g_mm();
        let bound_g_mm = growth.bounds_g_mm(&thresholds, day * DAY_US, last_g_mm, &deviation_g_mm);
        let (count, estimate) = counter.count(|| {
            let tracker = black_box(&mut tracker);
            Fast::update(
                tracker,
                black_box(&config),
                black_box(model),
                black_box(&reading),
                black_box(&bound_g_mm),
            )
        });
        let Ok(estimate) = black_box(estimate) else { panic!("a reading without an estimate") };
        deviation_g_mm = estimate.deviation_g_mm;
        sum += count;
        most = count.max(most);
        readings += 1;
    }
    (sum / readings, most)
}

/// Five seconds of four probes and the keyphasor's channel at 11,000 rpm: triangular waves, since the work does not depend on
/// their form.
#[inline(never)]
fn extraction(counter: &Counter) -> bool {
    const SPEED_RPM: f32 = 11_000.0;
    const SECONDS: u32 = 5;
    const THRESHOLD: u16 = 1_000;
    let config = ExtractionConfig::<PROBES>::new();
    let mut detector = KeyphasorDetector::new(THRESHOLD.into(), i32::from(THRESHOLD / 2));
    let Ok(mut extractor) = Extractor::new(config) else { panic!("the usual settings are refused") };
    let samples = SECONDS * config.sample_rate_hz as u32;
    let step = (SPEED_RPM / 60.0 / config.sample_rate_hz * 4_294_967_296.0) as u32;
    let (mut phase, mut sum, mut most, mut readings) = (0_u32, 0, 0, 0);
    for _ in 0..samples {
        phase = phase.wrapping_add(step);
        let wave = (phase as i32).unsigned_abs() as f32 / 2_147_483_648.0;
        let counts = [2_396 - (600.0 * wave) as u16; PROBES];
        // A straight edge from zero, through the threshold where the turn began.
        let keyphasor = match phase as f32 / step as f32 {
            age @ 0.0..1.0 => (f32::from(THRESHOLD) / (1.0 - age)) as u16,
            _ => 0,
        };
        let mut found = None;
        // Taken only where there is one, as firmware does: else what is counted is an empty result moved about.
        let (count, ()) = counter.count(|| {
            let mark = detector.push(black_box(keyphasor).into());
            if let Some(result) = extractor.push(black_box(counts).map(i32::from), mark) {
                found = Some(result);
            }
        });
        sum += count;
        most = count.max(most);
        if let Some(found) = found {
            assert!(found.keyphasor == Keyphasor::Locked && found.reading.is_complete());
            assert!((found.reading.speed_rpm - SPEED_RPM).abs() < 1.0);
            readings += 1;
        }
    }
    // 183 turns a second, sixteen a reading.
    assert!((55..=57).contains(&readings), "{readings} readings");
    let multiply_adds = Some(sample_multiply_adds());
    let mean = Row {
        what: "a sample of four probes and keyphasor, mean",
        instructions: sum.div_ceil(samples),
        limit: SAMPLE_LIMIT,
        multiply_adds,
    };
    let longest = Row {
        what: "a sample that ends a reading, longest",
        instructions: most,
        limit: LONGEST_SAMPLE_LIMIT,
        multiply_adds: None,
    };
    mean.print() & longest.print()
}
