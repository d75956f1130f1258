//! The queue as it is, with workers that only take time: ten thousand machines in a night, by numbers that were measured.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rand_core::{Rng as _, SeedableRng as _};
use rand_xoshiro::Xoshiro128PlusPlus;
use rotor_edge_plant::fleet::machines::StatedMachine;
use rotor_edge_plant::fleet::queue::{LEASE_US, ask, end, list, renew, take};
use rotor_edge_plant::fleet::task::{Ended, FleetCommand, Hands};
use rotor_edge_plant::item::Source;
use rotor_edge_plant::store::Store;
use rusqlite::Connection;

/// `track --method joint` over 60 days on one of two busy cores: median and 99 %, s.
const MEDIAN_S: f64 = 1.15;
const P99_S: f64 = 1.4;
/// Beside the command: taking, readings, report, ending, s.
const BESIDE_S: f64 = 0.0024;
/// Of a standard normal variable.
const Z99: f64 = 2.326;
/// A worker that was killed is started again, and one that finds nothing looks again, s.
const RESTART_S: f64 = 1.0;
const LOOK_S: f64 = 0.3;
/// Between two renewals of a lease, µs.
const RENEW_US: i64 = LEASE_US / 6;

/// Who takes the jobs.
struct Workers {
    number: usize,
    /// Each is killed so often, on average, s; none: never.
    killed_every_s: Option<f64>,
}

/// What came of a night.
#[derive(Debug)]
struct Night {
    took_s: f64,
    /// Computing that was lost with workers, s.
    lost_s: f64,
    /// Real time of the queue a job, s.
    queue_s: f64,
}

struct Chance(Xoshiro128PlusPlus);

impl Chance {
    /// Between zero and one, neither of them.
    fn share(&mut self) -> f64 {
        (f64::from(self.0.next_u32()) + 0.5) / (f64::from(u32::MAX) + 1.0)
    }

    /// Log-normal, by its median and its 99 %.
    fn job_s(&mut self) -> f64 {
        let normal = (-2.0 * self.share().ln()).sqrt() * (std::f64::consts::TAU * self.share()).cos();
        MEDIAN_S * ((P99_S / MEDIAN_S).ln() / Z99 * normal).exp()
    }

    fn until_killed_s(&mut self, workers: &Workers) -> f64 {
        workers.killed_every_s.map_or(f64::INFINITY, |every_s| -every_s * self.share().ln())
    }
}

/// A worker at a moment, µs: it looks for a job, renews its lease, ends its job, or is killed.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Step {
    Look,
    Renew(String),
    End(String),
}

fn us(seconds: f64) -> i64 {
    (seconds * 1e6) as i64
}

fn night(machines: usize, workers: &Workers) -> Night {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    drop(Store::open(&path).unwrap());
    let mut queue = Connection::open(&path).unwrap();
    queue.pragma_update(None, "synchronous", "off").unwrap();
    for number in 0..machines {
        let source =
            Source { plant: "north".into(), bus: format!("bus{}", number / 30), node: (number % 30) as u8 };
        let sql = "INSERT INTO source (plant, bus, node) VALUES (?, ?, ?)";
        queue.execute(sql, (&source.plant, &source.bus, source.node)).unwrap();
        let machine = StatedMachine { id: queue.last_insert_rowid(), source, rotor: "drawing".into() };
        // one after the other, as a command asks
        assert!(ask(&queue, &machine, (FleetCommand::Track, None), (0, 1), number as i64).unwrap());
    }
    let mut chance = Chance(Xoshiro128PlusPlus::seed_from_u64(10_000));
    let mut steps: BinaryHeap<Reverse<(i64, usize, Step)>> =
        (0..workers.number).map(|worker| Reverse((0, worker, Step::Look))).collect();
    // when each is killed next, and when its job was begun and will be done
    let mut killed_us: Vec<i64> = (0..workers.number).map(|_| us(chance.until_killed_s(workers))).collect();
    let mut begun_us = vec![0; workers.number];
    let mut ends_us = vec![0; workers.number];
    let (mut ended, mut last_us, mut lost_us) = (0, 0, 0);
    let real = std::time::Instant::now();
    while ended < machines {
        let Reverse((now_us, worker, step)) = steps.pop().unwrap();
        let name = format!("{worker}-{}", killed_us[worker]);
        if now_us >= killed_us[worker] {
            if step != Step::Look {
                lost_us += killed_us[worker] - begun_us[worker];
            }
            let again_us = killed_us[worker] + us(RESTART_S);
            killed_us[worker] = again_us.saturating_add(us(chance.until_killed_s(workers)));
            steps.push(Reverse((again_us.max(now_us), worker, Step::Look)));
            continue;
        }
        match step {
            Step::Look => match take(&mut queue, &name, &Hands::default(), now_us).unwrap() {
                None => steps.push(Reverse((now_us + us(LOOK_S), worker, Step::Look))),
                Some(job) => {
                    begun_us[worker] = now_us;
                    ends_us[worker] = now_us + us(chance.job_s() + BESIDE_S);
                    let next = match now_us + RENEW_US < ends_us[worker] {
                        true => (now_us + RENEW_US, worker, Step::Renew(job.id)),
                        false => (ends_us[worker], worker, Step::End(job.id)),
                    };
                    steps.push(Reverse(next));
                }
            },
            Step::Renew(id) => {
                assert!(renew(&queue, &name, &id, now_us).unwrap(), "a lease that is renewed lasts");
                let next = match now_us + RENEW_US < ends_us[worker] {
                    true => (now_us + RENEW_US, worker, Step::Renew(id)),
                    false => (ends_us[worker], worker, Step::End(id)),
                };
                steps.push(Reverse(next));
            }
            Step::End(id) => {
                let done = Ended::Done { answer: "{}".into(), model: None, report: None };
                assert!(end(&mut queue, &name, &id, &done, now_us).unwrap(), "it is this worker's");
                ended += 1;
                last_us = last_us.max(now_us);
                steps.push(Reverse((now_us, worker, Step::Look)));
            }
        }
    }
    let queue_s = real.elapsed().as_secs_f64() / machines as f64;
    assert!(list(&queue).unwrap().iter().all(|job| job.state == "done"), "each has one answer");
    Night { took_s: last_us as f64 * 1e-6, lost_s: lost_us as f64 * 1e-6, queue_s }
}

/// Of a log-normal variable.
fn mean_s() -> f64 {
    let sigma = (P99_S / MEDIAN_S).ln() / Z99;
    MEDIAN_S * (0.5 * sigma * sigma).exp() + BESIDE_S
}

#[test]
fn night_scales_over_workers_and_kills_cost_their_jobs() {
    let jobs = 2_000;
    let quiet = night(jobs, &Workers { number: 8, killed_every_s: None });
    let ideal_s = jobs as f64 * mean_s() / 8.0;
    // the last jobs do not end together, and 2,000 draws have a mean of their own
    assert!((quiet.took_s / ideal_s - 1.0).abs() < 0.03, "{quiet:?} but {ideal_s} s of computing");
    assert_eq!(quiet.lost_s, 0.0);
    let killed = night(jobs, &Workers { number: 8, killed_every_s: Some(30.0) });
    // killed at a random moment a worker loses half a job on average
    let kills = killed.took_s * 8.0 / (30.0 + RESTART_S);
    let lost_s = kills * 0.5 * mean_s();
    assert!((killed.lost_s / lost_s - 1.0).abs() < 0.25, "{killed:?} but {lost_s} s");
    assert!(killed.took_s > quiet.took_s);
}

#[test]
fn the_nights_of_the_page_are_those_of_the_queue() {
    let page =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/plant-at-scale.md")).unwrap();
    for (number, killed_every_s, how) in
        [(2, None, "never"), (16, None, "never"), (64, None, "never"), (64, Some(60.0), "every minute")]
    {
        let night = night(10_000, &Workers { number, killed_every_s });
        let minutes = night.took_s / 60.0;
        println!(
            "{number} workers, killed {how}: {minutes:.1} min, {:.1} min lost, {:.0} µs of the queue a job",
            night.lost_s / 60.0,
            1e6 * night.queue_s
        );
        let row = format!("| {number} | {how} | {minutes:.1} min | {:.1} min |", night.lost_s / 60.0);
        assert!(page.contains(&row), "the page has no row {row}");
    }
}
