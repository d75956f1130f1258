//! What a file may say about an oil-film bearing.

use super::{Film, FilmKind};

/// A key of the file and what is wrong with it.
type Fault = (String, String);

impl Film {
    /// Whether the numbers are those of an oil-film bearing.
    ///
    /// # Errors
    /// The first key that is missing, out of place or out of range, and a sentence with its number.
    pub fn check(&self) -> Result<(), Fault> {
        self.check_size()?;
        self.check_oil()?;
        if let Some(load) = self.load_n {
            within("load_n", load, 1e-3, 1e8, "N")?;
        }
        within("load_angle_deg", self.load_angle_deg, -360.0, 360.0, "degrees")?;
        self.check_kind()
    }

    fn check_size(&self) -> Result<(), Fault> {
        within("diameter_m", self.diameter_m, 1e-3, 5.0, "m")?;
        let ratio = self.length_m / self.diameter_m;
        if !(0.2..=2.0).contains(&ratio) {
            return fault(
                "length_m",
                format!("{} m is {ratio:.3} diameters long, expected 0.2 to 2", self.length_m),
            );
        }
        let slimness = 2.0 * self.radial_clearance_m / self.diameter_m;
        if !(2e-4..=1e-2).contains(&slimness) {
            return fault(
                "radial_clearance_m",
                format!(
                    "{} m is {slimness:.1e} of the radius, expected 2e-4 to 1e-2",
                    self.radial_clearance_m
                ),
            );
        }
        Ok(())
    }

    fn check_oil(&self) -> Result<(), Fault> {
        match (self.viscosity_pa_s, self.iso_vg, self.temperature_c) {
            (Some(viscosity), None, None) => within("viscosity_pa_s", viscosity, 1e-5, 10.0, "Pa·s"),
            (None, Some(grade), Some(temperature)) => {
                within("iso_vg", grade, 2.0, 1500.0, "mm²/s at 40 °C")?;
                within("temperature_c", temperature, 0.0, 150.0, "°C")
            }
            (Some(viscosity), _, _) => fault(
                "viscosity_pa_s",
                format!("{viscosity} Pa·s stands beside iso_vg or temperature_c, expected one of the two"),
            ),
            (None, Some(grade), None) => {
                fault("temperature_c", format!("missing, an oil of grade {grade} needs it"))
            }
            (None, None, Some(temperature)) => {
                fault("iso_vg", format!("missing beside temperature_c = {temperature}"))
            }
            (None, None, None) => {
                fault("viscosity_pa_s", "missing, expected it or iso_vg and temperature_c".into())
            }
        }
    }

    fn check_kind(&self) -> Result<(), Fault> {
        use FilmKind::{AxialGroove, Elliptical, Offset, Plain, TiltingPad};
        let kind = self.kind;
        self.refuse_keys_of_other_kinds()?;
        let pads = match (kind, self.pads) {
            (TiltingPad, None) => return fault("pads", "missing, a tilting-pad bearing needs it".into()),
            (_, pads) => pads.unwrap_or(2),
        };
        let least = match kind {
            Plain | AxialGroove => 1,
            Elliptical | Offset => 2,
            TiltingPad => 3,
        };
        if !(least..=12).contains(&pads) {
            return fault("pads", format!("{pads} pads, expected {least} to 12"));
        }
        if let Some(preload) = self.preload {
            within("preload", preload, 0.0, 0.9, "")?;
        } else if matches!(kind, Elliptical | Offset) {
            return fault("preload", "missing, a bearing of displaced lobes needs it".into());
        }
        if let Some(offset) = self.offset {
            within("offset", offset, 0.3, 1.0, "of the arc")?;
        }
        let pitch = 360.0 / pads as f64;
        if let Some(groove) = self.groove_arc_deg {
            within("groove_arc_deg", groove, 0.0, 0.5 * pitch, "degrees")?;
        }
        if let Some(arc) = self.pad_arc_deg {
            within("pad_arc_deg", arc, 10.0, pitch, "degrees")?;
        }
        Ok(())
    }

    fn refuse_keys_of_other_kinds(&self) -> Result<(), Fault> {
        use FilmKind::{AxialGroove, Elliptical, Offset, Plain, TiltingPad};
        let kind = self.kind;
        let keys = [
            ("pads", self.pads.is_some(), !matches!(kind, Plain | Offset)),
            ("pad_arc_deg", self.pad_arc_deg.is_some(), kind == TiltingPad),
            ("preload", self.preload.is_some(), !matches!(kind, Plain | AxialGroove)),
            ("offset", self.offset.is_some(), matches!(kind, Elliptical | TiltingPad)),
            ("load", self.load.is_some(), kind != Plain),
            ("groove_arc_deg", self.groove_arc_deg.is_some(), !matches!(kind, Plain | TiltingPad)),
        ];
        match keys.iter().find(|(_, stated, belongs)| *stated && !belongs) {
            Some((key, ..)) => {
                let name = match kind {
                    Plain => "plain",
                    AxialGroove => "axial_groove",
                    Elliptical => "elliptical",
                    Offset => "offset",
                    TiltingPad => "tilting_pad",
                };
                fault(key, format!("a bearing of kind \"{name}\" has none"))
            }
            None => Ok(()),
        }
    }
}

fn within(key: &str, value: f64, least: f64, most: f64, unit: &str) -> Result<(), Fault> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    fault(key, format!("{value}{unit}, expected {least} to {most}"))
}

fn fault(key: &str, sentence: String) -> Result<(), Fault> {
    Err((key.into(), sentence))
}
