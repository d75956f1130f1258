//! Runs compared with one another: the extra unbalance of one, and whether its stated weights can be true.

use nalgebra::{Complex, DMatrix};

use super::base::BaseModel;
use super::parameters;
use super::planes::PlaneUnbalance;
use crate::effects::Place;
use crate::fit::Fit;
use crate::fit::hypothesis::Hypothesis;
use crate::machine::weights::by_plane;
use crate::statistics::significance::percent;
use crate::unbalance::{G_MM, g_mm_deg};

type C = Complex<f64>;

/// A run whose stated weights contradict the data.
#[derive(Debug, Clone, PartialEq)]
pub struct RefutedRun {
    pub run: String,
    /// Probability that they are not as stated.
    pub probability: f64,
    /// Weights stated and found in each plane.
    pub weights: Vec<FoundWeight>,
    /// Whether the model that finds them describes the data, so that their intervals hold.
    pub model_fits: bool,
}

/// The weight of a plane in a run, as stated and as found.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundWeight {
    /// By the file, g·mm; zero where it states none.
    pub stated_g_mm: C,
    /// By the data, with its 95 % region.
    pub found: PlaneUnbalance,
    /// The simplest account of the difference that lies within that.
    pub account: Option<Account>,
}

/// How a stated weight and the found one can differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Account {
    AsStated,
    Missing,
    /// Its angle was counted against the rotation.
    OtherSense,
    /// As heavy as stated, turned by this angle, degrees.
    OtherHole(f64),
    /// Where it is stated, this many times as large.
    Scaled(f64),
}

impl Account {
    /// The simplest account within the 95 % region of the found weight.
    fn of(stated_g_mm: C, found: &PlaneUnbalance) -> Option<Self> {
        let stated = stated_g_mm / G_MM;
        let [size_g_mm, angle_deg] = g_mm_deg(stated);
        let turned_deg = (found.angle_deg - angle_deg + 180.0).rem_euclid(360.0) - 180.0;
        let [low, high] = found.interval_95_g_mm;
        if found.region.holds(stated_g_mm) {
            Some(Self::AsStated)
        } else if size_g_mm == 0.0 {
            None
        } else if found.region.holds(C::from(0.0)) {
            Some(Self::Missing)
        } else if found.region.holds(stated_g_mm.conj()) {
            Some(Self::OtherSense)
        } else if (low..=high).contains(&size_g_mm) {
            Some(Self::OtherHole(turned_deg))
        } else if turned_deg.abs() <= found.angle_95_deg {
            Some(Self::Scaled(found.unbalance_g_mm / size_g_mm))
        } else {
            None
        }
    }

    pub fn words(self) -> String {
        match self {
            Self::AsStated => "as stated".into(),
            Self::Missing => "it is missing altogether".into(),
            Self::OtherSense => "its angle was counted the other way round".into(),
            Self::OtherHole(turned_deg) => {
                format!("it sits in another hole, {turned_deg:.0}° from where it is stated")
            }
            Self::Scaled(factor) => format!("it is {factor:.2} times as large, at the stated angle"),
        }
    }
}

impl FoundWeight {
    fn words(&self, model_fits: bool) -> String {
        let found = &self.found;
        let stated = if self.stated_g_mm.norm() == 0.0 {
            "none".to_string()
        } else {
            let angle_deg = self.stated_g_mm.arg().to_degrees();
            format!("{:.0} g·mm at {angle_deg:.0}°", self.stated_g_mm.norm())
        };
        let account = self.account.map_or(String::new(), |r| format!(": {}", r.words()));
        format!("in plane {} {stated} stated, {} found{account}", found.name, sized(found, model_fits))
    }
}

impl RefutedRun {
    pub fn words(&self) -> String {
        let each: Vec<String> = self.weights.iter().map(|w| w.words(self.model_fits)).collect();
        let probable = percent(self.probability);
        format!(
            "The stated weights of run {} are wrong ({probable} probable): {}.",
            self.run,
            each.join("; ")
        )
    }
}

/// Unbalance of one run in each plane beyond that of the others and its stated weights.
pub struct RunChange {
    run: String,
    others: String,
    change: Vec<PlaneUnbalance>,
    /// Whether the file states weights for it.
    stated: bool,
    /// Weights found in each plane, where the file states weights for the run and all of them are in planes.
    weights: Option<Vec<FoundWeight>>,
}

impl RunChange {
    /// Of every effect of a hypothesis that is one of a run and not of the base; its fit must have its covariance.
    pub fn beyond(base: &BaseModel, with: &Hypothesis, fit: &Fit) -> Vec<Self> {
        let own = base.hypothesis.effects.len();
        let numbers = own..with.effects.len();
        numbers.filter_map(|effect| Self::of(base, with, fit, effect)).collect()
    }

    fn of(base: &BaseModel, with: &Hypothesis, fit: &Fit, effect: usize) -> Option<Self> {
        let Place::Run(number) = with.effects[effect].place else { return None };
        let covariance = fit.covariance.as_ref()?;
        let rotor = with.rotor;
        let run = &rotor.run[number];
        let first = parameters::first_unknown(with, effect);
        let own = |plane: usize| -> (C, DMatrix<f64>) {
            let at = fit.x.len() + 2 * (first + plane);
            (fit.unknowns[first + plane], covariance.view((at, at), (2, 2)).into_owned())
        };
        let planes = || rotor.plane.iter().enumerate();
        let found = |(i, plane): (usize, &crate::machine::drawing::Plane), stated: C| {
            let (u, covariance) = own(i);
            PlaneUnbalance::new(&plane.name, stated + u, &covariance)
        };
        let stated = !run.added_unbalance.is_empty();
        let weighted = by_plane(rotor, run).ok().filter(|_| stated);
        let weights = weighted.map(|stated| {
            let of = |(plane, stated): ((usize, _), &C)| {
                let found = found(plane, *stated);
                let stated_g_mm = stated * G_MM;
                FoundWeight { account: Account::of(stated_g_mm, &found), stated_g_mm, found }
            };
            planes().zip(&stated).map(of).collect()
        });
        let mut others: Vec<&str> = Vec::new();
        for listed in base.fitter.data.rows.iter().filter_map(|row| row.listed).filter(|k| *k != number) {
            if !others.contains(&rotor.run[listed].name.as_str()) {
                others.push(&rotor.run[listed].name);
            }
        }
        Some(Self {
            run: run.name.clone(),
            others: match others[..] {
                [one] => format!("run {one}"),
                _ => "the other runs".into(),
            },
            change: planes().map(|plane| found(plane, C::from(0.0))).collect(),
            stated,
            weights,
        })
    }

    /// One sentence on the difference; with intervals only where the model of the fit describes the data.
    pub fn words(&self, model_fits: bool) -> String {
        let one = |p: &PlaneUnbalance| format!("{} in plane {}", sized(p, model_fits), p.name);
        let each: Vec<String> = self.change.iter().map(one).collect();
        let stated = if self.stated { " and its stated weights say" } else { "" };
        format!("Run {} carries {} more than {}{stated}.", self.run, each.join(" and "), self.others)
    }

    /// Its stated weights as refuted with this probability, where it has any.
    fn refuted(&self, probability: f64, model_fits: bool) -> Option<RefutedRun> {
        let weights = self.weights.clone()?;
        Some(RefutedRun { run: self.run.clone(), probability, weights, model_fits })
    }
}

/// Changes that are there with this probability, by a model that describes the data or not: runs whose stated weights they refute,
/// and sentences on the others.
pub fn told(changes: &[RunChange], probability: f64, model_fits: bool) -> (Vec<RefutedRun>, Vec<String>) {
    let refuted = changes.iter().filter_map(|c| c.refuted(probability, model_fits)).collect();
    let others = changes.iter().filter(|c| c.weights.is_none()).map(|c| c.words(model_fits)).collect();
    (refuted, others)
}

/// Size and angle, with their 95 % intervals if the model describes the data.
fn sized(plane: &PlaneUnbalance, model_fits: bool) -> String {
    let ([low, high], size) = (plane.interval_95_g_mm, plane.unbalance_g_mm);
    match model_fits {
        true => format!("{size:.0} g·mm ({low:.0} to {high:.0} with 95 %) at {}", angle(plane)),
        false => format!("{size:.0} g·mm at {:.0}°", plane.angle_deg),
    }
}

/// An angle with its 95 % half-width.
fn angle(plane: &PlaneUnbalance) -> String {
    if plane.angle_95_deg < 90.0 {
        format!("{:.0}° ± {:.0}°", plane.angle_deg, plane.angle_95_deg)
    } else {
        "any angle".into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A weight found with 1 g·mm standard deviation in each component.
    fn read(stated: [f64; 2], found: [f64; 2]) -> Option<Account> {
        let polar = |[size, angle_deg]: [f64; 2]| C::from_polar(size, f64::to_radians(angle_deg));
        let covariance = DMatrix::from_diagonal_element(2, 2, 1e-12);
        Account::of(polar(stated), &PlaneUnbalance::new("1", polar(found) / G_MM, &covariance))
    }

    #[test]
    fn simplest_account_within_2_5_sd_is_chosen_and_none_beyond() {
        let stated = [100.0, 70.0];
        assert_eq!(read(stated, [101.0, 71.0]), Some(Account::AsStated));
        assert_eq!(read(stated, [2.0, 160.0]), Some(Account::Missing));
        assert_eq!(read(stated, [99.0, -70.5]), Some(Account::OtherSense));
        let Some(Account::OtherHole(turned)) = read([100.0, 170.0], [101.0, -130.0]) else { panic!() };
        assert!((turned - 60.0).abs() < 1e-9, "the short way round: {turned}");
        let Some(Account::Scaled(factor)) = read(stated, [50.0, 70.5]) else { panic!() };
        assert!((factor - 0.5).abs() < 1e-9);
        assert_eq!(read(stated, [50.0, 100.0]), None);
        assert_eq!(read([0.0, 0.0], [2.0, 10.0]), Some(Account::AsStated), "none stated, none found");
        assert_eq!(read([0.0, 0.0], [20.0, 10.0]), None, "one that nobody stated");
    }
}
