//! How fast a linear scene settles, from its spectral radius, with a constant that makes it a bound.
//!
//! From one frame to the next the relative state obeys z ← M·z. Let ρ be the spectral radius, γ = (1 + ρ)/2, and p the first power with ‖Mᵖ‖ ≤ γᵖ: there is one, since ‖Mᵏ‖^(1/k)
//! tends to ρ < γ. With κ the largest of ‖Mʲ‖/γʲ for j < p, every k = q·p + j has ‖Mᵏ‖ ≤ ‖Mᵖ‖^q·‖Mʲ‖ ≤ κ·γᵏ, so
//!
//! ```text
//! |z(k)| ≤ κ·γᵏ·|z(0)|,      a factor s is reached after k = ln(κ·s)/ln(1/γ) frames
//! ```
//!
//! Norms are Frobenius's, which bounds the Euclidean one. Positions count in metres, so two copies are no farther apart than √2·|z|.

use cohaptic_peer::Contact;
use cohaptic_stability::{Matrix, Method, Monodromy, StateKind, Verdict, analyse, monodromy};
use cohaptic_tests::{Draft, Log};

/// (position, velocity) of a device and of a copy.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Motion {
    pub(crate) device: (f64, f64),
    pub(crate) object: (f64, f64),
}

/// How fast a scene settles.
#[derive(Debug)]
pub(crate) struct Settling {
    monodromy: Monodromy,
    /// γ.
    pub(crate) rate: f64,
    /// κ.
    pub(crate) constant: f64,
}

impl Settling {
    /// Of a scene of one axis whose peers tick together; `None` unless the spectral radius is below 0.998 (a second, with frames of 4 ms, settles by e).
    pub(crate) fn of(draft: &Draft) -> Option<Self> {
        let scene = draft.scene();
        let analysis = analyse(&scene, Method::Reduced).unwrap();
        if analysis.verdict() != Verdict::Stable || analysis.radius.value > 0.998 {
            return None;
        }
        let rate = 0.5 * (1.0 + analysis.radius.value);
        let monodromy = monodromy(&scene).unwrap();
        let (mut power, mut bound, mut constant) = (Matrix::identity(monodromy.matrix.rows()), 1.0, 0.0_f64);
        loop {
            constant = constant.max(power.frobenius_norm() / bound);
            power = power.times(&monodromy.matrix);
            bound *= rate;
            if power.frobenius_norm() <= bound {
                return Some(Self { monodromy, rate, constant });
            }
        }
    }

    /// After how many frames every distance has shrunk to that part of |z|.
    pub(crate) fn frames(&self, part: f64) -> usize {
        ((self.constant / part).ln() / -self.rate.ln()).ceil() as usize
    }

    /// What |z| is at most so many frames later.
    pub(crate) fn later(&self, size: f64, frames: usize) -> f64 {
        self.constant * self.rate.powi(i32::try_from(frames).unwrap()) * size
    }

    /// How far rounding moves a state at most: in each frame by the error of the matrix and some roundings of positions of size `place`, which settle like everything else.
    pub(crate) fn rounding(&self, place: f64) -> f64 {
        self.constant / (1.0 - self.rate) * (self.monodromy.error + 1e-13) * place
    }

    /// Ticks in a frame.
    pub(crate) fn ticks(&self) -> usize {
        self.monodromy.frame.as_millis() as usize
    }

    /// The age of the oldest sample that is part of the state, in frames.
    pub(crate) fn memory(&self) -> usize {
        let age = |kind: StateKind| match kind {
            StateKind::SamplePosition { age, .. } | StateKind::SampleVelocity { age, .. } => age,
            StateKind::SampleForce { age, .. } | StateKind::SampleWave { age, .. } => age,
            StateKind::DevicePosition { .. }
            | StateKind::DeviceVelocity { .. }
            | StateKind::ObjectPosition { .. }
            | StateKind::ObjectVelocity { .. }
            | StateKind::PendingCoupling { .. }
            | StateKind::PendingForce { .. }
            | StateKind::LatestPosition { .. }
            | StateKind::LatestVelocity { .. }
            | StateKind::ReadingPosition { .. }
            | StateKind::ReadingVelocity { .. }
            | StateKind::KeptCoupling { .. }
            | StateKind::Memory { .. }
            | StateKind::WantedPosition { .. }
            | StateKind::SeenPosition { .. } => 0,
        };
        self.monodromy.states.iter().map(|state| age(state.kind)).max().unwrap_or(0)
    }

    /// |z| at the beginning of a frame, from the motions of every peer, tick by tick. What was sent in the frames before must have been what is held and on the way.
    pub(crate) fn size(&self, draft: &Draft, motions: &[Vec<Motion>], frame: usize) -> f64 {
        let start = frame * self.ticks();
        let reference = self.monodromy.relative[0][0].map_or(0.0, |peer| motions[peer][start].object.0);
        let time = self.monodromy.time;
        let sample = |peer: usize, age: usize| {
            let every = (draft.update / 1000) as usize;
            let phase = draft.peers[peer].phase as usize;
            let mut sent = (0..start).rev().filter(|tick| tick % every == phase);
            motions[peer][sent.nth(age - 1).unwrap()].object
        };
        let value = |peer: usize, kind: StateKind| match kind {
            // A device that touches nothing is relative to nothing.
            StateKind::DevicePosition { .. } if draft.peers[peer].contact == Contact::None => motions[peer][start].device.0,
            StateKind::DevicePosition { .. } => motions[peer][start].device.0 - reference,
            StateKind::DeviceVelocity { .. } => motions[peer][start].device.1 * time,
            StateKind::ObjectPosition { .. } => motions[peer][start].object.0 - reference,
            StateKind::ObjectVelocity { .. } => motions[peer][start].object.1 * time,
            StateKind::SamplePosition { age, .. } => sample(peer, age).0 - reference,
            StateKind::SampleVelocity { age, .. } => sample(peer, age).1 * time,
            StateKind::PendingCoupling { .. }
            | StateKind::PendingForce { .. }
            | StateKind::LatestPosition { .. }
            | StateKind::LatestVelocity { .. }
            | StateKind::ReadingPosition { .. }
            | StateKind::ReadingVelocity { .. }
            | StateKind::KeptCoupling { .. }
            | StateKind::Memory { .. }
            | StateKind::WantedPosition { .. }
            | StateKind::SeenPosition { .. }
            | StateKind::SampleForce { .. }
            | StateKind::SampleWave { .. } => {
                unreachable!("no computation delay, no slow device, nothing remembered, no operator, no server")
            }
        };
        self.monodromy.states.iter().map(|state| value(state.peer, state.kind).powi(2)).sum::<f64>().sqrt()
    }
}

/// The motions of every peer, tick by tick.
pub(crate) fn motions(log: &Log, peers: usize) -> Vec<Vec<Motion>> {
    let pair = |body: cohaptic_tests::Body| (body.position[0], body.velocity[0]);
    let of = |peer| log.of(peer).into_iter().map(|tick| Motion { device: pair(tick.device), object: pair(tick.object) }).collect();
    (0..peers).map(of).collect()
}

/// The largest distance of two copies at a tick \[m\].
pub(crate) fn spread(motions: &[Vec<Motion>], tick: usize) -> f64 {
    let places = || motions.iter().map(|motion| motion[tick].object.0);
    places().fold(f64::MIN, f64::max) - places().fold(f64::MAX, f64::min)
}
