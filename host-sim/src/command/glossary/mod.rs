//! Words of the program with their meanings: terms, verdicts, states and physical effects.

mod spelling;
mod terms;
mod words;

use rotor_edge_core::state::Reason;
use rotor_edge_desktop::effects::{self, Effect, Knowledge};

use crate::bus::states::name;
use crate::watch::reasons::{Why, why};
use spelling::OTHER_SPELLINGS;
use terms::TERMS;
pub use words::Kind;
use words::{VERDICTS_AND_STATES, Word};

/// The glossary but for the effects and reasons, which are explained where they are defined.
pub fn words() -> impl Iterator<Item = &'static Word> {
    VERDICTS_AND_STATES.iter().chain(TERMS)
}

/// What is said of a word.
pub struct Explained {
    pub name: String,
    pub kind: &'static str,
    pub paragraphs: Vec<String>,
    pub next: &'static str,
}

/// Letters and digits alone, so that spelling does not matter.
fn plain(word: &str) -> String {
    word.to_lowercase().chars().filter(|c| c.is_alphanumeric() || matches!(c, '%' | '/' | '²')).collect()
}

pub fn explained(asked: &str) -> Option<Explained> {
    // an effect's place is no part of its name
    let asked = plain(asked.split('@').next().unwrap_or_default());
    let effect = effects::ALL.into_iter().find(|e| plain(e.name()) == asked);
    let is_other = |name: &str| {
        OTHER_SPELLINGS.iter().any(|(term, others)| *term == name && others.iter().any(|o| plain(o) == asked))
    };
    let is_it = |w: &&Word| {
        plain(w.name) == asked || w.also.iter().any(|also| plain(also) == asked) || is_other(w.name)
    };
    let reason = || Reason::ALL.into_iter().find(|reason| plain(&name(reason)) == asked);
    let word = words().find(is_it).map(of_word);
    word.or_else(|| effect.map(of_effect)).or_else(|| reason().map(of_reason))
}

/// The words of a text that a newcomer may not know, with what they mean.
pub fn said_in(text: &str) -> Vec<(String, String)> {
    let spaced = |text: &str| {
        let words: Vec<String> = text.split(|c: char| !c.is_alphanumeric()).map(str::to_lowercase).collect();
        format!(" {} ", words.into_iter().filter(|w| !w.is_empty()).collect::<Vec<_>>().join(" "))
    };
    let text = spaced(text);
    // a letter alone is rarely the one that is meant
    let is_said = |name: &str| name.len() > 1 && text.contains(&spaced(name));
    let words = words().filter(|w| w.kind != Kind::State);
    let words =
        words.filter(|w| std::iter::once(&w.name).chain(w.also).any(|name| is_said(name))).map(of_word);
    let effects = effects::ALL.into_iter().filter(|e| is_said(e.name())).map(of_effect);
    words.chain(effects).map(|found| (found.name.replace('_', " "), found.paragraphs.join(" "))).collect()
}

fn of_effect(effect: &dyn Effect) -> Explained {
    let Knowledge { what, means, inspect } = effect.knowledge();
    let paragraphs = [what, means].map(String::from).to_vec();
    Explained { name: effect.name().into(), kind: "physical effect", paragraphs, next: inspect }
}

fn of_reason(reason: Reason) -> Explained {
    let Why { what, next } = why(reason, 0);
    let paragraphs = vec![format!("Of a monitor's state: {what}.")];
    Explained { name: name(reason), kind: "reason of a state", paragraphs, next }
}

fn of_word(word: &Word) -> Explained {
    Explained {
        name: word.name.into(),
        kind: kind(word.kind),
        paragraphs: vec![word.what.into()],
        next: word.next,
    }
}

fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Verdict => "verdict of a diagnosis",
        Kind::State => "state of a monitor",
        Kind::Term => "term",
    }
}

/// Spellings of other terms in a text, each with the term that stands for it.
pub fn other_spellings_in(text: &str) -> Vec<(&'static str, &'static str)> {
    let words = |text: &str| {
        let is_part = |c: char| c.is_alphanumeric() || matches!(c, '-' | '²');
        let words: Vec<String> = text.split(|c| !is_part(c)).map(str::to_lowercase).collect();
        format!(" {} ", words.into_iter().filter(|w| !w.is_empty()).collect::<Vec<_>>().join(" "))
    };
    let text = words(text);
    let all = OTHER_SPELLINGS.iter().flat_map(|(term, others)| others.iter().map(|other| (*other, *term)));
    all.filter(|(other, _)| text.contains(&words(other))).collect()
}

pub fn not_known(asked: &str) -> String {
    let asked = plain(asked);
    let all = words().map(|w| w.name).chain(effects::ALL.into_iter().map(|e| e.name()));
    let near: Vec<&str> =
        all.filter(|name| plain(name).contains(&asked) || asked.contains(&plain(name))).collect();
    match near.is_empty() {
        true => "there is no such word; `rotor-edge explain` lists all words".to_string(),
        false => format!("there is no such word, expected one of {}", near.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use rotor_edge_core::state::NodeState;

    use super::*;

    #[test]
    fn glossary_explains_every_effect_verdict_and_state_once() {
        let mut names: Vec<String> = words()
            .flat_map(|w| std::iter::once(w.name).chain(w.also.iter().copied()))
            .chain(effects::ALL.into_iter().map(|e| e.name()))
            .map(plain)
            .collect();
        for name in &names {
            let found = explained(name).unwrap();
            assert!(found.paragraphs.iter().all(|p| p.ends_with('.')), "{name}");
        }
        names.sort();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
        let is_there =
            |name: String, kind: Kind| words().any(|w| w.kind == kind && plain(w.name) == plain(&name));
        assert!(NodeState::ALL.iter().all(|state| is_there(format!("{state:?}"), Kind::State)));
        for verdict in ["adequate", "missing", "undecided", "unknown", "not_determined"] {
            assert!(is_there(verdict.into(), Kind::Verdict), "{verdict}");
        }
    }

    #[test]
    fn terms_of_check_are_explained() {
        for (asked, name) in [
            ("amplification", "amplification factor"),
            ("amplification factor", "amplification factor"),
            ("margin", "separation margin"),
            ("separation margin", "separation margin"),
            ("eccentricity", "eccentricity ratio"),
            ("ε", "eccentricity ratio"),
            ("attitude", "attitude angle"),
            ("trial unbalance", "trial unbalance"),
            ("log dec", "log decrement"),
        ] {
            assert_eq!(explained(asked).map(|found| found.name).as_deref(), Some(name), "{asked}");
        }
    }

    #[test]
    fn other_spellings_belong_to_terms_and_are_no_terms() {
        for (term, others) in OTHER_SPELLINGS {
            assert!(words().any(|w| w.name == *term), "{term}");
            for other in *others {
                assert_eq!(explained(other).unwrap().name, *term, "{other}");
                assert!(words().all(|w| w.name != *other && !w.also.contains(other)), "{other}");
            }
        }
        assert_eq!(other_spellings_in("The peak-to-peak value"), [("peak-to-peak", "pk-pk")]);
        assert!(other_spellings_in("the log decrement of a speak to peakers").is_empty());
    }

    #[test]
    fn a_text_has_the_words_that_it_says_explained_and_no_others() {
        let words = |text: &str| said_in(text).into_iter().map(|(word, _)| word).collect::<Vec<_>>();
        assert_eq!(
            words("<td>Residual</td> of a shaft_bow@2, 12 µm pk-pk"),
            ["pk-pk", "residual", "shaft bow"]
        );
        assert_eq!(words("e/f beyond the sealing ring"), ["residual"]);
        assert!(words("a rubber duck").is_empty());
    }

    #[test]
    fn glossary_finds_effect_at_place_and_suggests_near_words() {
        assert_eq!(explained("seal@disk 3").unwrap().name, "seal");
        assert_eq!(explained("Shaft bow").unwrap().name, "shaft_bow");
        assert_eq!(explained("e/f").unwrap().name, "residual");
        assert_eq!(explained("no_redundancy").unwrap().kind, "reason of a state");
        assert!(not_known("bow").contains("shaft_bow, thermal_bow, bow_kink"));
        assert!(not_known("teapot").contains("lists all words"));
    }
}
