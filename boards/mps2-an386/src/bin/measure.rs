//! x
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;
use rotor_edge_core::model::Model;
use rotor_edge_core::response::response;
use rotor_edge_core::track::{TrackConfig, Tracker};
use rotor_edge_mps2_an386::instructions::Counter;
use rotor_edge_mps2_an386::{sample, stack};

#[entry]
fn main() -> ! {
    stack::paint();
    let peripherals = cortex_m::Peripherals::take().unwrap();
    let counter = Counter::new(peripherals.SYST);
    let (n, _) = counter.count(|| unsafe { core::arch::asm!(".rept 1000", "nop", ".endr") });
    hprintln!("nops {}", n);
    let model = Model::<6>::decode(sample::MODEL).unwrap();
    let mut tracker = Tracker::new(&model);
    let config = TrackConfig::default();
    let (mut most, mut sum, mut number) = (0, 0, 0);
    let (mut least_r, mut most_r) = (u32::MAX, 0);
    for reading in sample::readings().filter(|r| r.is_complete()) {
        let (n, r) = counter.count(|| response(black_box(&model), black_box(reading.speed_rad_s()), &Default::default()).map(|r| (r.influence_matrix(), r.offset())));
        black_box(r.is_ok());
        least_r = n.min(least_r);
        most_r = n.max(most_r);
        let (n, e) = counter.count(|| tracker.update(black_box(&config), black_box(&model), black_box(&reading)));
        black_box(&e).as_ref().unwrap();
        most = n.max(most);
        sum += n;
        number += 1;
    }
    hprintln!("response {} {}", least_r, most_r);
    hprintln!("phase II: mean {} max {} of {}", sum / number, most, number);
    let x = black_box(2.0f32);
    let (n, r) = counter.count(|| (0..100).fold(x, |a, _| black_box(rotor_edge_core::reading::ProbeVector { cos_um: black_box(a), sin_um: 1.0 }.amplitude_um())));
    hprintln!("100 amplitudes {} {}", n, r);
    hprintln!("stack {} of {}", stack::high_water_bytes(), stack::size_bytes());
    debug::exit(debug::EXIT_SUCCESS);
    loop {}
}
