//! `[[material]]`: what shaft segments and disks are made of, by name.
//!
//! A name stands for three numbers and for nothing else, so each segment gets its numbers before the machine is read.

use std::ops::Range;

use serde::Deserialize;
use toml::de::{DeTable, DeValue};

/// What a segment gets from its material; a disk gets its density alone.
const NUMBERS: [&str; 3] = ["youngs_modulus_pa", "density_kg_m3", "poisson_ratio"];
/// What a segment is made of that names no material.
const USUAL: &str = "steel";

/// A material as a file states it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Material {
    pub(super) name: String,
    pub(super) youngs_modulus_pa: f64,
    pub(super) density_kg_m3: f64,
    pub(super) poisson_ratio: f64,
}

/// Takes the materials out of a file and puts their numbers into the segments that name them; returns them.
pub(super) fn resolve<'i>(root: &mut DeTable<'i>) -> Result<Vec<Material>, (Range<usize>, String)> {
    let mut stated = Vec::new();
    if let Some(list) = root.remove("material") {
        let whole = list.span();
        let DeValue::Array(list) = list.into_inner() else {
            return Err((whole, "material is no list, expected [[material]]".into()));
        };
        for one in list {
            let span = one.span();
            let read = Material::deserialize(toml::de::ValueDeserializer::from(one.clone()));
            let material = read.map_err(|e| (e.span().unwrap_or(span.clone()), e.message().into()))?;
            stated.push((material, one.into_inner()));
        }
    }
    for (table, numbers) in [("shaft", &NUMBERS[..]), ("disk", &NUMBERS[1..2])] {
        let pieces = root.get_mut(table).map(toml::Spanned::get_mut);
        let Some(DeValue::Array(pieces)) = pieces else { continue };
        for piece in pieces.iter_mut().map(toml::Spanned::get_mut) {
            if let DeValue::Table(piece) = piece {
                fill(table, piece, numbers, &stated)?;
            }
        }
    }
    Ok(taken(stated))
}

/// Puts the numbers of the material that a segment or disk names in its place.
fn fill<'i>(
    table: &str,
    piece: &mut DeTable<'i>,
    numbers: &[&str],
    stated: &[(Material, DeValue<'i>)],
) -> Result<(), (Range<usize>, String)> {
    let Some(name) = piece.remove("material") else { return Ok(()) };
    let span = name.span();
    let refused = |what: String| Err((span.clone(), what));
    let Some(name) = name.get_ref().as_str() else {
        return refused(format!("material of a [[{table}]] is no text, expected the name of a [[material]]"));
    };
    if let Some(own) = numbers.iter().find(|key| piece.contains_key(**key)) {
        return refused(format!(
            "a [[{table}]] has both material = \"{name}\" and {own}, expected one of the two"
        ));
    }
    match stated.iter().find(|(material, _)| material.name == name) {
        Some((_, DeValue::Table(all))) => {
            let all = all.iter().map(|(key, value)| (key.clone(), value.clone()));
            piece.extend(all.filter(|(key, _)| numbers.contains(&key.get_ref().as_ref())));
            Ok(())
        }
        None if name == USUAL => Ok(()),
        _ => {
            let known: Vec<String> = stated.iter().map(|(m, _)| format!("\"{}\"", m.name)).collect();
            let known = [known, vec![format!("\"{USUAL}\"")]].concat().join(", ");
            refused(format!("there is no material \"{name}\", expected one of {known}"))
        }
    }
}

fn taken(stated: Vec<(Material, DeValue)>) -> Vec<Material> {
    stated.into_iter().map(|(material, _)| material).collect()
}
