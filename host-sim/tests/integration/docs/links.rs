//! Every relative link of a page leads to a file and a heading that are there.

use std::collections::BTreeSet;
use std::fs;

use pulldown_cmark::{Event, Parser as Markdown, Tag, TagEnd};

use super::pages;

/// As GitHub and mdBook name a heading.
pub fn anchor(heading: &str) -> String {
    let kept = heading
        .to_lowercase()
        .chars()
        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
        .collect::<String>();
    kept.replace(' ', "-")
}

fn anchors(page: &str) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    let mut heading: Option<String> = None;
    for event in Markdown::new(page) {
        match event {
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::Text(text) | Event::Code(text) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&text);
                }
            }
            Event::End(TagEnd::Heading(_)) => all.extend(heading.take().map(|heading| anchor(&heading))),
            _ => {}
        }
    }
    all
}

#[test]
fn every_relative_link_leads_to_existing_file_and_heading() {
    let mut checked = 0;
    for path in pages() {
        let page = fs::read_to_string(&path).unwrap();
        for event in Markdown::new(&page) {
            let (Event::Start(Tag::Link { dest_url, .. }) | Event::Start(Tag::Image { dest_url, .. })) =
                event
            else {
                continue;
            };
            if dest_url.contains("://") {
                continue;
            }
            let (file, heading) = dest_url.split_once('#').map_or((&*dest_url, None), |(f, h)| (f, Some(h)));
            let target = if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            assert!(target.exists(), "{}: {dest_url} is not there", path.display());
            if let Some(heading) = heading {
                let there = anchors(&fs::read_to_string(&target).unwrap());
                assert!(
                    there.contains(heading),
                    "{}: {dest_url}: no such heading among {there:?}",
                    path.display()
                );
            }
            checked += 1;
        }
    }
    assert!(checked > 40, "{checked}");
}
