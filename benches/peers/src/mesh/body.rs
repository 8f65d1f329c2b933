//! The arithmetic of one peer, the same for all programs: device, copy, coupling, average-position coordination, samples held, exact motion.

use std::time::Duration;

use cohaptic_peer::{Gains, Integrator, Plant};

use super::{COUPLING, DEVICE, HAND_FORCE, Mesh, OBJECT_MASS, Packet, TICK_NANOS};

/// How a body that nothing ties to ground moves in a tick: the rows of the exact step.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub struct Motion {
    /// By the velocity, and by the force held, the position changes so.
    pub x: [f64; 2],
    /// The velocity so.
    pub v: [f64; 2],
}

impl Motion {
    fn new(mass: f64, damping: f64) -> Self {
        let plant = Plant { mass, damping, stiffness: 0.0 };
        let ([[_, x_by_v], [_, v_by_v]], [x_by_f, v_by_f]) = plant.step(Duration::from_nanos(TICK_NANOS), Integrator::Exact).coefficients();
        Self { x: [x_by_v, x_by_f], v: [v_by_v, v_by_f] }
    }

    #[inline]
    fn advance(&self, x: &mut f64, v: &mut f64, force: f64) {
        let before = *v;
        *x += self.x[0] * before + self.x[1] * force;
        *v = before + (self.v[0] * before + self.v[1] * force);
    }
}

/// The numbers of the peers of a mesh.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Numbers {
    /// Of the device.
    pub device: Motion,
    /// Of the copy of the object.
    pub copy: Motion,
    /// KC and BC.
    pub coupling: Gains,
    /// KT and BT as they are applied: 4·(N−1)/N² of those of the scene, which is its scaling by the number of peers.
    pub gains: Gains,
}

impl Numbers {
    /// Those of this mesh.
    #[must_use]
    pub fn new(mesh: Mesh) -> Self {
        let n = mesh.peers as f64;
        Self {
            device: Motion::new(DEVICE.mass, DEVICE.damping),
            copy: Motion::new(OBJECT_MASS / n, 0.0),
            coupling: COUPLING,
            gains: mesh.scaled_gains(),
        }
    }
}

/// The newest sample of one other peer.
#[derive(Clone, Copy, Debug)]
struct Held {
    x: f64,
    v: f64,
    /// The lowest number that is newer.
    next: u64,
}

/// One peer.
#[derive(Clone, Debug)]
pub struct Body {
    numbers: Numbers,
    me: usize,
    hand: f64,
    device: [f64; 2],
    copy: [f64; 2],
    /// Of all peers in order, with this one left out.
    held: Vec<Held>,
    others: f64,
    mean: [f64; 2],
    stale: bool,
    delivered: u64,
}

impl Body {
    /// The peer of that number, at rest at the origin.
    #[must_use]
    pub fn new(mesh: Mesh, me: usize) -> Self {
        Self {
            numbers: Numbers::new(mesh),
            me,
            hand: if me == 0 { HAND_FORCE } else { 0.0 },
            device: [0.0; 2],
            copy: [0.0; 2],
            held: vec![Held { x: 0.0, v: 0.0, next: 0 }; mesh.peers - 1],
            others: (mesh.peers - 1) as f64,
            mean: [0.0; 2],
            stale: false,
            delivered: 0,
        }
    }

    /// All peers of a mesh.
    #[must_use]
    pub fn all(mesh: Mesh) -> Vec<Self> {
        (0..mesh.peers).map(|me| Self::new(mesh, me)).collect()
    }

    /// Position and velocity of the copy, which is what a peer sends.
    #[must_use]
    #[inline]
    pub const fn state(&self) -> [f64; 2] {
        self.copy
    }

    /// The packets received.
    #[must_use]
    pub const fn delivered(&self) -> u64 {
        self.delivered
    }

    /// Holds what a packet brings if it is newer than the held sample.
    #[inline]
    pub fn receive(&mut self, packet: &Packet) {
        self.delivered += 1;
        let place = if packet.from < self.me { packet.from } else { packet.from - 1 };
        let held = &mut self.held[place];
        if packet.sequence >= held.next {
            *held = Held { x: packet.x, v: packet.v, next: packet.sequence + 1 };
            self.stale = true;
        }
    }

    /// One control tick: forces from the held samples, then motion to the next tick.
    #[inline]
    pub fn tick(&mut self) {
        if self.stale {
            self.stale = false;
            self.mean = self.mean_held();
        }
        let Numbers { device, copy, coupling, gains } = &self.numbers;
        let ([xh, vh], [xo, vo]) = (&mut self.device, &mut self.copy);
        let coupling = coupling.stiffness * (*xh - *xo) + coupling.damping * (*vh - *vo);
        let coordination = gains.stiffness * (*xo - self.mean[0]) + gains.damping * (*vo - self.mean[1]);
        device.advance(xh, vh, self.hand - coupling);
        copy.advance(xo, vo, coupling - coordination);
    }

    /// Four partial sums, as this project has them, so that all compute the same mean.
    #[inline]
    fn mean_held(&self) -> [f64; 2] {
        let (mut x, mut v) = ([0.0; 4], [0.0; 4]);
        let mut quads = self.held.chunks_exact(4);
        for quad in &mut quads {
            for (sum, sample) in quad.iter().enumerate() {
                x[sum] += sample.x;
                v[sum] += sample.v;
            }
        }
        for (sum, sample) in quads.remainder().iter().enumerate() {
            x[sum] += sample.x;
            v[sum] += sample.v;
        }
        [x, v].map(|[a, b, c, d]| ((a + b) + (c + d)) / self.others)
    }
}
