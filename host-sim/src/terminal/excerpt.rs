//! How much of a user's own text a sentence repeats.

/// Longest name or text of a user that a sentence repeats in full, characters.
const LONGEST_EXCERPT: usize = 80;
/// What is repeated of a longer one.
const EXCERPT: usize = 60;
/// Longest word that stands outside quotes, as a path does.
const LONGEST_WORD: usize = 300;
/// Longest sentence, with every list of what was expected.
const LONGEST_SENTENCE: usize = 2_000;

/// A sentence without what nobody reads: of long texts between quotes and of long words the beginning stands for all.
pub fn excerpted(sentence: &str) -> String {
    let mut short = String::new();
    for (i, part) in sentence.split('"').enumerate() {
        if i > 0 {
            short.push('"');
        }
        // every other part is between quotes
        let is_quoted = i % 2 == 1;
        if is_quoted && part.chars().count() > LONGEST_EXCERPT {
            short += &beginning(part, EXCERPT);
            continue;
        }
        for (j, word) in part.split(' ').enumerate() {
            if j > 0 {
                short.push(' ');
            }
            let is_long = word.chars().count() > LONGEST_WORD;
            short += &if is_long { beginning(word, EXCERPT) } else { word.into() };
        }
    }
    if short.chars().count() > LONGEST_SENTENCE { beginning(&short, LONGEST_SENTENCE) } else { short }
}

/// Longest list of names from a user's file, characters.
const LONGEST_LIST: usize = 200;

/// Names from a user's file: the first ones, and how many follow.
pub fn listed(names: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let (mut list, mut left) = (String::new(), 0);
    for (i, name) in names.into_iter().enumerate() {
        let name = name.as_ref();
        let name =
            if name.chars().count() > LONGEST_EXCERPT { beginning(name, EXCERPT) } else { name.into() };
        if left > 0 || (i > 0 && list.chars().count() + name.chars().count() > LONGEST_LIST) {
            left += 1;
            continue;
        }
        list += if i > 0 { ", " } else { "" };
        list += &name;
    }
    if left > 0 { format!("{list} and {left} more") } else { list }
}

fn beginning(text: &str, characters: usize) -> String {
    text.chars().take(characters).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_list_of_names_is_cut_and_counted() {
        assert_eq!(listed(["a", "b"]), "a, b");
        let names: Vec<String> = (0..1000).map(|n| format!("P{n:03}")).collect();
        let list = listed(&names);
        assert!(list.starts_with("P000, P001, ") && list.chars().count() < 220, "{list}");
        let shown = list.matches('P').count();
        assert!(list.ends_with(&format!(" and {} more", 1000 - shown)), "{list}");
        let list = listed(["x".repeat(5000), "y".repeat(5000), "z".repeat(5000), "w".repeat(5000)]);
        assert!(list.chars().count() < 220 && list.ends_with(" and 1 more"), "{list}");
    }

    #[test]
    fn long_text_of_a_user_is_repeated_in_part() {
        let long = "x".repeat(10_000);
        let sentence = excerpted(&format!("m.csv: row 3: \"{long}\" is no number, expected \"1.5\""));
        assert_eq!(sentence, format!("m.csv: row 3: \"{}…\" is no number, expected \"1.5\"", &long[..60]));
        assert_eq!(excerpted(&format!("--order {long}: no")), format!("--order {}… no", &long[..60]));
        let words = excerpted(&format!("\"{}\" is odd", "a b ".repeat(5_000)));
        assert!(words.chars().count() < 100 && words.ends_with("…\" is odd"), "{words}");
        let list = format!("expected one of {}", "probe 1, ".repeat(1_000));
        assert_eq!(excerpted(&list).chars().count(), LONGEST_SENTENCE + 1);
        let plain = "r.toml: [[disk]] \"wheel\" mass_kg: -1 is outside 0 to 1e6 kg";
        assert_eq!(excerpted(plain), plain);
    }
}
