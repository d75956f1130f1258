//! The viscosity of a mineral oil from its ISO grade and temperature.
//!
//! A grade's number is its kinematic viscosity at 40 °C in mm²/s (ISO 3448). With temperature it follows
//! Walther's line, `lg lg (ν + 0.7) = A − B lg T` (ASTM D341), whose slope B is that of the oils that define
//! the viscosity index 100 (ASTM D2270): from the equations of that standard for its reference oils,
//!
//! | grade | ν at 100 °C | B |
//! |---|---|---|
//! | 10 | 2.659 mm²/s | 3.828 |
//! | 22 | 4.294 mm²/s | 3.785 |
//! | 1500 | 68.4 mm²/s | 3.117 |
//!
//! and in between linear in the logarithm of the grade, which is how the slopes of real oils run.

/// Density of mineral oil, kg/m³.
const DENSITY_KG_M3: f64 = 870.0;
/// Grades and the slopes of their lines.
const SLOPES: [(f64, f64); 3] = [(10.0, 3.828), (22.0, 3.785), (1500.0, 3.117)];
const KELVIN: f64 = 273.15;

/// Dynamic viscosity, Pa·s, of a mineral oil of ISO grade `iso_vg` at `temperature_c`.
pub fn viscosity_pa_s(iso_vg: f64, temperature_c: f64) -> f64 {
    1e-6 * DENSITY_KG_M3 * kinematic_mm2_s(iso_vg, temperature_c)
}

fn kinematic_mm2_s(iso_vg: f64, temperature_c: f64) -> f64 {
    let slope = slope(iso_vg);
    let fall = slope * ((temperature_c + KELVIN) / (40.0 + KELVIN)).log10();
    let doubled = (iso_vg + 0.7).log10().log10() - fall;
    10f64.powf(10f64.powf(doubled)) - 0.7
}

fn slope(iso_vg: f64) -> f64 {
    let [a, b, c] = SLOPES;
    let ((x, u), (y, v)) = if iso_vg < b.0 { (a, b) } else { (b, c) };
    u + (v - u) * (iso_vg / x).ln() / (y / x).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grade_is_its_viscosity_at_40_degrees() {
        for grade in [2.0, 32.0, 46.0, 680.0] {
            assert!((kinematic_mm2_s(grade, 40.0) / grade - 1.0).abs() < 1e-12);
        }
    }

    /// Oils of viscosity index 100 by ASTM D2270: ν₄₀ = H(ν₁₀₀), its appendix's equations for 2 to 3.8, 3.8 to
    /// 4.4 and above 70 mm²/s (the last continued to 68).
    #[test]
    fn the_viscosity_index_is_100_at_the_reference_oils() {
        let low = |y: f64| 0.84155 * y * y + 1.5521 * y - 0.077;
        let middle = |y: f64| 0.78571 * y * y + 1.7929 * y - 0.183;
        let high = |y: f64| 0.16841 * y * y + 11.8493 * y - 96.947;
        for (hundred, forty) in [
            (2.659, low(2.659)),
            (3.41, low(3.41)),
            (4.0, middle(4.0)),
            (4.294, middle(4.294)),
            (68.36, high(68.36)),
        ] {
            let made = kinematic_mm2_s(forty, 100.0);
            assert!((made / hundred - 1.0).abs() < 2e-3, "VG {forty}: {made} for {hundred}");
        }
    }

    /// Typical viscosities at 100 °C of oils of index 95 to 100 as data sheets state them, to a few per cent.
    #[test]
    fn usual_grades_are_as_thin_at_100_degrees_as_data_sheets_say() {
        for (grade, hundred) in [
            (32.0, 5.4),
            (46.0, 6.7),
            (68.0, 8.7),
            (100.0, 11.2),
            (150.0, 14.7),
            (220.0, 18.9),
            (460.0, 31.0),
        ] {
            let made = kinematic_mm2_s(grade, 100.0);
            assert!((made / hundred - 1.0).abs() < 0.03, "VG {grade}: {made}");
        }
    }

    /// DIN 31652-1 / ISO 7902-1: `η = ηx exp((159.56/(T + 95) − 0.181913) ln(ρν₄₀/ηx))`, ηx = 0.18 mPa·s, another
    /// fit of the same oils.
    #[test]
    fn viscosity_equals_vogel_formula_of_standard_in_6_percent() {
        for grade in [22.0, 32.0, 46.0, 68.0, 100.0] {
            for temperature in [30.0, 50.0, 60.0, 70.0, 80.0] {
                let scale = 0.18e-3;
                let forty: f64 = 870e-6 * grade;
                let exponent: f64 = 159.56 / (temperature + 95.0) - 0.181913;
                let vogel = scale * (exponent * (forty / scale).ln()).exp();
                let ours = viscosity_pa_s(grade, temperature);
                assert!((ours / vogel - 1.0).abs() < 0.06, "VG {grade} at {temperature}: {ours} {vogel}");
            }
        }
    }
}
