//! Objects that turn: what an ideal network conserves, and the damping with which a grasp makes no energy.
//!
//! **Grasp.** Devices do not turn, BC = BT = BR = 0, all tick together every h and no sample in force is older than m ticks. Of the dampings bH, bO and bR let c, β and β′
//! be set aside with ½·h·KC·(1/c + 1/β + r²/β′) ≤ 1, and of bR ½·r·F·h more, F the largest coupling force, at most √(2·KC·E₀) without hands: the lever is held in body
//! axes while the force is held in world axes. If the rest of bO is at least KT·(m + 1)·h and the rest of bR at least κ·(m + 1)·h, κ the largest KR, all kinetic energy
//! and what the springs store never exceed their first value E₀.

use core::convert::Infallible;
use std::path::Path;

use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::Scene;
use cohaptic_tests_common::{cases, properties};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

type Triple = [f64; 3];

/// A tick \[s\].
const H: f64 = 1e-3;

/// A peer at a tick.
#[derive(Clone, Debug)]
struct Moment {
    /// Position and velocity of the device, then of the copy.
    device: [Triple; 2],
    copy: [Triple; 2],
    attitude: Attitude,
    handle: Option<Attitude>,
    /// FC, FT, the torque of the coupling and τT.
    forces: [Triple; 4],
}

struct Seen(Vec<Moment>);

impl Observer for Seen {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let triple = |numbers: &[f64]| Triple::try_from(numbers).unwrap();
        let turn = row.turn.unwrap();
        self.0.push(Moment {
            device: [triple(row.device.position), triple(row.device.velocity)],
            copy: [triple(row.object.position), triple(row.object.velocity)],
            attitude: *turn.object,
            handle: turn.device.copied(),
            forces: [triple(row.coupling_force), triple(row.coordination_force), *turn.coupling_torque, *turn.coordination_torque],
        });
        Ok(())
    }
}

/// How a peer begins, and where it grasps.
#[derive(Clone, Debug)]
struct Start {
    position: Triple,
    velocity: Triple,
    orientation: [f64; 4],
    rate: Triple,
    grasp: Triple,
    turns: bool,
}

/// Keys that are not of single peers, and the peers.
#[derive(Clone, Debug)]
struct Turned {
    mass: f64,
    inertia: Triple,
    stiffness: f64,
    coupling: f64,
    turning: Triple,
    peers: Vec<Start>,
}

impl Turned {
    /// Damping of copies, of their turns, of devices, BR; update in ticks, delay in ticks, duration in ticks.
    fn run(&self, [damping, turn_damping, device_damping, rate_damping]: [f64; 4], [update, delay, ticks]: [u32; 3]) -> Vec<Moment> {
        let Self { mass, inertia, stiffness, coupling, turning, peers } = self;
        let mut text = format!(
            "scene = {{ duration = \"{ticks}ms\", axes = 3 }}\nlink = {{ delay = \"{delay}ms\" }}\n[object]\nmass = {mass:?}\nsplit-mass = false\n\
             inertia = {inertia:?}\ndamping = {damping:?}\nrotational-damping = {turn_damping:?}\n[coordination]\nstrategy = \"average-position\"\n\
             stiffness = {stiffness:?}\ndamping = 0\nupdate = \"{update}ms\"\nrotational-stiffness = {turning:?}\nrotational-damping = {rate_damping:?}\n\
             [peer]\ndevice = {{ mass = 0.1, damping = {device_damping:?} }}\ncoupling = {{ stiffness = {coupling:?}, damping = 0 }}\n"
        );
        for (number, Start { position, velocity, orientation, rate, grasp, turns }) in peers.iter().enumerate() {
            text += &format!(
                "[[peers]]\nname = \"p{number}\"\nposition = {position:?}\nvelocity = {velocity:?}\norientation = {orientation:?}\n\
                 angular-velocity = {rate:?}\ngrasp = {grasp:?}\n"
            );
            if *turns {
                text += "device = { inertia = [1e-4, 2e-4, 1.5e-4] }\ncoupling = { rotational-stiffness = 0.5, rotational-damping = 0.001 }\n";
            }
        }
        let scene = Scene::parse(&text, Path::new("turned.toml"), &[]).unwrap_or_else(|error| unreachable!("{error}\n{text}"));
        let mut seen = Seen(Vec::new());
        let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut seen);
        seen.0
    }

    fn momentum(&self, moments: &[Moment]) -> Triple {
        let of = |moment: &Moment| add(scale(moment.copy[1], self.mass), scale(moment.device[1], 0.1));
        moments.iter().map(of).fold([0.0; 3], add)
    }

    fn angular_momentum(&self, moments: &[Moment]) -> Triple {
        let spin = |attitude: &Attitude, inertia: Triple| turned(attitude, by(inertia, attitude.rate));
        let of = |moment: &Moment| {
            let [(p, v), (x, w)] = [(moment.copy[0], moment.copy[1]), (moment.device[0], moment.device[1])];
            let bodies = add(scale(cross(p, v), self.mass), scale(cross(x, w), 0.1));
            let handle = moment.handle.as_ref().map_or([0.0; 3], |handle| spin(handle, [1e-4, 2e-4, 1.5e-4]));
            add(add(bodies, spin(&moment.attitude, self.inertia)), handle)
        };
        moments.iter().map(of).fold([0.0; 3], add)
    }

    /// Kinetic energy, and that of all springs.
    fn energy(&self, moments: &[Moment]) -> f64 {
        let others = super::count(moments.len() - 1);
        let half = 0.5 * self.turning.iter().sum::<f64>();
        let weights = self.turning.map(|stiffness| (half - stiffness) / others);
        let alone = moments.iter().zip(&self.peers).map(|(moment, start)| {
            let stretched = subtract(moment.device[0], add(moment.copy[0], turned(&moment.attitude, start.grasp)));
            let turning = dot(moment.attitude.rate, by(self.inertia, moment.attitude.rate));
            let moving = self.mass * dot(moment.copy[1], moment.copy[1]) + 0.1 * dot(moment.device[1], moment.device[1]);
            0.5 * (turning + moving + self.coupling * dot(stretched, stretched))
        });
        let pairs = (0..moments.len()).flat_map(|j| (0..j).map(move |i| (&moments[i], &moments[j])));
        let between = pairs.map(|(one, other)| {
            let apart = subtract(one.copy[0], other.copy[0]);
            let (a, b) = (one.attitude.matrix(), other.attitude.matrix());
            // The diagonal of RᵢᵀRⱼ.
            let aligned = |axis: usize| (0..3).map(|row| a[row][axis] * b[row][axis]).sum::<f64>();
            let turned: f64 = (0..3).map(|axis| weights[axis] * (1.0 - aligned(axis))).sum();
            0.5 * self.stiffness / others * dot(apart, apart) + turned
        });
        alone.sum::<f64>() + between.sum::<f64>()
    }
}

fn add(a: Triple, b: Triple) -> Triple {
    core::array::from_fn(|axis| a[axis] + b[axis])
}

fn subtract(a: Triple, b: Triple) -> Triple {
    core::array::from_fn(|axis| a[axis] - b[axis])
}

fn by(a: Triple, b: Triple) -> Triple {
    core::array::from_fn(|axis| a[axis] * b[axis])
}

fn scale(a: Triple, factor: f64) -> Triple {
    a.map(|component| component * factor)
}

fn dot(a: Triple, b: Triple) -> f64 {
    by(a, b).iter().sum()
}

fn size(a: Triple) -> f64 {
    dot(a, a).sqrt()
}

fn cross(a: Triple, b: Triple) -> Triple {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn turned(attitude: &Attitude, vector: Triple) -> Triple {
    attitude.matrix().map(|row| dot(row, vector))
}

fn triple(size: f64) -> BoxedStrategy<Triple> {
    [-size..size, -size..size, -size..size].boxed()
}

/// Two to five peers with turns of any size, `turning` devices among them or not.
fn turns(turning: bool) -> BoxedStrategy<Turned> {
    let orientation = [-1.0..1.0, -1.0..1.0, -1.0..1.0, 0.2..1.0_f64];
    let start = (triple(0.05), triple(0.3), orientation, triple(15.0), triple(0.03), any::<bool>());
    let start = start.prop_map(move |(position, velocity, orientation, rate, grasp, turns)| Start {
        position,
        velocity,
        orientation,
        rate,
        grasp,
        turns: turns && turning,
    });
    // Moments of inertia of a body, and stiffnesses, are sums of two positive numbers each.
    let sums = |low: f64, high: f64| [low..high, low..high, low..high].prop_map(|[a, b, c]| [b + c, c + a, a + b]);
    (0.3..1.0_f64, sums(1e-4, 1e-3), 50.0..300.0_f64, 100.0..1000.0_f64, sums(0.01, 0.05), vec(start, 2..=5))
        .prop_map(|(mass, inertia, stiffness, coupling, turning, peers)| Turned { mass, inertia, stiffness, coupling, turning, peers })
        .boxed()
}

properties! {
    #![proptest_config(cases(60))]

    /// No delay, a sample a tick, nothing tied to ground, and dampers of turns alone, whose torques are opposite: momentum is rounded. At the beginning of a tick the torques
    /// of all forces cancel too. Over the tick forces stay in world axes and torques in body axes, while points move and bodies turn: angular momentum changes by
    /// at most ½h²·(v·|F| + ω·|τ|) for each body, v and ω its largest speeds. Speeds under held forces are largest at the ends of a tick; those of turns also change by
    /// the gyroscopic term, by far less than half.
    #[test]
    fn momentum_is_conserved_by_an_ideal_network(turns in turns(true), rate_damping in 0.0..1e-3_f64) {
        let peers = turns.peers.len();
        let moments = turns.run([0.0, 0.0, 0.0, rate_damping], [1, 0, 150]);
        let rows: Vec<&[Moment]> = moments.chunks_exact(peers).collect();
        let (momentum, angular) = (turns.momentum(rows[0]), turns.angular_momentum(rows[0]));
        let (mut rounding, mut most) = (0.0, 0.0);
        for pair in rows.windows(2) {
            for (now, next) in pair[0].iter().zip(pair[1]) {
                let [fc, ft, coupling, coordination] = now.forces;
                let largest = |of: &dyn Fn(&Moment) -> Triple| size(of(now)).max(size(of(next)));
                let (v, w) = (largest(&|moment| moment.copy[1]), largest(&|moment| moment.device[1]));
                let spin = 2.0 * largest(&|moment| moment.attitude.rate);
                let twist = 2.0 * largest(&|moment| moment.handle.map_or([0.0; 3], |handle| handle.rate));
                let on_handle = size(coupling) + 0.06 * size(fc);
                most += 0.5 * H * H * (v * size(subtract(fc, ft)) + w * size(fc) + spin * size(subtract(coupling, coordination)) + twist * on_handle);
                // Differences of positions below a metre and their products round, a dozen times, and so does what they add to a velocity.
                rounding += 24.0 * super::ROUNDING * (H * (turns.stiffness + turns.coupling) + turns.mass * (v + w));
            }
            let off = size(subtract(turns.momentum(pair[1]), momentum));
            prop_assert!(off <= rounding, "{off:e} > {rounding:e} kg·m/s");
            let off = size(subtract(turns.angular_momentum(pair[1]), angular));
            prop_assert!(off <= most + rounding, "{off:e} > {most:e} kg·m²/s");
        }
        // The bound says something: it is small against what turns and moves.
        let moving: f64 = rows[0].iter().zip(&turns.peers).map(|(moment, start)| {
            size(by(turns.inertia, start.rate)) + turns.mass * size(moment.copy[0]) * size(moment.copy[1])
        }).sum();
        prop_assert!(most < moving, "{most:e}, {moving:e}");
    }

    /// At the bound, however the three shares are chosen.
    #[test]
    fn a_grasp_makes_no_energy(
        turns in turns(false), shares in [0.1..1.0_f64, 0.1..1.0, 0.1..1.0], update in select(&[1_u32, 4][..]), delay in 0..12_u32,
    ) {
        let peers = turns.peers.len();
        let sum: f64 = shares.iter().sum();
        let reach = turns.peers.iter().map(|start| size(start.grasp)).fold(0.0, f64::max);
        let share = |place: usize| 0.5 * H * turns.coupling * sum / shares[place];
        let stale = f64::from(delay + update) * H;
        let first = turns.run([0.0; 4], [update, delay, 1]);
        let stored = turns.energy(&first[..peers]);
        let force = (2.0 * turns.coupling * stored).sqrt();
        let stiffest = turns.turning.iter().copied().fold(0.0, f64::max);
        let damping = turns.stiffness * stale + share(1);
        let turn_damping = stiffest * stale + share(2) * reach * reach + 0.5 * reach * force * H;
        let moments = turns.run([damping, turn_damping, share(0), 0.0], [update, delay, 600]);
        for row in moments.chunks_exact(peers) {
            let energy = turns.energy(row);
            prop_assert!(energy <= stored * (1.0 + 1e-12), "{energy} J > {stored} J");
        }
    }
}

/// The shares are needed: with a thousandth of them a stiff grasp gains energy, whatever else is damped as the bound says.
#[test]
fn without_its_shares_a_grasp_makes_energy() {
    let start = |x: f64| Start {
        position: [x, 0.0, 0.0],
        velocity: [0.1, 0.0, 0.0],
        orientation: [1.0, 0.0, 0.0, 0.0],
        rate: [0.0, 0.0, 5.0],
        grasp: [0.0, 0.03, 0.0],
        turns: false,
    };
    let turns = Turned { mass: 0.5, inertia: [2e-4; 3], stiffness: 50.0, coupling: 1000.0, turning: [0.02; 3], peers: vec![start(0.0), start(0.01)] };
    let most = |factor: f64| {
        let shares = 0.5 * H * turns.coupling * 3.0 * factor;
        let force = (2.0 * turns.coupling * turns.energy(&turns.run([0.0; 4], [1, 0, 1])[..2])).sqrt();
        let turn_damping = 0.02 * H + shares * 9e-4 + 0.5 * 0.03 * force * H * factor;
        let moments = turns.run([50.0 * H + shares, turn_damping, shares, 0.0], [1, 0, 3000]);
        let energies: Vec<f64> = moments.chunks_exact(2).map(|row| turns.energy(row)).collect();
        energies.iter().copied().fold(0.0, f64::max) / energies[0]
    };
    assert!(most(1.0) <= 1.0 + 1e-12, "{}", most(1.0));
    assert!(most(1e-3) > 1.01, "{}", most(1e-3));
}
