//! What a NATS server lets us in by, and what we know it by.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use async_nats::ConnectOptions;
use clap::Args;
use nkeys::{KeyPair, KeyPairType};

/// Keys to a server and of it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Args)]
pub struct Access {
    /// Login to the NATS server: a credentials file, or a seed made by `nkey`
    #[arg(long, value_name = "FILE")]
    pub credentials: Option<PathBuf>,
    /// Certificates (PEM) of the authority that signed the NATS server's certificate; encrypts the connection [default: with tls://, the authorities of this system]
    #[arg(long = "ca", value_name = "FILE")]
    pub authority: Option<PathBuf>,
}

impl Access {
    /// How to connect by them.
    ///
    /// # Errors
    /// One sentence if a file is not there or holds something else.
    pub fn options(&self) -> Result<ConnectOptions> {
        let options = self.credentials.as_deref().map_or_else(|| Ok(ConnectOptions::new()), let_in_by)?;
        let Some(authority) = &self.authority else { return Ok(options) };
        if !read(authority)?.contains("BEGIN CERTIFICATE") {
            bail!("{}: expected certificates in PEM", authority.display());
        }
        Ok(options.add_root_certificates(authority.clone()).require_tls(true))
    }
}

fn let_in_by(file: &Path) -> Result<ConnectOptions> {
    let text = read(file)?;
    let options = match KeyPair::from_seed(text.trim()) {
        Ok(pair) if pair.key_pair_type() == KeyPairType::User => {
            Ok(ConnectOptions::with_nkey(text.trim().into()))
        }
        _ => ConnectOptions::with_credentials(&text),
    };
    options.ok().with_context(|| {
        format!(
            "{}: no credentials, expected a file of NATS or the seed of a user, which begins with SU",
            file.display()
        )
    })
}

fn read(file: &Path) -> Result<String> {
    std::fs::read_to_string(file).with_context(|| format!("{}: cannot be read", file.display()))
}

/// A new seed, which stays secret, and the public key that belongs to it, for the server's settings.
///
/// # Errors
/// Never, unless the library contradicts itself.
pub fn new_seed() -> Result<(String, String)> {
    let pair = KeyPair::new_user();
    Ok((pair.seed()?, pair.public_key()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("hall3.seed");
        std::fs::write(&file, text).unwrap();
        let access = Access { credentials: Some(file), authority: None };
        access.options().map_or_else(|error| format!("{error:#}"), |_| String::new())
    }

    #[test]
    fn a_seed_is_that_of_a_user_or_it_is_refused() {
        let (seed, public) = new_seed().unwrap();
        assert!(seed.starts_with("SU") && public.starts_with('U'), "{public}");
        assert_eq!(refused(&format!("{seed}\n")), "");
        for other in [KeyPair::new_account().seed().unwrap(), public, "hello".into(), String::new()] {
            assert!(refused(&other).contains("hall3.seed: no credentials"), "{other}");
        }
    }
}
