//! Lists of names that other programs rely on: `place: name name …`, a line a place.

use std::collections::{BTreeMap, BTreeSet};

use super::kept;

/// `record` adds names that are not listed yet; it never removes one.
const MODE: &str = "ROTOR_EDGE_COMPATIBILITY";

/// Names by the place where they stand.
pub type Names = BTreeMap<String, BTreeSet<String>>;

/// Fails if a listed name is gone. New names are no failure.
#[track_caller]
pub fn assert_all_there(list: &str, present: &Names) {
    let path = kept(list);
    let mut listed = parse(&std::fs::read_to_string(&path).unwrap_or_default());
    let missing = missing(&listed, present);
    assert!(missing.is_empty(), "{list}: these names are gone:\n{}", missing.join("\n"));
    if std::env::var(MODE).is_ok_and(|mode| mode == "record") {
        for (place, names) in present {
            listed.entry(place.clone()).or_default().extend(names.iter().cloned());
        }
        std::fs::write(path, text(&listed)).unwrap();
    }
    assert!(!listed.is_empty(), "{list}: no names; {MODE}=record lists the present ones");
}

fn missing(listed: &Names, present: &Names) -> Vec<String> {
    let none = BTreeSet::new();
    let of_place = |(place, names): (&String, &BTreeSet<String>)| {
        let there = present.get(place).unwrap_or(&none);
        names.difference(there).map(|name| format!("{place}: {name}")).collect::<Vec<_>>()
    };
    listed.iter().flat_map(of_place).collect()
}

fn parse(text: &str) -> Names {
    let line = |line: &str| {
        let (place, names) = line.split_once(": ")?;
        Some((place.to_string(), names.split(' ').map(str::to_string).collect()))
    };
    text.lines().filter_map(line).collect()
}

fn text(names: &Names) -> String {
    let line = |(place, names): (&String, &BTreeSet<String>)| {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        format!("{place}: {}\n", names.join(" "))
    };
    names.iter().map(line).collect()
}

#[test]
fn list_of_names_lacks_only_what_is_gone() {
    let listed = parse("a: x y\nb: z\n");
    assert_eq!(parse(&text(&listed)), listed);
    assert_eq!(missing(&listed, &parse("a: w x y\nb: z\nc: v\n")), Vec::<String>::new());
    assert_eq!(missing(&listed, &parse("a: x\n")), ["a: y", "b: z"]);
}
