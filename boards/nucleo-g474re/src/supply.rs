//! The supply: why the chip started, and whether it will last long enough to write flash.

use defmt::intern;
use embassy_stm32::pac;

/// The detector's threshold, about 2.9 V: what is left above the 1.71 V that flash needs must carry a save, 50 ms.
const THRESHOLD: u8 = 6;
/// Brown-out level 4 of the option bytes, about 2.8 V.
const BROWN_OUT_LEVEL: u8 = 4;

/// Starts the detector and says why the chip was reset.
pub fn start() {
    pac::PWR.cr2().modify(|control| {
        control.set_pls(THRESHOLD);
        control.set_pvde(true);
    });
    let causes = pac::RCC.csr().read();
    for (is_set, cause) in [
        (causes.borrstf(), intern!("brown-out or power-on")),
        (causes.iwdgrstf(), intern!("the watchdog: the program hung")),
        (causes.sftrstf(), intern!("the program itself")),
        (causes.pinrstf(), intern!("the reset pin")),
    ] {
        if is_set {
            defmt::info!("reset by {=istr}", cause);
        }
    }
    pac::RCC.csr().modify(|causes| causes.set_rmvf(true));
    if pac::FLASH.optr().read().bor_lev() < BROWN_OUT_LEVEL {
        defmt::warn!("brown-out level below 4: set it in the option bytes (README)");
    }
}

/// The supply is below the detector's threshold: no time to erase and write.
pub fn is_low() -> bool {
    pac::PWR.sr2().read().pvdo()
}
