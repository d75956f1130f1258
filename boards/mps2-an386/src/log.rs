//! Lines of text on the second UART.

use core::fmt;

use crate::uart::UART1;

/// The log as something to write to.
pub struct Log;

impl fmt::Write for Log {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.bytes().for_each(|byte| UART1.write(byte));
        Ok(())
    }
}

/// The log when interrupts are off or nothing can be trusted: bytes go out one by one.
pub struct LastWords;

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
