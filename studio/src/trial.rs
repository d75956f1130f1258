//! Effects that are looked at before they are added: fitted on a worker, so that nothing else waits for them. The newest one wins.

use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};

use anyhow::Result;

use crate::session::analysis::Analysis;
use crate::session::step::Step;
use crate::session::{Looking, Session};
use crate::workbench::{Workbench, unbroken};

/// Fits an effect at a place into the current model of a session.
type FitTrial = dyn Fn(&Session, &str, Option<&str>) -> Result<(Step, Analysis)> + Send + Sync;

/// An effect that is to be looked at.
struct Trial {
    looking: Looking,
    /// As it was when that was asked.
    session: Session,
    /// Who asked; dropped without a word if the trial is outdated.
    asked: Sender<Result<()>>,
}

/// Trials of a bench: one is fitted, the newest of the others waits.
pub struct Trials {
    /// Of the newest one.
    number: u64,
    waiting: Option<Trial>,
    is_fitting: bool,
    fit: Arc<FitTrial>,
}

impl Default for Trials {
    fn default() -> Self {
        Self { number: 0, waiting: None, is_fitting: false, fit: Arc::new(fitted) }
    }
}

fn fitted(session: &Session, effect: &str, at: Option<&str>) -> Result<(Step, Analysis)> {
    let model = session.model()?;
    let step = Step::adding(&model.rotor, &model.readings, effect, at)?;
    let analysis = Analysis::of(&step.words(), session, &session.fitted_to(&step)?)?;
    Ok((step, analysis))
}

impl Workbench {
    /// Looks at an effect before it is added. Returns as soon as it is fitted, or outdated: by a newer one, or by a change of the
    /// session.
    ///
    /// # Errors
    /// As `add`.
    pub fn look_at(&self, effect: &str, at: Option<&str>) -> Result<()> {
        let (asked, told) = channel();
        let mut bench = self.lock();
        let number = bench.trials.number + 1;
        let looking = Looking { number, effect: effect.into(), at: at.map(String::from) };
        let session = bench.opened_mut()?;
        session.looking = Some(looking.clone());
        let session = session.clone();
        bench.trials.number = number;
        // the one that waited is dropped, which tells who asked for it
        bench.trials.waiting = Some(Trial { looking, session, asked });
        bench.version += 1;
        if !std::mem::replace(&mut bench.trials.is_fitting, true) {
            let this = self.clone();
            std::thread::spawn(move || this.fit_trials());
        }
        drop(bench);
        told.recv().unwrap_or(Ok(()))
    }

    /// Fits trials until none waits.
    fn fit_trials(&self) {
        loop {
            let mut bench = self.lock();
            let Some(Trial { looking, session, asked }) = bench.trials.waiting.take() else {
                bench.trials.is_fitting = false;
                return;
            };
            let fit = bench.trials.fit.clone();
            let is_wanted = bench.is_looking(&looking);
            drop(bench);
            if is_wanted {
                let found = unbroken(|| fit(&session, &looking.effect, looking.at.as_deref()));
                if let Some(answer) = self.show_trial(&looking, found) {
                    // nobody may be waiting any more
                    let _ = asked.send(answer);
                }
            }
        }
    }

    /// Shows a trial, unless it is outdated.
    fn show_trial(&self, looking: &Looking, found: Result<(Step, Analysis)>) -> Option<Result<()>> {
        let mut bench = self.lock();
        if !bench.is_looking(looking) {
            return None;
        }
        bench.version += 1;
        let shown = found.and_then(|(step, analysis)| {
            let key = bench.opened()?.key(&step);
            bench.remember(key, Arc::new(analysis));
            let session = bench.opened_mut()?;
            session.moved = None;
            session.preview = Some(step);
            Ok(())
        });
        if let Some(session) = &mut bench.session {
            session.looking = None;
        }
        Some(shown)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::mpsc::{Receiver, channel};

    use super::*;
    use crate::session::files::InputFiles;

    /// A bench whose fits tell that they begin, and end when they are let go.
    fn gated() -> (Workbench, Receiver<String>, Sender<()>) {
        let (begin, begun) = channel();
        let (let_go, gate) = channel::<()>();
        let gate = Mutex::new(gate);
        let bench = Workbench::default();
        let session = Session::open(InputFiles::sample()).unwrap();
        let mut inside = bench.lock();
        inside.begin(session).unwrap();
        inside.trials.fit = Arc::new(move |session, effect, at| {
            begin.send(at.unwrap_or_default().to_string())?;
            gate.lock().unwrap().recv()?;
            fitted(session, effect, at)
        });
        drop(inside);
        (bench, begun, let_go)
    }

    /// Asks for a seal at a disk, and returns when that is noted.
    fn ask(bench: &Workbench, at: &'static str) -> std::thread::JoinHandle<Result<()>> {
        let before = bench.lock().trials.number;
        let asking = bench.clone();
        let asked = std::thread::spawn(move || asking.look_at("seal", Some(at)));
        while bench.lock().trials.number == before {
            std::thread::yield_now();
        }
        asked
    }

    fn previewed(bench: &Workbench) -> Option<String> {
        bench.lock().session.as_ref().unwrap().preview.as_ref().map(Step::label)
    }

    #[test]
    fn newest_trial_wins_and_those_between_are_never_fitted() {
        let (bench, begun, let_go) = gated();
        let first = ask(&bench, "disk 1");
        assert_eq!(begun.recv().unwrap(), "disk 1");
        let between = ask(&bench, "disk 2");
        let newest = ask(&bench, "disk 3");
        // told while the first is still fitted
        between.join().unwrap().unwrap();
        let_go.send(()).unwrap();
        first.join().unwrap().unwrap();
        assert_eq!(previewed(&bench), None, "the first is outdated");
        assert_eq!(begun.recv().unwrap(), "disk 3");
        let_go.send(()).unwrap();
        newest.join().unwrap().unwrap();
        assert_eq!(previewed(&bench).as_deref(), Some("seal@disk 3"));
        assert!(begun.try_recv().is_err(), "two fits in all");
        let refused = ask(&bench, "disk 9");
        let_go.send(()).unwrap();
        assert!(refused.join().unwrap().unwrap_err().to_string().contains("disk 9"));
        assert_eq!(previewed(&bench).as_deref(), Some("seal@disk 3"), "the one before stays");
    }

    #[test]
    fn changes_are_made_while_a_trial_is_fitted_and_outdate_it() {
        type ChangeSession = fn(&mut Session);
        let changes: [ChangeSession; 3] = [Session::undo, Session::forget_preview, |session| {
            let (rotor, given) = (session.given.clone(), session.given.clone());
            let number = crate::session::parameters::all(&given).remove(0);
            session.move_to(&rotor, &number.id, number.value).unwrap();
        }];
        for change in changes {
            let (bench, begun, let_go) = gated();
            let trial = ask(&bench, "disk 3");
            begun.recv().unwrap();
            // the fit has not ended, and nothing waits for it
            bench.change(|bench| bench.opened_mut().map(change)).unwrap();
            crate::view::state(&mut bench.lock()).unwrap();
            let_go.send(()).unwrap();
            trial.join().unwrap().unwrap();
            assert_eq!(previewed(&bench), None);
        }
    }
}
