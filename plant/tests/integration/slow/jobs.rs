//! Jobs over a server, from the question what is missing to the better model in the monitor: each job is done once, whoever
//! is killed, and keys stay where the bus is.

use crate::common::nats::Nats;
use crate::common::plant::Plant;
use crate::common::{Bus, Program, run, until};
use clap::Parser as _;
use rotor_edge::command::{Cli, run as rotor_edge};
use rotor_edge::sample;
use serde_json::Value;

/// A minute of readings, a second apart.
fn runup_of(nodes: std::ops::Range<u8>) -> Plant {
    Plant::of(nodes, sample::RUNUP_DAY_126, |row, _| row as i64 * 1_000_000)
}

fn summary(plant: &Plant) -> String {
    let days = "100000";
    String::from_utf8(run(&["fleet", "summary", plant.path(), "--days", days]).stdout).unwrap()
}

#[test]
fn server_jobs_are_done_once_through_kills() {
    let Some(mut nats) = Nats::start() else { return };
    let plant = runup_of(1..7);
    plant.says(&["fleet", "improve", plant.path()], "6 new jobs.");
    let address = nats.address();
    let share = || Program::start(&["fleet", "share", plant.path(), "--with", &address]);
    let worker = || Program::start(&["worker", &address]);
    let done = || plant.jobs().iter().filter(|job| job["state"] == "done").count();
    let (sharing, [first, second]) = (share(), [worker(), worker()]);
    until("the first answer", || done() >= 1);
    // each has the next job in its hands, or is about to
    first.kill();
    until("another answer", || done() >= 2);
    nats.kill();
    std::thread::sleep(std::time::Duration::from_secs(1));
    nats.restart();
    sharing.kill();
    let sharing = share();
    let third = worker();
    until("every answer", || done() == 6);
    let alone = runup_of(1..2);
    alone.says(&["fleet", "improve", alone.path()], "1 new job.");
    alone.says(&["worker", alone.path(), "--once"], "1 job done.");
    let expected = &alone.jobs()[0];
    for job in plant.jobs() {
        assert_eq!((&job["answer"], &job["model"]), (&expected["answer"], &expected["model"]), "to the bit");
    }
    // nothing is left, and who is asked to cancel says so
    assert_eq!(run(&["fleet", "cancel", plant.path(), "a"]).status.code(), Some(1));
    for program in [sharing, second, third] {
        let (code, _, err) = program.end();
        assert_eq!(code, Some(0), "{err}");
    }
}

#[test]
fn cancelled_job_is_withdrawn_and_invalid_one_set_aside() {
    let Some(nats) = Nats::start() else { return };
    let plant = Plant::of_days(1..3, 3);
    let address = nats.address();
    let sharing = Program::start(&["fleet", "share", plant.path(), "--with", &address]);
    plant.says(&["fleet", "track", plant.path()], "2 new jobs.");
    until("both at the server", || plant.jobs().iter().all(|job| job["state"] == "running"));
    let id = plant.jobs()[0]["id"].as_str().unwrap().to_string();
    plant.says(&["fleet", "cancel", plant.path(), &id], "1 job cancelled.");
    let is_taken_back = || {
        let store = rusqlite::Connection::open(plant.path()).unwrap();
        let sql = "SELECT worker IS NULL FROM job WHERE state = 'cancelled'";
        store.query_row(sql, [], |row| row.get(0)).unwrap()
    };
    until("the job that is taken back", is_taken_back);
    let output = run(&["worker", &address, "--once"]);
    assert_eq!(String::from_utf8_lossy(&output.stdout), "1 job done.\n");
    until("the other answer", || plant.has_state("done") || plant.has_state("failed"));
    assert_eq!(sharing.end().0, Some(0));
}

#[test]
fn missing_effect_is_learned_and_better_model_deployed() {
    let bus = Bus::start();
    let plant = runup_of(1..3);
    assert!(summary(&plant).contains("not diagnosed yet"), "{}", summary(&plant));
    plant.says(&["fleet", "improve", plant.path()], "2 new jobs.");
    plant.says(&["worker", plant.path(), "--once"], "2 jobs done.");
    let said = summary(&plant);
    assert!(
        said.contains("missing: seal; the model with it is adequate")
            && said.contains("2 better models to deploy."),
        "{said}"
    );
    assert!(
        said.contains("no usable data, 2 of 2 monitors") && said.contains("no message was received"),
        "{said}"
    );

    let keys = plant.at("keys");
    std::fs::create_dir_all(format!("{keys}/hall1")).unwrap();
    let (key, state) = (format!("{keys}/hall1/2.key"), plant.at("monitor.state"));
    rotor_edge(Cli::parse_from(["rotor-edge", "key", "-o", &key])).unwrap();
    let spec = bus.spec();
    let words = ["rotor-edge", "node", "--bus", &spec, "--node", "2", "--key", &key, "--state", &state];
    let monitor = Cli::parse_from(words);
    // it ends with the test
    std::thread::spawn(|| rotor_edge(monitor));

    plant.says(&["fleet", "deploy", plant.path(), "north/hall1/2"], "1 model to deploy.");
    let deployments = || {
        let is_one = |job: &Value| job["command"] == "deploy";
        plant.jobs().into_iter().filter(is_one).collect::<Vec<_>>()
    };
    plant.says(&["worker", plant.path(), "--once"], "0 jobs done.");
    assert_eq!(deployments()[0]["state"], "waiting", "who is at no bus has no key");
    let at_bus = format!("hall1={spec}");
    let worker = ["worker", plant.path(), "--plant", "north", "--bus", &at_bus, "--keys", &keys, "--once"];
    plant.says(&worker, "1 job done.");
    assert_eq!(deployments()[0]["state"], "done", "{:?}", deployments());
    let held = std::fs::read(&state).unwrap();
    assert!(held.len() > 100, "the monitor keeps what it was sent");
    let said = summary(&plant);
    assert!(said.contains("1 better model to deploy."), "the other one's still: {said}");

    // no monitor 1 is on the bus, and nobody has its key
    plant.says(&["fleet", "deploy", plant.path()], "1 model to deploy.");
    plant.says(&worker, "1 job done.");
    let failed = &deployments()[1];
    assert!(failed["state"] == "failed" && failed["answer"].as_str().unwrap().contains("1.key"), "{failed}");
    let kept = std::fs::read(plant.path()).unwrap();
    let secret = std::fs::read(&key).unwrap();
    let secret = secret.trim_ascii();
    assert!(
        secret.len() >= 16 && !kept.windows(secret.len()).any(|part| part == secret),
        "no key in the store"
    );
}
