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
use rotor_edge_boards::monitor::{BoardModel, ModelCell, OWN_MODEL, SHAPES, decode};
use rotor_edge_core::can::Keyphasor;
use rotor_edge_core::extraction::{ExtractionConfig, Extractor, KeyphasorDetector};
use rotor_edge_core::model::MAX_PLANES;
use rotor_edge_core::reading::{PROBES, Reading, rad_s};
use rotor_edge_core::response::{SupportAmplitudes, response};
use rotor_edge_core::swarm::{DEFAULT_PARTICLES, SwarmConfig};
use rotor_edge_core::track::{TrackConfig, Tracker};
use rotor_edge_mps2_an386::instructions::Counter;
use rotor_edge_mps2_an386::sample;

/// Design limits.
const RESPONSE_LIMIT: u32 = 25_000;
const PHASE_TWO_LIMIT: u32 = 250_000;
/// Of a 170 MHz core at 20 kHz: a quarter of the time between two samples on average, all of it at most.
const SAMPLE_LIMIT: u32 = 170_000_000 / 20_000 / 4;
const LONGEST_SAMPLE_LIMIT: u32 = 4 * SAMPLE_LIMIT;
/// Instructions of the calibration, and by how many the counter may err.
const KNOWN: u32 = 1_000;
const SLACK: u32 = 3;

static MODEL: ModelCell = ModelCell::new();
static BETTER: ModelCell = ModelCell::new();

/// One row of the table.
struct Row {
    what: &'static str,
    instructions: u32,
    limit: u32,
    /// `None`: not arithmetic in the main.
    multiply_adds: Option<u32>,
}

impl Row {
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

/// Multiply-adds of one solution with a full matrix: assembly, elimination, substitution, read-out.
fn response_multiply_adds(supports: u32) -> u32 {
    let n = SHAPES as u32;
    let unknowns = 2 * n;
    let sides = MAX_PLANES as u32 + 1;
    let pairs = unknowns * (unknowns - 1) / 2;
    let shaft = 2 * n * n;
    let terms = supports * (2 * 4 * n + 2 * 4 * n * n);
    let triangle: u32 = (1..unknowns).map(|below| below * below + below).sum();
    let complex = triangle + 2 * sides * pairs + sides * unknowns;
    let read = PROBES as u32 * sides * (2 * unknowns + 4);
    shaft + terms + 4 * complex + read
}

/// Multiply-adds of the swarm: each move evaluates eight residuals of four unknowns and steps four coordinates.
fn swarm_multiply_adds() -> u32 {
    let moves = (1 + u32::from(SwarmConfig::default().iterations)) * DEFAULT_PARTICLES as u32;
    moves * (8 * 4 + 4 * 3)
}

/// Multiply-adds of one sample: the phase one step on (8), its weighted vector and its square (8), each probe's value and
/// product with the vector.
fn sample_multiply_adds() -> u32 {
    8 + 8 + PROBES as u32 * 3
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
    let (Ok(model), Ok(better)) = (decode(&MODEL, OWN_MODEL), decode(&BETTER, sample::BETTER)) else {
        panic!("the sample's models are refused")
    };
    within &= solve(&counter, "Z solve and H, sample", model);
    within &= solve(&counter, "Z solve and H, with the seal", better);
    within &= phase_two(&counter, model);
    within &= extraction(&counter);
    debug::exit(if within { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

/// The worst of the speed range.
#[inline(never)]
fn solve(counter: &Counter, what: &'static str, model: &BoardModel) -> bool {
    let mut instructions = 0;
    for speed_rpm in (1_000..=12_000).step_by(1_000) {
        let speed = rad_s(speed_rpm as f32);
        let (count, solved) = counter.count(|| {
            let at_speed = response(black_box(model), black_box(speed), &SupportAmplitudes::default());
            at_speed.map(|at_speed| (at_speed.influence_matrix(), at_speed.offset()))
        });
        assert!(black_box(solved).is_ok());
        instructions = count.max(instructions);
    }
    let multiply_adds = response_multiply_adds(model.supports.len() as u32);
    Row { what, instructions, limit: RESPONSE_LIMIT, multiply_adds: Some(multiply_adds) }.print()
}

/// The mean and the worst of the record.
#[inline(never)]
fn phase_two(counter: &Counter, model: &BoardModel) -> bool {
    let config = TrackConfig::default();
    let mut tracker = Tracker::new(model);
    let (mut sum, mut most, mut readings) = (0, 0, 0);
    for reading in sample::readings().filter(Reading::is_complete) {
        let (count, estimate) =
            counter.count(|| tracker.update(black_box(&config), black_box(model), black_box(&reading)));
        assert!(black_box(estimate).is_ok());
        sum += count;
        most = count.max(most);
        readings += 1;
    }
    let multiply_adds = response_multiply_adds(model.supports.len() as u32) + swarm_multiply_adds();
    let row = |what, instructions| Row {
        what,
        instructions,
        limit: PHASE_TWO_LIMIT,
        multiply_adds: Some(multiply_adds),
    };
    let mean = row("phase II, mean of the record", sum / readings).print();
    row("phase II, its worst reading", most).print() && mean
}

/// Five seconds of four probes and the keyphasor's channel at 11,000 rpm: triangular waves, since the work does not depend on
/// their form.
#[inline(never)]
fn extraction(counter: &Counter) -> bool {
    const SPEED_RPM: f32 = 11_000.0;
    const SECONDS: u32 = 5;
    const THRESHOLD: i16 = 1_000;
    let config = ExtractionConfig::new();
    let mut detector = KeyphasorDetector::new(THRESHOLD, THRESHOLD / 2);
    let mut extractor = Extractor::new();
    let samples = SECONDS * config.sample_rate_hz as u32;
    let step = (SPEED_RPM / 60.0 / config.sample_rate_hz * 4_294_967_296.0) as u32;
    let (mut phase, mut sum, mut most, mut readings) = (0_u32, 0, 0, 0);
    for _ in 0..samples {
        phase = phase.wrapping_add(step);
        let wave = (phase as i32).unsigned_abs() as f32 / 2_147_483_648.0;
        let counts = [-1_700 - (600.0 * wave) as i16; PROBES];
        // A straight edge from zero, through the threshold where the turn began.
        let keyphasor = match phase as f32 / step as f32 {
            age @ 0.0..1.0 => (f32::from(THRESHOLD) / (1.0 - age)) as i16,
            _ => 0,
        };
        let (count, found) = counter.count(|| {
            let mark = detector.push(black_box(keyphasor));
            extractor.push(black_box(&config), black_box(counts), mark)
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
