//! Commands of the desk over many machines: what workers answer is what the desk answers, once, whoever is killed.
//!
//! `ROTOR_EDGE_JOBS=1000` asks for so many joint jobs over 60 days each.

use std::ffi::OsString;
use std::path::Path;
use std::time::Instant;

use crate::common::plant::Plant;
use crate::common::{Program, refusal, run, until};
use rotor_edge::command::{Listener, object};
use rotor_edge::sample;
use serde_json::Value;

/// What the desk says of files.
fn desk(command: &str, rotor: &Path, data: &Path) -> Value {
    let words = [command.into(), rotor.into(), data.into(), "--json".into()];
    serde_json::from_str(&object(words, Listener::Program(&|_, _| {})).unwrap()).unwrap()
}

#[test]
fn two_workers_answer_as_offline_and_duplicate_job_is_one() {
    let plant = Plant::of_days(1..4, 40);
    plant.says(&["fleet", "track", plant.path()], "3 new jobs.");
    plant.says(&["fleet", "track", plant.path(), "north/hall1/2"], "0 new jobs, 1 job requested before.");
    let workers = [(); 2].map(|()| Program::start(&["worker", plant.path(), "--once"]));
    until("three answers", || plant.jobs().iter().filter(|job| job["state"] == "done").count() == 3);
    for mut worker in workers {
        assert!(worker.child.wait().unwrap().success());
    }
    let folder = plant.folder.path();
    let expected = desk("track", &folder.join("rotor.toml"), &folder.join("data.csv"));
    for job in plant.jobs() {
        assert_eq!((&job["tries"], &job["node"].as_u64().is_some()), (&1.into(), &true), "{job}");
        assert_eq!(job["answer"]["estimates"], expected["estimates"], "to the bit");
    }
    let said = String::from_utf8(run(&["fleet", "status", plant.path()]).stdout).unwrap();
    assert!(
        said.contains("3 done") && said.contains("north/hall1/2") && said.contains("40 days, 0 flags"),
        "{said}"
    );
}

#[test]
fn what_cannot_be_asked_or_done_is_one_sentence() {
    let plant = Plant::of_days(1..2, 3);
    let path = plant.path();
    let rotor = plant.at("rotor.toml");
    let said = refusal(&["machine", path, "north/hall1/9", &rotor]);
    assert!(
        said.contains("monitor north/hall1/9 has sent no message, expected one of north/hall1/1"),
        "{said}"
    );
    assert!(refusal(&["machine", path, "north/hall1/1", &plant.at("data.csv")]).contains("data.csv"));
    assert!(refusal(&["fleet", "track", path, "south"]).contains("no machine is chosen"));
    assert!(refusal(&["fleet", "deploy", path, "north"]).contains("no better model of it was found"));
    for [command, option, value] in [["forecast", "--limit", "-1"], ["deploy", "--trial", "0"]] {
        let said = refusal(&["fleet", command, path, option, value]);
        assert!(said.contains(&format!("{option} {value}: expected a positive number")), "{said}");
    }
    let said = refusal(&["fleet", "share", path, "--with", path]);
    assert!(said.contains("expected nats://"), "{said}");
    let lonely = ["worker", path, "--bus", "hall1=slcan:127.0.0.1:1", "--keys", "none"];
    assert!(refusal(&lonely).contains("none: not a folder of keys"));
    assert!(refusal(&["fleet", "cancel", path, "abc"]).contains("job abc is neither waiting nor running"));
    assert!(refusal(&["worker", &plant.at("none.db")]).contains("no such file"));
    plant.says(&["fleet", "diagnose", path, "--to", "2020-01-01T00:00Z"], "1 new job.");
    plant.says(&["worker", path, "--once"], "1 job done.");
    let jobs = plant.jobs();
    assert_eq!(
        (&jobs[0]["state"], &jobs[0]["answer"]),
        (&"failed".into(), &"no reading in this period".into())
    );
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn job_of_killed_worker_is_done_within_its_lease() {
        // a minute of readings, a second apart: all of them are used
        let plant = Plant::of(1..3, sample::RUNUP_DAY_126, |row, _| row as i64 * 1_000_000);
        plant.says(&["fleet", "improve", plant.path(), "north"], "2 new jobs.");
        let first = Program::start(&["worker", plant.path()]);
        until("a job that runs", || plant.has_state("running"));
        first.kill();
        let was_running = plant.has_state("running");
        plant.says(&["worker", plant.path(), "--once"], "jobs done.");
        let jobs = plant.jobs();
        let tries: u64 = jobs.iter().map(|job| job["tries"].as_u64().unwrap()).sum();
        assert_eq!(tries, 2 + u64::from(was_running));
        let folder = plant.folder.path();
        let better = folder.join("better.toml");
        let data = folder.join("data.csv");
        let words = [
            "improve".into(),
            folder.join("rotor.toml").into(),
            data.into(),
            "-o".into(),
            better.clone().into(),
            "--json".into(),
        ];
        let expected: Value =
            serde_json::from_str(&object(words, Listener::Program(&|_, _| {})).unwrap()).unwrap();
        for job in &jobs {
            assert_eq!(job["state"], "done", "{job}");
            assert_eq!(job["answer"]["steps"][0]["effect"], "seal");
            assert_eq!(job["answer"]["verdict"], expected["verdict"]);
            assert!(job["model"].as_str().unwrap().contains("kind = \"seal\""), "the better drawing");
        }
    }

    #[test]
    fn two_workers_do_joint_jobs_as_two_processes_of_the_desk_would() {
        let jobs: usize = std::env::var("ROTOR_EDGE_JOBS").map_or(4, |number| number.parse().unwrap());
        let machines = jobs.min(250);
        let plant = Plant::of_days(0..machines as u8, 60);
        let folder = plant.folder.path();
        let [rotor, data] = ["rotor.toml", "data.csv"].map(|name| folder.join(name));
        // as many as tell the time of one
        let alone = jobs.min(40);
        let pure = Instant::now();
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    let words = || ["track", "--method", "joint", "--json"].map(OsString::from);
                    for _ in 0..alone / 2 {
                        let words = words().into_iter().chain([rotor.clone().into(), data.clone().into()]);
                        object(words, Listener::Program(&|_, _| {})).unwrap();
                    }
                });
            }
        });
        let pure_s = pure.elapsed().as_secs_f64() * jobs as f64 / alone as f64;
        // other ends of the period make other jobs of the same days
        for minute in 0..jobs / machines {
            let to = format!("2027-01-01T00:{minute:02}Z");
            plant.says(&["fleet", "track", plant.path(), "--method", "joint", "--to", &to], "new jobs");
        }
        let begun = Instant::now();
        let workers = [(); 2].map(|()| Program::start(&["worker", plant.path(), "--once"]));
        for mut worker in workers {
            assert!(worker.child.wait().unwrap().success());
        }
        let took_s = begun.elapsed().as_secs_f64();
        let all = plant.jobs();
        assert_eq!(all.len(), jobs / machines * machines);
        assert!(all.iter().all(|job| job["state"] == "done" && job["tries"] == 1));
        println!(
            "{jobs} joint jobs on two workers: {took_s:.1} s, {:.3} of their pure time",
            took_s / pure_s
        );
        let mut seconds: Vec<f64> = all.iter().map(|job| job["seconds"].as_f64().unwrap()).collect();
        seconds.sort_by(f64::total_cmp);
        let at = |share: f64| seconds[((seconds.len() - 1) as f64 * share) as usize];
        println!("a job: median {:.3} s, 99 % {:.3} s, longest {:.3} s", at(0.5), at(0.99), at(1.0));
    }
}
