//! Tokens are compared one at a time for each client, so that guesses side by side are no faster than one after the other.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Whoever guesses a token waits so long for each.
const WRONG_TOKEN: Duration = Duration::from_secs(1);
/// Requests of one client that may wait for their turn; more are refused at once.
const MOST_WAITING: usize = 4;

/// What came of a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Guess {
    Right,
    Wrong,
    /// It was not looked at: too many of the same client wait.
    Refused,
}

/// Clients whose tokens are being compared.
#[derive(Debug, Clone, Default)]
pub struct Guesses(Arc<Mutex<HashMap<IpAddr, Arc<tokio::sync::Mutex<()>>>>>);

impl Guesses {
    /// Compares a token in its client's turn; the turn of a wrong one ends a second later.
    pub async fn judge(&self, client: IpAddr, is_right: impl FnOnce() -> bool) -> Guess {
        let Some(turns) = self.enter(client) else { return Guess::Refused };
        let guess = {
            let _turn = turns.lock().await;
            if is_right() {
                Guess::Right
            } else {
                tokio::time::sleep(WRONG_TOKEN).await;
                Guess::Wrong
            }
        };
        drop(turns);
        self.clients().retain(|_, turns| Arc::strong_count(turns) > 1);
        guess
    }

    fn clients(&self) -> std::sync::MutexGuard<'_, HashMap<IpAddr, Arc<tokio::sync::Mutex<()>>>> {
        // every change is whole before anything can panic
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The turns of a client, unless it has too many already.
    fn enter(&self, client: IpAddr) -> Option<Arc<tokio::sync::Mutex<()>>> {
        let mut clients = self.clients();
        let turns = clients.entry(client).or_default();
        (Arc::strong_count(turns) <= MOST_WAITING).then(|| turns.clone())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn runtime() -> tokio::runtime::Runtime {
        tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap()
    }

    #[test]
    fn wrong_tokens_side_by_side_are_compared_one_at_a_time() {
        let (guesses, compared) = (Guesses::default(), AtomicUsize::new(0));
        let client = IpAddr::from([127, 0, 0, 1]);
        let guess = || guesses.judge(client, || compared.fetch_add(1, Ordering::Relaxed) > 100);
        runtime().block_on(async {
            let mut all: Vec<_> = (0..10).map(|_| Box::pin(guess())).collect();
            // each is begun, and one alone has been compared
            let mut begun = Vec::new();
            for guess in &mut all {
                begun.push(futures_util::FutureExt::now_or_never(guess.as_mut()));
            }
            assert_eq!(compared.load(Ordering::Relaxed), 1);
            let refused = begun.iter().filter(|g| **g == Some(Guess::Refused)).count();
            assert_eq!(refused, 10 - MOST_WAITING, "the rest is not looked at");
            // another client is not kept waiting
            let other = guesses.judge(IpAddr::from([10, 0, 0, 7]), || true);
            assert_eq!(other.await, Guess::Right);
        });
    }
}
