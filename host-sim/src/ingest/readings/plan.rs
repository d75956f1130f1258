//! What is done with every column that is needed: its units complete, or asked for.

use std::cell::OnceCell;
use std::collections::HashSet;

use anyhow::{Result, bail};

use super::assign::{AssignedColumn, UnusedColumn, assign};
use super::date_order::order_of_steps;
use super::mapping::Mapping;
use super::status::Statuses;
use super::survey::{largest_of, units_of_cells};
use crate::ingest::calendar::{self, DateOrder, ParsedMoment};
use crate::ingest::column_units::ColumnUnits;
use crate::ingest::header::meaning;
use crate::ingest::number::{self, Decimal, DecimalEvidence};
use crate::ingest::preamble::Preamble;
use crate::ingest::probes::Probes;
use crate::ingest::sheet::SheetRow;
use crate::ingest::table::ReadingTable;
use crate::ingest::target::{Quantity, Target};
use crate::ingest::unit::{Angle, Detection, Sense, Sensitivity, SpeedUnit, Unit};
use crate::terminal::listed;

/// Speeds of a file whose fastest is below this may as well be Hz, rpm.
const SLOWEST_RPM: f64 = 300.0;

/// Characters of a date such as 20240305.
const COMPACT_DATE: usize = 8;

/// A column, and what its numbers are multiplied by.
#[derive(Debug, Clone)]
pub struct Column {
    /// Place in the row, from 0.
    pub index: usize,
    pub header: String,
    /// Everything that its quantity needs is stated.
    pub target: Target,
    /// To µm, µm/s or µm/s² zero-to-peak, radians of phase lag, rpm, volts; 1 where there is nothing to multiply.
    pub factor: f64,
    /// Which derivative of the displacement it is.
    pub derivative: u8,
    /// Columns that say whether its values are valid, from 0.
    pub statuses: Vec<usize>,
    /// The unit that stands behind its numbers, as written.
    pub cell_unit: String,
}

#[derive(Debug, Clone)]
pub struct Plan {
    pub columns: Vec<Column>,
    pub left: Vec<UnusedColumn>,
    pub decimal: Decimal,
    pub dates: Option<DateOrder>,
    /// The order of dates, where the steps from row to row alone show it.
    pub dates_by_steps: Option<DateOrder>,
    pub probes: Probes,
}

impl Plan {
    pub fn column(&self, quantity: Quantity) -> Option<&Column> {
        self.columns.iter().find(|c| c.target.quantity == quantity)
    }
}

/// The plan of a table.
///
/// # Errors
/// One sentence with file, sheet, row and column, and the option that would decide, where the export leaves open what
/// changes the physics, or has no speed, amplitude or phase.
pub fn plan(table: &ReadingTable, of_rotor: Option<Vec<String>>, mapping: &Mapping) -> Result<Plan> {
    let probes = Probes::new(of_rotor, table);
    let (assigned, mut left) = assign(table, &probes, mapping)?;
    let place = table.sheet.place();
    whole(table, &assigned, &left, mapping)?;
    let decimal = mapping.decimal.map_or_else(|| decimal(table, &assigned), Ok)?;
    let above = Preamble::of(&table.above);
    let statuses = Statuses::of(table, &assigned, &mut left)?;
    left.sort_by_key(|l| l.number);
    let mut columns = Vec::new();
    let mut missing: Vec<(String, String)> = Vec::new();
    let units = units_of_cells(table, &assigned, decimal);
    let largest = OnceCell::new();
    let is_left: HashSet<usize> = left.iter().map(|l| l.number).collect();
    for column in assigned {
        if is_left.contains(&(column.header.index + 1)) {
            continue;
        }
        let cell_unit = units[&column.header.index].clone().unwrap_or_default();
        let stated = column.target.stated.or(meaning(&cell_unit, |_| false).stated);
        let largest = || {
            largest
                .get_or_init(|| largest_of(table, decimal))
                .get(column.header.index)
                .copied()
                .unwrap_or(0.0)
        };
        let complete = complete(&column, stated, mapping, &above, largest);
        let Factor { stated, factor, derivative } = match complete {
            Ok(complete) => complete,
            Err(what) => {
                let what = if mapping.amplitudes_alone { in_header(&what) } else { what };
                // one sentence for all columns that lack the same
                if !missing.iter().any(|(_, other)| *other == what) {
                    missing.push((column.header.place(table), what));
                }
                continue;
            }
        };
        let target = Target { stated, ..column.target.clone() };
        let statuses = statuses.of_column(&column);
        columns.push(Column {
            index: column.header.index,
            header: column.header.name,
            target,
            factor,
            derivative,
            statuses,
            cell_unit,
        });
    }
    if !missing.is_empty() {
        let all: Vec<String> = missing.iter().map(|(column, what)| format!("{column} {what}")).collect();
        bail!("{place}: {}", all.join("; "));
    }
    let (shown, dates_by_steps) =
        if mapping.dates.is_some() { (None, None) } else { date_order(table, &columns, decimal) };
    let dates = mapping.dates.or(shown).or(dates_by_steps);
    Ok(Plan { columns, left, decimal, dates, dates_by_steps, probes })
}

/// The same for a file that is read without options.
fn in_header(what: &str) -> String {
    let lacks = what.split(", expected").next().unwrap_or_default();
    format!("{lacks}, expected that in its header, such as `Fan DE [um pp]`")
}

/// Whether there is a speed, and for each probe both parts of its vibration.
fn whole(
    table: &ReadingTable,
    assigned: &[AssignedColumn],
    left: &[UnusedColumn],
    mapping: &Mapping,
) -> Result<()> {
    let place = format!("{}: row {}", table.sheet.place(), table.header_row);
    let vibration: Vec<&Target> =
        assigned.iter().map(|c| &c.target).filter(|t| t.quantity.is_vibration()).collect();
    if vibration.is_empty() {
        let why = left.iter().map(|l| format!("`{}` ({})", l.header, l.why)).collect::<Vec<_>>().join(", ");
        bail!(
            "{place}: no column is a 1x vibration, expected amplitude and phase of a probe; left are {why}"
        );
    }
    let names = || listed(table.columns.iter().map(|c| format!("`{}`", c.name)));
    if mapping.speed_rpm.is_none() && !assigned.iter().any(|c| c.target.quantity == Quantity::Speed) {
        bail!(
            "{place}: no column is a speed, expected one, --column \"NAME=speed:rpm\" or --speed-rpm; there are {}",
            names()
        );
    }
    let all: HashSet<(Quantity, Option<&str>)> =
        vibration.iter().map(|t| (t.quantity, t.probe.as_deref())).collect();
    for target in &vibration {
        use Quantity::{Amplitude, Cos, Imaginary, Phase, Real, Sin};
        let other = match target.quantity {
            Amplitude => Phase,
            Phase => Amplitude,
            Cos => Sin,
            Sin => Cos,
            Real => Imaginary,
            _ => Real,
        };
        let is_whole = mapping.amplitudes_alone && target.quantity == Amplitude;
        if !is_whole && !all.contains(&(other, target.probe.as_deref())) {
            let of = target.probe.as_deref().map_or(String::new(), |probe| format!(" of {probe}"));
            let is_alone = vibration.iter().all(|other| other.quantity == Amplitude);
            let help = if is_alone {
                "; of amplitudes alone, `rotor-edge balance --trial-only` makes a balance"
            } else {
                ""
            };
            bail!(
                "{place}: there is the {}{of} and no {}, expected both, or --column \"NAME=left\"{help}",
                target.quantity.name(),
                other.name()
            );
        }
    }
    Ok(())
}

/// What a column needs to be stated, from everywhere, and its factor; or what is missing, with the option for it.
fn complete(
    column: &AssignedColumn,
    stated: ColumnUnits,
    mapping: &Mapping,
    above: &Preamble,
    largest: impl Fn() -> f64,
) -> std::result::Result<Factor, String> {
    let name = &column.header.name;
    let quantity = column.target.quantity;
    let owner = ColumnUnits {
        length: mapping.unit,
        detection: mapping.amplitude,
        sense: mapping.phase,
        angle: mapping.angle,
        ..ColumnUnits::default()
    };
    let stated = if quantity == Quantity::Gap { stated } else { stated.or(owner).or(above.stated) };
    let mut stated = of_quantity(quantity, stated);
    if matches!(quantity, Quantity::Cos | Quantity::Sin) && name.ends_with("_um") {
        stated.detection = stated.detection.or(Some(Detection::ZeroToPeak));
    }
    if has_sense(quantity) && stated.sense.is_none() {
        return Err("says neither lag nor lead, expected --lag or --lead".into());
    }
    let mut derivative = 0;
    let factor = match quantity {
        Quantity::Speed => speed_factor(&mut stated, name, largest)?,
        Quantity::Phase => phase_factor(&mut stated, largest)?,
        Quantity::Gap => gap_factor(&mut stated),
        Quantity::Condition => stated.condition.map(|unit| unit.factor).ok_or_else(|| {
            format!("is a condition without a unit, expected --column \"{name}=NAME:condition:degC\", bar, MW or percent")
        })?,
        quantity if quantity.is_vibration() => {
            if column.is_derivative && stated.length.is_some_and(Unit::is_displacement) {
                return Err("is a velocity or an acceleration, expected --unit mm/s, in/s, m/s2 or g".into());
            }
            let of_probe = mapping.sensitivity_mv_um.map(Sensitivity::of_probe);
            let owner = mapping.sensitivity.or(of_probe);
            let sensitivity = owner.or(column.sensitivity).or(above.sensitivity);
            let (factor, of) = vibration_factor(quantity, &stated, sensitivity)?;
            derivative = of;
            factor
        }
        _ => 1.0,
    };
    Ok(Factor { stated, factor, derivative })
}

/// What a column states once it is complete, and what its numbers are multiplied by.
struct Factor {
    stated: ColumnUnits,
    factor: f64,
    derivative: u8,
}

/// Whether lag or lead matters to a quantity.
fn has_sense(quantity: Quantity) -> bool {
    matches!(quantity, Quantity::Phase | Quantity::Real | Quantity::Imaginary)
}

/// The conventions that concern a quantity: one that is stated of another says nothing of it.
fn of_quantity(quantity: Quantity, mut stated: ColumnUnits) -> ColumnUnits {
    if !has_sense(quantity) {
        stated.sense = None;
    }
    if quantity != Quantity::Phase {
        stated.angle = None;
    }
    if !quantity.is_of_probe() || quantity == Quantity::Phase {
        (stated.length, stated.detection) = (None, None);
    }
    if quantity != Quantity::Time {
        stated.time = None;
    }
    if quantity != Quantity::Speed {
        stated.speed = None;
    }
    if quantity != Quantity::Condition {
        stated.condition = None;
    }
    stated
}

/// To rpm; a speed without a unit is in rpm, unless it is so slow that it may be in Hz.
fn speed_factor(
    stated: &mut ColumnUnits,
    name: &str,
    largest: impl Fn() -> f64,
) -> std::result::Result<f64, String> {
    if stated.speed.is_none() && largest() < SLOWEST_RPM {
        return Err(format!(
            "no speed is above {} and no unit is stated, expected --column \"{name}=speed:rpm\" or speed:Hz",
            largest()
        ));
    }
    let unit = stated.speed.get_or_insert(SpeedUnit::Rpm);
    // revolutions, and radians of an angular speed
    if *unit == SpeedUnit::PerSecond && is_angular(name) {
        *unit = SpeedUnit::RadS;
    }
    Ok(unit.rpm())
}

fn is_angular(name: &str) -> bool {
    let lower = name.to_lowercase();
    ["omega", "ω", "angular", "winkelgeschw"].iter().any(|word| lower.contains(word))
}

/// To radians of phase lag; a phase without a unit is in degrees, unless all of it lies within a turn in radians.
fn phase_factor(stated: &mut ColumnUnits, largest: impl Fn() -> f64) -> std::result::Result<f64, String> {
    if stated.angle.is_none() && largest() <= 2.0 * std::f64::consts::PI {
        return Err("may be degrees or radians, expected --angle degrees or --angle radians".into());
    }
    let angle = *stated.angle.get_or_insert(Angle::Degrees);
    let sign = if stated.sense == Some(Sense::Lag) { 1.0 } else { -1.0 };
    Ok(sign * angle.radians())
}

fn gap_factor(stated: &mut ColumnUnits) -> f64 {
    let unit = *stated.length.get_or_insert(Unit::Volt);
    stated.detection = None;
    if unit == Unit::Millivolt { 1e-3 } else { 1.0 }
}

/// To µm, µm/s or µm/s² zero-to-peak, of an imaginary part that lags; and which derivative that is.
fn vibration_factor(
    quantity: Quantity,
    stated: &ColumnUnits,
    sensitivity: Option<Sensitivity>,
) -> std::result::Result<(f64, u8), String> {
    let no_unit = "states no unit, expected --unit um, --unit mil, --unit mm/s or the like";
    let no_detection = "does not state pk-pk, 0-pk or rms, expected --pp, --zero-peak or --rms";
    let (length, detection) = match (stated.length, stated.detection) {
        (Some(length), Some(detection)) => (length, detection),
        (Some(_), None) => return Err(no_detection.into()),
        (None, Some(_)) => return Err(no_unit.into()),
        (None, None) => return Err(format!("{no_unit}, and {no_detection}")),
    };
    let Some(vibration) = length.vibration(sensitivity) else {
        return Err("is a voltage, expected --sensitivity-mv-um, or --sensitivity \"100 mV/g\"".into());
    };
    let leads = stated.sense == Some(Sense::Lead) && quantity == Quantity::Imaginary;
    let sign = if leads { -1.0 } else { 1.0 };
    Ok((sign * vibration.size * detection.zero_to_peak(), vibration.derivative))
}

fn decimal(table: &ReadingTable, assigned: &[AssignedColumn]) -> Result<Decimal> {
    let numeric =
        |c: &&AssignedColumn| c.target.quantity.is_of_probe() || c.target.quantity == Quantity::Speed;
    let columns: Vec<usize> = assigned.iter().filter(numeric).map(|c| c.header.index).collect();
    let shown = table.rows.of_blocks(|rows| {
        let mut seen = number::DecimalMarks::default();
        rows.for_each(|row| columns.iter().filter_map(|c| row.cell(*c).as_text()).for_each(|t| seen.add(t)));
        seen
    });
    let seen = shown.into_iter().fold(number::DecimalMarks::default(), number::DecimalMarks::or);
    let with = |signs: &'static [char]| {
        let text = |row: &SheetRow| {
            columns
                .iter()
                .filter_map(|c| row.cell(*c).as_text())
                .find(|t| t.contains(signs))
                .map(str::to_string)
        };
        table.rows.find_map(text)
    };
    let place = table.sheet.place();
    match seen.shows() {
        DecimalEvidence::Surely(decimal) => Ok(decimal),
        DecimalEvidence::Either if table.sheet.separator == Some(',') && with(&[',']).is_none() => {
            Ok(Decimal::Point)
        }
        DecimalEvidence::Either => {
            let example = with(&[',', '.']).unwrap_or_default();
            bail!(
                "{place}: \"{example}\" may be a decimal or thousands, expected --decimal comma or --decimal point"
            )
        }
        DecimalEvidence::Both => bail!(
            "{place}: some numbers have a decimal comma and some a point, expected --decimal comma or --decimal point"
        ),
    }
}

/// The order that a date shows, else the one that the steps between dates show.
fn date_order(
    table: &ReadingTable,
    columns: &[Column],
    decimal: Decimal,
) -> (Option<DateOrder>, Option<DateOrder>) {
    let column = |quantity: Quantity| columns.iter().find(|c| c.target.quantity == quantity).map(|c| c.index);
    let Some(time) = column(Quantity::Time) else { return (None, None) };
    // of dates that have one reading by their form, a first one stands for all
    let shown = |row: &SheetRow| {
        let text = row.cell(time).as_text()?;
        // nor do numbers of days or seconds have an order
        if number::plain(text, decimal).is_some() && text.len() != COMPACT_DATE {
            return Some(None);
        }
        let is_plain = matches!(calendar::of_text(text, None), ParsedMoment::Moment(_));
        let order = calendar::order_shown(text);
        (is_plain || order.is_some()).then_some(order)
    };
    match table.rows.find_map(shown) {
        Some(order) => (order, None),
        None => (None, order_of_steps(table, time, column(Quantity::Clock))),
    }
}
