//! Words and numbers of a text.

/// A part of a line.
#[derive(Debug, Clone, PartialEq)]
pub enum Token {
    Word(String),
    Number {
        text: String,
        value: f64,
        /// One unit of the last printed digit.
        unit: f64,
        /// Printed without decimals or exponent.
        is_integer: bool,
    },
}

/// Words and numbers in their order; white space separates and is left out.
pub fn tokens(line: &str) -> Vec<Token> {
    line.split_whitespace().flat_map(parts).collect()
}

/// The line with `#` for each number.
pub fn without_numbers(line: &str) -> String {
    let name = |token| match token {
        Token::Word(word) => word,
        Token::Number { .. } => "#".to_string(),
    };
    tokens(line).into_iter().map(name).collect::<Vec<_>>().join(" ")
}

fn parts(word: &str) -> Vec<Token> {
    let chars: Vec<char> = word.chars().collect();
    let (mut all, mut plain, mut i) = (Vec::new(), String::new(), 0);
    while i < chars.len() {
        let is_range = chars[..i].ends_with(&['.', '.']);
        let after_name = i > 0 && is_name(chars[i - 1]) && !is_range;
        let begins = chars[i].is_ascii_digit()
            || (is_sign(chars[i]) && chars.get(i + 1).is_some_and(char::is_ascii_digit));
        match number(&chars[i..]).filter(|_| begins && !after_name) {
            Some((length, token)) => {
                if !plain.is_empty() {
                    all.push(Token::Word(std::mem::take(&mut plain)));
                }
                all.push(token);
                i += length;
            }
            None => {
                plain.push(chars[i]);
                i += 1;
            }
        }
    }
    if !plain.is_empty() {
        all.push(Token::Word(plain));
    }
    all
}

/// Part of a name such as `15X`, `k_xx` or `9e9b96`.
fn is_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_' || c == '.'
}

fn is_sign(c: char) -> bool {
    c == '-' || c == '−'
}

/// A number at the beginning, and its length in characters; `None` where it is part of a name.
fn number(chars: &[char]) -> Option<(usize, Token)> {
    let digits =
        |from: usize| chars[from.min(chars.len())..].iter().take_while(|c| c.is_ascii_digit()).count();
    let at = |i: usize| chars.get(i).copied().unwrap_or(' ');
    let mut i = usize::from(is_sign(at(0)));
    i += digits(i);
    // 11,500 rpm
    while at(i) == ',' && digits(i + 1) == 3 {
        i += 4;
    }
    let mut decimals = 0;
    if at(i) == '.' && digits(i + 1) > 0 {
        decimals = digits(i + 1);
        i += 1 + decimals;
    }
    let mantissa = i;
    let mut exponent = 0;
    if at(i) == 'e' {
        let begin = i + 1 + usize::from(at(i + 1) == '-' || at(i + 1) == '+');
        if digits(begin) > 0 {
            i = begin + digits(begin);
            exponent = chars[mantissa + 1..i].iter().collect::<String>().parse().ok()?;
        }
    }
    if is_name(at(i)) && at(i) != '.' || at(i) == '.' && digits(i + 1) > 0 {
        return None;
    }
    let text: String = chars[..i].iter().collect();
    let value = text.replace('−', "-").replace(',', "").parse().ok()?;
    let unit = 10_f64.powi(exponent - decimals as i32);
    Some((i, Token::Number { text, value, unit, is_integer: decimals == 0 && i == mantissa }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(line: &str) -> Vec<f64> {
        let value = |token: &Token| match token {
            Token::Number { value, .. } => Some(*value),
            Token::Word(_) => None,
        };
        tokens(line).iter().filter_map(value).collect()
    }

    #[test]
    fn numbers_are_found_between_words_and_signs() {
        assert_eq!(
            values("397 g·mm (379 to 414) at -48° ± 2°, −0.11"),
            [397.0, 379.0, 414.0, -48.0, 2.0, -0.11]
        );
        assert_eq!(values("at 11,500 rpm 8.0e-7, 1.5963e8."), [11_500.0, 8e-7, 1.5963e8]);
        assert_eq!(values("3000..3600"), [3000.0, 3600.0]);
    }

    #[test]
    fn digits_of_names_are_words() {
        assert_eq!(values("probe 15X k_11 runup-day126.csv 9e9b965e 1x 0.1.0"), [] as [f64; 0]);
        assert_eq!(without_numbers("bearing 15: 15X 3.2 %"), "bearing # : 15X # %");
    }

    #[test]
    fn unit_of_the_last_digit_is_known() {
        let units: Vec<f64> = tokens("1.25 8.0e-7 12")
            .iter()
            .map(|token| match token {
                Token::Number { unit, .. } => *unit,
                Token::Word(_) => 0.0,
            })
            .collect();
        assert_eq!(units, [0.01, 1e-8, 1.0]);
    }
}
