//! `rotor-edge bus` and `rotor-edge decode` as a user meets them: real programs, real sockets.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::program::{assert_says, json, refusal, rotor_edge};
use crate::shared::{PATIENCE, Shared};
use nix::sys::signal::Signal;
use rotor_edge::bus::log::{LogReader, LogWriter, RecordingBus};
use rotor_edge::bus::wire::WireFrame;
use rotor_edge::bus::{CanBus, local_bus, open};
use rotor_edge::edge::{Deployment, EdgeNode, encoded};
use rotor_edge::sample;
use rotor_edge_core::can::{Frame, MonitorResult, NumberedReading, ResultAssembler, reading_frames};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_desktop::identify::{PhaseOneConfig, identify};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::rotor_file;
use tempfile::TempDir;

/// What an SLCAN client is told up to the answer to `V`.
fn until_version(stream: &mut TcpStream) -> Vec<u8> {
    let mut said = Vec::new();
    while !said.ends_with(b"V1013\r") {
        let mut byte = [0];
        stream.read_exact(&mut byte).unwrap();
        said.push(byte[0]);
    }
    said
}

fn frame(id: u16, number: u32) -> Frame {
    Frame::standard(id, &number.to_le_bytes()).unwrap()
}

fn hear(bus: &mut dyn CanBus) -> Frame {
    bus.receive(PATIENCE).unwrap().expect("a frame in time")
}

fn recorded(path: &Path) -> Vec<Frame> {
    let lines = LogReader::open(path).unwrap();
    lines.map(|line| line.unwrap().whole().unwrap().frame.unwrap().ours().unwrap()).collect()
}

#[test]
fn slcan_and_socketcand_share_bus_and_recording_is_complete() {
    const FRAMES: u32 = 2000;
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("both.log");
    let shared = Shared::start(&["--record", log.to_str().unwrap()]);
    let (mut slcan, mut socketcand) = (shared.join("slcan"), shared.join("socketcand"));
    let mut third = shared.join("slcan");
    for number in 0..FRAMES {
        slcan.send(&frame(0x100, number)).unwrap();
        socketcand.send(&frame(0x200, number)).unwrap();
    }
    for number in 0..FRAMES {
        assert_eq!(hear(&mut *socketcand), frame(0x100, number));
        assert_eq!(hear(&mut *slcan), frame(0x200, number));
    }
    let heard: Vec<Frame> = (0..2 * FRAMES).map(|_| hear(&mut *third)).collect();
    assert_eq!(recorded(&log), heard, "all hear the order of the recording");
    for id in [0x100, 0x200] {
        let of_one: Vec<Frame> = heard.iter().copied().filter(|frame| frame.raw_id() == id).collect();
        assert_eq!(of_one, (0..FRAMES).map(|number| frame(id, number)).collect::<Vec<_>>());
    }
    let (code, said) = shared.end(Signal::SIGTERM);
    assert_eq!(code, Some(0));
    assert_says(&said, &["4000 frames of 3 clients", "0 copies dropped", "0 lines refused"]);
}

#[test]
fn bus_exits_with_0_on_sigint_and_keeps_recording_on_sigkill() {
    assert_eq!(Shared::start(&[]).end(Signal::SIGINT).0, Some(0));
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("killed.log");
    let shared = Shared::start(&["--record", log.to_str().unwrap()]);
    let (mut from, mut to) = (shared.join("slcan"), shared.join("slcan"));
    let frames: Vec<Frame> = (0..100).map(|number| frame(1, number)).collect();
    for sent in &frames {
        from.send(sent).unwrap();
        hear(&mut *to);
    }
    assert_eq!(shared.end(Signal::SIGKILL).0, None);
    assert_eq!(recorded(&log), frames, "what was heard is recorded");
    let gone = to.receive(PATIENCE).unwrap_err();
    assert_says(&gone.to_string(), &["slcan:127.0.0.1", "closed by the other side"]);
}

#[test]
fn garbage_half_lines_and_clients_that_vanish_disturb_nobody() {
    let shared = Shared::start(&[]);
    let (mut from, mut to) = (shared.join("slcan"), shared.join("socketcand"));
    let noise: Vec<u8> = (0..20_000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for port in ["slcan_port", "socketcand_port"] {
        let mut stream = shared.raw(port);
        stream.write_all(&noise).unwrap();
        stream.write_all(b"\rO\rt12").unwrap();
        drop(stream);
    }
    let mut half = shared.raw("slcan_port");
    half.write_all(b"O\rV\rt1232").unwrap();
    assert_eq!(until_version(&mut half), b"\rV1013\r");
    from.send(&frame(5, 1)).unwrap();
    assert_eq!(hear(&mut *to), frame(5, 1));
    half.write_all(b"0a0B\rt123").unwrap();
    assert_eq!(hear(&mut *from), Frame::standard(0x123, &[10, 11]).unwrap());
    assert_eq!(hear(&mut *to), Frame::standard(0x123, &[10, 11]).unwrap());
    // a command in the middle of a line ends neither: it is refused, and the next line counts
    half.write_all(b"?\rV\r").unwrap();
    assert_eq!(until_version(&mut half), b"t005401000000\r\x07V1013\r");
    let (code, said) = shared.end(Signal::SIGTERM);
    assert_eq!(code, Some(0));
    assert!(!said.contains(" 0 lines refused"), "{said}");
}

/// What a server says up to the next closing bracket.
fn message(stream: &mut TcpStream) -> String {
    let mut said = Vec::new();
    while !said.ends_with(b">") {
        let mut byte = [0];
        stream.read_exact(&mut byte).unwrap();
        said.push(byte[0]);
    }
    String::from_utf8(said).unwrap()
}

/// python-can 4.6 reads an `< error … >` as a frame, whose identifier is then no number, and its reader ends.
#[test]
fn socketcand_says_nothing_to_remote_and_fd_frames() {
    let shared = Shared::start(&[]);
    let mut stream = shared.raw("socketcand_port");
    assert_eq!(message(&mut stream), "< hi >");
    for command in ["< open vcan0 >", "< rawmode >"] {
        stream.write_all(command.as_bytes()).unwrap();
        assert_eq!(message(&mut stream), "< ok >");
    }
    let mut other = shared.join("slcan");
    let fd = ["ff"; 64].join(" ");
    let sent = ["123 8 ", "123 C 1 2 3 4 5 6 7 8 9 a b c", &format!("12345678 40 {fd}")];
    sent.iter().for_each(|frame| stream.write_all(format!("< send {frame} >").as_bytes()).unwrap());
    // words of socketcand's branches
    stream.write_all(b"< fdsend 123 0 2 1 2 >< sendfd 123 0 2 1 2 >< sendrtr 00000123 0 >").unwrap();
    stream.write_all(b"< send 124 1 7 >").unwrap();
    assert_eq!(hear(&mut *other), Frame::standard(0x124, &[7]).unwrap());
    other.send(&frame(5, 1)).unwrap();
    assert!(message(&mut stream).starts_with("< frame 005 "), "the first word since");
    stream.write_all(b"< fly >").unwrap();
    assert_eq!(message(&mut stream), "< error unknown command >", "as socketcand says to any other word");
    assert_says(&shared.end(Signal::SIGTERM).1, &["7 lines refused"]);
}

#[test]
fn slcan_accepts_each_command_with_a_carriage_return() {
    let shared = Shared::start(&[]);
    let mut stream = shared.raw("slcan_port");
    stream.write_all(b"C\rS6\rZ0\rO\r").unwrap();
    let mut answers = [0; 4];
    stream.read_exact(&mut answers).unwrap();
    assert_eq!(answers, [b'\r'; 4]);
}

#[test]
fn a_frame_before_the_channel_is_open_is_refused() {
    let shared = Shared::start(&[]);
    let mut stream = shared.raw("slcan_port");
    let mut listener = shared.join("slcan");
    stream.write_all(b"t1230\rL\rt1230\rC\rO\rt1240\r").unwrap();
    // a bell for each frame, a carriage return for L, C and O
    let mut answers = [0; 5];
    stream.read_exact(&mut answers).unwrap();
    assert_eq!(&answers, b"\x07\r\x07\r\r");
    assert_eq!(hear(&mut *listener).raw_id(), 0x124);
}

#[test]
fn a_client_that_never_reads_misses_frames_and_stalls_nobody() {
    const IN_FLIGHT: usize = 1000;
    let mut shared = Shared::start(&[]);
    let (mut from, mut to) = (shared.join("slcan"), shared.join("socketcand"));
    let mut idle = shared.raw("slcan_port");
    idle.write_all(b"O\r").unwrap();
    let (report, reported) = std::sync::mpsc::channel();
    let mut stderr = shared.stderr.take().unwrap();
    let reader = std::thread::spawn(move || {
        let mut line = String::new();
        while stderr.read_line(&mut line).is_ok_and(|length| length > 0) {
            report.send(std::mem::take(&mut line)).unwrap();
        }
    });
    let mut waiting = VecDeque::new();
    let begun = Instant::now();
    let said = (0..).find_map(|number| {
        let sent = frame(7, number);
        from.send(&sent).unwrap();
        waiting.push_back(sent);
        if waiting.len() >= IN_FLIGHT {
            assert_eq!(hear(&mut *to), waiting.pop_front().unwrap(), "frame {number}");
        }
        assert!(begun.elapsed() < 6 * PATIENCE, "nothing was reported");
        reported.try_recv().ok()
    });
    assert_says(&said.unwrap(), &["slcan client 127.0.0.1", "does not read"]);
    for sent in waiting {
        assert_eq!(hear(&mut *to), sent);
    }
    drop(idle);
    assert_says(&reported.recv_timeout(PATIENCE).unwrap(), &["left; it missed", "because it did not read"]);
    assert_eq!(shared.end(Signal::SIGTERM).0, Some(0));
    assert_says(&reported.recv_timeout(PATIENCE).unwrap(), &["copies dropped for clients that did not read"]);
    reader.join().unwrap();
}

#[test]
fn socketcand_answers_come_one_a_packet_however_busy_the_bus_is() {
    let shared = Shared::start(&[]);
    let mut busy = shared.join("slcan");
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stop.load(std::sync::atomic::Ordering::Relaxed) {
                busy.send(&frame(0x321, 0)).unwrap();
            }
        });
        for _ in 0..5 {
            let mut stream = shared.raw("socketcand_port");
            // as python-can reads: whatever the packet holds must be the answer
            let mut packet = [0; 256];
            let mut answer = |stream: &mut TcpStream| {
                let length = stream.read(&mut packet).unwrap();
                String::from_utf8(packet[..length].to_vec()).unwrap()
            };
            assert_eq!(answer(&mut stream), "< hi >");
            stream.write_all(b"< open vcan0 >").unwrap();
            assert_eq!(answer(&mut stream), "< ok >");
            stream.write_all(b"< rawmode >").unwrap();
            assert_eq!(answer(&mut stream), "< ok >");
            assert!(answer(&mut stream).starts_with("< frame 321 "));
        }
        stop.store(true, std::sync::atomic::Ordering::Relaxed);
    });
}

#[test]
fn load_and_ports_are_printed_for_people_too() {
    let mut program = crate::program::program()
        .args(["bus", "--slcan", "0", "--socketcand", "0"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdout = BufReader::new(program.stdout.take().unwrap());
    let mut text = String::new();
    while !text.contains("Ctrl-C") {
        assert!(stdout.read_line(&mut text).unwrap() > 0, "{text}");
    }
    assert_says(&text, &["--bus slcan:127.0.0.1:", "--bus socketcand:127.0.0.1:", "socket://127.0.0.1:"]);
    assert_says(
        &text,
        &["4890 frames a second", "500 kbit/s     132 %   22", "1000 kbit/s      66 %   all 30"],
    );
    program.kill().unwrap();
    program.wait().unwrap();
}

#[test]
fn failed_bus_start_gives_reason_and_keeps_old_recording() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("older.log");
    std::fs::write(&log, "(1.0) can0 123#01\n").unwrap();
    let shared = Shared::start(&[]);
    let port = shared.opened["slcan_port"].to_string();
    let log_text = log.to_str().unwrap();
    let in_use = refusal(&["bus", "--slcan", &port, "--socketcand", "0", "--record", log_text]);
    assert_says(&in_use, &[&format!("port {port} is in use"), "--slcan PORT"]);
    assert_eq!(std::fs::read_to_string(&log).unwrap(), "(1.0) can0 123#01\n");
    let in_use = refusal(&["bus", "--slcan", "0", "--socketcand", &port]);
    assert_says(&in_use, &["--socketcand PORT"]);
    let nowhere = folder.path().join("no/folder/x.log").display().to_string();
    let unwritable = refusal(&["bus", "--slcan", "0", "--socketcand", "0", "--record", &nowhere]);
    assert_says(&unwritable, &["x.log", "cannot be written"]);
    assert_eq!(rotor_edge(&["bus", "--slcan", "70000"]).status.code(), Some(2));
}

#[cfg(target_os = "linux")]
#[test]
fn full_disk_ends_recording_with_error_and_bus_continues() {
    let mut shared = Shared::start(&["--record", "/dev/full"]);
    let (mut from, mut to) = (shared.join("slcan"), shared.join("slcan"));
    from.send(&frame(1, 1)).unwrap();
    let mut said = String::new();
    shared.stderr.as_mut().unwrap().read_line(&mut said).unwrap();
    assert_says(&said, &["the recording ends here", "the bus goes on", "No space left"]);
    assert_eq!(hear(&mut *to), frame(1, 1));
    for number in 2..5 {
        from.send(&frame(1, number)).unwrap();
        assert_eq!(hear(&mut *to), frame(1, number));
    }
    let (code, said) = shared.end(Signal::SIGTERM);
    assert_eq!(code, Some(1));
    assert_says(&said, &["/dev/full: the recording ended before the bus"]);
}

#[test]
fn buses_that_cannot_be_joined_say_what_to_do() {
    let refused = |spec: &str| open(spec).err().unwrap().to_string();
    let shared = Shared::start(&[]);
    let (slcan, socketcand) = (shared.spec("slcan"), shared.spec("socketcand"));
    let crossed = refused(&socketcand.replace("socketcand:", "slcan:").replace("/vcan0", ""));
    assert_says(&crossed, &["greets as a socketcand server"]);
    let crossed = refused(&slcan.replace("slcan:", "socketcand:"));
    assert_says(&crossed, &["does not answer as a socketcand server", "slcan:"]);
    let nobody = slcan.to_string();
    assert_eq!(shared.end(Signal::SIGTERM).0, Some(0));
    assert_says(&refused(&nobody), &["nobody listens at 127.0.0.1", "start `rotor-edge bus`"]);
    assert_says(&refused("slcan:/dev/ttyNOWHERE@115200"), &["/dev/ttyNOWHERE", "no such serial port"]);
    if cfg!(target_os = "linux") {
        assert_says(
            &refused("socketcan:nowhere0"),
            &["no interface nowhere0", "type vcan", "rotor-edge bus"],
        );
        assert_says(&refused("socketcan:lo"), &["lo is no CAN interface"]);
    }
}

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).display().to_string()
    }
}

/// The sample's record, told to a controller over a bus that is recorded; what the controller answered.
fn record_sample(
    rotor: &Rotor,
    readings: &[measurement::Reading],
    node: u8,
    log: &Path,
) -> Vec<MonitorResult> {
    let mut first_days = readings[..3].to_vec();
    first_days.extend(measurement::parse("run-up", sample::RUNUP_DAY_0, rotor).unwrap());
    let found = identify(rotor, &first_days, &PhaseOneConfig::default()).unwrap();
    let deployment = Deployment::new(&found.rotor, 12_000.0).unwrap();
    let mut controller = EdgeNode::new({
        let mut config = NodeConfig::new(node);
        config.listen_us = 0;
        config
    })
    .unwrap();
    controller.load(Ok(&encoded(&deployment.edge).unwrap())).unwrap();
    let [host, mut far] = <[_; 2]>::try_from(local_bus(2)).ok().unwrap();
    let mut host = RecordingBus::new(host, log).unwrap();
    let (mut answers, mut assembler) = (Vec::new(), ResultAssembler::new());
    for (row, measured) in readings.iter().enumerate() {
        for frame in reading_frames(node, &NumberedReading::new(row as u16, deployment.reading(measured))) {
            host.send(&frame).unwrap();
        }
        // the record's days: what is a flag after days is none after seconds
        let time_us = row as u64 * 86_400_000_000;
        controller.poll(time_us);
        while let Some(frame) = far.receive(Duration::ZERO).unwrap() {
            controller.receive(time_us, &frame);
        }
        while let Some(frame) = controller.transmit() {
            far.send(&frame).unwrap();
        }
        while let Some(frame) = host.receive(Duration::ZERO).unwrap() {
            answers.extend(assembler.receive(&frame));
        }
    }
    answers
}

#[test]
fn decoded_recording_equals_sent_record_and_results() {
    let folder = Folder::new();
    std::fs::write(folder.path("rotor.toml"), sample::ROTOR).unwrap();
    let rotor = rotor_file::read(&folder.path("rotor.toml")).unwrap();
    let record = measurement::parse("record", sample::RECORD, &rotor).unwrap();
    let answers = record_sample(&rotor, &record, 4, &folder.path("day.log"));
    let (log, csv, rotor_text) = (folder.text("day.log"), folder.text("back.csv"), folder.text("rotor.toml"));
    let all = json(&rotor_edge(&["decode", &log, "-o", &csv, "--rotor", &rotor_text, "--json"]));

    let back = measurement::read(Path::new(&csv), &rotor).unwrap();
    assert_eq!(back.len(), record.len());
    for (back, sent) in back.iter().zip(&record) {
        assert_eq!(back.speed_rpm as f32, sent.speed_rpm as f32);
        for (back, sent) in back.probes.iter().zip(&sent.probes) {
            assert_eq!(back.is_some(), sent.is_some());
            // half a unit of the fifth decimal, and f32 below 128 µm
            let far = back.zip(*sent).map_or(0.0, |(a, b)| (a - b).re.abs().max((a - b).im.abs()));
            assert!(far <= 0.5e-11 + 128e-6 * f64::from(f32::EPSILON), "{back:?} {sent:?}");
        }
    }
    let node = &all["nodes"][0];
    assert_eq!((&node["node"], &node["readings"]), (&4.into(), &record.len().into()));
    assert_eq!(node["counters"]["lost"], 0);
    assert!(node["heartbeats"].as_u64().unwrap() > 0);
    let results = node["results"].as_array().unwrap();
    assert_eq!(results.len(), answers.len());
    for (decoded, answer) in results.iter().zip(&answers) {
        assert_eq!(decoded["sequence"], answer.sequence);
        assert_eq!(decoded["ratio"].as_f64().unwrap() as f32, answer.ratio);
        let [x, y] = answer.unbalance_g_mm[1].map(f64::from);
        let size = decoded["planes"][1]["unbalance_g_mm"].as_f64().unwrap();
        assert!((size - x.hypot(y)).abs() <= 1e-9 * size, "{size}");
    }
    let text = String::from_utf8(rotor_edge(&["decode", &log]).stdout).unwrap();
    assert_says(&text, &["Node 4: 451 readings", "FLAGGED, bearing 2"]);
    // a loss of power cuts a line, and the next one begins behind it
    let whole = std::fs::read_to_string(&log).unwrap();
    let (first, rest) = whole.split_at(whole.len() / 2);
    std::fs::write(&log, format!("{first}#{rest}")).unwrap();
    let torn = json(&rotor_edge(&["decode", &log, "--json"]));
    assert_eq!(torn["torn"], 1);
    let readings = torn["nodes"][0]["readings"].as_u64().unwrap();
    assert!((450..=451).contains(&readings), "{readings}");
    assert_says(
        &String::from_utf8_lossy(&rotor_edge(&["decode", &log]).stdout),
        &["Damaged lines, ignored: 1"],
    );
}

#[test]
fn readings_of_several_nodes_are_written_one_node_at_a_time() {
    let folder = Folder::new();
    let vectors = [[1.0, 2.0], [f32::NAN, 4.0], [5.0, 6.0], [7.0, 8.0]];
    let reading = Reading::new(3000.1, &vectors.map(|[cos_um, sin_um]| ProbeVector { cos_um, sin_um }));
    let reading = reading.unwrap();
    let mut log = LogWriter::create(&folder.path("two.log")).unwrap();
    for (node, time_us) in [(1, 5_000_000), (2, 5_000_000 + 43_200_000_000)] {
        let frames = reading_frames(node, &NumberedReading::new(9, reading));
        log.write(time_us, frames.iter().map(WireFrame::from).collect::<Vec<_>>().iter()).unwrap();
    }
    let (log, csv) = (folder.text("two.log"), folder.text("out.csv"));
    assert_says(&refusal(&["decode", &log, "-o", &csv]), &["readings of nodes 1, 2", "--node"]);
    assert_says(&refusal(&["decode", &log, "-o", &csv, "--node", "3"]), &["no reading of node 3", "1, 2"]);
    assert!(!Path::new(&csv).exists());
    assert!(rotor_edge(&["decode", &log, "-o", &csv, "--node", "2"]).status.success());
    assert_eq!(
        std::fs::read_to_string(&csv).unwrap(),
        "time_d,speed_rpm,probe1_cos_um,probe1_sin_um,probe2_cos_um,probe2_sin_um,probe3_cos_um,probe3_sin_um,\
         probe4_cos_um,probe4_sin_um\n\
         0.5,3000.1,1.00000,2.00000,,,5.00000,6.00000,7.00000,8.00000\n"
    );
}

#[test]
fn unusable_logs_are_refused_with_row_and_expected_format() {
    let folder = Folder::new();
    let refused = |text: &str| {
        std::fs::write(folder.path("x.log"), text).unwrap();
        refusal(&["decode", &folder.text("x.log"), "-o", &folder.text("x.csv")])
    };
    let foreign = "(1.0) can0 7E8#0641000BE3E81300\n(1.1) can0 18DAF110#02\n";
    assert_says(&refused(foreign), &["x.log: a log of another protocol", "none of its 2 frames"]);
    assert_says(&refused("nonsense\n"), &["x.log, row 1: \"nonsense\"", "candump log"]);
    assert_says(&refused(""), &["x.log: the log holds no frame"]);
    assert!(!folder.path("x.csv").exists());
    assert_says(&refusal(&["decode", &folder.text("none.log")]), &["none.log: cannot be read"]);
}
