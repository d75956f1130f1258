//! Compares recorded text with the present text: words exactly, numbers as numbers.

use super::difference::Difference;
use super::token::{Token, tokens, without_numbers};
use super::tolerance::{Class, ROUNDING_GROWTH};

/// Words before an integer that names something.
const NAMING: [&str; 15] = [
    "bearing", "bearings", "case", "column", "day", "disk", "hole", "line", "monitor", "node", "plane",
    "probe", "row", "run", "wheel",
];
/// Words behind an integer that is a rounded quantity.
const UNITS: [&str; 22] = [
    "%", "°", "g·mm", "rpm", "µm", "mm", "kg", "g", "N", "W", "s", "d", "V", "Hz", "days", "µm,", "g·mm,",
    "rpm,", "mm/s", "°,", "σ", "to",
];
/// Words before such an integer.
const BEFORE_QUANTITY: [&str; 3] = ["±", "to", "→"];

/// Differences of a text of many lines; places are lines of the present text. In lines with one of the
/// words in `rounding`, numbers are rounding errors themselves.
pub fn compare(recorded: &str, now: &str, class: Class, rounding: &[String]) -> Vec<Difference> {
    let (before, after): (Vec<&str>, Vec<&str>) = (recorded.lines().collect(), now.lines().collect());
    let steps = align(&before, &after);
    let is_same_words = steps.iter().all(|step| matches!(step, Step::Both(..)));
    // a number that is one character longer can move a word to the next line
    if !is_same_words && without_numbers(recorded) == without_numbers(now) && recorded.len() != now.len() {
        return numbers(recorded, now, class, "whole text");
    }
    let line = |index: usize| format!("line {}", index + 1);
    let found = steps.into_iter().flat_map(|step| match step {
        Step::Both(i, j) if rounding.iter().any(|words| after[j].contains(words.as_str())) => {
            growth(before[i], after[j], &line(j))
        }
        Step::Both(i, j) => numbers(before[i], after[j], class, &line(j)),
        Step::Recorded(i, j) => vec![Difference::exact(&line(j), before[i], "no such line")],
        Step::Now(j) => vec![Difference::exact(&line(j), "no such line", after[j])],
    });
    found.collect()
}

/// Differences of one string; a name without spaces has to be equal.
pub fn compare_sentence(recorded: &str, now: &str, class: Class, place: &str) -> Vec<Difference> {
    let is_sentence = recorded.contains(' ') && without_numbers(recorded) == without_numbers(now);
    match (recorded == now, is_sentence) {
        (true, _) => Vec::new(),
        (false, true) => numbers(recorded, now, class, place),
        (false, false) => vec![Difference::exact(place, recorded, now)],
    }
}

/// Differences in the numbers of two texts with the same words.
fn numbers(recorded: &str, now: &str, class: Class, place: &str) -> Vec<Difference> {
    let (before, after) = (tokens(recorded), tokens(now));
    let differs = |index: usize| -> Option<f64> {
        let (Token::Number { value: a, .. }, Token::Number { value: b, unit, is_integer, .. }) =
            (&before[index], &after[index])
        else {
            return None;
        };
        let allowed = match *is_integer && is_exact(&after, index, class) {
            true => 0.0,
            false => unit * (1.0 + 1e-6) + class.relative_in_text() * a.abs(),
        };
        ((a - b).abs() > allowed).then_some(allowed)
    };
    match (0..before.len()).find_map(differs) {
        Some(allowed) => vec![Difference::number(place, recorded.trim_end(), now.trim_end(), allowed)],
        None => Vec::new(),
    }
}

/// A line whose numbers are rounding errors, if one of them has grown.
fn growth(recorded: &str, now: &str, place: &str) -> Vec<Difference> {
    let has_grown = |(before, after): (Token, Token)| match (before, after) {
        (Token::Number { value: a, unit, .. }, Token::Number { value: b, .. }) => {
            b.abs() > ROUNDING_GROWTH * a.abs().max(unit)
        }
        _ => false,
    };
    match tokens(recorded).into_iter().zip(tokens(now)).any(has_grown) {
        true => vec![Difference::exact(place, recorded, now)],
        false => Vec::new(),
    }
}

/// Whether an integer counts or names something.
fn is_exact(all: &[Token], index: usize, class: Class) -> bool {
    let word = |index: Option<usize>| match index.and_then(|i| all.get(i)) {
        Some(Token::Word(word)) => word.trim_matches([':', '(', ')', ';', '"']),
        _ => "",
    };
    let (before, behind) = (word(index.checked_sub(1)), word(Some(index + 1)));
    match class {
        Class::Direct => !UNITS.contains(&behind) && !BEFORE_QUANTITY.contains(&before),
        Class::Fitted | Class::Sampled => NAMING.contains(&before) && !UNITS[..3].contains(&behind),
    }
}

enum Step {
    /// Lines with the same words.
    Both(usize, usize),
    /// A line that is recorded only, and where it would be now.
    Recorded(usize, usize),
    /// A line that is there now only.
    Now(usize),
}

/// Longest common subsequence of the lines' words.
fn align(before: &[&str], after: &[&str]) -> Vec<Step> {
    let words = |lines: &[&str]| lines.iter().map(|line| without_numbers(line)).collect::<Vec<_>>();
    let (a, b) = (words(before), words(after));
    let width = b.len() + 1;
    let mut longest = vec![0_u32; (a.len() + 1) * width];
    for i in (0..a.len()).rev() {
        for j in (0..b.len()).rev() {
            longest[i * width + j] = match a[i] == b[j] {
                true => 1 + longest[(i + 1) * width + j + 1],
                false => longest[(i + 1) * width + j].max(longest[i * width + j + 1]),
            };
        }
    }
    let (mut i, mut j, mut steps) = (0, 0, Vec::new());
    while i < a.len() || j < b.len() {
        let is_recorded_next =
            j == b.len() || i < a.len() && longest[(i + 1) * width + j] >= longest[i * width + j + 1];
        if i < a.len() && j < b.len() && a[i] == b[j] {
            steps.push(Step::Both(i, j));
            (i, j) = (i + 1, j + 1);
        } else if is_recorded_next {
            steps.push(Step::Recorded(i, j));
            i += 1;
        } else {
            steps.push(Step::Now(j));
            j += 1;
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(class: Class, recorded: &str, now: &str) -> usize {
        compare(recorded, now, class, &[]).len()
    }

    #[test]
    fn last_digit_may_differ_by_one() {
        assert_eq!(count(Class::Direct, "  k_xx  1.5963e8  1.6 %", "  k_xx 1.5964e8  1.5 %"), 0);
        assert_eq!(count(Class::Direct, "k_xx 1.5963e8", "k_xx 1.5965e8"), 1);
        assert_eq!(count(Class::Fitted, "error 12345.6 µm", "error 12350.6 µm"), 0);
        assert_eq!(count(Class::Fitted, "error 12345.6 µm", "error 12395.6 µm"), 1);
    }

    #[test]
    fn integer_that_names_something_is_exact() {
        assert_eq!(count(Class::Sampled, "suspect bearing: 16", "suspect bearing: 15"), 1);
        assert_eq!(count(Class::Direct, "readings 451", "readings 452"), 1);
        assert_eq!(count(Class::Direct, "397 g·mm (379 to 414)", "398 g·mm (378 to 415)"), 0);
        assert_eq!(count(Class::Direct, "probe 15X", "probe 16X"), 2);
    }

    #[test]
    fn changed_added_and_lost_lines_are_shown() {
        let recorded = "Model\n  error 3.2 %\nNext: improve\n";
        let found = compare(recorded, "Model\n  misfit 3.2 %\nNext: improve\n", Class::Direct, &[]);
        let shown: Vec<(&str, &str)> = found.iter().map(|d| (d.recorded.as_str(), d.now.as_str())).collect();
        assert_eq!(shown, [("  error 3.2 %", "no such line"), ("no such line", "  misfit 3.2 %")]);
        assert_eq!(count(Class::Direct, recorded, "Model\nNext: improve\n"), 1);
        assert_eq!(count(Class::Direct, recorded, "Model\n  error 3.2 %\nNext: improve\nx\n"), 1);
    }

    #[test]
    fn printed_rounding_error_may_not_grow() {
        let rounding = ["largest gap".to_string()];
        let count = |now: &str| compare("  largest gap 2.0e-7", now, Class::Direct, &rounding).len();
        assert_eq!([count("  largest gap 3.1e-8"), count("  largest gap 4.0e-6")], [0, 1]);
    }

    #[test]
    fn longer_number_may_move_a_line_break() {
        assert_eq!(
            count(Class::Direct, "the error is 9.99 µm\nat last", "the error is 10.00\nµm at last"),
            0
        );
        assert_eq!(count(Class::Direct, "one two\nthree", "one\ntwo three"), 4);
    }
}
