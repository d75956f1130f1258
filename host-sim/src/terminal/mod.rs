//! The one place where text for people goes to a terminal: lines wrap at words, tables fit.
//!
//! JSON, CSV, DBC files and completions are for programs and are printed as they are.

mod columns;
mod excerpt;
mod lines;
mod wrap;

pub use excerpt::{excerpted, listed};
pub use lines::fit;

use std::env;
use std::io::{self, IsTerminal as _, Write as _, stderr, stdout};

use terminal_size::{Width, terminal_size_of};
use unicode_width::UnicodeWidthStr as _;

/// Columns where there is no terminal.
const DEFAULT_COLUMNS: usize = 80;
/// Narrower terminals are treated as this wide.
const LEAST_COLUMNS: usize = 20;

/// Columns of text on standard output: `COLUMNS`, else the terminal's, else 80.
pub fn columns() -> usize {
    columns_of(terminal_size_of(stdout()).map(|(Width(columns), _)| columns))
}

fn columns_of(terminal: Option<u16>) -> usize {
    let stated = env::var("COLUMNS").ok().and_then(|columns| columns.trim().parse().ok());
    let columns = stated.filter(|&columns| columns > 0).or(terminal.map(usize::from));
    columns.unwrap_or(DEFAULT_COLUMNS).max(LEAST_COLUMNS)
}

/// Prints text on standard output. A table must be in one text, as its columns are laid out together.
///
/// # Panics
/// As `print!` does if standard output takes nothing any more.
pub fn print(text: &str) {
    print!("{}", fit(text, columns()));
}

/// Prints a message on standard error. A reader who is gone stops nothing.
pub fn tell(message: &str) {
    let columns = columns_of(terminal_size_of(stderr()).map(|(Width(columns), _)| columns));
    let _ = stderr().write_all(fit(&format!("{message}\n"), columns).as_bytes());
}

/// Prints an event of a program that runs on: wrapped on a terminal, one line in a log.
///
/// # Errors
/// If standard output takes nothing any more.
pub fn log(event: &str) -> io::Result<()> {
    let event = format!("{event}\n");
    let text = if stdout().is_terminal() { fit(&event, columns()) } else { event };
    stdout().write_all(text.as_bytes())
}

/// Ends the process as `clap` does, with help or a message that fits.
pub fn exit(error: &clap::Error) -> ! {
    let text: Vec<String> = error.render().to_string().lines().map(excerpted).collect();
    let text = text.join("\n") + "\n";
    if text == error.render().to_string() && text.lines().all(|line| line.width() <= columns()) {
        error.exit();
    }
    match error.use_stderr() {
        true => tell(text.trim_end()),
        false => print(&text),
    }
    std::process::exit(error.exit_code())
}

/// `println!` for a terminal's width.
#[macro_export]
macro_rules! say {
    ($($words:tt)*) => {
        $crate::terminal::print(&format!("{}\n", format_args!($($words)*)))
    };
}
