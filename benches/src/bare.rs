//! The same work in a hand-written loop without any abstraction: the limit of what one core can do, and what the program's speed is set against.
//!
//! It computes what a run of the mesh scene computes with nothing recorded but counters: N devices and copies, coupling and average-position
//! forces, and exact motion. Each peer sends a packet to each other, with delay, loss and jitter. It keeps the newest sample of each sender, the mean
//! when one has changed, the counters of every link, and the largest discrepancy. It leaves out what a program needs and a loop does not: bytes on
//! the wire, a second axis, another strategy, another order of events, an observer, any check. The random numbers are the program's.

use std::collections::VecDeque;

use cohaptic_benches_common::mesh::{COUPLING, DELAY_NANOS, DEVICE, HAND_FORCE, LOSS, Mesh, OBJECT_MASS, SD_NANOS, TICK_NANOS, TICKS_A_FRAME};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{LinkName, standard_normal};

use crate::COPY_DAMPING;

/// What the loop ends with.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// Position of each copy \[m\].
    pub positions: Vec<f64>,
    /// Packets delivered over all links.
    pub delivered: u64,
    /// The largest distance between two copies \[m\].
    pub max_discrepancy: f64,
}

#[derive(Clone, Copy, Default)]
struct Counters {
    offered: u64,
    delivered: u64,
    lost: u64,
    found_full: u64,
    delay_nanos: u128,
}

#[derive(Clone, Copy)]
struct Packet {
    arrival: u64,
    sent: u64,
    sequence: u64,
    from: usize,
    to: usize,
    x: f64,
    v: f64,
}

#[derive(Clone, Copy)]
struct Held {
    x: f64,
    v: f64,
    next: u64,
}

/// A tail-drop queue before a line of one rate, for packets of one size: Lindley's recursion over the instants at which packets leave.
#[derive(Clone, Copy, Debug)]
pub struct Queue {
    /// The time of a packet on the line \[ns\].
    pub service: u64,
    /// How many packets fit into it, the one on the line among them.
    pub limit: u64,
}

impl Queue {
    /// 64 bytes at 10 Mbit/s, up to 100 of them: none waits that comes every 8 ms.
    pub const NEVER_FULL: Self = Self { service: 51_200, limit: 100 };
    /// 64 bytes at 60 kbit/s, up to 8 of them.
    pub const FULL: Self = Self { service: 8_533_334, limit: 8 };
}

/// Coefficients of the motion of a free damped mass over a tick, from the closed form.
struct Motion {
    x_by_v: f64,
    x_by_f: f64,
    v_by_v: f64,
    v_by_f: f64,
}

impl Motion {
    fn new(mass: f64, damping: f64) -> Self {
        let h = TICK_NANOS as f64 / 1e9;
        if damping == 0.0 {
            return Self { x_by_v: h, x_by_f: h * h / 2.0 / mass, v_by_v: 0.0, v_by_f: h / mass };
        }
        let decay = -(-damping / mass * h).exp_m1();
        let reached = decay * mass / damping;
        Self { x_by_v: reached, x_by_f: (h - reached) / damping, v_by_v: -decay, v_by_f: decay / damping }
    }
}

/// Runs the mesh for a number of ticks.
#[must_use]
pub fn run(mesh: Mesh, ticks: u64) -> Outcome {
    run_through(None, mesh, ticks)
}

/// Runs the mesh for a number of ticks, each link with such a queue.
#[must_use]
pub fn run_through(queue: Option<Queue>, mesh: Mesh, ticks: u64) -> Outcome {
    let n = mesh.peers;
    let others = (n - 1) as f64;
    let device = Motion::new(DEVICE.mass, DEVICE.damping);
    let copy = Motion::new(OBJECT_MASS / n as f64, COPY_DAMPING);
    let gains = mesh.scaled_gains();
    let names: Vec<String> = (0..n).map(|i| format!("peer{}", i + 1)).collect();
    let stream = |link: usize| Stream::new(1, LinkName::between(&names[link / n], &names[link % n]).as_str().as_bytes());
    let draws: Vec<Stream> = (0..n * n).map(stream).collect();
    let loss_bound = LOSS * 9_007_199_254_740_992.0;

    let (mut xh, mut vh) = (vec![0.0; n], vec![0.0; n]);
    let (mut xo, mut vo) = (vec![0.0; n], vec![0.0; n]);
    let mut hand = vec![0.0; n];
    hand[0] = HAND_FORCE;
    let mut held = vec![Held { x: 0.0, v: 0.0, next: 0 }; n * n];
    let (mut mean_x, mut mean_v, mut stale) = (vec![0.0; n], vec![0.0; n], vec![false; n]);
    let mut counters = vec![Counters::default(); n * n];
    let mut leaves = vec![0_u64; if queue.is_some() { n * n } else { 0 }];
    let mut ring: VecDeque<Packet> = VecDeque::new();
    let mut wheel: Vec<Vec<Packet>> = vec![Vec::new(); 128];
    let mut max_discrepancy = 0.0_f64;

    for tick in 0..ticks {
        let now = tick * TICK_NANOS;
        if tick % TICKS_A_FRAME == 0 {
            let sequence = tick / TICKS_A_FRAME;
            for from in 0..n {
                for to in 0..n {
                    if from == to {
                        continue;
                    }
                    let link = from * n + to;
                    counters[link].offered += 1;
                    let mut packet = Packet { arrival: now + DELAY_NANOS, sent: now, sequence, from, to, x: xo[from], v: vo[from] };
                    if mesh.impaired {
                        let words = draws[link].packet(sequence);
                        let [loss_word, jitter_word] = words.loss_and_jitter();
                        if ((loss_word >> 11) as f64) < loss_bound {
                            counters[link].lost += 1;
                            continue;
                        }
                        if let Some(Queue { service, limit }) = queue {
                            // The latest departure says how many wait.
                            if leaves[link].saturating_sub(now) > service * limit {
                                counters[link].found_full += 1;
                                continue;
                            }
                            leaves[link] = leaves[link].max(now) + service;
                            packet.arrival = leaves[link] + DELAY_NANOS;
                        }
                        let mut more = words.more(Purpose::Jitter);
                        let z = standard_normal(jitter_word, || more.next_word());
                        packet.arrival = packet.arrival.saturating_add_signed((z * SD_NANOS).round_ties_even() as i64);
                        wheel[packet.arrival.div_ceil(TICK_NANOS).max(tick) as usize % 128].push(packet);
                    } else {
                        ring.push_back(packet);
                    }
                }
            }
        }
        let mut receive = |packet: Packet| {
            let counters = &mut counters[packet.from * n + packet.to];
            counters.delivered += 1;
            counters.delay_nanos += u128::from(packet.arrival - packet.sent);
            let held = &mut held[packet.to * n + packet.from];
            if packet.sequence >= held.next {
                *held = Held { x: packet.x, v: packet.v, next: packet.sequence + 1 };
                stale[packet.to] = true;
            }
        };
        if mesh.impaired {
            wheel[tick as usize % 128].drain(..).for_each(&mut receive);
        } else {
            while ring.front().is_some_and(|packet| packet.arrival <= now) {
                if let Some(packet) = ring.pop_front() {
                    receive(packet);
                }
            }
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..n {
            if stale[i] {
                // Four partial sums, as the program does, so that both compute the same mean.
                let (mut sums_x, mut sums_v) = ([0.0; 4], [0.0; 4]);
                let row = &held[i * n..(i + 1) * n];
                for (place, sample) in row[..i].iter().chain(&row[i + 1..]).enumerate() {
                    sums_x[place % 4] += sample.x;
                    sums_v[place % 4] += sample.v;
                }
                mean_x[i] = ((sums_x[0] + sums_x[1]) + (sums_x[2] + sums_x[3])) / others;
                mean_v[i] = ((sums_v[0] + sums_v[1]) + (sums_v[2] + sums_v[3])) / others;
                stale[i] = false;
            }
            let coupling = COUPLING.stiffness * (xh[i] - xo[i]) + COUPLING.damping * (vh[i] - vo[i]);
            let coordination = gains.stiffness * (xo[i] - mean_x[i]) + gains.damping * (vo[i] - mean_v[i]);
            low = if xo[i] < low { xo[i] } else { low };
            high = if xo[i] > high { xo[i] } else { high };
            let force = hand[i] - coupling;
            xh[i] += device.x_by_v * vh[i] + device.x_by_f * force;
            vh[i] += device.v_by_v * vh[i] + device.v_by_f * force;
            let force = coupling - coordination;
            xo[i] += copy.x_by_v * vo[i] + copy.x_by_f * force;
            vo[i] += copy.v_by_v * vo[i] + copy.v_by_f * force;
        }
        max_discrepancy = max_discrepancy.max(high - low);
    }
    Outcome { positions: xo, delivered: counters.iter().map(|link| link.delivered).sum(), max_discrepancy }
}
