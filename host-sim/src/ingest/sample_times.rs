//! The times of samples: at which rate they rise, and what is lost.

/// A step of time may be this much longer or shorter than the mean, relative; a lost row is a step twice as long.
const LARGEST_JITTER: f64 = 0.5;

/// Samples a second of evenly spaced times, or a sentence with the first uneven step.
pub fn rate(file: &str, column: &str, times_s: &[f64]) -> Result<f64, String> {
    let (Some(first), Some(last)) = (times_s.first(), times_s.last()) else { return Ok(f64::NAN) };
    let mean_s = (last - first) / (times_s.len() - 1) as f64;
    if is_rounded(times_s, mean_s) {
        return Ok(1.0 / mean_s);
    }
    let steps = || times_s.windows(2).map(|pair| pair[1] - pair[0]);
    let is_even = |step: f64| ((step / mean_s) - 1.0).abs() <= LARGEST_JITTER;
    let Some(uneven) = steps().position(|step| !is_even(step)) else { return Ok(1.0 / mean_s) };
    let place = |i: usize| {
        let [from, to] = [times_s[i], times_s[i + 1]];
        format!("{file}: sample {}, column {column}: goes from {from} to {to}", i + 2)
    };
    // a step of several usual ones is a gap, which a stated rate would hide
    let usual_s = usual(steps().collect());
    let lost = |step: f64| (step / usual_s).round() - 1.0;
    let is_whole = |step: f64| (step / usual_s - lost(step) - 1.0).abs() <= 0.25 && lost(step) >= 0.0;
    if usual_s > 0.0 && steps().all(is_whole) {
        let gap = steps().position(|step| lost(step) > 0.0).unwrap_or(uneven);
        let all: f64 = steps().map(lost).sum();
        return Err(format!(
            "{}, {} steps at once; {all} samples are lost in all, expected every sample: cut the file at its gaps",
            place(gap),
            lost(times_s[gap + 1] - times_s[gap]) + 1.0
        ));
    }
    Err(format!("{}, expected steps of {usual_s:.6e} s, or --rate-hz if the samples are even", place(uneven)))
}

/// The median of steps, s.
fn usual(mut steps: Vec<f64>) -> f64 {
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Whether times repeat because they are written with too few digits: each is within a digit of an even one.
fn is_rounded(times_s: &[f64], mean_s: f64) -> bool {
    let steps = || times_s.windows(2).map(|pair| pair[1] - pair[0]);
    let Some(digit) = steps().filter(|step| *step > 0.0).reduce(f64::min) else { return false };
    let is_near = |(n, time): (usize, &f64)| (time - times_s[0] - mean_s * n as f64).abs() <= 1.01 * digit;
    steps().all(|step| step >= 0.0)
        && steps().any(|step| step == 0.0)
        && times_s.iter().enumerate().all(is_near)
}
