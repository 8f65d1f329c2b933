//! The bodies of an object that turns: what goes, and beside it attitudes and torques, eight lanes at a time.
//!
//! What a lane computes is what [`cohaptic_peer::rotation::Rotation`] does, with the same functions in the same order, so every bit is the same.

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_peer::rotation::{Attitude, DeviceRotation, RotationConfig, RotationStep, Spin, Triple};
use cohaptic_peer::{Contact, Gains, Hand, Signal};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use pulp::NullaryFnOnce;

use super::blocks::{Blocks, Grasped, Moved};
use super::bodies::{Bodies, SeenPlace};
use super::lanes::{Lanes, WIDTH, larger, smaller};
use super::place::{Places, Spot};
use super::processor::on_widest;
use super::samples::Sample;
use super::translations::Translations;
use super::turn::{Computed, Handles, Shared, Steps, Turn};
use crate::plan::DeviceChoice;
use crate::spread::{Spread, squared_chord};

/// Pairs of numbers of a sample: three of positions and velocities, then R by rows and the angular velocity in world axes.
pub(super) const PAIRS: usize = 9;

/// All bodies of an object that turns.
#[derive(Clone, Debug)]
pub(super) struct TurningBlocks {
    places: Places,
    translations: Translations<3>,
    turns: Vec<Turn>,
    shared: Shared,
    /// FC along each axis, by the place of its block.
    coupling: Vec<Lanes>,
    /// How far copies are turned apart, in each run.
    spreads: Vec<Spread>,
}

/// What devices hold of copies that turn: points off their centres.
struct Points<'a>(&'a [Lanes]);

impl Grasped for Points<'_> {
    #[inline(always)]
    fn coupling(&self, place: usize) -> Option<&Lanes> {
        Some(&self.0[place])
    }
}

impl TurningBlocks {
    /// Torques and turns of a tick, and the coupling forces. Gives the sum of the sizes of all that turns.
    #[inline(always)]
    fn turn(&mut self) -> Lanes {
        let per_axis = self.places.blocks();
        let mut size = Lanes::ZERO;
        for (place, turn) in self.turns.iter_mut().enumerate() {
            let blocks = [0, 1, 2].map(|axis| self.translations.blocks().block(axis * per_axis + place));
            let coupling = turn.tick(&self.shared, blocks);
            for (axis, coupling) in coupling.into_iter().enumerate() {
                self.coupling[axis * per_axis + place] = coupling;
            }
            size = size + turn.size();
        }
        size
    }

    /// Whether no two copies of a run are farther apart than any were so far: the two longest chords to the reference of each run.
    #[inline(always)]
    fn two_longest(&self) -> [Lanes; 2] {
        let references: [[f64; 4]; WIDTH] = std::array::from_fn(|lane| {
            let run = lane % self.places.runs;
            self.orientation(self.spreads[run].reference(), run)
        });
        let (mut first, mut second) = (Lanes::ZERO, Lanes::ZERO);
        let last = self.places.peers * self.places.runs;
        for (place, turn) in self.turns.iter().enumerate() {
            let mut squares = Lanes::ZERO;
            for (lane, reference) in references.iter().enumerate() {
                squares.0[lane] = squared_chord(reference, &turn.attitude.orientation.map(|part| part.0[lane]));
            }
            // Those beyond the last repeat it, which would count twice.
            if (place + 1) * WIDTH > last {
                squares.0[last - place * WIDTH..].fill(0.0);
            }
            for lane in 0..WIDTH {
                let (square, longest) = (squares.0[lane], first.0[lane]);
                first.0[lane] = larger(square, longest);
                second.0[lane] = larger(smaller(square, longest), second.0[lane]);
            }
        }
        [first, second]
    }

    /// Takes in how far copies are turned apart, before they move.
    fn measure(&mut self, two_longest: &[Lanes; 2]) {
        let Places { peers, runs, .. } = self.places;
        let [first, second] = two_longest;
        for run in 0..runs {
            let (mut two, mut lane) = ([0.0; 2], run);
            while lane < WIDTH {
                let (a, b) = (first.0[lane], second.0[lane]);
                two = [larger(a, two[0]), larger(smaller(a, two[0]), larger(b, two[1]))];
                lane += runs;
            }
            if !self.spreads[run].holds(two) {
                let mut spread = std::mem::take(&mut self.spreads[run]);
                spread.take((0..peers).map(|peer| self.orientation(peer, run)));
                self.spreads[run] = spread;
            }
        }
    }

    #[inline(always)]
    fn orientation(&self, peer: usize, run: usize) -> [f64; 4] {
        let Spot { block, lane } = self.places.spot(0, peer, run);
        self.turns[block].attitude.orientation.map(|part| part.0[lane])
    }

    /// Changes what there is of devices of a peer that turn, in all runs.
    fn change_handles(&mut self, peer: usize, mut change: impl FnMut(&mut Handles, usize)) {
        for (Spot { block, lane }, ..) in self.places.all(0).filter(|(_, other, _)| *other == peer) {
            if let Some(handles) = &mut self.turns[block].handles {
                change(handles, lane);
            }
        }
    }

    #[cold]
    fn look_at_each(&self, finite: &mut [bool]) {
        for (Spot { block, lane }, _, run) in self.places.all(0) {
            finite[run] &= self.turns[block].is_finite(lane);
        }
    }
}

/// The turning part of a peer of a scene.
fn config(scene: &Scene, peer: usize) -> RotationConfig {
    scene.rotation_config(peer).expect("the shape of the scenes says that their objects turn")
}

/// The step of a body in a tick of a scene.
fn step(scene: &Scene, spin: Spin, config: &RotationConfig) -> RotationStep {
    spin.step(scene.peers[0].clock.tick, config.integrator, config.steps)
}

impl Shared {
    /// Copies turn as in these scenes, in each run.
    fn set_steps(&mut self, scenes: &[&Scene]) {
        for lane in 0..WIDTH {
            let scene = scenes[lane % scenes.len()];
            let config = config(scene, 0);
            self.step.set(lane, &step(scene, config.copy, &config));
        }
    }

    /// KR and BR of each run.
    fn set_gains(&mut self, gains: &[Gains<Triple>]) {
        for (lane, axis) in (0..WIDTH).flat_map(|lane| (0..3).map(move |axis| (lane, axis))) {
            let gains = &gains[lane % gains.len()];
            (self.gains.stiffness[axis].0[lane], self.gains.damping[axis].0[lane]) = (gains.stiffness[axis], gains.damping[axis]);
        }
    }
}

/// The part of a tick that turns, whatever the law.
struct Turned<'a>(&'a mut TurningBlocks);

impl NullaryFnOnce for Turned<'_> {
    type Output = Lanes;

    #[inline(always)]
    fn call(self) -> Lanes {
        let two_longest = self.0.two_longest();
        self.0.measure(&two_longest);
        self.0.turn()
    }
}

impl Bodies<3, PAIRS> for TurningBlocks {
    fn new(places: Places, scenes: &[&Scene], law: &BuiltIn, devices: Option<&[DeviceChoice]>) -> Self {
        let of_runs: Vec<RotationConfig> = scenes.iter().map(|scene| config(scene, 0)).collect();
        let mut turns = vec![Turn::at_rest(); places.blocks()];
        for (Spot { block, lane }, peer, run) in places.all(0) {
            let (turn, spec, config) = (&mut turns[block], &scenes[run].peers[peer], config(scenes[run], peer));
            let attitude = scenes[run].rotation.as_ref().map_or(Attitude::REST, |rotation| rotation.peers[peer].attitude);
            turn.begin(lane, attitude, config.grasp, spec.compute_delay);
            if let Some(DeviceRotation { handle, coupling, hand }) = &config.device {
                let step = step(scenes[run], *handle, &config);
                let handles = turn.handles.get_or_insert_with(|| Box::new(Handles::none(&step)));
                handles.begin(lane, attitude, &step, coupling, spec.contact == Contact::Grasp);
                handles.set_hand(lane, hand.as_ref());
            }
        }
        let mut shared =
            Shared { step: Steps::of(&step(scenes[0], of_runs[0].copy, &of_runs[0])), gains: of_runs[0].gains.map(|_| [Lanes::ZERO; 3]) };
        shared.set_steps(scenes);
        shared.set_gains(&of_runs.iter().map(|config| config.gains).collect::<Vec<_>>());
        Self {
            places,
            translations: Translations::new(places, scenes, law, devices),
            turns,
            shared,
            coupling: vec![Lanes::ZERO; 3 * places.blocks()],
            spreads: vec![Spread::default(); places.runs],
        }
    }

    #[inline(always)]
    fn blocks(&self) -> &Blocks {
        self.translations.blocks()
    }

    #[inline(always)]
    fn blocks_mut(&mut self) -> &mut Blocks {
        self.translations.blocks_mut()
    }

    #[inline(always)]
    fn sample<const L: usize>(&self, peer: usize) -> Sample<PAIRS, L> {
        let mut sample = Sample::ZERO;
        self.blocks().add_to::<3, PAIRS, L>(&mut sample, peer);
        for run in 0..L {
            let Spot { block, lane } = self.places.spot(0, peer, run);
            let attitude = self.turns[block].attitude(lane);
            let numbers = attitude.matrix().into_iter().flatten().chain(attitude.world_rate());
            for (place, number) in numbers.enumerate() {
                let pair = if place % 2 == 0 { &mut sample.position } else { &mut sample.velocity };
                pair[3 + place / 2][run] = number;
            }
        }
        sample
    }

    #[inline(always)]
    fn set_target<const L: usize>(&mut self, pair: usize, peer: usize, x: [f64; L], v: [f64; L]) {
        let Some(pair) = pair.checked_sub(3) else {
            self.translations.set_target(pair, peer, x, v);
            return;
        };
        for run in 0..L {
            let Spot { block, lane } = self.places.spot(0, peer, run);
            let mean = &mut self.turns[block].mean;
            (mean[2 * pair].0[lane], mean[2 * pair + 1].0[lane]) = (x[run], v[run]);
        }
        if L < WIDTH && peer + 1 == self.places.peers {
            let Spot { block, lane } = self.places.spot(0, peer, L - 1);
            let mean = &mut self.turns[block].mean;
            mean[2 * pair].0[lane..].fill(x[L - 1]);
            mean[2 * pair + 1].0[lane..].fill(v[L - 1]);
        }
    }

    fn set_contact(&mut self, peer: usize, contact: Contact) {
        self.translations.set_contact(peer, contact);
        self.change_handles(peer, |handles, lane| handles.set_grasps(lane, contact == Contact::Grasp));
    }

    fn set_hand_torque(&mut self, peer: usize, torque: Option<&Signal>) {
        self.change_handles(peer, |handles, lane| handles.set_hand(lane, torque));
    }

    fn set_gains_of_turns<const L: usize>(&mut self, gains: &[Gains<Triple>; L]) {
        self.shared.set_gains(gains);
    }

    fn set_damping(&mut self, scenes: &[&Scene]) {
        self.translations.set_damping(scenes);
        self.shared.set_steps(scenes);
    }

    fn set_hand(&mut self, peer: usize, hand: Option<&Hand>) {
        self.translations.set_hand(peer, hand);
    }

    fn move_hands(&mut self, now: Instant) {
        self.translations.move_hands(now);
        for handles in self.turns.iter_mut().filter_map(|turn| turn.handles.as_mut()) {
            handles.move_hands(now);
        }
    }

    #[inline(always)]
    fn advance<const L: usize>(&mut self, processor: pulp::Arch, law: &BuiltIn<Lanes>) -> Moved<L> {
        let size = on_widest(processor, Turned(self));
        let mut moved = self.translations.advance_grasped::<L>(processor, law, &Points(&self.coupling));
        let size = size & self.blocks().goes_on;
        if !size.0.iter().sum::<f64>().is_finite() {
            self.look_at_each(&mut moved.finite);
        }
        moved
    }

    fn seen(&self, place: usize, law: &BuiltIn<Lanes>) -> SeenPlace<3> {
        let at = [0, 1, 2].map(|axis| axis * self.places.blocks() + place);
        let Computed { coupling, torques, aligning } = self.turns[place].compute(&self.shared, at.map(|at| self.translations.blocks().block(at)));
        let axes = std::array::from_fn(|axis| self.blocks().seen(at[axis], law, Some(coupling[axis])));
        SeenPlace { axes, turn: Some((torques.on_copy, aligning)) }
    }

    fn device_attitude(&self, peer: usize, run: usize) -> Option<Attitude> {
        let Spot { block, lane } = self.places.spot(0, peer, run);
        self.turns[block].device(lane)
    }

    fn attitude(&self, peer: usize, run: usize) -> Option<Attitude> {
        let Spot { block, lane } = self.places.spot(0, peer, run);
        Some(self.turns[block].attitude(lane))
    }

    fn max_rotation_discrepancy(&self, run: usize) -> Option<f64> {
        Some(self.spreads[run].angle())
    }
}
