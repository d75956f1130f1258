//! The core behind Modbus instead of CAN: a master reads the state of a monitor as registers.
//!
//! `cargo run -p rotor-edge-core --no-default-features --example modbus`. The frames are those of Modbus RTU. The machine is
//! simulated; halfway, its bearing 2 loses half of the stiffness upwards. The firmware in `examples/firmware` answers with
//! the same registers.

#[path = "firmware/registers.rs"]
mod registers;

mod machine;

use crc::{CRC_16_MODBUS, Crc};
use machine::{MachineModel, model, reading, seen, with_softer_bearing};
use registers::{REGISTERS, answer, registers};
use rotor_edge_core::monitor::Monitor;
use rotor_edge_core::reading::Keyphasor;
use rotor_edge_core::state::NodeState;
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_core::track::TrackConfig;

const ADDRESS: u8 = 17;
const SECOND_US: u64 = 1_000_000;

fn main() {
    let mut monitor =
        Monitor::<2, 4, 2>::new(TrackConfig::default(), Thresholds::DEFAULT).expect("the usual");
    monitor.set_model(model()).expect("it was checked");
    let worn: MachineModel = with_softer_bearing(&model());
    for second in 0..240 {
        let machine = if second < 120 { &model() } else { &worn };
        let reading = reading(machine, 9000.0, &seen([[2900.0, 4100.0], [-1100.0, 1900.0]], second));
        monitor.take(second * SECOND_US, &reading, Keyphasor::Locked);
        if second % 60 == 59 {
            let read = asked(&monitor, second * SECOND_US);
            println!(
                "{second:4} s: state {}, suspected bearing {}, plane 1 [{:.0}, {:.0}] g·mm",
                read[0],
                read[3],
                float(&read[8..]),
                float(&read[10..])
            );
        }
    }
    let read = asked(&monitor, 239 * SECOND_US);
    assert_eq!([read[0], read[3]], [NodeState::Flagged as u16, 2], "bearing 2, counted from one");
    assert_eq!(asked(&monitor, 300 * SECOND_US)[5], 61, "seconds since the last verdict");
}

/// All registers, as a master gets them.
fn asked(monitor: &Monitor<2, 4, 2>, time_us: u64) -> [u16; REGISTERS] {
    let request = framed(&[ADDRESS, 4, 0, 0, 0, REGISTERS as u8]);
    let answer =
        answer(&request, ADDRESS, &registers(monitor, time_us)).expect("the request is for this device");
    let (body, _) = answer.split_last_chunk::<2>().expect("a CRC");
    assert_eq!(framed(body)[..], answer[..]);
    assert_eq!(body[..3], [ADDRESS, 4, 2 * REGISTERS as u8]);
    let mut words = body[3..].chunks_exact(2).map(|word| u16::from_be_bytes([word[0], word[1]]));
    [0; REGISTERS].map(|_| words.next().expect("as many as were asked for"))
}

fn framed(body: &[u8]) -> Vec<u8> {
    let crc = Crc::<u16>::new(&CRC_16_MODBUS).checksum(body).to_le_bytes();
    [body, &crc].concat()
}

fn float(words: &[u16]) -> f32 {
    f32::from_bits(u32::from(words[0]) << 16 | u32::from(words[1]))
}

#[test]
fn a_master_reads_the_worn_bearing() {
    main();
}

/// The example of the Modbus specification's CRC (serial line guide V1.02, appendix B): 02 07 is followed by 41 12.
#[test]
fn crc_is_that_of_the_specification() {
    assert_eq!(framed(&[0x02, 0x07]), [0x02, 0x07, 0x41, 0x12]);
}

#[test]
fn wrong_requests_get_an_exception_or_silence() {
    let none = [0; REGISTERS];
    let ask = |body: &[u8]| answer(&framed(body), ADDRESS, &none).map(|answer| answer.to_vec());
    assert_eq!(ask(&[ADDRESS, 6, 0, 0, 0, 1]), Some(framed(&[ADDRESS, 0x86, 1])));
    assert_eq!(ask(&[ADDRESS, 4, 0, 9, 0, 8]), Some(framed(&[ADDRESS, 0x84, 2])));
    assert_eq!(ask(&[ADDRESS, 4, 0, 0, 0, 0]), Some(framed(&[ADDRESS, 0x84, 2])));
    assert_eq!(ask(&[ADDRESS + 1, 4, 0, 0, 0, 1]), None);
    assert_eq!(answer(&[ADDRESS, 4, 0, 0, 0, 1, 0, 0], ADDRESS, &none), None);
}
