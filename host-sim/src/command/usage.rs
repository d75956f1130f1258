//! What is wrong with a command line, for who sees no usage beside it.

/// The first paragraph of a parser's message, on one line.
pub fn sentence(message: &str) -> String {
    let paragraph = message.split("\n\n").next().unwrap_or(message);
    let lines: Vec<&str> = paragraph.lines().map(str::trim).collect();
    lines.join(" ").trim_start_matches("error: ").to_string()
}
