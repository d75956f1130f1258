//! Mountings: the readings between two changes of weights, repeats averaged.
//!
//! Everything is in µm and g·mm. A row is one probe at one speed; rows of a speed stand together.

use nalgebra::{Complex, DVector};

use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::machine::weights::by_plane;
use crate::measurement::Reading;
use crate::unbalance::G_MM;

type C = Complex<f64>;

/// Neighbouring speeds further apart than this, relative, are two speeds of measurement.
const SAME_SPEED: f64 = 0.005;
/// Most rows: the unknowns grow with them, and neighbouring speeds of a run-up tell little more than one.
const MOST_ROWS: usize = 24;

/// The readings of one run, averaged at each speed.
#[derive(Debug, Clone)]
pub struct Mounting {
    pub run: String,
    /// Stated weight in each plane, g·mm; `None` for a blind run.
    pub stated: Option<Vec<C>>,
    /// Session that its readings state.
    pub session: Option<String>,
    /// First and last time of its readings, days, where all have one.
    pub times_d: Option<[f64; 2]>,
    /// Mean phasor of each row, µm; `None` where nothing was read.
    pub phasors: Vec<Option<C>>,
    /// Mean speed of each row's readings, rad/s.
    pub speeds_rad_s: Vec<f64>,
    /// Readings behind each mean.
    pub repeats: Vec<usize>,
}

/// All runs of a measurement.
#[derive(Debug, Clone)]
pub struct Mountings {
    /// In the order of the file.
    pub runs: Vec<Mounting>,
    /// Number of the base run.
    pub base: usize,
    /// Common speeds, rad/s, ascending.
    pub speeds_rad_s: Vec<f64>,
    pub probes: usize,
    /// Variance of a component of one reading about the mean of its mounting, µm², by row.
    pub repeat_variance: DVector<f64>,
    pub remarks: Vec<String>,
}

impl Mountings {
    /// Sorts readings into runs and common speeds.
    ///
    /// # Errors
    /// One sentence if there is no base run, weights are not in the planes, or too few runs have any.
    pub fn of(rotor: &Rotor, readings: &[Reading], base: Option<&str>) -> Result<Self, Error> {
        if rotor.plane.is_empty() || rotor.probe.is_empty() {
            let what = "the rotor's file has no [[plane]] or no [[probe]], expected both";
            return Err(Error::Unsuitable(what.into()));
        }
        let mut names: Vec<&str> = Vec::new();
        for (i, r) in readings.iter().enumerate() {
            let Some(run) = r.run.as_deref().filter(|run| !run.is_empty()) else {
                return Err(Error::ReadingWithoutRun { reading: i + 1 });
            };
            if !names.contains(&run) {
                names.push(run);
            }
        }
        let mut stated: Vec<Option<Vec<C>>> =
            names.iter().map(|name| weights(rotor, name)).collect::<Result<_, _>>()?;
        let base = base_run(&names, &stated, base)?;
        stated[base] = Some(vec![C::from(0.0); rotor.plane.len()]);
        let weighted = |w: &Option<Vec<C>>| w.as_ref().is_some_and(|w| w.iter().any(|u| u.norm() > 0.0));
        if !stated.iter().any(weighted) {
            return Err(Error::NoWeightedRun);
        }
        let (groups, mut remarks) = speeds(&names, readings, names[base]);
        if groups.is_empty() {
            return Err(Error::NoCommonSpeed { base: names[base].into() });
        }
        let groups = thinned(groups, rotor.probe.len(), &mut remarks);
        let (mut runs, repeat_variance) = averaged(rotor, &names, stated, readings, &groups);
        for m in &mut runs {
            (m.session, m.times_d) = occasion(&m.run, readings)?;
        }
        let whole = Self {
            base,
            speeds_rad_s: groups.iter().map(|g| 0.5 * (g[0] + g[1])).collect(),
            probes: rotor.probe.len(),
            repeat_variance,
            runs,
            remarks,
        };
        whole.without_empty()
    }

    pub fn rows(&self) -> usize {
        self.speeds_rad_s.len() * self.probes
    }

    /// Root mean square of each row over all runs, µm.
    pub fn levels_um(&self) -> Vec<f64> {
        let level = |row: usize| {
            let seen: Vec<f64> =
                self.runs.iter().filter_map(|m| m.phasors[row]).map(|y| y.norm_sqr()).collect();
            (seen.iter().sum::<f64>() / seen.len().max(1) as f64).sqrt()
        };
        (0..self.rows()).map(level).collect()
    }

    /// The same at common speeds: readings a little beside them are moved along the slopes
    /// `d ln Y / d ln Ω` of each row.
    pub fn at_common_speeds(&self, slopes: &[C]) -> Self {
        let mut moved = self.clone();
        for m in &mut moved.runs {
            for (row, y) in m.phasors.iter_mut().enumerate() {
                let by = (self.speeds_rad_s[row / self.probes] / m.speeds_rad_s[row]).ln();
                *y = y.map(|y| y * (slopes[row] * by).exp());
            }
        }
        moved
    }

    /// Leaves out runs without a reading at the common speeds.
    fn without_empty(mut self) -> Result<Self, Error> {
        let base = self.runs[self.base].run.clone();
        let (kept, empty): (Vec<_>, Vec<_>) =
            self.runs.into_iter().partition(|m| m.phasors.iter().any(Option::is_some));
        for m in empty {
            self.remarks
                .push(format!("Run {} is left out: none of its speeds was measured in the base run.", m.run));
        }
        self.base = kept.iter().position(|m| m.run == base).unwrap_or(0);
        self.runs = kept;
        Ok(self)
    }
}

/// Weights that the file states for a run, by plane, g·mm; `None` if it has no such run.
fn weights(rotor: &Rotor, name: &str) -> Result<Option<Vec<C>>, Error> {
    let Some(run) = rotor.run.iter().find(|r| r.name == name) else { return Ok(None) };
    let outside = |position_m| Error::WeightOutsidePlanes { run: name.into(), position_m };
    let kg_m = by_plane(rotor, run).map_err(outside)?;
    Ok(Some(kg_m.into_iter().map(|u| u * G_MM).collect()))
}

/// Session of a run, and its first and last time.
fn occasion(run: &str, readings: &[Reading]) -> Result<(Option<String>, Option<[f64; 2]>), Error> {
    let own = || readings.iter().filter(|r| r.run.as_deref() == Some(run));
    let mut stated = own().filter_map(|r| r.session.as_ref());
    let session = stated.next();
    if let Some((first, other)) = session.zip(stated.find(|other| Some(*other) != session)) {
        return Err(Error::RunInTwoSessions { run: run.into(), sessions: [first, other].map(String::clone) });
    }
    let times: Option<Vec<f64>> = own().map(|r| r.time_d).collect();
    let ends = times.map(|t| {
        [t.iter().copied().fold(f64::INFINITY, f64::min), t.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    });
    Ok((session.cloned(), ends))
}

fn base_run(names: &[&str], stated: &[Option<Vec<C>>], wanted: Option<&str>) -> Result<usize, Error> {
    let bare = |w: &Option<Vec<C>>| w.as_ref().is_some_and(|w| w.iter().all(|u| u.norm() == 0.0));
    if let Some(wanted) = wanted {
        let Some(base) = names.iter().position(|n| *n == wanted) else {
            return Err(Error::UnknownBaseRun { run: wanted.into() });
        };
        if stated[base].is_some() && !bare(&stated[base]) {
            return Err(Error::WeightedBaseRun { run: wanted.into() });
        }
        return Ok(base);
    }
    let without: Vec<usize> = (0..names.len()).filter(|i| bare(&stated[*i])).collect();
    match without[..] {
        [base] => Ok(base),
        [] => Err(Error::NoBaseRun),
        _ => Err(Error::AmbiguousBaseRun { runs: without.iter().map(|i| names[*i].to_string()).collect() }),
    }
}

/// Lowest and highest speed of each group that the base run and another share, rad/s.
fn speeds(names: &[&str], readings: &[Reading], base: &str) -> (Vec<[f64; 2]>, Vec<String>) {
    let mut all: Vec<(f64, &str)> =
        readings.iter().filter_map(|r| Some((r.speed_rad_s(), r.run.as_deref()?))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut groups, mut remarks) = (Vec::new(), Vec::new());
    for group in all.chunk_by(|a, b| b.0 <= a.0 * (1.0 + SAME_SPEED)) {
        let has = |name: &str| group.iter().any(|(_, run)| *run == name);
        let range = [group[0].0, group[group.len() - 1].0];
        if has(base) && names.iter().filter(|n| has(n)).count() > 1 {
            groups.push(range);
        } else {
            let rpm = crate::units::rpm(0.5 * (range[0] + range[1]));
            let why = if has(base) { "no other run has it" } else { "the base run has none there" };
            remarks.push(format!("{rpm:.0} rpm is left out: {why}."));
        }
    }
    (groups, remarks)
}

/// As many speeds as the unknowns allow, spread evenly.
fn thinned(groups: Vec<[f64; 2]>, probes: usize, remarks: &mut Vec<String>) -> Vec<[f64; 2]> {
    let most = (MOST_ROWS / probes).max(1);
    if groups.len() <= most {
        return groups;
    }
    remarks.push(format!("{most} of {} common speeds are used, spread over their range.", groups.len()));
    let last = groups.len() - 1;
    (0..most).map(|i| groups[if most == 1 { last } else { i * last / (most - 1) }]).collect()
}

fn averaged(
    rotor: &Rotor,
    names: &[&str],
    stated: Vec<Option<Vec<C>>>,
    readings: &[Reading],
    groups: &[[f64; 2]],
) -> (Vec<Mounting>, DVector<f64>) {
    let probes = rotor.probe.len();
    let rows = groups.len() * probes;
    let (mut squares, mut freedom) = (DVector::<f64>::zeros(rows), vec![0usize; rows]);
    let mut runs = Vec::new();
    for (name, stated) in names.iter().zip(stated) {
        let mut m = Mounting {
            run: (*name).into(),
            stated,
            session: None,
            times_d: None,
            phasors: vec![None; rows],
            speeds_rad_s: vec![1.0; rows],
            repeats: vec![0; rows],
        };
        for row in 0..rows {
            let [low, high] = groups[row / probes];
            let here = readings
                .iter()
                .filter(|r| r.run.as_deref() == Some(name) && (low..=high).contains(&r.speed_rad_s()));
            let seen: Vec<(f64, C)> =
                here.filter_map(|r| Some((r.speed_rad_s(), r.probes[row % probes]? * 1e6))).collect();
            let count = seen.len() as f64;
            m.repeats[row] = seen.len();
            m.speeds_rad_s[row] = 0.5 * (low + high);
            if !seen.is_empty() {
                let mean = seen.iter().map(|(_, y)| y).sum::<C>() / count;
                m.speeds_rad_s[row] = seen.iter().map(|(w, _)| w).sum::<f64>() / count;
                m.phasors[row] = Some(mean);
                squares[row] += seen.iter().map(|(_, y)| (y - mean).norm_sqr()).sum::<f64>();
                freedom[row] += 2 * (seen.len() - 1);
            }
        }
        runs.push(m);
    }
    (runs, DVector::from_fn(rows, |row, _| squares[row] / freedom[row].max(1) as f64))
}
