//! A particle swarm in Cartesian unbalance: no trigonometry in the loop, so bounds on |U| are discs.

/// Particles unless said otherwise.
pub const DEFAULT_PARTICLES: usize = 16;

/// How the particles move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwarmConfig {
    /// Moves of the whole swarm.
    pub iterations: u16,
    /// Share of its velocity a particle keeps.
    pub inertia: f32,
    /// Pull towards the best place the particle itself has seen.
    pub own_pull: f32,
    /// Pull towards the best place any particle has seen.
    pub swarm_pull: f32,
}

impl Default for SwarmConfig {
    fn default() -> Self {
        Self { iterations: 20, inertia: 0.6, own_pull: 1.4, swarm_pull: 1.6 }
    }
}
