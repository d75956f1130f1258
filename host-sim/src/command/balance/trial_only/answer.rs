//! What `balance --trial-only` answers, in words and tables.

use rotor_edge_desktop::balance::alone::{Basis, Correction, PlaneWeight, ProbeVibration};
use rotor_edge_desktop::balance::optimum::Criterion;
use rotor_edge_desktop::balance::places::WeightPiece;

use crate::answers::balance::{AngleSense, StaticCouple, TrialBalance, VectorAnswer};
use crate::command::output;

/// The answer, and how it is told.
pub struct TrialBalanceResult {
    pub correction: Correction,
    pub criterion: Criterion,
    /// Run that the weights are added to.
    pub onto: Option<String>,
    pub sense: AngleSense,
    /// Whether earlier coefficients were used.
    pub coefficients: bool,
}

impl TrialBalanceResult {
    /// Columns of the table of weights.
    pub const WEIGHTS: [&str; 3] = ["plane", "unbalance to add, g·mm", "angle"];
    /// Columns of the table of vibration.
    pub const LEFT: [&str; 5] = ["probe", "speed, rpm", "before", "after", "after, at most (95 %)"];

    /// The direction in which angles count.
    pub fn direction(&self) -> &'static str {
        self.sense.words()
    }

    pub fn answer(&self) -> TrialBalance {
        let onto = self.onto.clone();
        TrialBalance::of(&self.correction, self.criterion, onto, self.sense, &self.shop_lines())
    }

    /// Unit of the vibration as people write it.
    pub fn unit(&self) -> &str {
        match self.correction.unit.as_str() {
            "um" => "µm",
            "mm_s" => "mm/s",
            "m_s2" => "m/s²",
            other => other,
        }
    }

    /// What the weights are for.
    pub fn title(&self) -> String {
        let to = match (&self.onto, self.coefficients) {
            (Some(run), _) => format!("to add to what run \"{run}\" has"),
            (None, true) => "to add to the machine as it was measured, by earlier coefficients".into(),
            (None, false) => "for the machine without trial weights".into(),
        };
        let least = match self.criterion {
            Criterion::LeastSquares => "least squares",
            Criterion::MinMax => "the largest vibration least",
        };
        format!("Correction weights {to}, {least}; angles from the keyphasor mark, {}", self.direction())
    }

    /// Rows of the table of weights.
    pub fn weight_rows(&self) -> Vec<[String; 3]> {
        let row = |w: &PlaneWeight| {
            let (size, angle_deg) = (w.wanted_g_mm.norm(), self.sense.angle_deg(w.wanted_g_mm));
            match w.interval_95 {
                Some(([from, to], half_deg)) => [
                    w.plane.clone(),
                    format!("{} ({} to {} with 95 %)", digits(size), digits(from), digits(to)),
                    match half_deg < 180.0 {
                        true => format!("{angle_deg:.1}° ± {half_deg:.1}°"),
                        false => format!("{angle_deg:.1}°, any with 95 %"),
                    },
                ],
                None => [w.plane.clone(), digits(size), format!("{angle_deg:.1}°")],
            }
        };
        self.correction.weights.iter().map(row).collect()
    }

    /// What to do, one line a plane.
    pub fn shop_lines(&self) -> Vec<String> {
        let line = |w: &PlaneWeight| {
            let kept = w.filling.pieces.iter().filter(|p| p.unbalance_g_mm.norm() > 0.0);
            let pieces: Vec<String> = kept.map(|p| self.piece(p)).collect();
            match pieces.is_empty() {
                true => format!("{}: add nothing.", w.plane),
                false => format!("{}: add {}.", w.plane, pieces.join(", and ")),
            }
        };
        self.correction.weights.iter().map(line).collect()
    }

    fn piece(&self, piece: &WeightPiece) -> String {
        let size = match piece.mass_and_radius {
            Some([mass_g, radius_mm]) => format!("{} g at {radius_mm} mm", plain(mass_g)),
            None => format!("{} g·mm", plain(piece.unbalance_g_mm.norm())),
        };
        let hole = piece.hole.map_or(String::new(), |hole| format!(" in hole {hole}"));
        format!("{size}{hole}, at {:.0}° {}", self.sense.angle_deg(piece.unbalance_g_mm), self.direction())
    }

    /// Static part and couple of two planes in words, and what the weights do.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some(parts) = StaticCouple::of(&self.correction.weights, self.sense) {
            let phasor =
                |u: &VectorAnswer| format!("{} g·mm at {:.1}°", digits(u.magnitude_g_mm), u.angle_deg);
            lines.push(format!(
                "Static: {} in all. Couple: {} in plane {}, its opposite in plane {}.",
                phasor(&parts.static_unbalance),
                phasor(&parts.couple),
                self.correction.weights[0].plane,
                self.correction.weights[1].plane
            ));
        }
        let left = &self.correction.left;
        let rms = |of: fn(&ProbeVibration) -> f64| {
            (left.iter().map(|l| of(l).powi(2)).sum::<f64>() / left.len() as f64).sqrt()
        };
        let most = |of: fn(&ProbeVibration) -> f64| left.iter().map(of).fold(0.0, f64::max);
        lines.push(format!(
            "Vibration, {} zero to peak, with the weights that are put in: {} becomes {} root mean square, {} becomes {} at most.",
            self.unit(),
            digits(rms(|l| l.before)),
            digits(rms(|l| l.after)),
            digits(most(|l| l.before)),
            digits(most(|l| l.after))
        ));
        lines.push(match self.correction.basis {
            Basis::Stated => "Intervals from the stated noise.".into(),
            Basis::Runs(values) => {
                format!("Intervals from what the runs miss each other by ({values} values beyond the coefficients).")
            }
            Basis::Readings(values) => format!("Intervals from repeated readings ({values} values)."),
            Basis::Unknown => "No intervals: the noise is not known.".into(),
        });
        lines
    }

    /// Rows of the table of vibration.
    pub fn left_rows(&self) -> Vec<[String; 5]> {
        let row = |l: &ProbeVibration| {
            let at_most = l.after_at_most.map_or("–".into(), digits);
            [l.probe.clone(), format!("{:.0}", l.speed_rpm), digits(l.before), digits(l.after), at_most]
        };
        self.correction.left.iter().map(row).collect()
    }

    pub fn print(&self) {
        /// More rows than this say nothing to a reader; they are in the JSON and the report.
        const MOST_ROWS: usize = 40;
        println!("{}", self.title());
        output::table(&Self::WEIGHTS, &self.weight_rows());
        println!();
        self.shop_lines().iter().for_each(|line| println!("{line}"));
        println!();
        let rows = self.left_rows();
        if rows.len() <= MOST_ROWS {
            output::table(&Self::LEFT, &rows);
        }
        self.lines().iter().for_each(|line| println!("{line}"));
        if !self.correction.doubts.is_empty() {
            println!();
        }
        self.correction.doubts.iter().for_each(|doubt| println!("{doubt}"));
    }
}

/// Four significant digits.
pub fn digits(value: f64) -> String {
    let before = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    format!("{value:.*}", (3 - before).clamp(0, 6) as usize)
}

/// The same without zeros at the end.
fn plain(value: f64) -> String {
    let text = digits(value);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}
