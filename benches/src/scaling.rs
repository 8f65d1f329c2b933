//! One scene on many threads, beyond the cores of this machine: a model with the figures that two cores give.
//!
//! Threads meet once in each window, the time between two instants at which samples are sent. In a window of a scene of N peers a thread moves its peers, eight at once, and draws the packets to them; then all wait
//! for each other at one counter, and each takes the N samples of all. With w the work of a window on one thread, m the time of a meeting of two and c that of taking a sample,
//!
//! ```text
//! time(t) = w·⌈⌈N/t⌉/8⌉/⌈N/8⌉ + m·t/2 + c·N,      t > 1
//! ```
//!
//! since each thread that comes to a counter takes it from the one before. w and time(2) are measured; c is that of a copy of its words out of the memory that cores share.

use std::hint::black_box;
use std::time::{Duration, Instant};

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_scene::Scene;

/// Words of a sample that threads exchange: its place, and position and velocity along three axes.
const WORDS: usize = 7;
/// The threads for which the time is given.
pub const THREADS: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Peers a register.
const LANES: usize = 8;

/// The times of a window.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    peers: usize,
    /// On one thread.
    work: Duration,
    /// Measured on two.
    on_two: Duration,
    /// Taking a sample of another thread.
    copy: Duration,
}

impl Window {
    /// Measures a scene of N peers that all send at the same instants, which lasts that number of windows: what that number of windows takes beyond one.
    ///
    /// # Errors
    ///
    /// As `scene`.
    pub fn measure<E>(scene: impl Fn(u32) -> Result<Scene, E>, windows: u32, rounds: usize) -> Result<Self, E> {
        let (one_window, scene) = (scene(1)?, scene(windows + 1)?);
        let wall = |scene: &Scene, threads: usize| {
            let start = Instant::now();
            let Ok(_) = Simulation::new(scene, Model::Least).on_threads(threads).run(black_box(&mut NoObserver));
            start.elapsed()
        };
        // All alternate; the least of each is the one that nobody else has disturbed.
        let round = || [1, 2].map(|threads| [&scene, &one_window].map(|scene| wall(scene, threads)));
        let least = |a: [Duration; 2], b: [Duration; 2]| [a[0].min(b[0]), a[1].min(b[1])];
        let rounds = (0..rounds.max(1)).map(|_| round()).reduce(|[a, b], [c, d]| [least(a, c), least(b, d)]);
        let [one, two] = rounds.unwrap_or_default().map(|[many, one]| many.saturating_sub(one) / windows);
        Ok(Self { peers: scene.peers.len(), work: one, on_two: two, copy: copy_of_a_sample() })
    }

    /// The work of a window on one thread.
    #[must_use]
    pub const fn work(&self) -> Duration {
        self.work
    }

    /// What each thread takes of the others in a window \[bytes\].
    #[must_use]
    pub const fn traffic(&self) -> usize {
        self.peers * WORDS * size_of::<f64>()
    }

    /// The time of a meeting of two threads: the rest of the time on two.
    #[must_use]
    pub fn meeting(&self) -> Duration {
        self.on_two.saturating_sub(self.share(2) + self.taking())
    }

    fn share(&self, threads: usize) -> Duration {
        let blocks = |peers: usize| peers.div_ceil(LANES);
        self.work.mul_f64(blocks(self.peers.div_ceil(threads)) as f64 / blocks(self.peers) as f64)
    }

    fn taking(&self) -> Duration {
        self.copy.mul_f64(self.peers as f64)
    }

    /// How many times as fast as one thread, and what most of the time goes to.
    #[must_use]
    pub fn gain(&self, threads: usize) -> (f64, &'static str) {
        if threads == 1 {
            return (1.0, "moving");
        }
        let parts = [(self.share(threads), "moving"), (self.meeting().mul_f64(threads as f64 / 2.0), "meeting"), (self.taking(), "taking")];
        let all: Duration = parts.iter().map(|(time, _)| *time).sum();
        let binds = parts.into_iter().max_by_key(|(time, _)| *time).map_or("", |(_, word)| word);
        (self.work.as_secs_f64() / all.as_secs_f64(), binds)
    }
}

/// The time in which a sample is copied out of a table that is too large for the caches of one core.
fn copy_of_a_sample() -> Duration {
    let many = 1 << 17;
    let from = vec![[1.0_f64; WORDS]; many];
    let mut to = vec![[0.0_f64; WORDS]; many];
    let start = Instant::now();
    to.copy_from_slice(black_box(&from));
    let took = start.elapsed();
    black_box(&to);
    took / u32::try_from(many).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_gives_on_two_threads_what_was_measured_there() {
        let micros = Duration::from_micros;
        let window = Window { peers: 200, work: micros(1000), on_two: micros(540), copy: Duration::from_nanos(10) };
        // 100 of 200 peers are 13 of 25 registers.
        assert_eq!(window.meeting(), micros(540 - 520 - 2));
        let (gain, binds) = window.gain(2);
        assert!((gain - 1000.0 / 540.0).abs() < 1e-9 && binds == "moving", "{gain} {binds}");
        // Of 64 threads each has four peers, which take as long as eight; 64 meet in 32 times the time of two.
        let (gain, binds) = window.gain(64);
        assert!((gain - 1000.0 / (40.0 + 576.0 + 2.0)).abs() < 1e-9 && binds == "meeting", "{gain} {binds}");
    }
}
