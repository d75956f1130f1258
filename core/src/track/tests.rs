use super::*;
use crate::model::tests::{rigid_modes, rigid_place, rigid_rotor};
use crate::model::{Noise, Probe, Support};
use crate::response::{response, support_amplitudes};
use crate::testing::Random;

const SPEED_RPM: f32 = 9000.0;
const GROWTH: f32 = 1.2;

/// What the model itself would show, with the amplitudes at hardening supports iterated to rest.
fn shown<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    model: &Model<SHAPES, PROBES, PLANES>,
    unbalance: &[Pair],
) -> Reading {
    let speed = crate::reading::rad_s(SPEED_RPM);
    let mut amplitudes = SupportAmplitudes::default();
    for _ in 0..200 {
        let aim = support_amplitudes(model, speed, &amplitudes, unbalance).unwrap();
        for (present, aim) in amplitudes.0.as_flattened_mut().iter_mut().zip(aim.0.as_flattened()) {
            *present += 0.5 * (aim - *present);
        }
    }
    let vectors: std::vec::Vec<_> = response(model, speed, &amplitudes).unwrap().vectors(unbalance).collect();
    Reading::new(SPEED_RPM, &vectors).unwrap()
}

fn follow<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    model: &Model<SHAPES, PROBES, PLANES>,
    reading: &Reading,
) -> Result<Estimate, TrackError> {
    update(&mut Tracker::new(model), model, reading, GROWTH)
}

/// What each plane may have grown to since the last estimate.
fn grown<const PLANES: usize>(tracker: &Tracker<PLANES>, growth: f32) -> [f32; MAX_PLANES] {
    let mut bounds = [0.0; MAX_PLANES];
    for (bound, [x, y]) in bounds.iter_mut().zip(tracker.last_g_mm()) {
        *bound = growth * x.hypot(*y);
    }
    bounds
}

fn update<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    tracker: &mut Tracker<PLANES>,
    model: &Model<SHAPES, PROBES, PLANES>,
    reading: &Reading,
    growth: f32,
) -> Result<Estimate, TrackError> {
    let bounds = grown(tracker, growth);
    tracker.update(&TrackConfig::default(), model, reading, &bounds)
}

fn differs_by(found: &[Pair], want: &[Pair]) -> f32 {
    let pairs = found.as_flattened().iter().zip(want.as_flattened());
    pairs.fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
}

#[test]
fn a_known_unbalance_comes_back_from_the_models_own_response() {
    let model = rigid_rotor();
    let truth = [[3300.0, 3900.0], [-1100.0, 1900.0]];
    let estimate = follow(&model, &shown(&model, &truth)).unwrap();
    assert!(differs_by(&estimate.unbalance_g_mm, &truth) < 0.1, "{:?}", estimate.unbalance_g_mm);
    assert!(estimate.residual.ratio < 1e-5 && estimate.gap_um < 1e-5 * estimate.residual.f_um);
    assert_eq!((estimate.at_bound, estimate.searched), ([false; 4], false));
    assert_eq!((estimate.planes, estimate.redundancy, estimate.residual.features), (2, 4, 8));
}

#[test]
fn static_and_dynamic_put_together_are_the_planes() {
    let model = rigid_rotor();
    let estimate = follow(&model, &shown(&model, &model.initial_unbalance_g_mm)).unwrap();
    for i in 0..2 {
        let [half, dynamic] = [0.5 * estimate.static_g_mm[i], estimate.dynamic_g_mm[i]];
        assert!((half + dynamic - estimate.unbalance_g_mm[0][i]).abs() < 1e-2);
        assert!((half - dynamic - estimate.unbalance_g_mm[1][i]).abs() < 1e-2);
    }
}

#[test]
fn threefold_jump_is_followed_at_bound_and_caught_up() {
    let model = rigid_rotor();
    let truth = [[9000.0, 12_000.0], [-3000.0, 6000.0]];
    let reading = shown(&model, &truth);
    let mut tracker = Tracker::new(&model);
    let mut residuals = std::vec::Vec::new();
    for number in 1..=9 {
        let estimate = update(&mut tracker, &model, &reading, GROWTH).unwrap();
        // 1.2⁶ = 2.99 < 3 < 1.2⁷.
        assert_eq!(estimate.at_bound[..2], [number < 7; 2], "reading {number}");
        assert!(estimate.free_residual_um < 1e-4 * estimate.residual.f_um);
        assert!(!estimate.searched && estimate.gap_um < 1e-3 * estimate.residual.f_um);
        residuals.push(estimate.residual.e_um);
    }
    assert!(residuals[..7].windows(2).all(|pair| pair[1] < pair[0]), "{residuals:?}");
    assert!(differs_by(tracker.last_g_mm(), &truth) < 0.5);
}

#[test]
fn growth_is_the_factor_of_the_bound() {
    let model = rigid_rotor();
    let reading = shown(&model, &[[9000.0, 12_000.0], [-3000.0, 6000.0]]);
    for growth in [1.0, 1.5, 2.5] {
        let mut tracker = Tracker::new(&model);
        let estimate = update(&mut tracker, &model, &reading, growth).unwrap();
        let [x, y] = estimate.unbalance_g_mm[0];
        assert!((x.hypot(y) / (growth * 5000.0) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn a_balanced_plane_can_grow_again_from_the_floor() {
    let mut model = rigid_rotor();
    let truth = [[80.0, 0.0], [0.0, -90.0]];
    let reading = shown(&model, &truth);
    model.initial_unbalance_g_mm = Vec::from_array([[0.0; 2]; 2]);
    assert!(differs_by(&follow(&model, &reading).unwrap().unbalance_g_mm, &truth) < 0.01);
}

#[test]
fn one_plane_has_no_dynamic_unbalance() {
    let mut model = rigid_rotor();
    model.planes.truncate(1);
    model.initial_unbalance_g_mm.truncate(1);
    let truth = [[2000.0, 100.0]];
    let estimate = follow(&model, &shown(&model, &truth)).unwrap();
    assert!(differs_by(&estimate.unbalance_g_mm[..1], &truth) < 0.05);
    assert_eq!((estimate.dynamic_g_mm, estimate.static_g_mm), ([0.0; 2], estimate.unbalance_g_mm[0]));
    assert_eq!((estimate.planes, estimate.redundancy), (1, 6));
}

/// The rigid rotor seen by eight probes.
fn roomy() -> Model<2, 8, 4> {
    let small = rigid_rotor();
    let modes = rigid_modes();
    let probe = |number: u8| {
        let angle = 0.4 + 0.9 * f32::from(number);
        let place = rigid_place(f64::from(number) / 4.0 - 0.9);
        Probe::plain(modes.shape(&place), [angle.cos(), angle.sin()], number / 4)
    };
    Model {
        machine: small.machine,
        shaft: small.shaft,
        internal_damping_s: 0.0,
        planes: small.planes.iter().copied().collect(),
        supports: small.supports,
        knots: Vec::new(),
        forcings: Vec::new(),
        probes: (0..8).map(probe).collect(),
        masked: 0,
        initial_unbalance_g_mm: small.initial_unbalance_g_mm.iter().copied().collect(),
        unbalance_floor_g_mm: 100.0,
        noise: Noise { relative: 0.0, floor_um: 0.1 },
        speed_range_rpm: small.speed_range_rpm,
    }
}

#[test]
fn lost_probes_are_left_out_until_planes_are_undetermined() {
    let model = roomy();
    assert_eq!(model.check(), Ok(()));
    let truth = [[3300.0, 3900.0], [-1100.0, 1900.0]];
    let whole = shown(&model, &truth);
    for (mask, redundancy) in [(0b1, 10), (0b111, 6), (0b0111_1110, 0)] {
        let mut reading = whole;
        reading.lose(mask);
        let estimate = follow(&model, &reading).unwrap();
        assert!(differs_by(&estimate.unbalance_g_mm, &truth) < 1.0, "{:?}", estimate.unbalance_g_mm);
        assert_eq!((estimate.redundancy, estimate.residual.features), (redundancy, redundancy + 4));
        assert!(estimate.calculated[..8].iter().all(|vector| vector.is_finite()));
    }
    let mut reading = whole;
    reading.lose(0b0111_1111);
    assert_eq!(follow(&model, &reading), Err(TrackError::Undetermined));
    reading.lose(0xff);
    assert_eq!(follow(&model, &reading), Err(TrackError::Incomplete));
}

#[test]
fn planes_with_deviation_above_bound_are_undetermined() {
    let mut model = rigid_rotor();
    let reading = shown(&model, &[[3000.0, 4000.0], [-1000.0, 2000.0]]);
    let deviation = follow(&model, &reading).unwrap().deviation_g_mm;
    assert!(deviation[..2].iter().all(|x| *x > 0.0) && deviation[2].is_nan());
    // The smaller bound is 1.2·2236 g·mm.
    model.noise.floor_um = 0.1 * 0.99 * GROWTH * 2236.0 / deviation[1];
    assert!(follow(&model, &reading).is_ok());
    model.noise.floor_um *= 1.02;
    assert_eq!(follow(&model, &reading), Err(TrackError::Undetermined));
    model.noise = Noise::default();
    assert!(follow(&model, &reading).unwrap().deviation_g_mm.iter().all(|x| x.is_nan()));
}

#[test]
fn estimates_of_noisy_readings_scatter_as_the_deviation_says() {
    let model = rigid_rotor();
    let whole = shown(&model, &model.initial_unbalance_g_mm);
    let mut random = Random::new(51);
    // A sum of twelve uniform numbers: near enough to normal, variance 12·(2²/12) = 4.
    let mut normal = || 0.5 * (0..12).map(|_| random.signed()).sum::<f32>();
    let (mut square, mut deviation) = ([0.0; 2], [0.0; 4]);
    const READINGS: usize = 2000;
    for _ in 0..READINGS {
        let noisy = whole.probes().iter().map(|p| ProbeVector {
            cos_um: p.cos_um + model.noise.floor_um * normal(),
            sin_um: p.sin_um + model.noise.floor_um * normal(),
        });
        let reading = Reading::new(SPEED_RPM, &noisy.collect::<std::vec::Vec<_>>()).unwrap();
        let estimate = follow(&model, &reading).unwrap();
        for plane in 0..2 {
            let [a, b] = [estimate.unbalance_g_mm[plane], model.initial_unbalance_g_mm[plane]];
            square[plane] += 0.5 * ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)) / READINGS as f32;
        }
        deviation = estimate.deviation_g_mm;
    }
    for plane in 0..2 {
        // With normal noise nothing scatters less than least squares (2,000 readings tell to 2 %), and least absolute
        // residuals by √(π/2) more, with n rows and p unknowns √(n/(n − p)) of that.
        let ratio = square[plane].sqrt() / deviation[plane];
        let most = (core::f32::consts::FRAC_PI_2 * 8.0 / 4.0).sqrt();
        assert!((0.95..most).contains(&ratio), "{ratio}");
    }
}

#[test]
fn hardening_supports_are_followed_to_their_amplitude() {
    let mut model = rigid_rotor();
    for support in &mut model.supports {
        *support = Support { hardening_per_um2: 2e-6, ..support.clone() };
    }
    let truth = [[3100.0, 4100.0], [-900.0, 2100.0]];
    let reading = shown(&model, &truth);
    let mut tracker = Tracker::new(&model);
    let estimate = update(&mut tracker, &model, &reading, GROWTH).unwrap();
    assert!((1..=8).contains(&estimate.rounds), "{}", estimate.rounds);
    assert!(differs_by(&estimate.unbalance_g_mm, &truth) < 2.0, "{:?}", estimate.unbalance_g_mm);
    assert!(estimate.residual.ratio < 5e-4);
    let again = update(&mut tracker, &model, &reading, GROWTH).unwrap();
    assert!(again.rounds <= 1, "the next reading goes on from there: {}", again.rounds);
    // Without the hardening the same reading does not fit.
    let linear = TrackConfig { amplitude_rounds: 0, ..TrackConfig::default() };
    let without = {
        let mut tracker = Tracker::new(&model);
        let bounds = grown(&tracker, GROWTH);
        tracker.update(&linear, &model, &reading, &bounds).unwrap()
    };
    assert!(differs_by(&without.unbalance_g_mm, &truth) > 50.0);
}

#[test]
fn a_reading_that_cannot_be_used_leaves_the_tracker_as_it_was() {
    let model = rigid_rotor();
    let good = shown(&model, &model.initial_unbalance_g_mm);
    let mut tracker = Tracker::new(&model);
    let before = tracker;
    let mut update = |reading: &Reading| update(&mut tracker, &model, reading, GROWTH);
    let mut lost = good;
    lost.lose(0b0111);
    assert_eq!(update(&lost), Err(TrackError::Undetermined));
    for speed_rpm in [13_000.0, f32::NAN] {
        assert_eq!(update(&Reading::new(speed_rpm, good.probes()).unwrap()), Err(TrackError::Speed));
    }
    let fewer = Reading::new(SPEED_RPM, &good.probes()[..3]).unwrap();
    assert_eq!(update(&fewer), Err(TrackError::ProbeCount));
    assert_eq!(tracker, before);
}

#[test]
fn tracker_resumes_from_its_state_or_from_phase_one() {
    let model = rigid_rotor();
    let resumed = Tracker::resume(&model, &[[1.0, 2.0], [f32::NAN, 0.0]]);
    assert_eq!(resumed.last_g_mm(), [[1.0, 2.0], [-1000.0, 2000.0]]);
    assert_eq!(Tracker::resume(&model, &[]), Tracker::new(&model));
}

#[test]
fn equal_readings_give_equal_bits_whatever_the_capacity() {
    let model = rigid_rotor();
    let reading = shown(&model, &[[2500.0, 4100.0], [-1100.0, 1800.0]]);
    let mut bytes = [0; 2048];
    model.encode(&mut bytes).unwrap();
    let roomy = Model::<2, 8, 4>::decode(&bytes).unwrap();
    for factor in [1.0, 3.0] {
        let vectors =
            reading.probes().iter().map(|p| ProbeVector { cos_um: factor * p.cos_um, sin_um: p.sin_um });
        let reading = Reading::new(SPEED_RPM, &vectors.collect::<std::vec::Vec<_>>()).unwrap();
        let (small, large) = (follow(&model, &reading).unwrap(), follow(&roomy, &reading).unwrap());
        assert_eq!(std::format!("{small:?}"), std::format!("{large:?}"));
    }
}
