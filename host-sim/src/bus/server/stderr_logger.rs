//! What a server says to whoever runs it. The bus never waits for that: what nobody reads is dropped.

use std::io::Write;
use std::sync::mpsc::{Sender, SyncSender, channel, sync_channel};
use std::thread;
use std::time::Duration;

/// Sentences that wait to be written, at most.
const QUEUE_SENTENCES: usize = 256;
/// Longest wait for the last of them.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// A sentence, and who waits until it is written.
type Sentence = (String, Option<Sender<()>>);

/// Hands sentences to a thread that writes them to standard error.
#[derive(Clone)]
pub struct StderrLogger(SyncSender<Sentence>);

impl StderrLogger {
    /// Writes each sentence as a line of standard error.
    pub fn start() -> Self {
        let (queue, sentences) = sync_channel::<Sentence>(QUEUE_SENTENCES);
        let write = move || {
            for (sentence, written) in sentences {
                // nobody is left to be told that nobody reads
                let _ = writeln!(std::io::stderr(), "{sentence}");
                let _ = written.map(|written| written.send(()));
            }
        };
        // without it nothing is said, which is no reason to have no bus
        let _ = thread::Builder::new().name("stderr".into()).spawn(write);
        Self(queue)
    }

    #[cfg(test)]
    pub fn silent() -> Self {
        Self(sync_channel(0).0)
    }

    /// Says a sentence; dropped where too many wait.
    pub fn tell(&self, sentence: String) {
        let _ = self.0.try_send((sentence, None));
    }

    /// Says the last sentence, and waits a little until it is written.
    pub fn tell_last(&self, sentence: String) {
        let (written, is_written) = channel();
        if self.0.try_send((sentence, Some(written))).is_ok() {
            let _ = is_written.recv_timeout(LAST_WORDS);
        }
    }
}
