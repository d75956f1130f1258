//! The visible text of a page that `--report` writes.

/// Elements whose content is not shown, or is the same on every page.
const LEFT_OUT: [&str; 5] = ["script", "style", "noscript", "head", "details class=\"glossary\""];
/// Elements that do not end a line.
const INLINE: [&str; 10] = ["a", "b", "code", "em", "i", "small", "span", "strong", "sub", "sup"];

/// Text of an HTML page, one line for each element that begins a line.
pub fn visible_text(html: &str) -> String {
    let mut text = String::new();
    let mut rest = html;
    while let Some((before, after)) = rest.split_once('<') {
        text.push_str(before);
        let Some((tag, mut after)) = after.split_once('>') else { break };
        if let Some(element) = LEFT_OUT.iter().find(|element| begins(tag, element)) {
            let end = format!("</{}>", element.split(' ').next().expect("an element has a name"));
            after = after.split_once(&end).map_or("", |(_, behind)| behind);
        }
        let name: String =
            tag.trim_start_matches('/').chars().take_while(char::is_ascii_alphanumeric).collect();
        text.push(if INLINE.contains(&name.as_str()) { ' ' } else { '\n' });
        rest = after;
    }
    text.push_str(rest);
    let lines = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
    lines.filter(|line| !line.is_empty()).map(|line| decoded(&line) + "\n").collect()
}

fn begins(tag: &str, element: &str) -> bool {
    tag.strip_prefix(element).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
}

fn decoded(line: &str) -> String {
    let pairs = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#39;", "'"), ("&amp;", "&")];
    pairs.iter().fold(line.to_string(), |line, (from, to)| line.replace(from, to))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_text_leaves_out_scripts_and_keeps_svg_text() {
        let html = "<head><title>x</title></head><h1>A &amp; B</h1><script>let x = 1;</script>\
            <svg><path d=\"M0\"></path><text x=\"1\">disk 1</text></svg><p>6 <b>µm</b></p>\
            <details class=\"glossary\"><p>word</p></details>";
        assert_eq!(visible_text(html), "A & B\ndisk 1\n6 µm\n");
    }
}
