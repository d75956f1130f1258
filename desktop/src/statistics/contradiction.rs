//! Stated numbers that data contradict.

use nalgebra::{DMatrix, DVector};

use super::interval::{HALF_95, interval_95};

/// What is stated of one of the fitted numbers, as a normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedNumber {
    /// Place among the fitted numbers.
    pub place: usize,
    pub mean: f64,
    pub sd: f64,
}

/// A stated number that data contradict, as the data alone have it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContradictedNumber {
    /// Place among the fitted numbers.
    pub place: usize,
    pub value: f64,
    /// Ends of its 95 % interval.
    pub interval_95: [f64; 2],
}

/// A normal distribution of the fitted numbers, from which priors are taken out one by one.
struct Estimate {
    x: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Estimate {
    /// Mean and standard deviation of a number without its own prior; `None` where data say nothing about it.
    fn without_prior(&self, stated: &StatedNumber) -> Option<[f64; 2]> {
        let variance = self.covariance[(stated.place, stated.place)].max(0.0);
        let left = stated.sd.powi(2) - variance;
        let known = left > 0.0 && left.is_finite();
        known.then(|| {
            let gain = variance / left;
            let x = self.x[stated.place];
            [x + gain * (x - stated.mean), stated.sd * gain.sqrt()]
        })
    }

    /// Takes a prior out of all numbers.
    fn release(&mut self, stated: &StatedNumber) {
        let own = self.covariance.column(stated.place).into_owned();
        let left = stated.sd.powi(2) - own[stated.place];
        self.x += &own * ((self.x[stated.place] - stated.mean) / left);
        self.covariance += &own * own.transpose() / left;
    }
}

/// By how many standard deviations data and stated number differ, if the 95 % interval does not reach the stated 95 % range.
fn distance(stated: &StatedNumber, [mean, sd]: [f64; 2]) -> Option<f64> {
    let apart = (mean - stated.mean).abs();
    (apart > HALF_95 * (sd + stated.sd)).then(|| apart / sd.hypot(stated.sd))
}

/// The stated numbers whose 95 % range the 95 % interval of the data does not reach. `x` and its covariance hold the priors of
/// all numbers that `stated` lists. A prior that data contradict draws the fit, and other numbers with it; so it is taken out, the
/// most contradicted first, before the next number is judged.
pub fn contradicted(
    x: &[f64],
    covariance: &DMatrix<f64>,
    stated: &[StatedNumber],
) -> Vec<ContradictedNumber> {
    let covariance = covariance.view((0, 0), (x.len(), x.len())).into_owned();
    let mut estimate = Estimate { x: DVector::from_column_slice(x), covariance };
    let (mut left, mut released) = (stated.to_vec(), Vec::new());
    loop {
        let judge = |(i, s): (usize, &StatedNumber)| Some((i, distance(s, estimate.without_prior(s)?)?));
        let worst = left.iter().enumerate().filter_map(judge).max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((i, _)) = worst else { break };
        let number = left.remove(i);
        estimate.release(&number);
        released.push(number);
    }
    let found = |s: &StatedNumber| {
        let (value, sd) = (estimate.x[s.place], estimate.covariance[(s.place, s.place)].max(0.0).sqrt());
        // a later one that was released may account for an earlier one
        distance(s, [value, sd])?;
        Some(ContradictedNumber { place: s.place, value, interval_95: interval_95(value, sd) })
    };
    released.iter().filter_map(found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two numbers stated as 0 ± 0.1, and data with this information and these values of them.
    fn judged(information: [f64; 3], values: [f64; 2]) -> Vec<ContradictedNumber> {
        let [a, both, b] = information;
        let data = DMatrix::from_row_slice(2, 2, &[a, both, both, b]);
        let covariance = (&data + DMatrix::identity(2, 2) * 100.0).try_inverse().unwrap();
        let x = &covariance * data * DVector::from_column_slice(&values);
        let stated = [0, 1].map(|place| StatedNumber { place, mean: 0.0, sd: 0.1 });
        contradicted(x.as_slice(), &covariance, &stated)
    }

    #[test]
    fn contradicted_number_has_the_value_and_interval_of_the_data() {
        let [found] = judged([400.0, 0.0, 400.0], [0.34, 0.05])[..] else { panic!("not one") };
        assert_eq!(found.place, 0);
        assert!((found.value - 0.34).abs() < 1e-12);
        let half = HALF_95 * 0.05;
        assert!((found.interval_95[0] - 0.34 + half).abs() < 1e-12);
        assert!((found.interval_95[1] - 0.34 - half).abs() < 1e-12);
    }

    #[test]
    fn number_within_its_stated_range_is_not_contradicted() {
        assert!(judged([400.0, 0.0, 400.0], [0.28, -0.28]).is_empty());
        assert!(judged([0.0, 0.0, 0.0], [5.0, 5.0]).is_empty(), "without data");
    }

    #[test]
    fn number_drawn_by_a_contradicted_one_is_not_contradicted() {
        // the data know the sum far better than either; the first alone is off
        let found = judged([4000.0, 3900.0, 4000.0], [0.9, 0.0]);
        assert!(found.len() == 1 && found[0].place == 0, "{found:?}");
        assert!((found[0].value - 0.9).abs() < 0.25, "{found:?}");
    }
}
