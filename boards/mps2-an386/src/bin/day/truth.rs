//! What is true of the machine and its bus, which states that allows, and how often each was seen.

use cortex_m_semihosting::hprintln;
use rotor_edge_core::state::NodeState;

/// Evidence of this age is none any more; the default threshold.
pub const AGE_LIMIT_S: u64 = 10;
/// A fault is flagged within this: ten seconds of suspicion, three readings of four seconds each.
pub const FLAG_S: u64 = 30;
/// A new model has learned within this.
const LEARNING_S: u64 = 120;
/// The other one is forgotten within this.
const OTHER_S: u64 = 5;

/// What goes on.
#[derive(Clone, Copy, PartialEq)]
pub enum Scene {
    Healthy,
    /// Frames are lost, flipped, doubled and swapped.
    BadBus,
    /// Everybody else talks without a pause.
    Flood,
    ProbeLost,
    /// As many rows as unknowns are left.
    TwoProbesLost,
    /// Gap voltages of three probes say that they are not connected.
    ProbesOff,
    NoKeyphasor,
    TooFast,
    Absurd,
    Silence,
    OtherNode,
    /// Deployments, each cut off somewhere.
    PowerCuts,
    /// One bearing's vector grows and turns: no unbalance does that.
    Fault,
}

impl Scene {
    pub const ALL: [Self; 13] = [
        Self::Healthy,
        Self::BadBus,
        Self::Flood,
        Self::ProbeLost,
        Self::TwoProbesLost,
        Self::ProbesOff,
        Self::NoKeyphasor,
        Self::TooFast,
        Self::Absurd,
        Self::Silence,
        Self::OtherNode,
        Self::PowerCuts,
        Self::Fault,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Healthy => "healthy",
            Self::BadBus => "bad bus",
            Self::Flood => "flood",
            Self::ProbeLost => "1 probe lost",
            Self::TwoProbesLost => "2 probes lost",
            Self::ProbesOff => "3 gaps off",
            Self::NoKeyphasor => "no keyphasor",
            Self::TooFast => "too fast",
            Self::Absurd => "absurd values",
            Self::Silence => "silence",
            Self::OtherNode => "other node",
            Self::PowerCuts => "power cuts",
            Self::Fault => "fault",
        }
    }

    /// Whether a whole reading can be judged.
    pub fn can_be_judged(self) -> bool {
        !matches!(
            self,
            Self::TwoProbesLost | Self::ProbesOff | Self::NoKeyphasor | Self::TooFast | Self::Absurd
        )
    }
}

/// What is known beside the scene, in seconds of the whole day.
pub struct Truth {
    pub has_model: bool,
    pub deployed_s: u64,
    /// The last reading that was judged since the last start.
    pub judged_s: Option<u64>,
    /// Whether the last whole reading could be judged.
    pub can_be_judged: Option<bool>,
    /// A faulty reading was the last.
    pub is_faulty: bool,
    pub faulty_since_s: Option<u64>,
    pub is_flagged: bool,
    pub other_s: Option<u64>,
}

impl Truth {
    /// Looked at where the second ends.
    pub fn allows(&self, now_s: u64, state: NodeState) -> bool {
        if let Some(other_s) = self.other_s {
            match now_s - other_s {
                0..2 => return state == NodeState::Conflict,
                2..OTHER_S if matches!(state, NodeState::Conflict | NodeState::Listening) => return true,
                _ => {}
            }
        }
        if !self.has_model {
            return state == NodeState::NoModel;
        }
        if self.is_flagged {
            return state == NodeState::Flagged;
        }
        let is_fresh = self.judged_s.is_some_and(|judged_s| now_s - judged_s < AGE_LIMIT_S);
        let is_new = now_s - self.deployed_s <= LEARNING_S;
        match (self.can_be_judged, self.judged_s) {
            (None, _) => state == NodeState::Waiting,
            (Some(false), None) => state == NodeState::Blind,
            (Some(_), Some(_)) if !is_fresh => state == NodeState::Stale,
            (Some(false), _) => state == NodeState::Blind,
            (Some(true), _) => match state {
                NodeState::Tracking => true,
                NodeState::Learning => is_new,
                NodeState::Suspicious => self.is_faulty,
                _ => false,
            },
        }
    }
}

/// States in the order of the table's columns.
const COLUMNS: [(NodeState, &str); 10] = [
    (NodeState::Tracking, "track"),
    (NodeState::Learning, "learn"),
    (NodeState::Suspicious, "susp"),
    (NodeState::Flagged, "flag"),
    (NodeState::Waiting, "wait"),
    (NodeState::Blind, "blind"),
    (NodeState::Stale, "stale"),
    (NodeState::NoModel, "no model"),
    (NodeState::Conflict, "conflict"),
    (NodeState::Listening, "listen"),
];

/// Seconds of each state in each scene.
pub struct Table {
    seconds: [[u32; COLUMNS.len()]; Scene::ALL.len()],
    pub wrong_s: u32,
    pub healthy_while_blind_s: u32,
    pub slowest_flag_s: u64,
    pub faults: u32,
    pub starts: u32,
}

impl Table {
    pub const fn new() -> Self {
        Self {
            seconds: [[0; COLUMNS.len()]; Scene::ALL.len()],
            wrong_s: 0,
            healthy_while_blind_s: 0,
            slowest_flag_s: 0,
            faults: 0,
            starts: 0,
        }
    }

    pub fn saw(&mut self, scene: Scene, state: NodeState) {
        let row = Scene::ALL.iter().position(|&one| one == scene);
        let column = COLUMNS.iter().position(|&(one, _)| one == state);
        if let (Some(row), Some(column)) = (row, column) {
            self.seconds[row][column] += 1;
        }
    }

    pub fn print(&self) {
        hprintln!(
            "seconds of each state; of a scene's ten minutes, the first 200 s and the last 100 s are healthy"
        );
        let heads = COLUMNS.map(|(_, name)| name);
        hprintln!(
            "{:<14}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}",
            "",
            heads[0],
            heads[1],
            heads[2],
            heads[3],
            heads[4],
            heads[5],
            heads[6],
            heads[7],
            heads[8],
            heads[9]
        );
        for (scene, s) in Scene::ALL.iter().zip(&self.seconds) {
            hprintln!(
                "{:<14}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}",
                scene.name(),
                s[0],
                s[1],
                s[2],
                s[3],
                s[4],
                s[5],
                s[6],
                s[7],
                s[8],
                s[9]
            );
        }
        hprintln!("a state that was not true: {} s", self.wrong_s);
        hprintln!("\"healthy\" with no evidence within {} s: {} s", AGE_LIMIT_S, self.healthy_while_blind_s);
        hprintln!(
            "{} faults, the slowest flag after {} s; {} starts",
            self.faults,
            self.slowest_flag_s,
            self.starts
        );
    }
}
