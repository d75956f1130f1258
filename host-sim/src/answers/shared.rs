//! Parts that several answers hold.

use nalgebra::Complex;
use rotor_edge_desktop::unbalance::g_mm_deg;
use serde::{Serialize, Serializer};

/// The convention of every amplitude in µm, where a key of an answer names it.
pub const ZERO_TO_PEAK: &str = "0-pk";

/// What an ``uncertainty`` is, where a key of an answer names it.
pub const STANDARD_DEVIATION: &str = "standard deviation";

/// An unbalance and where it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UnbalanceAnswer {
    pub unbalance_g_mm: f64,
    pub angle_deg: f64,
}

impl UnbalanceAnswer {
    pub fn of(unbalance_kg_m: Complex<f64>) -> Self {
        let [unbalance_g_mm, angle_deg] = g_mm_deg(unbalance_kg_m);
        Self { unbalance_g_mm, angle_deg }
    }
}

/// An unbalance, or a weight, at a plane.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneUnbalance {
    pub name: String,
    pub unbalance_g_mm: f64,
    pub angle_deg: f64,
}

impl PlaneUnbalance {
    pub fn of(name: &str, unbalance_kg_m: Complex<f64>) -> Self {
        let [unbalance_g_mm, angle_deg] = g_mm_deg(unbalance_kg_m);
        Self { name: name.into(), unbalance_g_mm, angle_deg }
    }
}

/// Values by name in the order in which they are shown; a map in JSON.
#[derive(Debug, Clone, PartialEq)]
pub struct ByName<T>(Vec<(String, T)>);

impl<T> Default for ByName<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> ByName<T> {
    pub fn iter(&self) -> impl Iterator<Item = (&str, &T)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }

    pub fn get(&self, name: &str) -> Option<&T> {
        self.iter().find(|(own, _)| *own == name).map(|(_, value)| value)
    }
}

impl<T: Default> ByName<T> {
    /// The value of a name, added at the end if there is none.
    pub fn entry(&mut self, name: &str) -> &mut T {
        let at = self.0.iter().position(|(own, _)| own == name).unwrap_or(self.0.len());
        if at == self.0.len() {
            self.0.push((name.into(), T::default()));
        }
        &mut self.0[at].1
    }
}

impl<T> FromIterator<(String, T)> for ByName<T> {
    fn from_iter<I: IntoIterator<Item = (String, T)>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

impl<T: Serialize> Serialize for ByName<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.iter())
    }
}
