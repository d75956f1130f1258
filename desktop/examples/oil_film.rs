//! A machine on oil films, made in code: what its bearings carry, how they answer, and from which speed they whip.
//!
//! `cargo run --release -p rotor-edge-desktop --example oil_film`

use rotor_edge_desktop::Error;
use rotor_edge_desktop::bearing::Law;
use rotor_edge_desktop::check::{CheckUnbalance, check};
use rotor_edge_desktop::rotor_file;

const MACHINE: &str = r#"
schema = 2
name = "compressor"
shaft = [{ length_m = 1.2, outer_diameter_m = 0.09 }]
disk = [{ name = "wheel", position_m = 0.6, mass_kg = 60.0, diametral_inertia_kg_m2 = 0.5, polar_inertia_kg_m2 = 0.9 }]
plane = [{ name = "wheel", position_m = 0.6 }]
probe = [{ name = "AX", bearing = "A", position_m = 0.16, angle_deg = 45 }]
[[bearing]]
name = "A"
position_m = 0.1
film = { kind = "plain", diameter_m = 0.08, length_m = 0.04, radial_clearance_m = 8e-5, iso_vg = 46, temperature_c = 55 }
[[bearing]]
name = "B"
position_m = 1.1
film = { kind = "plain", diameter_m = 0.08, length_m = 0.04, radial_clearance_m = 8e-5, iso_vg = 46, temperature_c = 55 }
"#;

fn main() -> Result<(), Error> {
    let rotor = rotor_file::parse("compressor.toml", MACHINE)?;
    for bearing in &rotor.bearing {
        let Law::Film(film) = &bearing.law else { continue };
        println!("{} carries {:.0} N", bearing.name, film.load_n());
        for speed_rpm in [1500.0, 3000.0, 6000.0] {
            let state = film.curve().state(rotor_edge_desktop::units::rad_s(speed_rpm))?;
            println!(
                "  {speed_rpm:>5} rpm: eccentricity {:.2}, attitude {:.0}°, k_xx {:.2e}, k_xy {:.2e}, k_yx {:.2e} N/m",
                state.eccentricity_ratio,
                state.attitude_deg,
                state.stiffness_n_m.m11,
                state.stiffness_n_m.m12,
                state.stiffness_n_m.m21
            );
        }
    }
    let found = check(&rotor, None, CheckUnbalance::default())?;
    for critical in &found.critical {
        println!(
            "undamped critical speed at {:.0} rpm",
            rotor_edge_desktop::units::rpm(critical.speed_rad_s)
        );
    }
    match &found.threshold {
        Some(mode) => {
            println!("unstable from {:.0} rpm on", rotor_edge_desktop::units::rpm(mode.speed_rad_s))
        }
        None => println!("stable over {:.0} to {:.0} rpm", found.range_rpm[0], found.range_rpm[1]),
    }
    Ok(())
}
