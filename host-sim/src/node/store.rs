//! What survives a restart, in one file that is always whole: the counter of commands and the deployed model.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};

use crate::edge::EdgeModel;

const FIRST_LINE: &str = "rotor-edge monitor 1";

/// The stored state of one monitor.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    counter: u64,
    model: Option<EdgeModel>,
    model_hex: String,
}

impl Store {
    /// Reads the file; a missing one is a monitor that was never deployed to.
    ///
    /// # Errors
    /// If the file is there and is not a whole state.
    pub fn open(path: &Path) -> Result<Self> {
        let mut store = Self { path: path.to_path_buf(), counter: 0, model: None, model_hex: String::new() };
        let text = match std::fs::read_to_string(path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(store),
            text => text.with_context(|| format!("{}: cannot be read", path.display()))?,
        };
        store.parse(&text).with_context(|| {
            format!("{}: not the state of a monitor; delete it to begin anew", path.display())
        })?;
        Ok(store)
    }

    /// Last counter accepted.
    pub fn counter(&self) -> u64 {
        self.counter
    }

    /// The model deployed last.
    pub fn model(&self) -> Option<&EdgeModel> {
        self.model.as_ref()
    }

    /// Stores both, or neither: written beside the old file, flushed to the disk, then renamed over it.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&mut self, counter: u64, model: Option<&[u8]>) -> Result<()> {
        let model_hex = model.map_or_else(|| self.model_hex.clone(), to_hex);
        let partial = self.path.with_extension("partial");
        let mut file = std::fs::File::create(&partial)?;
        write!(file, "{FIRST_LINE}\ncounter {counter}\nmodel {model_hex}\n")?;
        file.sync_all()?;
        std::fs::rename(&partial, &self.path)?;
        (self.counter, self.model_hex) = (counter, model_hex);
        Ok(())
    }

    fn parse(&mut self, text: &str) -> Result<()> {
        let mut lines = text.lines();
        if lines.next() != Some(FIRST_LINE) {
            bail!("line 1: expected \"{FIRST_LINE}\"");
        }
        let mut field = |name: &str| {
            let value = lines.next().and_then(|line| line.strip_prefix(name)).map(str::trim);
            value.ok_or_else(|| anyhow!("expected a line \"{name} …\""))
        };
        self.counter = field("counter")?.parse().context("counter: expected a number")?;
        self.model_hex = field("model")?.to_string();
        if !self.model_hex.is_empty() {
            let bytes = from_hex(&self.model_hex).context("model: expected hexadecimal digits")?;
            self.model = Some(EdgeModel::decode(&bytes).map_err(|e| anyhow!("model: {e:?}"))?);
        }
        Ok(())
    }
}

/// Two digits a byte.
pub(crate) fn to_hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// The bytes of two digits each.
pub(crate) fn from_hex(text: &str) -> Option<Vec<u8>> {
    let digits: Option<Vec<u32>> = text.chars().map(|c| c.to_digit(16)).collect();
    let digits = digits.filter(|d| d.len() % 2 == 0)?;
    Some(digits.chunks(2).map(|pair| (pair[0] * 16 + pair[1]) as u8).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::Deployment;
    use crate::sample;

    fn model() -> EdgeModel {
        let (mut rotor, ..) = sample::load().unwrap();
        for plane in &mut rotor.plane {
            (plane.unbalance_g_mm, plane.angle_deg) = (Some(100.0), Some(30.0));
        }
        Deployment::new(&rotor, 11_000.0).unwrap().edge
    }

    fn encoded(model: &EdgeModel) -> Vec<u8> {
        let mut bytes = vec![0; EdgeModel::max_size_bytes()];
        let length = model.encode(&mut bytes).unwrap();
        bytes.truncate(length);
        bytes
    }

    #[test]
    fn what_was_saved_is_there_after_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("monitor.state");
        let mut store = Store::open(&path).unwrap();
        assert_eq!((store.counter(), store.model()), (0, None));
        store.save(7, Some(&encoded(&model()))).unwrap();
        store.save(8, None).unwrap();
        let again = Store::open(&path).unwrap();
        assert_eq!((again.counter(), again.model()), (8, Some(&model())));
    }

    #[test]
    fn a_file_cut_anywhere_or_of_something_else_is_refused_and_a_partial_one_is_not_looked_at() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("monitor.state");
        Store::open(&path).unwrap().save(7, Some(&encoded(&model()))).unwrap();
        let whole = std::fs::read_to_string(&path).unwrap();
        for length in [0, 10, 25, 40, whole.len() / 2, whole.len() - 2] {
            std::fs::write(&path, &whole[..length]).unwrap();
            let message = format!("{:#}", Store::open(&path).unwrap_err());
            assert!(message.contains("monitor.state"), "{message}");
        }
        std::fs::write(&path, &whole).unwrap();
        std::fs::write(path.with_extension("partial"), "rotor-edge mon").unwrap();
        assert_eq!(Store::open(&path).unwrap().counter(), 7);
    }
}
