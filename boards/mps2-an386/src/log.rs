//! Lines of text on the second UART.

use core::fmt;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;

use crate::uart::UART1;

/// The log as something to write to.
pub struct Log;

impl fmt::Write for Log {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.bytes().for_each(|byte| UART1.write(byte));
        Ok(())
    }
}

/// Says why the program ends, byte by byte, since nothing else can be trusted any more, and starts it anew.
pub fn report_and_reset(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    let _ = fmt::Write::write_fmt(&mut LastWords, format_args!("{info}\r\n"));
    SCB::sys_reset()
}

struct LastWords;

impl fmt::Write for LastWords {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.bytes().for_each(|byte| UART1.write_at_once(byte));
        Ok(())
    }
}

/// Writes a line to the log.
#[macro_export]
macro_rules! log {
    ($($argument:tt)*) => {
        // The log never fails.
        let _ = core::fmt::Write::write_fmt(
            &mut $crate::log::Log,
            format_args!("{}\r\n", format_args!($($argument)*)),
        );
    };
}
