//! Which column is what, before its units are asked for.

use std::cmp::Ordering;
use std::collections::{HashMap, HashSet};

use anyhow::{Context, Result, bail};

use super::mapping::Mapping;
use crate::ingest::calendar;
use crate::ingest::column_units::ColumnUnits;
use crate::ingest::conditions::{self, StatedCondition};
use crate::ingest::header::{Header, Meaning, meaning};
use crate::ingest::preamble;
use crate::ingest::probes::Probes;
use crate::ingest::sheet::{Cell, SheetRow};
use crate::ingest::table::ReadingTable;
use crate::ingest::target::{Quantity, Rule, Target};
use crate::ingest::unit::{Sensitivity, Unit};
use crate::ingest::words::Word;

/// The probe of a table of amplitudes without phase that names none.
const NAMELESS: &str = "vibration";

/// A column with what it holds.
#[derive(Debug, Clone)]
pub struct AssignedColumn {
    pub header: Header,
    pub target: Target,
    /// Whether the owner said so.
    pub by_rule: bool,
    /// Whether it says that it is the part at running speed.
    synchronous: bool,
    /// Whether it says no more than a unit: the vibration of a probe, at whatever frequency.
    unit_alone: bool,
    /// Whether it says that it is a velocity or an acceleration.
    pub is_derivative: bool,
    pub sensitivity: Option<Sensitivity>,
}

/// A column that is not needed.
#[derive(Debug, Clone, PartialEq)]
pub struct UnusedColumn {
    /// From 1.
    pub number: usize,
    pub header: String,
    pub why: String,
}

/// Every column of a table, as one that is needed or one that is left.
///
/// # Errors
/// One sentence with the columns if two of them are the same quantity, or the probe of one is not known.
pub fn assign(
    table: &ReadingTable,
    probes: &Probes,
    mapping: &Mapping,
) -> Result<(Vec<AssignedColumn>, Vec<UnusedColumn>)> {
    let mut assigned: Vec<AssignedColumn> = Vec::new();
    let mut left = Vec::new();
    for header in &table.columns {
        match one(table, header, probes, mapping)? {
            Ok(column) => assigned.push(column),
            Err(why) => left.push(leave(header, why)),
        }
    }
    let has_point = assigned.iter().any(|c| c.target.quantity == Quantity::Point);
    for column in assigned.iter_mut().filter(|c| c.target.quantity.is_of_probe() && c.target.probe.is_none())
    {
        if has_point {
            continue;
        }
        let above = preamble::stated(&table.above, Word::Point).and_then(|name| probes.named(name));
        let nameless = || mapping.amplitudes_alone.then(|| NAMELESS.to_string());
        let Some(name) = above.or_else(|| probes.named("")).or_else(nameless) else {
            bail!(
                "{}: {} names no probe, expected --column \"{}=PROBE:{}\"",
                table.sheet.place(),
                column.header.place(table),
                column.header.name,
                column.target.quantity.name(),
            );
        };
        column.target.probe = Some(name);
    }
    tell_conditions_apart(&mut assigned);
    pair_date_and_clock(table, &mut assigned, &mut left);
    choose(table, &mut assigned, &mut left)?;
    // without phases it is the owner's own choice which vibration is balanced
    if !mapping.amplitudes_alone {
        leave_overall(table, &mut assigned, &mut left)?;
    }
    Ok((assigned, left))
}

fn leave(header: &Header, why: impl Into<String>) -> UnusedColumn {
    UnusedColumn { number: header.index + 1, header: header.name.clone(), why: why.into() }
}

type Known = std::result::Result<AssignedColumn, String>;

/// The column that the owner states a rule for.
fn by_rule(
    header: &Header,
    rule: &Rule,
    said: &Meaning,
    condition: Option<&StatedCondition>,
    probes: &Probes,
) -> Result<Known> {
    if rule.to.quantity == Quantity::Left {
        return Ok(Err("as stated".into()));
    }
    let mut stated = rule.to.stated.or(said.stated);
    if let Some(StatedCondition::Known(_, unit)) = condition {
        stated.condition.get_or_insert(*unit);
    }
    if let (Some(name), Some(of_rotor)) = (&rule.to.probe, &probes.of_rotor)
        && rule.to.quantity.is_of_probe()
        && !of_rotor.contains(name)
    {
        bail!(
            "--column \"{}={}\": the rotor has no probe {name}, expected {}",
            rule.from,
            rule.to,
            of_rotor.join(", ")
        );
    }
    let probe = match &rule.to.probe {
        Some(name) => Some(name.clone()),
        None if rule.to.quantity.is_of_probe() => probes.named(&said.name),
        None if rule.to.quantity == Quantity::Condition => condition.map(|c| c.name().to_string()),
        None => None,
    };
    let target = Target { probe, stated, quantity: rule.to.quantity };
    Ok(Ok(AssignedColumn {
        header: header.clone(),
        target,
        by_rule: true,
        synchronous: true,
        unit_alone: false,
        // the owner knows better
        is_derivative: said.is_derivative && rule.to.stated.length.is_none(),
        sensitivity: said.sensitivity,
    }))
}

fn one(table: &ReadingTable, header: &Header, probes: &Probes, mapping: &Mapping) -> Result<Known> {
    let said = meaning(&header.text(), |word| probes.is_probe(word));
    // the group may be that of probes to the left
    let condition = conditions::stated(&[header.name.as_str(), &header.unit].join(" "));
    if let Some(rule) = mapping.column.iter().find(|rule| header.is(&rule.from)) {
        return by_rule(header, rule, &said, condition.as_ref(), probes).with_context(|| table.sheet.place());
    }
    if header.name.is_empty() {
        return Ok(Err("it has no header".into()));
    }
    // "temps" is the time in French
    let is_time = said.quantity == Some(Quantity::Time) && said.name.is_empty();
    if let Some(condition) = condition.filter(|_| !said.is_status && !said.synchronous && !is_time) {
        return Ok(of_condition(header, condition));
    }
    let quantity = if said.is_status { Some(Quantity::Status) } else { said.quantity };
    let Some(quantity) = quantity else { return Ok(Err("not recognised".into())) };
    if let Some(why) = said.not_needed.filter(|_| quantity.is_of_probe()) {
        return Ok(Err(why.into()));
    }
    // a time, a probe or a machine of one's own has no further name
    let is_bare = said.name.is_empty();
    if matches!(quantity, Quantity::Run | Quantity::Point | Quantity::Machine) && !is_bare {
        return Ok(Err("not recognised".into()));
    }
    if quantity == Quantity::Gap && !is_voltage(&said) {
        return Ok(Err("a position, no gap voltage".into()));
    }
    if said.contradicts {
        bail!("{}: {} states two units that contradict each other", table.sheet.place(), header.place(table));
    }
    let mut probe = None;
    if quantity.is_of_probe() && !is_bare {
        let Some(name) = probes.named(&said.name) else {
            return Ok(Err(format!("\"{}\" is no probe of the rotor", said.name)));
        };
        probe = Some(name);
    }
    let unit_alone = quantity == Quantity::Amplitude && said.by_unit && !said.synchronous;
    let target = Target { probe, quantity, stated: said.stated };
    Ok(Ok(AssignedColumn {
        header: header.clone(),
        target,
        by_rule: false,
        synchronous: said.synchronous,
        unit_alone,
        is_derivative: said.is_derivative,
        sensitivity: said.sensitivity,
    }))
}

/// A column that is a condition of operation, or why it is left.
fn of_condition(header: &Header, condition: StatedCondition) -> Known {
    let (name, unit) = match condition {
        StatedCondition::Known(name, unit) => (name, unit),
        StatedCondition::WithoutUnit(name) => {
            return Err(format!(
                "a condition without a unit; --column \"{}={name}:condition:UNIT\" states one",
                header.name
            ));
        }
    };
    let stated = ColumnUnits { condition: Some(unit), ..ColumnUnits::default() };
    let target = Target { probe: Some(name), quantity: Quantity::Condition, stated };
    Ok(AssignedColumn {
        header: header.clone(),
        target,
        by_rule: false,
        synchronous: false,
        unit_alone: false,
        is_derivative: false,
        sensitivity: None,
    })
}

/// Names of conditions that several columns have get the column's number.
fn tell_conditions_apart(assigned: &mut [AssignedColumn]) {
    let mut taken: HashSet<Option<String>> = HashSet::new();
    for column in assigned.iter_mut().filter(|c| c.target.quantity == Quantity::Condition) {
        if column.target.probe.is_none() {
            column.target.probe = Some(format!("condition_{}", column.header.index + 1));
        }
        if !taken.insert(column.target.probe.clone()) {
            let number = column.header.index + 1;
            column.target.probe = column.target.probe.as_ref().map(|name| format!("{name}_{number}"));
            taken.insert(column.target.probe.clone());
        }
    }
}

fn is_voltage(said: &Meaning) -> bool {
    said.stated.length.is_none_or(Unit::is_voltage)
}

/// A column with the date and one with the clock are one moment; of several moments the first is taken.
fn pair_date_and_clock(
    table: &ReadingTable,
    assigned: &mut Vec<AssignedColumn>,
    left: &mut Vec<UnusedColumn>,
) {
    let is_clock = |column: &AssignedColumn| {
        let filled = |row: &SheetRow| {
            Some(row.cell(column.header.index)).filter(|c| !c.is_empty()).map(|c| c.clone().into_owned())
        };
        match &table.rows.find_map(filled) {
            Some(Cell::Text(text)) => calendar::clock(&text.split_whitespace().collect::<Vec<_>>()).is_some(),
            Some(Cell::Number(part)) => (0.0..1.0).contains(part) && column.target.stated.time.is_none(),
            Some(Cell::Time(time)) => time.year() <= 1900,
            _ => false,
        }
    };
    let times: Vec<usize> =
        (0..assigned.len()).filter(|i| assigned[*i].target.quantity == Quantity::Time).collect();
    let clock = times.iter().copied().find(|i| times.len() > 1 && is_clock(&assigned[*i]));
    let date = times.iter().copied().find(|i| Some(*i) != clock);
    if let Some(clock) = clock {
        assigned[clock].target.quantity = Quantity::Clock;
    }
    let mut index = 0;
    assigned.retain(|column| {
        let keep = column.target.quantity != Quantity::Time || Some(index) == date;
        index += 1;
        if !keep {
            left.push(leave(&column.header, "a further time"));
        }
        keep
    });
}

/// Of several columns of one quantity the one that says most of itself.
fn choose(
    table: &ReadingTable,
    assigned: &mut Vec<AssignedColumn>,
    left: &mut Vec<UnusedColumn>,
) -> Result<()> {
    let weight = |c: &AssignedColumn| (c.by_rule, c.synchronous, !c.is_derivative, c.header.name.len() <= 5);
    let mut best: HashMap<(Quantity, Option<String>), AssignedColumn> = HashMap::new();
    let mut equals = Vec::new();
    let key = |c: &AssignedColumn| (c.target.quantity, c.target.probe.clone());
    // several columns may each say that another one is valid
    for column in assigned.iter().filter(|c| c.target.quantity != Quantity::Status) {
        let Some(rival) = best.get(&key(column)) else {
            best.insert(key(column), column.clone());
            continue;
        };
        match weight(column).cmp(&weight(rival)) {
            Ordering::Less => (),
            Ordering::Equal => equals.push((rival.clone(), column.clone())),
            Ordering::Greater => {
                best.insert(key(column), column.clone());
            }
        }
    }
    let is_best = |c: &AssignedColumn| best.get(&key(c)).is_none_or(|b| b.header.index == c.header.index);
    if let Some((rival, column)) = equals.iter().find(|(rival, _)| is_best(rival)) {
        let probe = column.target.probe.as_deref().map_or(String::new(), |probe| format!(" of {probe}"));
        bail!(
            "{}: {} and {} are both the {}{probe}, expected --column \"NAME=left\" for one of them",
            table.sheet.place(),
            rival.header.place(table),
            column.header.place(table),
            column.target.quantity.name(),
        );
    }
    assigned.retain(|column| {
        let is_best = is_best(column);
        if !is_best {
            left.push(leave(&column.header, "another column says more of itself"));
        }
        is_best
    });
    Ok(())
}

/// An amplitude that does not say of what may be of all frequencies together: left, unless a phase would go with it.
fn leave_overall(
    table: &ReadingTable,
    assigned: &mut Vec<AssignedColumn>,
    left: &mut Vec<UnusedColumn>,
) -> Result<()> {
    let phases = assigned.iter().filter(|c| c.target.quantity == Quantity::Phase);
    let with_phase: HashSet<Option<String>> = phases.map(|c| c.target.probe.clone()).collect();
    if let Some(column) = assigned.iter().find(|c| c.unit_alone && with_phase.contains(&c.target.probe)) {
        let (place, name) = (table.sheet.place(), &column.header.name);
        bail!(
            "{place}: {} may be the vibration at all frequencies, expected --column \"{name}={}\" or \"{name}=left\"",
            column.header.place(table),
            Target { stated: Default::default(), ..column.target.clone() },
        );
    }
    assigned.retain(|column| {
        if column.unit_alone {
            left.push(leave(&column.header, "not said to be the vibration at running speed"));
        }
        !column.unit_alone
    });
    left.sort_by_key(|l| l.number);
    Ok(())
}

impl Header {
    /// Row and column as messages name it.
    pub fn place(&self, table: &ReadingTable) -> String {
        format!("row {}, column {} `{}`", table.header_row, self.index + 1, self.name)
    }
}
