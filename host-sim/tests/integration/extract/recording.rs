//! A recording that is known in closed form.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use nalgebra::{Complex, Matrix3, Vector3};

/// Four proximity probes and a keyphasor.
pub struct Recording {
    /// At the first sample.
    pub speed_rpm: f64,
    /// Rise of the speed, rpm a second.
    pub rise_rpm_s: f64,
    pub rate_hz: f64,
    pub seconds: f64,
}

impl Default for Recording {
    fn default() -> Self {
        Self { speed_rpm: 11_000.0, rise_rpm_s: 0.0, rate_hz: 20_000.0, seconds: 1.0 }
    }
}

pub const NAMES: [&str; 4] = ["15X", "15Y", "16X", "16Y"];

impl Recording {
    pub const GAP_V: f64 = -9.5;
    pub const MV_UM: f64 = 7.87;

    pub fn samples(&self) -> usize {
        (self.seconds * self.rate_hz) as usize
    }

    /// Turns since the keyphasor's mark before the first sample.
    pub fn turns(&self, n: usize) -> f64 {
        let seconds = n as f64 / self.rate_hz;
        0.37 + seconds * (self.speed_rpm + 0.5 * seconds * self.rise_rpm_s) / 60.0
    }

    /// `cos − i sin`, µm.
    pub fn phasor_um(probe: usize) -> Complex<f64> {
        Complex::from_polar(50.0 + 12.0 * probe as f64, -(0.4 + 1.3 * probe as f64))
    }

    /// `cos · cos Ωt + sin · sin Ωt`, t = 0 at the mark.
    pub fn um(&self, probe: usize, n: usize) -> f64 {
        let angle = TAU * self.turns(n);
        let y = Self::phasor_um(probe);
        y.re * angle.cos() - y.im * angle.sin()
    }

    pub fn volts(&self, probe: usize, n: usize) -> f64 {
        Self::GAP_V + 1e-3 * Self::MV_UM * self.um(probe, n)
    }

    /// A key on the shaft: from −10 V through −6 V at the mark to −2 V, straight over a tenth of a turn.
    pub fn key(&self, n: usize) -> f64 {
        Self::pulse(self.turns(n))
    }

    /// The same of a phase in turns.
    pub fn pulse(turns: f64) -> f64 {
        let from_mark = turns - turns.round();
        (-6.0 + 80.0 * from_mark).min(-2.0 - 80.0 * (from_mark - 0.2)).clamp(-10.0, -2.0)
    }

    /// The whole recording as text; `change` may make of the volts at a place in
    /// turns, the keyphasor's last, what it likes.
    pub fn csv_with(&self, change: impl Fn(f64, &mut [f64; 5])) -> String {
        let mut text = format!("time_s,{},kph\n", NAMES.join(","));
        for n in 0..self.samples() {
            let [a, b, c, d] = [0, 1, 2, 3].map(|probe| self.volts(probe, n));
            let mut row = [a, b, c, d, self.key(n)];
            change(self.turns(n), &mut row);
            let [a, b, c, d, key] = row;
            writeln!(text, "{},{a},{b},{c},{d},{key}", n as f64 / self.rate_hz).unwrap();
        }
        text
    }

    pub fn csv(&self) -> String {
        self.csv_with(|_, _| ())
    }
}

/// The textbook's fit of mean, cosine and sine to all samples of a probe, with exact phases: `cos − i sin`, µm.
pub fn least_squares_um(recording: &Recording, probe: usize) -> Complex<f64> {
    let (mut gram, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for n in 0..recording.samples() {
        let angle = TAU * recording.turns(n);
        let row = Vector3::new(1.0, angle.cos(), angle.sin());
        gram += row * row.transpose();
        right += row * (1e3 * recording.volts(probe, n) / Recording::MV_UM);
    }
    let solved = gram.lu().solve(&right).expect("many turns");
    Complex::new(solved[1], -solved[2])
}
