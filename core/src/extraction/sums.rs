//! The sums of a least-squares fit `x = mean + Re(Y e^{iθ})`, and the weights of a window's first and last samples.

use nalgebra::Complex;

type C = Complex<f32>;

/// Mean and 1x phasor of a channel, counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HarmonicFit {
    pub mean: f32,
    pub phasor: C,
}

/// What is summed of one probe; x is a sample less the reference.
#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    /// Σ count, exact however many.
    counts: i64,
    /// The window's first count, taken off so that products keep their last bits.
    reference: f32,
    /// The last two x, by the parity of their number.
    last: [f32; 2],
    /// Σ x v̄ of the turn under way, and of the window's turns before.
    turn: C,
    window: C,
    /// What the weights at the window's edges add to Σ x.
    edges: f32,
}

/// Σ v and Σ v².
#[derive(Debug, Clone, Copy, Default)]
struct VectorSums {
    vectors: C,
    squares: C,
}

/// Sums over samples, `v = e^{iθ}` of their moments. All of a sample's work is in [`Sums::add`], which is written in plain
/// numbers: firmware that is built to be small calls a function for each complex product.
///
/// Floats and not integers: on a Cortex-M4F a 64-bit product sum (SMLAL) has to be loaded and stored as two words, which
/// costs what its one instruction saves.
#[derive(Debug, Clone)]
pub(super) struct Sums<const PROBES: usize> {
    channels: [Channel; PROBES],
    turn: VectorSums,
    window: VectorSums,
    /// The vectors of the last two samples, by the parity of their number.
    last: [C; 2],
    samples: u32,
    /// Time from the window's edge to its first sample, samples.
    age: f32,
    /// What the weights at the edges add to the number of samples.
    edges: f32,
    /// Bit i: probe i had a sample at a rail.
    clipped: u8,
}

/// Weights (less one) of the two samples nearest to a window's edge, the nearer first, for an edge `distance` samples beyond
/// it: trapezoidal rule, the piece up to the edge extrapolated in a straight line, and the first term of Euler and
/// Maclaurin for the rule's end.
fn edge_weights(distance: f32) -> [f32; 2] {
    let square = 0.5 * distance * distance;
    [distance + square - 0.5 - 1.0 / 12.0, 1.0 / 12.0 - square]
}

/// Of samples kept by parity, the one of this number.
fn kept<T: Copy>([even, odd]: [T; 2], number: u32) -> T {
    if number & 1 == 0 { even } else { odd }
}

impl<const PROBES: usize> Sums<PROBES> {
    /// Of a window that begins with a sample that comes `age` after its edge and is to be added.
    #[inline(always)]
    pub fn beginning(counts: &[i32; PROBES], age: f32) -> Self {
        Self {
            channels: counts.map(|count| Channel { reference: count as f32, ..Channel::default() }),
            turn: VectorSums::default(),
            window: VectorSums::default(),
            last: [C::default(); 2],
            samples: 0,
            age,
            edges: 0.0,
            clipped: 0,
        }
    }

    /// Begins such a window.
    #[inline(never)]
    pub fn begin(&mut self, counts: &[i32; PROBES], age: f32) {
        *self = Self::beginning(counts, age);
    }

    /// Adds a sample of each probe at the moment of a vector; without an angle, that is zero, and only means are of use.
    #[inline]
    pub fn add(&mut self, counts: &[i32; PROBES], vector: C, rails: [i32; 2]) {
        let (C { re, im }, [lowest, highest]) = (vector, rails);
        let VectorSums { vectors, squares } = &mut self.turn;
        vectors.re += re;
        vectors.im += im;
        squares.re += re * re - im * im;
        squares.im += 2.0 * re * im;
        let parity = (self.samples & 1) as usize;
        if let Some(last) = self.last.get_mut(parity) {
            *last = vector;
        }
        // one comparison for both rails: what lies at or below the lower one wraps to far above the other
        let first_inside = lowest.wrapping_add(1);
        let mut farthest = 0;
        for (channel, &count) in self.channels.iter_mut().zip(counts) {
            farthest = farthest.max(count.wrapping_sub(first_inside) as u32);
            channel.counts = channel.counts.wrapping_add(i64::from(count));
            let value = count as f32 - channel.reference;
            if let Some(last) = channel.last.get_mut(parity) {
                *last = value;
            }
            channel.turn.re += re * value;
            channel.turn.im -= im * value;
        }
        self.samples = self.samples.wrapping_add(1);
        if farthest >= highest.wrapping_sub(first_inside) as u32 {
            self.note_clipped(counts, rails);
        }
        if self.samples == 2 {
            self.weigh(0, edge_weights(self.age));
        }
    }

    #[cold]
    fn note_clipped(&mut self, counts: &[i32; PROBES], [lowest, highest]: [i32; 2]) {
        for (probe, &count) in counts.iter().enumerate() {
            self.clipped |= u8::from(count <= lowest || count >= highest) << probe;
        }
    }

    /// Bit i: probe i had a sample at a rail.
    pub fn clipped(&self) -> u8 {
        self.clipped
    }

    /// Ends the window `distance` samples after the last sample.
    pub fn end(&mut self, distance: f32) {
        self.weigh(self.samples.wrapping_sub(1), edge_weights(distance));
    }

    /// Adds to the weights of the last two samples: to that of this number, and to the other's.
    #[inline(never)]
    fn weigh(&mut self, nearest: u32, [of_nearest, of_other]: [f32; 2]) {
        for (number, weight) in [(nearest, of_nearest), (nearest.wrapping_add(1), of_other)] {
            let vector = kept(self.last, number);
            self.edges += weight;
            self.turn.vectors += vector * weight;
            self.turn.squares += vector * vector * weight;
            for channel in &mut self.channels {
                let value = weight * kept(channel.last, number);
                channel.edges += value;
                channel.turn += vector.conj() * value;
            }
        }
    }

    /// Adds the turn under way to those before; its phase lagged by `angle` in the mean (rad, small).
    pub fn end_turn(&mut self, angle: f32) {
        let by = 1.0 + super::phase::turned_less_one(angle);
        self.window.vectors += self.turn.vectors * by;
        self.window.squares += self.turn.squares * by * by;
        self.turn = VectorSums::default();
        let back = by.conj();
        for channel in &mut self.channels {
            channel.window += channel.turn * back;
            channel.turn = C::default();
        }
    }

    /// The mean of each channel over all samples, whole turns or not, with phasors of NaN.
    pub fn means(&self) -> [HarmonicFit; PROBES] {
        self.channels.map(|channel| HarmonicFit {
            mean: channel.reference + self.excess(&channel) / self.samples as f32,
            phasor: C::new(f32::NAN, f32::NAN),
        })
    }

    /// Σ x.
    fn excess(&self, channel: &Channel) -> f32 {
        let references = i64::from(channel.reference as i32).wrapping_mul(i64::from(self.samples));
        channel.counts.wrapping_sub(references) as f32
    }

    /// Solves, for each probe, with A = Σv/W and B = Σv²/W of the weight W:
    /// `Σx/W = mean + Re(Y A)`, `2 Σx v̄/W = 2 mean Ā + Y + B̄ Ȳ`.
    pub fn fits(&self) -> [HarmonicFit; PROBES] {
        let weight = self.samples as f32 + self.edges;
        let (a, b) = (self.window.vectors / weight, self.window.squares / weight);
        // with mean = X − Re(Y A): M Y-parts = right, the mean taken out
        let direct = 1.0 - a.norm_sqr();
        let mirrored = b.conj() - a.conj() * a.conj();
        let determinant = direct * direct - mirrored.norm_sqr();
        self.channels.map(|channel| {
            let mean = (self.excess(&channel) + channel.edges) / weight;
            let right = channel.window * (2.0 / weight) - a.conj() * (2.0 * mean);
            let phasor = (right * direct - mirrored * right.conj()) / determinant;
            HarmonicFit { mean: mean - (phasor * a).re + channel.reference, phasor }
        })
    }
}
