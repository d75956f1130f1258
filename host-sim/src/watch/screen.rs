//! What somebody in front of the terminal has chosen: a monitor, and whether the picture stands still.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::Watch;

/// Whether to go on after a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    Go,
    Quit,
}

#[derive(Debug, Default)]
pub struct Screen {
    selected: Option<u8>,
    frozen: Option<Box<Watch>>,
}

impl Screen {
    /// Does what a key stands for.
    pub fn key(&mut self, watch: &mut Watch, key: KeyEvent) -> Flow {
        if key.kind == KeyEventKind::Release {
            return Flow::Go;
        }
        match key.code {
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => return Flow::Quit,
            KeyCode::Char('q') => return Flow::Quit,
            KeyCode::Down | KeyCode::Right | KeyCode::Tab => self.select(watch, 1),
            KeyCode::Up | KeyCode::Left | KeyCode::BackTab => self.select(watch, -1),
            KeyCode::Char('p') => {
                self.frozen = match self.frozen.take() {
                    None => Some(Box::new(watch.clone())),
                    Some(_) => None,
                };
            }
            KeyCode::Char('r') => {
                if let Some(node) = self.selected(watch) {
                    watch.clear(node);
                    self.frozen.iter_mut().for_each(|frozen| frozen.clear(node));
                }
            }
            _ => {}
        }
        Flow::Go
    }

    /// What is drawn: everything heard, until now or until the pause.
    pub fn shown<'a>(&'a self, watch: &'a Watch) -> &'a Watch {
        self.frozen.as_deref().unwrap_or(watch)
    }

    /// Whether the picture stands still.
    pub fn is_paused(&self) -> bool {
        self.frozen.is_some()
    }

    /// The monitor that is looked at: the chosen one, else the first.
    pub fn selected(&self, watch: &Watch) -> Option<u8> {
        self.selected.or_else(|| self.shown(watch).monitors().next().map(|(node, _)| node))
    }

    fn select(&mut self, watch: &Watch, step: isize) {
        let nodes: Vec<u8> = self.shown(watch).monitors().map(|(node, _)| node).collect();
        let at = nodes.iter().position(|node| Some(*node) == self.selected(watch));
        if let Some(at) = at {
            let next = (at as isize + step).rem_euclid(nodes.len() as isize);
            self.selected = Some(nodes[next as usize]);
        }
    }
}
