//! What survives a loss of power, in one file that is always whole: the counter of commands, the deployed model, the
//! thresholds, the monitor's memory and the last nonce of authenticated readings.
//!
//! ```text
//! rotor-edge monitor 2
//! counter 41 9d3c07a2          the number, and the CRC-32 of its digits
//! model 02000000…              bytes as hexadecimal digits, each with a checksum of its own inside; nothing if there is none
//! thresholds 01…
//! memory 01…
//! freshness 17… 5e0b6f19       only if it takes authenticated readings alone; as the counter
//! code 5be1…                   with a key alone: its code over the monitor's number and all lines before
//! ```
//!
//! A file with a code that is not of this key and this monitor is refused. Whatever else the file holds, the monitor starts:
//! what cannot be read is missing and the monitor says so. A counter that cannot be read is taken for the present time in
//! milliseconds, so that no recorded command is accepted again. The first saving over a damaged file leaves a copy of it
//! beside, with `.damaged` at its name's end.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail};
use rotor_edge_core::command::Key;
use rotor_edge_core::state::Reason;
use rotor_edge_desktop::whole_file;

use super::hex::{from_hex, to_hex};
use super::mac::StateMac;

const NAME: &str = "rotor-edge monitor";
/// The last version before this one: counter without a checksum, and a model of its time.
const BEFORE: &str = "rotor-edge monitor 1";
const FIRST_LINE: &str = "rotor-edge monitor 2";

/// What one monitor must not forget.
#[derive(Debug, Clone, PartialEq)]
struct StoredState {
    counter: u64,
    model: Result<Vec<u8>, Reason>,
    thresholds: Option<Vec<u8>>,
    memory: Option<Vec<u8>>,
    nonce: Option<u64>,
}

/// The stored state of one monitor: in a file, or only as long as the process lives.
#[derive(Debug)]
pub struct Store {
    path: Option<PathBuf>,
    mac: Option<StateMac>,
    kept: StoredState,
    /// In place of a model that was never stored.
    initial: Option<Vec<u8>>,
    damaged: bool,
}

impl Store {
    /// Forgets everything with the process.
    pub fn in_memory() -> Self {
        let kept = StoredState {
            counter: 0,
            model: Err(Reason::NothingStored),
            thresholds: None,
            memory: None,
            nonce: None,
        };
        Self { path: None, mac: None, kept, initial: None, damaged: false }
    }

    /// Reads the file of a monitor without a key; a missing one is a monitor that was never deployed to.
    ///
    /// # Errors
    /// If the file is there and the system does not let it be read.
    pub fn open(path: &Path) -> Result<Self> {
        Self::read(path, None)
    }

    /// Reads the file of a monitor that takes commands. One without a code, as it is after damage or where it was written
    /// without a key, counts as damaged throughout.
    ///
    /// # Errors
    /// As [`Self::open`], and if the code in it is not of this key and this monitor.
    pub fn authenticated(path: &Path, key: Key, node: u8) -> Result<Self> {
        Self::read(path, Some(StateMac::new(key, node)))
    }

    fn read(path: &Path, mac: Option<StateMac>) -> Result<Self> {
        let mut store = Self { path: Some(path.to_path_buf()), mac, ..Self::in_memory() };
        let bytes = match std::fs::read(path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(store),
            bytes => bytes.with_context(|| format!("{}: cannot be read", path.display()))?,
        };
        let text = String::from_utf8_lossy(&bytes);
        store.kept = match mac.map(|mac| mac.confirms(&text)) {
            None | Some(Some(true)) => StoredState::parse(&text),
            Some(None) => StoredState::parse(""),
            Some(Some(false)) => bail!(
                "{}: is not the state of this monitor: it has another number or key, or was changed; give the right file, or \
                 start a new one with a new key",
                path.display()
            ),
        };
        store.damaged = bytes != store.text(&store.kept).as_bytes();
        Ok(store)
    }

    /// With a model for as long as none is deployed.
    pub fn with_initial_model(mut self, model: Vec<u8>) -> Self {
        self.initial = Some(model);
        self
    }

    /// Last command counter accepted.
    pub fn counter(&self) -> u64 {
        self.kept.counter
    }

    /// Bytes of the model to start with.
    ///
    /// # Errors
    /// Why there is none.
    pub fn model(&self) -> Result<&[u8], Reason> {
        match (&self.kept.model, &self.initial) {
            (Ok(deployed), _) => Ok(deployed),
            (Err(Reason::NothingStored), Some(initial)) => Ok(initial),
            (Err(reason), _) => Err(*reason),
        }
    }

    /// Whether a model was deployed to this monitor.
    pub fn is_deployed(&self) -> bool {
        self.kept.model.is_ok()
    }

    /// Thresholds that were set over the bus.
    pub fn thresholds(&self) -> Option<&[u8]> {
        self.kept.thresholds.as_deref()
    }

    pub fn memory(&self) -> Option<&[u8]> {
        self.kept.memory.as_deref()
    }

    /// How fresh a reading must be; nothing if that was never stored, or is damaged.
    pub fn nonce(&self) -> Option<u64> {
        self.kept.nonce
    }

    /// Stores what a command brings, and its counter: all, or nothing.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save_command(
        &mut self,
        counter: u64,
        model: Option<&[u8]>,
        thresholds: Option<&[u8]>,
    ) -> Result<()> {
        let mut kept = StoredState { counter, ..self.kept.clone() };
        if let Some(model) = model {
            kept.model = Ok(model.to_vec());
        }
        if let Some(thresholds) = thresholds {
            kept.thresholds = Some(thresholds.to_vec());
        }
        self.replace(kept)
    }

    /// Stores what the monitor learned.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save_memory(&mut self, memory: &[u8]) -> Result<()> {
        self.replace(StoredState { memory: Some(memory.to_vec()), ..self.kept.clone() })
    }

    /// Stores how fresh a reading must be after a restart.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save_nonce(&mut self, nonce: u64) -> Result<()> {
        self.replace(StoredState { nonce: Some(nonce), ..self.kept.clone() })
    }

    fn replace(&mut self, kept: StoredState) -> Result<()> {
        if let Some(path) = &self.path {
            if self.damaged {
                let mut copy = path.clone().into_os_string();
                copy.push(".damaged");
                std::fs::copy(path, copy)?;
                self.damaged = false;
            }
            whole_file::write(path, self.text(&kept).as_bytes())?;
        }
        self.kept = kept;
        Ok(())
    }

    fn text(&self, kept: &StoredState) -> String {
        let text = kept.text();
        match self.mac {
            Some(mac) => mac.close(&text),
            None => text,
        }
    }
}

impl StoredState {
    fn text(&self) -> String {
        let checked = |number: u64| {
            let digits = number.to_string();
            format!("{digits} {:08x}", crc32(digits.as_bytes()))
        };
        let nonce = self.nonce.map_or(String::new(), |nonce| format!("freshness {}\n", checked(nonce)));
        let hex = |bytes: Option<&Vec<u8>>| bytes.map_or(String::new(), |bytes| to_hex(bytes));
        format!(
            "{FIRST_LINE}\ncounter {}\nmodel {}\nthresholds {}\nmemory {}\n{nonce}",
            checked(self.counter),
            hex(self.model.as_ref().ok()),
            hex(self.thresholds.as_ref()),
            hex(self.memory.as_ref())
        )
    }

    fn parse(text: &str) -> Self {
        let is_ours = text.lines().next().is_some_and(|line| line.starts_with(NAME));
        // a line that is not ended was cut
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        let field = |name: &str| {
            let mut lines = whole.lines().skip(1);
            lines.find_map(|line| line.strip_prefix(name)).map(str::trim).filter(|_| is_ours)
        };
        let bytes = |name: &str| field(name).filter(|hex| !hex.is_empty()).map(from_hex);
        let counter = match (text.lines().next(), field("counter ")) {
            (Some(BEFORE), Some(number)) => number.parse().ok(),
            (_, Some(number)) => checked_number(number),
            (_, None) => None,
        };
        let model = match bytes("model ") {
            Some(Some(bytes)) => Ok(bytes),
            // a line without bytes; anything else is damage
            None if field("model").is_some_and(str::is_empty) => Err(Reason::NothingStored),
            _ => Err(Reason::Damaged),
        };
        Self {
            counter: counter.unwrap_or_else(present_ms),
            model,
            thresholds: bytes("thresholds ").flatten(),
            memory: bytes("memory ").flatten(),
            nonce: field("freshness ").and_then(checked_number),
        }
    }
}

fn checked_number(text: &str) -> Option<u64> {
    let (digits, code) = text.split_once(' ')?;
    let is_right = u32::from_str_radix(code, 16) == Ok(crc32(digits.as_bytes()));
    digits.parse().ok().filter(|_| is_right)
}

fn present_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64)
}

/// zlib's CRC-32.
fn crc32(bytes: &[u8]) -> u32 {
    crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("monitor.state");
        (folder, path)
    }

    #[test]
    fn saved_state_is_there_after_restart_and_nothing_else() {
        let (folder, path) = folder();
        let mut store = Store::open(&path).unwrap();
        assert_eq!((store.counter(), store.model()), (0, Err(Reason::NothingStored)));
        store.save_command(7, Some(&[1, 2, 3]), None).unwrap();
        store.save_memory(&[4, 5]).unwrap();
        store.save_command(8, None, Some(&[6])).unwrap();
        let again = Store::open(&path).unwrap();
        assert_eq!((again.counter(), again.model()), (8, Ok(&[1, 2, 3][..])));
        assert_eq!((again.memory(), again.thresholds()), (Some(&[4, 5][..]), Some(&[6][..])));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn initial_model_counts_until_deployment_and_never_if_damaged() {
        let (_folder, path) = folder();
        let mut store = Store::open(&path).unwrap().with_initial_model(vec![9]);
        assert_eq!(store.model(), Ok(&[9][..]));
        store.save_memory(&[1]).unwrap();
        assert_eq!(Store::open(&path).unwrap().model(), Err(Reason::NothingStored));
        store.save_command(1, Some(&[2]), None).unwrap();
        assert_eq!(store.model(), Ok(&[2][..]));
        std::fs::write(&path, "rotor-edge monitor 2\ncounter 1 83dcefb7\nmodel 0x\n").unwrap();
        let damaged = Store::open(&path).unwrap().with_initial_model(vec![9]);
        assert_eq!(damaged.model(), Err(Reason::Damaged));
    }

    #[test]
    fn truncated_file_starts_with_counter_above_old_commands() {
        let (_folder, path) = folder();
        Store::open(&path).unwrap().save_command(4_123, Some(&[1; 20]), Some(&[2; 9])).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let counter_ends = 1 + whole.iter().enumerate().filter(|(_, b)| **b == b'\n').nth(1).unwrap().0;
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let store = Store::open(&path).unwrap();
            if length >= counter_ends {
                assert_eq!(store.counter(), 4_123, "{length} bytes");
            } else {
                assert!(store.counter() > 1_600_000_000_000, "{length} bytes: {}", store.counter());
            }
            match store.model() {
                Ok(model) => assert_eq!(model, [1; 20]),
                Err(reason) => assert_eq!(reason, Reason::Damaged, "{length} bytes"),
            }
        }
    }

    #[test]
    fn changed_counter_digit_is_noticed_and_file_kept_beside() {
        let (folder, path) = folder();
        Store::open(&path).unwrap().save_command(4_123, None, None).unwrap();
        let whole = std::fs::read_to_string(&path).unwrap();
        for digit in ["1", "2", "3", "4"] {
            std::fs::write(&path, whole.replacen(digit, "7", 1)).unwrap();
            let counter = Store::open(&path).unwrap().counter();
            assert!(counter == 4_123 || counter > 1_600_000_000_000, "{counter}");
        }
        std::fs::write(&path, b"\xff\x00 something else").unwrap();
        let mut store = Store::open(&path).unwrap();
        assert_eq!(store.model(), Err(Reason::Damaged));
        store.save_memory(&[1]).unwrap();
        let copy = folder.path().join("monitor.state.damaged");
        assert_eq!(std::fs::read(copy).unwrap(), b"\xff\x00 something else");
    }

    #[test]
    fn authenticated_state_needs_its_key_number_and_code() {
        let (_folder, path) = folder();
        let key = Key([3; 32]);
        let open = |key, node| Store::authenticated(&path, key, node);
        open(key, 1).unwrap().save_command(7, Some(&[1, 2]), None).unwrap();
        let again = open(key, 1).unwrap();
        assert_eq!((again.counter(), again.model()), (7, Ok(&[1, 2][..])));
        let whole = std::fs::read_to_string(&path).unwrap();
        for (key, node) in [(key, 2), (Key([4; 32]), 1)] {
            let refused = open(key, node).unwrap_err().to_string();
            assert!(refused.contains("not the state of this monitor"), "{refused}");
        }
        std::fs::write(&path, whole.replace("model 0102", "model 0103")).unwrap();
        assert!(open(key, 1).is_err(), "another model");
        std::fs::write(&path, whole.split_once("code").unwrap().0).unwrap();
        let bare = open(key, 1).unwrap();
        assert_eq!(bare.model(), Err(Reason::Damaged), "who cuts the code off gains nothing");
        assert!(bare.counter() > 1_600_000_000_000);
    }

    #[test]
    fn a_file_of_the_version_before_keeps_its_counter() {
        let (_folder, path) = folder();
        std::fs::write(&path, "rotor-edge monitor 1\ncounter 41\nmodel 0100000006\n").unwrap();
        let store = Store::open(&path).unwrap();
        assert_eq!((store.counter(), store.model()), (41, Ok(&[1, 0, 0, 0, 6][..])));
        std::fs::write(&path, "rotor-edge monitor 1\ncounter 41\nmodel \n").unwrap();
        assert_eq!(Store::open(&path).unwrap().model(), Err(Reason::NothingStored));
    }
}
