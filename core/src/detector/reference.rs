//! What the machine was when it was last trusted: the unbalance of each plane, and the vectors at a few speeds.
//!
//! ```text
//! changed      |u − anchor| > (growth − 1)·|anchor| + doubt       of any plane
//! doubt        7.52·√(deviation² + that of the anchor²), at least the floor of the unbalance
//! ```
//!
//! The anchor is a vector, so growth, decline and turning are bounded alike. It follows trusted estimates alone, with
//! `growth_s` as time constant: a step of `growth − 1` passes at once, and a walk as fast. A growth time after the last
//! trusted estimate the anchor is that estimate, however long ago it was.
//!
//! Each speed has anchors of its own, since what a model gets wrong at a speed is found as unbalance there; all of them
//! move together with what is found at one. At a speed that is not known, the surest anchor counts, and the features are
//! taken to be as wrong as the residual says.

use nalgebra::Complex;

use super::average::is_same_speed;
use super::change::{Change, reason_of, size_of};
use super::evidence::Observation;
use super::growth::{DOUBT, STEP};
use super::noise::square;
use super::seconds_since;
use crate::model::{MAX_PLANES, Pair};
use crate::reading::{MAX_PROBES, ProbeVector, Reading};
use crate::scalar;
use crate::state::Reason;
use crate::thresholds::Thresholds;

/// Speeds whose vectors are kept.
const SPEEDS: usize = 4;
/// Readings are averaged until the next one has less weight than this.
const LEAST_WEIGHT: f32 = 1.0 / 16.0;
/// Square of the ratio of two speeds' anchors up to which one follows the other in proportion.
const LARGEST_FACTOR: f32 = 4.0;

/// Anchors and vectors of trusted readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reference {
    speeds: [TrustedSpeed; SPEEDS],
    pulls: [Pull; MAX_PLANES],
    /// The speed last trusted.
    last: u8,
    visits: u32,
    moved_us: Option<u64>,
}

/// What was trusted at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TrustedSpeed {
    /// Zero after a restart: then it is like no speed.
    speed_rpm: f32,
    /// Bit i: probe i has a vector.
    valid: u8,
    /// Number of the last visit, zero for a place without a speed.
    visit: u32,
    readings: u8,
    /// Variance of the vectors' noise relative to that of one reading.
    variance: f32,
    vectors: [ProbeVector; MAX_PROBES],
    anchors: [Anchor; MAX_PLANES],
}

/// Unbalance of a plane, and the variance of either part, (g·mm)².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Anchor {
    g_mm: Pair,
    variance: f32,
}

/// Where the last trusted estimate draws the anchors of a plane: all by the same factor, as what a model gets wrong is in
/// proportion to the unbalance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Pull {
    /// From the anchor at the speed last trusted.
    way_g_mm: Pair,
    /// How much the estimate says: one if it is sure, zero if it says nothing.
    gain: f32,
    variance: f32,
}

impl Default for Reference {
    fn default() -> Self {
        Self {
            speeds: [TrustedSpeed::NONE; SPEEDS],
            pulls: [Pull::default(); MAX_PLANES],
            last: 0,
            visits: 0,
            moved_us: None,
        }
    }
}

impl Reference {
    /// Goes on after a loss of power from the unbalance last trusted and from what it was at most
    /// ([`Growth::most_g_mm`](super::Growth::most_g_mm)). Where that is anything, the next trusted reading is the first.
    pub fn resume(trusted_g_mm: &[Pair], most_g_mm: &[f32]) -> Self {
        let mut reference = Self::default();
        let mut speed = TrustedSpeed { visit: 1, ..TrustedSpeed::NONE };
        for (place, (anchor, &g_mm)) in speed.anchors.iter_mut().zip(trusted_g_mm).enumerate() {
            let last = scalar::length(g_mm);
            let deviation = scalar::greater(0.0, most_g_mm.get(place).unwrap_or(&last) - last) / DOUBT;
            if !(last.is_finite() && square(deviation).is_finite()) {
                return reference;
            }
            *anchor = Anchor { g_mm, variance: square(deviation) };
        }
        if let [first, ..] = &mut reference.speeds
            && !trusted_g_mm.is_empty()
        {
            (*first, reference.visits) = (speed, 1);
        }
        reference
    }

    /// Draws the anchors towards the last trusted estimate; gives the part of the growth time by which they moved.
    pub fn advance(&mut self, thresholds: &Thresholds, time_us: u64) -> f32 {
        let Some(moved_us) = self.moved_us else {
            self.moved_us = Some(time_us);
            return 0.0;
        };
        let part = scalar::lesser(1.0, seconds_since(moved_us, time_us) / thresholds.growth_s);
        if part < STEP {
            return 0.0;
        }
        self.moved_us = Some(time_us);
        let Some(&TrustedSpeed { anchors: from, .. }) = self.speeds.get(usize::from(self.last)) else {
            return 0.0;
        };
        for (place, speed) in (0..).zip(&mut self.speeds) {
            for ((anchor, pull), from) in speed.anchors.iter_mut().zip(&self.pulls).zip(from) {
                anchor.g_mm = pull.moved(anchor.g_mm, from.g_mm, part);
                let weight = part * pull.gain;
                // At another speed the error of the estimate comes on top.
                anchor.variance = if place == self.last {
                    mean_variance(anchor.variance, weight, pull.variance)
                } else {
                    anchor.variance + weight * weight * pull.variance
                };
            }
        }
        for pull in &mut self.pulls {
            *pull = pull.after(part);
        }
        part
    }

    /// Some plane's unbalance changed more than it may. Without a trusted reading nothing did.
    pub fn is_changed(&self, thresholds: &Thresholds, observed: &Observation) -> bool {
        let known = self.at_speed(observed.averaged.reading.speed_rpm);
        let deviations = if known.is_some() { &observed.deviation_g_mm } else { &observed.misfit_g_mm };
        let planes = observed.unbalance_g_mm.iter().zip(deviations).take(usize::from(observed.planes));
        (0..).zip(planes).any(|(plane, (&[x, y], &deviation))| {
            let anchor = match known {
                Some(speed) => speed.anchors.get(plane).copied(),
                None => self.surest(plane),
            };
            anchor.is_some_and(|anchor| {
                let [a, b] = anchor.g_mm;
                let allowed = (thresholds.growth - 1.0) * scalar::length(anchor.g_mm)
                    + anchor.doubt_g_mm(deviation, observed.floor_g_mm);
                scalar::length([x - a, y - b]) > allowed
            })
        })
    }

    /// Takes a trusted reading. `part`: what [`Reference::advance`] gave for it; `counts`: it is not within the averaging
    /// time of the last one that counted.
    pub fn trust(&mut self, thresholds: &Thresholds, observed: &Observation, part: f32, counts: bool) {
        let known = self.place_of(observed.averaged.reading.speed_rpm);
        let place = known.unwrap_or_else(|| self.least_needed(thresholds.learning_readings));
        let is_visit = known.is_none() || place != self.last;
        if is_visit {
            self.visits = self.visits.saturating_add(1);
        }
        let Some(speed) = self.speeds.get_mut(usize::from(place)) else { return };
        if known.is_none() {
            *speed = TrustedSpeed::new(observed);
        } else {
            speed.follow(observed, part, counts && part < LEAST_WEIGHT);
            if is_visit {
                // The vectors of a visit long ago say nothing of the change since.
                speed.follow_vectors(&observed.averaged.reading, 1.0);
                speed.variance = observed.averaged.variance;
            }
        }
        speed.visit = self.visits;
        speed.readings = speed.readings.saturating_add(u8::from(counts));
        self.last = place;
        let estimates = observed.unbalance_g_mm.iter().zip(&observed.deviation_g_mm);
        for ((pull, anchor), (&[x, y], &deviation)) in
            self.pulls.iter_mut().zip(&speed.anchors).zip(estimates)
        {
            let variance = square(deviation);
            let allowed =
                scalar::greater(observed.floor_g_mm, (thresholds.growth - 1.0) * scalar::length(anchor.g_mm));
            let gain = if variance > 0.0 { square(allowed) / (square(allowed) + variance) } else { 1.0 };
            let [a, b] = anchor.g_mm;
            *pull = Pull { way_g_mm: [gain * (x - a), gain * (y - b)], gain, variance };
        }
    }

    /// Which cause alone explains the change since the readings trusted at this speed, with the mask of the probes that
    /// changed if those of one place alone did. `fits`: the model explains the reading, if nothing bounds the unbalance.
    ///
    /// A changed unbalance explains a common factor as well where one plane alone changed, as with a model of one plane, and
    /// a probe or a bearing where the model fits: then it is none of these.
    pub fn cause(
        &self,
        observed: &Observation,
        bearings: &[u8; MAX_PROBES],
        fits: bool,
    ) -> Option<(Reason, u8)> {
        let trusted = self.at_speed(observed.averaged.reading.speed_rpm)?;
        let before = (trusted.valid, &trusted.vectors, trusted.variance);
        let change = Change::new(before, observed, bearings);
        let factor = change.common_factor().filter(|(factor, _)| {
            let way = size_of(factor - 1.0);
            let moved = trusted.anchors.iter().zip(&observed.deviation_g_mm).filter(|(anchor, deviation)| {
                way * scalar::length(anchor.g_mm) > anchor.doubt_g_mm(**deviation, observed.floor_g_mm)
            });
            !fits || moved.count() > 1
        });
        let local = if fits { None } else { change.local() };
        // Of several probes at one bearing the suspect tells.
        let alone = |mask: u8| mask.is_power_of_two().then_some((Reason::Probe, mask));
        match (factor, local) {
            (Some((_, left_um)), Some((mask, local_left_um))) if local_left_um < left_um => alone(mask),
            (Some((factor, _)), _) => Some((reason_of(factor), 0)),
            (None, Some((mask, _))) => alone(mask),
            (None, None) => None,
        }
    }

    fn place_of(&self, speed_rpm: f32) -> Option<u8> {
        let mut nearest: Option<(u8, f32)> = None;
        for (place, speed) in (0..).zip(&self.speeds) {
            let distance_rpm = (speed.speed_rpm - speed_rpm).abs();
            if speed.visit > 0
                && is_same_speed(speed.speed_rpm, speed_rpm)
                && nearest.is_none_or(|(_, least_rpm)| distance_rpm < least_rpm)
            {
                nearest = Some((place, distance_rpm));
            }
        }
        nearest.map(|(place, _)| place)
    }

    fn at_speed(&self, speed_rpm: f32) -> Option<&TrustedSpeed> {
        self.speeds.get(usize::from(self.place_of(speed_rpm)?))
    }

    /// The anchor of a plane with the least variance.
    fn surest(&self, plane: usize) -> Option<Anchor> {
        let mut surest: Option<Anchor> = None;
        for anchor in self.speeds.iter().filter(|speed| speed.visit > 0).filter_map(|s| s.anchors.get(plane))
        {
            if surest.is_none_or(|surest| anchor.variance < surest.variance) {
                surest = Some(*anchor);
            }
        }
        surest
    }

    /// The place for a new speed: one without, which was never visited; else of those that the machine only passed through,
    /// else of all, the one visited longest ago.
    fn least_needed(&self, settled_readings: u8) -> u8 {
        let need = |speed: &TrustedSpeed| (speed.readings >= settled_readings, speed.visit);
        let least = (0..).zip(&self.speeds).min_by_key(|(_, speed)| need(speed));
        least.map_or(0, |(place, _)| place)
    }
}

impl TrustedSpeed {
    const NONE: Self = Self {
        speed_rpm: 0.0,
        valid: 0,
        visit: 0,
        readings: 0,
        variance: 0.0,
        vectors: [ProbeVector { cos_um: 0.0, sin_um: 0.0 }; MAX_PROBES],
        anchors: [Anchor { g_mm: [0.0; 2], variance: 0.0 }; MAX_PLANES],
    };

    fn new(observed: &Observation) -> Self {
        let reading = &observed.averaged.reading;
        let mut speed =
            Self { speed_rpm: reading.speed_rpm, variance: observed.averaged.variance, ..Self::NONE };
        speed.follow_vectors(reading, 1.0);
        let estimates = observed.unbalance_g_mm.iter().zip(&observed.deviation_g_mm);
        for (anchor, (&g_mm, &deviation)) in speed.anchors.iter_mut().zip(estimates) {
            *anchor = Anchor { g_mm, variance: square(deviation) };
        }
        speed
    }

    /// A probe that was lost until now begins with what it is.
    fn follow_vectors(&mut self, reading: &Reading, weight: f32) {
        let measured = reading.valid_mask();
        for (place, (own, &new)) in self.vectors.iter_mut().zip(reading.probes()).enumerate() {
            let weight = if self.valid >> place & 1 == 1 { weight } else { 1.0 };
            if measured >> place & 1 == 1 {
                let way = [new.cos_um - own.cos_um, new.sin_um - own.sin_um];
                let [cos_um, sin_um] = towards([own.cos_um, own.sin_um], weight, way);
                *own = ProbeVector { cos_um, sin_um };
            }
        }
        self.valid |= measured;
    }

    /// The vectors follow by `part`, the anchors as all anchors do. `averages`: both are the mean of the first readings, as
    /// far as noise goes.
    fn follow(&mut self, observed: &Observation, part: f32, averages: bool) {
        let share = |own: f32, new: f32| {
            let weight = own / (own + new);
            if averages && weight >= LEAST_WEIGHT { weight } else { 0.0 }
        };
        let weight = scalar::greater(part, share(self.variance, observed.averaged.variance));
        self.variance = mean_variance(self.variance, weight, observed.averaged.variance);
        self.follow_vectors(&observed.averaged.reading, weight);
        let estimates = observed.unbalance_g_mm.iter().zip(&observed.deviation_g_mm);
        for (anchor, (&[x, y], &deviation)) in self.anchors.iter_mut().zip(estimates) {
            let variance = square(deviation);
            let weight = share(anchor.variance, variance);
            let [a, b] = anchor.g_mm;
            anchor.g_mm = towards([a, b], weight, [x - a, y - b]);
            anchor.variance = mean_variance(anchor.variance, weight, variance);
        }
    }
}

impl Pull {
    /// An anchor after a part of the way; `from_g_mm`: the one at the speed last trusted.
    fn moved(&self, anchor_g_mm: Pair, from_g_mm: Pair, part: f32) -> Pair {
        let complex = |[x, y]: Pair| Complex::new(x, y);
        let way = complex(anchor_g_mm) * complex(self.way_g_mm) / complex(from_g_mm);
        let in_proportion = way.norm_sqr() <= LARGEST_FACTOR * complex(self.way_g_mm).norm_sqr();
        // Of an anchor at nothing there are no factors.
        towards(anchor_g_mm, part, if in_proportion { [way.re, way.im] } else { self.way_g_mm })
    }

    /// What is left of it.
    fn after(&self, part: f32) -> Self {
        let [x, y] = self.way_g_mm;
        Self {
            way_g_mm: [(1.0 - part) * x, (1.0 - part) * y],
            gain: (1.0 - part) * self.gain,
            variance: self.variance,
        }
    }
}

impl Anchor {
    /// What an estimate of this deviation may differ from the anchor by noise.
    fn doubt_g_mm(&self, deviation_g_mm: f32, floor_g_mm: f32) -> f32 {
        scalar::greater(floor_g_mm, DOUBT * scalar::sqrt(square(deviation_g_mm) + self.variance))
    }
}

fn towards([x, y]: Pair, weight: f32, [along_x, along_y]: Pair) -> Pair {
    [x + weight * along_x, y + weight * along_y]
}

/// Variance of a mean in which a value of another variance has this weight.
fn mean_variance(own: f32, weight: f32, new: f32) -> f32 {
    (1.0 - weight) * (1.0 - weight) * own + weight * weight * new
}
