//! A day of the node in simulated time, in which everything goes wrong in turn: each second its state is compared with what
//! was true, and a table says how often which state was seen.
//!
//! A reading every four seconds. Every ten minutes another scene, drawn at random: 200 s of a healthy machine, 300 s of the
//! scene, 100 s to recover in, after which a flag is acknowledged. Every hour a deployment, in turn as it should be, with a
//! foreign key, sent twice, and cut short.

#![no_std]
#![no_main]

mod host;
mod power;
mod truth;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;
use rotor_edge_boards::monitor::{Monitor, Place};
use rotor_edge_core::can::isotp::IsoTp;
use rotor_edge_core::command::MAX_REQUEST_BYTES;
use rotor_edge_mps2_an386::state::StateMemory;
use rotor_edge_mps2_an386::{sample, stack};
use static_cell::StaticCell;

use host::{Host, Link};
use power::Powered;
use truth::{Scene, Table};

const DAY_S: u64 = 86_400;
const HOUR_S: u64 = 3_600;
const SCENE_S: u64 = 600;
const BEGIN_S: u64 = 200;
const END_S: u64 = 500;
/// When a flag is acknowledged: its evidence is past.
const ACKNOWLEDGE_S: u64 = 560;
/// After this every kind of event has happened, and the stack must not grow any further.
const SETTLED_S: u64 = 12 * HOUR_S;

static PLACE: Place = Place::new();
static REQUEST: StaticCell<[u8; MAX_REQUEST_BYTES]> = StaticCell::new();
static LINK: StaticCell<Link> = StaticCell::new();
static TABLE: StaticCell<Table> = StaticCell::new();

#[entry]
fn main() -> ! {
    stack::paint();
    // SAFETY: once, here.
    let (slots, journal) = unsafe { StateMemory::take() };
    let Ok((monitor, _)) = Monitor::start(&PLACE, Powered(slots), Powered(journal), sample::config()) else {
        panic!("the node does not start")
    };
    let request = REQUEST.init_with(|| [0; MAX_REQUEST_BYTES]);
    let mut host = Host::new(monitor, request, LINK.init_with(IsoTp::new), TABLE.init_with(Table::new));
    let mut settled_bytes = 0;
    let mut scene = Scene::Healthy;
    for second in 1..=DAY_S {
        let within_s = second % SCENE_S;
        if within_s == 0 {
            // Each once, then at random.
            let turn = (second / SCENE_S) as usize;
            scene = *Scene::ALL.get(turn).unwrap_or(&Scene::ALL[host.below(Scene::ALL.len())]);
        }
        let now = if (BEGIN_S..END_S).contains(&within_s) { scene } else { Scene::Healthy };
        match second % HOUR_S {
            // Without a model for the first minute.
            60 => host.deploy_in_some_way(second / HOUR_S),
            _ if within_s == ACKNOWLEDGE_S => host.acknowledge(),
            _ => {}
        }
        host.pass_a_second(second, now, scene);
        if second == SETTLED_S {
            settled_bytes = stack::high_water_bytes();
        }
    }
    host.table.print();
    hprintln!("stack {} of {} bytes", stack::high_water_bytes(), stack::size_bytes());
    assert_eq!((host.table.wrong_s, host.table.healthy_while_blind_s), (0, 0), "states that were not true");
    assert!(host.table.slowest_flag_s <= truth::FLAG_S, "a fault went unflagged");
    assert_eq!(stack::high_water_bytes(), settled_bytes, "the stack grew after hour {}", SETTLED_S / HOUR_S);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}
