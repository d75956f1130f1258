//! What a foundation must satisfy.

use super::Checker;
use crate::error::Error;
use crate::machine::drawing::Rotor;

/// Checks what several bearings stand on.
pub(super) fn check(c: &Checker, rotor: &Rotor) -> Result<(), Error> {
    let Some(foundation) = &rotor.foundation else { return Ok(()) };
    if rotor.schema < 2 {
        return c.fail("schema", format!("{} does not know [foundation], expected 2", rotor.schema));
    }
    let count = foundation.bearings.len();
    if count < 2 {
        return c.fail(
            "[foundation] bearings",
            format!("{count} given, a foundation joins two at least; one has a pedestal"),
        );
    }
    c.unique("[foundation] bearings", foundation.bearings.iter().map(String::as_str))?;
    for name in &foundation.bearings {
        if !rotor.bearing.iter().any(|b| b.name == *name) {
            return c.fail("[foundation] bearings", format!("there is no bearing \"{name}\""));
        }
    }
    match (foundation.mode.is_empty(), foundation.table.is_empty()) {
        (true, true) => {
            let what = "has no mode and no table, expected one of the two; for a rigid foundation leave out [foundation]";
            return c.fail("[foundation]", what);
        }
        (false, false) => return c.fail("[foundation]", "has modes and a table, expected one of the two"),
        _ => (),
    }
    if let Err((row, what)) = foundation.compliance() {
        let key =
            if row == 0 { "[foundation] table".into() } else { format!("[foundation] table row {row}") };
        return c.fail(key, what);
    }
    for (i, m) in foundation.mode.iter().enumerate() {
        let key = |name: &str| format!("[foundation] mode {} {name}", i + 1);
        c.within(&key("frequency_hz"), m.frequency_hz, 0.1, 1e5, "Hz")?;
        c.within(&key("damping_ratio"), m.damping_ratio, 0.0, 1.0, "")?;
        c.within(&key("modal_mass_kg"), m.modal_mass_kg, 1e-3, 1e9, "kg")?;
        for (name, shape) in [("x", &m.x), ("y", &m.y)] {
            if shape.len() != count {
                return c.fail(
                    key(name),
                    format!("{} numbers, expected one for each of {count} bearings", shape.len()),
                );
            }
            shape.iter().try_for_each(|v| c.within(&key(name), *v, -1e3, 1e3, ""))?;
        }
    }
    Ok(())
}
