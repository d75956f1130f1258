//! Every kind of fault, with its parameters drawn at random.

use super::dice::Dice;
use super::fault::{Course, Fault, LONGEST_LOOP};
use super::machine::{Machine, MachineKind};
use super::monitor::Pace;

/// Slow faults that fit the model change the unbalance so many times faster than it may grow; slower ones are at the edge
/// of what can be told from unbalance, or beyond.
const TELLABLE: f64 = 2.0;

/// What comes before the first reading under the fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interlude {
    None,
    /// The monitor is off.
    PowerOff,
    /// The machine stands still, and runs up with the fault.
    Standstill,
    /// No readings arrive.
    Silence,
}

/// A true change of the machine that stale readings hide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueChange {
    /// Readings after the fault began, and how many the change takes.
    pub after: usize,
    pub over: usize,
    /// Size of the unbalance over that before, and its turn, degrees.
    pub factor: f64,
    pub turn_deg: f64,
}

/// A scenario with all its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    pub fault: Fault,
    pub course: Course,
    pub interlude: Interlude,
    /// How long that takes, s.
    pub pause_s: Option<f64>,
    pub change: Option<TrueChange>,
    /// The machine runs at several speeds, before and under the fault.
    pub varies_speed: bool,
    /// Readings arrive in steps of this, µm; all digits of f32 without.
    pub resolution_um: Option<f64>,
}

/// A kind of scenario. `bearings`: with probes at so many bearings at least.
pub struct Kind {
    pub name: &'static str,
    bearings: usize,
    draw: fn(&mut Dice, &Bounds) -> (Fault, Course),
    interlude: Interlude,
}

/// What a draw must know of the scene.
pub struct Bounds {
    pace: Pace,
    probes: usize,
    by_bearing: Vec<Vec<usize>>,
}

impl Bounds {
    fn probe(&self, dice: &mut Dice) -> usize {
        dice.whole(0, self.probes - 1)
    }

    /// The X and Y probes of a bearing.
    fn pair(&self, dice: &mut Dice) -> [usize; 2] {
        let bearing = &self.by_bearing[dice.whole(0, self.by_bearing.len() - 1)];
        [bearing[0], bearing[1]]
    }

    fn two_bearings(&self, dice: &mut Dice) -> [usize; 2] {
        let first = dice.whole(0, self.by_bearing.len() - 1);
        let step = dice.whole(1, self.by_bearing.len() - 1);
        [first, (first + step) % self.by_bearing.len()]
    }

    fn two_probes(&self, dice: &mut Dice) -> (usize, usize) {
        let first = self.probe(dice);
        (first, (first + dice.whole(1, self.probes - 1)) % self.probes)
    }

    /// A part of the time under the fault, in readings.
    fn slowly(&self, dice: &mut Dice) -> Course {
        Course::Slow((self.pace.faulty as f64 * dice.between(0.5, 0.9)) as usize)
    }
}

const fn kind(name: &'static str, bearings: usize, draw: fn(&mut Dice, &Bounds) -> (Fault, Course)) -> Kind {
    Kind { name, bearings, draw, interlude: Interlude::None }
}

const fn after(
    name: &'static str,
    interlude: Interlude,
    draw: fn(&mut Dice, &Bounds) -> (Fault, Course),
) -> Kind {
    Kind { name, bearings: 1, draw, interlude }
}

fn turned(dice: &mut Dice, least: f64, most: f64) -> f64 {
    dice.sign() * dice.between(least, most)
}

fn bursts(dice: &mut Dice) -> Course {
    Course::Bursts(dice.whole(2, 6))
}

use Course::{AllButOneOf, OneOf, Permanent, Sometimes};
use Fault::*;

#[rustfmt::skip]
pub const KINDS: &[Kind] = &[
    kind("phase reference jumps", 1, |d, _| (Angle(turned(d, 5.0, 180.0)), Permanent)),
    kind("phase reference jumps far", 1, |d, _| (Angle(turned(d, 40.0, 180.0)), Permanent)),
    kind("phase reference lost", 1, |_, _| (RandomAngle(180.0), Permanent)),
    kind("phase reference slips", 1, |d, _| (RandomAngle(d.between(60.0, 120.0)), Permanent)),
    kind("phase reference diffuses", 1, |d, _| (AngleDiffuses(d.between(10.0, 40.0)), Permanent)),
    kind("phase reference walks", 1, |d, b| (Angle(720.0 * d.sign()), b.slowly(d))),
    kind("two marks", 1, |_, _| (TwoMarks(90.0), Permanent)),
    kind("two marks now and then", 1, |_, _| (TwoMarks(180.0), Sometimes(0.5))),
    kind("phase reference jumps in bursts", 1, |d, _| (Angle(turned(d, 60.0, 180.0)), bursts(d))),
    kind("phase reference jumps at times", 1, |d, _| (Angle(turned(d, 60.0, 180.0)), OneOf(3))),
    kind("phase reference lost at times", 1, |d, _| (RandomAngle(180.0), Sometimes(d.between(0.2, 0.5)))),
    kind("phases counted backwards", 1, |_, _| (AnglesReversed, Permanent)),
    kind("gains collapse", 1, |d, _| (Scale(d.factor(0.1, 0.5)), Permanent)),
    kind("gains rise", 1, |d, _| (Scale(d.between(1.6, 3.0)), Permanent)),
    kind("gains collapse in bursts", 1, |d, _| (Scale(d.factor(0.1, 0.5)), bursts(d))),
    kind("gains collapse at times", 1, |d, _| (Scale(d.factor(0.1, 0.5)), OneOf(3))),
    kind("gains fall slowly", 1, |d, b| (Scale(d.factor(0.1, 0.4)), b.slowly(d))),
    kind("gains at random", 1, |_, _| (RandomScale, Permanent)),
    kind("wrong unit", 1, |d, _| (Scale(d.pick(&[1.0 / 25.4, 25.4, 1e-3, 1e3, 0.5, 2.0])), Permanent)),
    kind("all zero", 1, |_, _| (Zeros, Permanent)),
    kind("all zero at times", 1, |_, _| (Zeros, OneOf(3))),
    kind("signal lost", 1, |_, _| (OnlyNoise, Permanent)),
    kind("frozen", 1, |_, _| (Frozen, Permanent)),
    kind("frozen vectors", 1, |_, _| (FrozenVectors, Permanent)),
    kind("loop", 1, |d, _| (Loop(d.whole(3, LONGEST_LOOP)), Permanent)),
    kind("noise × 5", 1, |d, _| (Noise(d.between(4.0, 8.0)), Permanent)),
    kind("noise of 100 %", 1, |d, _| (NoisePart(d.between(0.7, 1.5)), Permanent)),
    kind("noise of 100 % at times", 1, |d, _| (NoisePart(d.between(0.7, 1.5)), Sometimes(0.4))),
    kind("speed wrong", 1, |d, _| (SpeedFactor(d.pick(&[0.5, 0.75, 0.8, 1.25, 2.0, 1.0 / 60.0])), Permanent)),
    kind("speed wrong at times", 1, |d, _| (SpeedFactor(d.pick(&[0.5, 0.75, 1.25, 2.0])), OneOf(3))),
    kind("bearings exchanged", 2, |d, b| (BearingsExchanged(b.two_bearings(d)), Permanent)),
    kind("probe reversed", 1, |d, b| (ProbeReversed(b.probe(d)), Permanent)),
    kind("probe reversed, two of three", 1, |d, b| (ProbeReversed(b.probe(d)), AllButOneOf(3))),
    kind("probe reversed, one of three", 1, |d, b| (ProbeReversed(b.probe(d)), OneOf(3))),
    kind("probe's gain falls", 1, |d, b| (ProbeGain(b.probe(d), d.between(0.2, 0.6)), Permanent)),
    kind("probe's gain rises", 1, |d, b| (ProbeGain(b.probe(d), d.between(1.8, 4.0)), Permanent)),
    kind("probe's gain drifts down", 1, |d, b| (ProbeGain(b.probe(d), d.factor(0.1, 0.4)), b.slowly(d))),
    kind("probe's gain drifts up", 1, |d, b| (ProbeGain(b.probe(d), d.between(2.0, 4.0)), b.slowly(d))),
    kind("probe zero", 1, |d, b| (ProbeZero(b.probe(d)), Permanent)),
    kind("probe without signal", 1, |d, b| (ProbeOnlyNoise(b.probe(d)), Permanent)),
    kind("probe without signal in bursts", 1, |d, b| (ProbeOnlyNoise(b.probe(d)), bursts(d))),
    kind("probe lost", 1, |d, b| (ProbeLost(b.probe(d)), Permanent)),
    kind("probe clipped", 1, |d, b| (ProbeClipped(b.probe(d), d.between(0.1, 0.5)), Permanent)),
    kind("probe offset", 1, |d, b| (ProbeOffset(b.probe(d), d.between(0.5, 2.0), d.between(0.0, 360.0)), Permanent)),
    kind("probe's offset grows", 1, |d, b| (ProbeOffset(b.probe(d), d.between(1.0, 2.0), d.between(0.0, 360.0)), b.slowly(d))),
    kind("probe at random angles", 1, |d, b| (ProbeRandomAngle(b.probe(d)), Permanent)),
    kind("probe turned", 1, |d, b| (ProbeAngle(b.probe(d), turned(d, 60.0, 180.0)), Permanent)),
    kind("probe noise of 100 %", 1, |d, b| (ProbeNoisePart(b.probe(d), d.between(0.7, 1.5)), Permanent)),
    kind("probe frozen", 1, |d, b| (ProbeFrozen(b.probe(d)), Permanent)),
    kind("X and Y exchanged", 1, |d, b| { let [x, y] = b.pair(d); (ProbesExchanged(x, y), Permanent) }),
    kind("X and Y exchanged in bursts", 1, |d, b| { let [x, y] = b.pair(d); (ProbesExchanged(x, y), bursts(d)) }),
    kind("probes exchanged", 1, |d, b| { let (x, y) = b.two_probes(d); (ProbesExchanged(x, y), Permanent) }),
    kind("probe wired twice", 1, |d, b| { let (from, to) = b.two_probes(d); (ProbeCopied { from, to }, Permanent) }),
    kind("gains of a bearing collapse", 2, |d, b| (PairScale(b.pair(d), d.factor(0.1, 0.5)), Permanent)),
    kind("gains of a bearing fall slowly", 2, |d, b| (PairScale(b.pair(d), d.factor(0.1, 0.4)), b.slowly(d))),
    kind("a bearing's probes turned", 2, |d, b| (PairAngle(b.pair(d), turned(d, 60.0, 180.0)), Permanent)),
    kind("a bearing's probes turned at times", 2, |d, b| (PairAngle(b.pair(d), turned(d, 60.0, 180.0)), Sometimes(0.3))),
    after("phase jumps while power is off", Interlude::PowerOff, |d, _| (Angle(turned(d, 40.0, 180.0)), Permanent)),
    after("gains collapse while power is off", Interlude::PowerOff, |d, _| (Scale(d.factor(0.1, 0.5)), Permanent)),
    after("probe reversed while power is off", Interlude::PowerOff, |d, b| (ProbeReversed(b.probe(d)), Permanent)),
    after("phase jumps at a standstill", Interlude::Standstill, |d, _| (Angle(turned(d, 40.0, 180.0)), Permanent)),
    after("gains rise at a standstill", Interlude::Standstill, |d, _| (Scale(d.between(1.8, 3.0)), Permanent)),
    after("phase jumps in a silence", Interlude::Silence, |d, _| (Angle(turned(d, 40.0, 180.0)), Permanent)),
];

impl Kind {
    /// A machine that this fault can happen to.
    pub fn machine(&self, dice: &mut Dice) -> MachineKind {
        let fitting: Vec<MachineKind> =
            MachineKind::ALL.into_iter().filter(|m| *m != MachineKind::Fan || self.bearings < 2).collect();
        dice.pick(&fitting)
    }

    pub fn draw(&self, dice: &mut Dice, machine: &Machine, pace: Pace) -> Plan {
        let bounds = Bounds { pace, probes: machine.probes(), by_bearing: machine.probes_by_bearing() };
        let (fault, course) = (self.draw)(dice, &bounds);
        let change = fault.is_stale().then(|| TrueChange {
            after: dice.whole(0, pace.faulty / 3),
            over: dice.whole(1, 10),
            factor: dice.between(1.6, 2.5),
            turn_deg: dice.between(-60.0, 60.0),
        });
        Plan {
            fault,
            course: told_from_unbalance(fault, course, pace),
            interlude: self.interlude,
            pause_s: (self.interlude != Interlude::None)
                .then(|| pause_s(fault, pace, dice.between(0.5, 6.0))),
            change,
            varies_speed: dice.happens(0.3),
            resolution_um: dice.happens(0.5).then(|| dice.pick(&[0.001, 0.01])),
        }
    }
}

/// Faults that fit the model and grow no faster than unbalance may cannot be told from it: they are made as fast as
/// [`TELLABLE`] asks for.
fn told_from_unbalance(fault: Fault, course: Course, pace: Pace) -> Course {
    let Course::Slow(readings) = course else { return course };
    match readings.min((longest_s(fault, pace) / pace.period_s) as usize) {
        0 | 1 => Permanent,
        readings => Course::Slow(readings),
    }
}

/// A pause of so many age limits, but not so long that the unbalance may have grown as much meanwhile; one period at least.
fn pause_s(fault: Fault, pace: Pace, age_limits: f64) -> f64 {
    (age_limits * pace.age_limit_s()).min(longest_s(fault, pace)).max(pace.period_s)
}

/// The longest time in which a fault can be told from growing unbalance; infinite for those that do not fit the model.
fn longest_s(fault: Fault, pace: Pace) -> f64 {
    let thresholds = pace.thresholds();
    let allowed_a_second = f64::from((thresholds.growth - 1.0) / thresholds.growth_s);
    fault.change().map_or(f64::INFINITY, |change| change / (TELLABLE * allowed_a_second))
}

#[test]
fn slow_faults_outrun_the_allowed_growth_at_every_pace() {
    for pace in Pace::ALL {
        for (fault, change) in [(Scale(0.2), 0.8), (Angle(720.0), 12.566)] {
            let drawn = told_from_unbalance(fault, Course::Slow(pace.faulty), pace);
            let Course::Slow(readings) = drawn else { continue };
            let days = readings as f64 * pace.period_s / 86_400.0;
            assert!(change / days >= 0.4 - 1e-3, "{fault} in {days} days");
        }
        // a probe's own drift does not fit: it may take its time
        assert_eq!(told_from_unbalance(ProbeGain(0, 0.2), Course::Slow(44), pace), Course::Slow(44));
    }
}
