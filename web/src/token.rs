//! Secrets that let a client in.

use sha2::{Digest as _, Sha256};

/// Random bytes of a token: more than anybody can try.
const BYTES: usize = 16;

/// What is kept of a token: comparing it takes no time that tells how much of a guess is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TokenDigest([u8; 32]);

impl TokenDigest {
    /// SHA-256 of the token.
    pub fn of(token: &str) -> Self {
        Self(Sha256::digest(token).into())
    }

    pub fn is_of(&self, token: &str) -> bool {
        *self == Self::of(token)
    }
}

/// A new token of hexadecimal digits.
///
/// # Errors
/// If the system has no random numbers.
pub fn random() -> std::io::Result<String> {
    let mut bytes = [0; BYTES];
    getrandom::fill(&mut bytes).map_err(|e| std::io::Error::other(e.to_string()))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_differ_and_are_known_by_their_digest() {
        let (a, b) = (random().unwrap(), random().unwrap());
        assert!(a != b && a.len() == 2 * BYTES);
        assert!(TokenDigest::of(&a).is_of(&a) && !TokenDigest::of(&a).is_of(&b));
    }
}
