//! Bodies of all peers and their motion, eight lanes at a time.
//!
//! A lane computes [`cohaptic_peer::tick`] and the scene's law, as [`cohaptic_peer::Peer`] does, so every bit is the same. Each tick is a loop over lanes
//! without branches. The compiler turns the loop into vector instructions.

mod block;
mod law;

use cohaptic_peer::coordination::{BuiltIn, Coefficients, Law, LawVisitor};
use cohaptic_peer::{Contact, Enclosure, HandForce, Motion, State, StepMap};
use cohaptic_scene::Scene;
use pulp::NullaryFnOnce;

use super::lanes::{Lanes, Mask, WIDTH, larger, smaller};
use super::place::{Places, Spot};
use super::processor::on_widest;
use crate::plan::DeviceChoice;
pub(super) use block::Block;
use block::{Forces, Late, RESTING, ZERO_MAP, set_map};
use law::memory_of_lane;
pub(super) use law::{LawOfLanes, law_of_lanes};

/// All bodies on all axes.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    places: Places,
    axes: usize,
    /// Blocks in the order of [`Places`]: all blocks of the first axis, then all blocks of the next axis.
    blocks: Vec<Block>,
    /// Displacements of the means since the held samples were sent \[m\], indexed by block. Empty for a law without extrapolation.
    leads: Vec<Lanes>,
    /// Numbers of the law's memory, ordered by block, then lane.
    memory: Vec<f64>,
    /// Motions of the copies at the latest ticks, as many as the law's lag: a ring of ticks, each with all blocks.
    past: Vec<Motions>,
    /// Index in the ring of the oldest tick in `past`.
    oldest: usize,
    /// Step map of the copies. One map for all peers of a run.
    object_map: StepMap<Lanes>,
    /// Forces computed at the latest tick, indexed by block. `None` if all peers apply forces without delay.
    late: Option<Vec<Late>>,
    /// Walls of the object, indexed by run. `None` if no run has walls.
    walls: Option<Vec<Option<Enclosure>>>,
    /// Lanes of running runs. Lanes of ended runs are not checked for finite numbers.
    pub(super) goes_on: Mask,
    /// Least and greatest positions along the axis in computation \[m\]. A field, not local variables of the loop over blocks, because the compiler vectorises
    /// this form only.
    extremes: [Lanes; 2],
}

/// Position \[m\] and velocity \[m/s\] of eight bodies along one axis.
pub(super) type Motions = Motion<Lanes>;

/// States and forces of eight peers along one axis, as shown in rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) device: Motions,
    pub(super) object: Motions,
    pub(super) target: Motions,
    /// Coupling force FC \[N\].
    pub(super) coupling: Lanes,
    /// Coordination force FT \[N\], without the part of the law's own damping.
    pub(super) coordination: Lanes,
}

/// Results of a tick for each of L runs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved<const L: usize> {
    /// Largest distance along an axis between two copies before the move \[m\], indexed by run.
    pub(super) discrepancy: [f64; L],
    /// `true` if all numbers are finite after the move, indexed by run.
    pub(super) finite: [bool; L],
}

/// Returns the motion of one lane.
#[inline(always)]
pub(super) fn lane_of(motions: &Motions, lane: usize) -> Motion {
    Motion { position: motions.position.0[lane], velocity: motions.velocity.0[lane] }
}

/// Replaces the motion of one lane.
#[inline(always)]
fn set_lane(motions: &mut Motions, lane: usize, motion: Motion) {
    (motions.position.0[lane], motions.velocity.0[lane]) = (motion.position, motion.velocity);
}

impl Blocks {
    /// Returns the bodies of runs of these scenes. The scenes share the kind of `law` and may differ in its coefficients. `devices` is the choice for each
    /// peer's device if an observer sees devices. With `None` only devices with a possible contact move.
    pub(super) fn new<const A: usize>(places: Places, scenes: &[&Scene], law: &BuiltIn, devices: Option<&[DeviceChoice]>) -> Self {
        let mut blocks = Vec::with_capacity(A * places.blocks());
        let mut late = Vec::with_capacity(A * places.blocks());
        for axis in 0..A {
            blocks.extend((0..places.blocks()).map(|_| Block::empty(axis)));
            late.extend((0..places.blocks()).map(|_| Late { computed: Forces::NONE, is_late: Mask::NONE }));
            for (spot, peer, run) in places.all(axis) {
                let member = places.first + peer;
                let (spec, config) = (&scenes[run].peers[member], scenes[run].peer_config(member));
                let (initial, device): (State<A>, State<A>) = (scenes[run].initial_state(member), scenes[run].initial_device(member));
                let block: &mut Block = &mut blocks[spot.block];
                block.device.position.0[spot.lane] = device.position[axis];
                set_lane(&mut block.object, spot.lane, initial.along(axis));
                late[spot.block].is_late.set(spot.lane, config.compute_delay);
                block.touch(spot.lane, config.contact);
                if !moves(scenes[run], member, devices) {
                    // The device stays at rest: no force on the copy depends on this device, and no observer sees the device.
                    set_map(&mut block.device_map, spot.lane, &RESTING);
                    continue;
                }
                let map = spec.device.plant(spec.hand.as_ref()).step(spec.clock.tick, scenes[run].integrator);
                block.is_tied |= !map.is_free();
                set_map(&mut block.device_map, spot.lane, &map);
                block.device.velocity.0[spot.lane] = device.velocity[axis];
                block.coupling.stiffness.0[spot.lane] = config.coupling.stiffness;
                block.coupling.damping.0[spot.lane] = config.coupling.damping;
                let force: Option<[f64; A]> = HandForce::of(spec.hand.as_ref()).constant();
                block.hand.0[spot.lane] = force.map_or(0.0, |force| force[axis]);
            }
        }
        // Lists for delays and walls are kept only if some peer has a delay or some run has walls, so the usual tick skips both.
        let any_late = scenes.iter().any(|scene| scene.peers.iter().any(|peer| peer.compute_delay));
        let walls: Vec<Option<Enclosure>> = scenes.iter().map(|scene| scene.object.enclosure).collect();
        Self {
            leads: if Law::<f64>::horizon(law).is_some() { vec![Lanes::ZERO; blocks.len()] } else { Vec::new() },
            memory: vec![0.0; blocks.len() * WIDTH * Law::<f64>::memory(law)],
            past: (0..Law::<f64>::lag(law)).flat_map(|_| blocks.iter().map(|block| block.object)).collect(),
            oldest: 0,
            places,
            axes: A,
            blocks,
            object_map: object_map(scenes),
            late: any_late.then_some(late),
            walls: walls.iter().any(Option::is_some).then_some(walls),
            goes_on: Mask::ALL,
            extremes: [Lanes::ZERO; 2],
        }
    }

    /// Returns position \[m\] and velocity \[m/s\] of a copy of the object along an axis.
    #[inline(always)]
    pub(super) fn object(&self, axis: usize, peer: usize, run: usize) -> (f64, f64) {
        let Spot { block, lane } = self.places.spot(axis, peer, run);
        let Motion { position, velocity } = lane_of(&self.blocks[block].object, lane);
        (position, velocity)
    }

    /// Returns the least and the greatest position of the copies \[m\] for each axis, in a single run. Lanes beyond the last peer repeat the last peer and
    /// change neither position.
    pub(super) fn extremes(&self) -> impl Iterator<Item = (f64, f64)> {
        self.blocks.chunks(self.places.blocks()).map(|blocks| {
            let (mut low, mut high) = (Lanes::splat(f64::INFINITY), Lanes::splat(f64::NEG_INFINITY));
            for block in blocks {
                (low, high) = (block.object.position.smaller(low), block.object.position.larger(high));
            }
            (
                low.0.into_iter().fold(f64::INFINITY, |least, x| smaller(x, least)),
                high.0.into_iter().fold(f64::NEG_INFINITY, |most, x| larger(x, most)),
            )
        })
    }

    /// Returns the number of runs.
    pub(super) const fn runs(&self) -> usize {
        self.places.runs
    }

    /// Returns the bodies of all peers, by axis.
    pub(super) fn of_all(&self) -> &[Block] {
        &self.blocks
    }

    /// Returns states and forces of the block at index `place`, before the bodies move.
    pub(super) fn seen(&self, place: usize, law: &BuiltIn<Lanes>) -> Seen {
        law.visit(Look { blocks: self, place })
    }

    fn seen_by(&self, law: &impl LawOfLanes, place: usize) -> Seen {
        let (block, remembered, lag) = (&self.blocks[place], law.remembered() * WIDTH, law.looks_back());
        let past = if lag > 0 { self.past[self.oldest * self.blocks.len() + place] } else { block.object };
        let lead = self.leads.get(place).unwrap_or(&Lanes::ZERO);
        // A copy of the memory: looking must not change the law's memory.
        let mut memory = self.memory[place * remembered..(place + 1) * remembered].to_vec();
        let coupling = block.coupling();
        let (mut coordination, mut target) = (Lanes::ZERO, block.mean);
        for lane in 0..WIDTH {
            let seen = block.observation(&past, lead, lane);
            let law = law.of_lane(lane);
            coordination.0[lane] = law.force(&seen, memory_of_lane(&mut memory, remembered / WIDTH, lane));
            set_lane(&mut target, lane, law.target(&seen));
        }
        Seen { device: block.device, object: block.object, target, coupling, coordination }
    }

    /// Replaces the mean of the held samples of a peer along an axis, in all runs.
    #[inline(always)]
    pub(super) fn set_target<const L: usize>(&mut self, axis: usize, peer: usize, x: [f64; L], v: [f64; L]) {
        for run in 0..L {
            let Spot { block, lane } = self.places.spot(axis, peer, run);
            set_lane(&mut self.blocks[block].mean, lane, Motion { position: x[run], velocity: v[run] });
        }
        // The last run of the last peer fills the unused lanes, so unused lanes move alike and change no extreme.
        if L < WIDTH && peer + 1 == self.places.peers {
            let Spot { block, lane } = self.places.spot(axis, peer, L - 1);
            let mean = &mut self.blocks[block].mean;
            mean.position.0[lane..].fill(x[L - 1]);
            mean.velocity.0[lane..].fill(v[L - 1]);
        }
    }

    /// Replaces the displacement of the mean since the held samples were sent \[m\], in all runs.
    pub(super) fn set_lead<const L: usize>(&mut self, axis: usize, peer: usize, lead: [f64; L]) {
        for (run, lead) in lead.into_iter().enumerate() {
            let Spot { block, lane } = self.places.spot(axis, peer, run);
            self.leads[block].0[lane] = lead;
            // As in `set_target`: unused lanes follow the last run of the last peer.
            if peer + 1 == self.places.peers && run + 1 == L {
                self.leads[block].0[lane..].fill(lead);
            }
        }
    }

    /// Ends a run: its numbers are no longer checked for being finite.
    pub(super) fn end(&mut self, run: usize) {
        for lane in (run..WIDTH).step_by(self.places.runs) {
            self.goes_on.set(lane, false);
        }
    }

    /// Replaces the damping of the copies by the damping of these scenes, indexed by run.
    pub(super) fn set_damping(&mut self, scenes: &[&Scene]) {
        self.object_map = object_map(scenes);
    }

    /// Replaces the contact between a peer's device and copy, in all runs.
    pub(super) fn set_contact(&mut self, peer: usize, contact: Contact) {
        for (spot, ..) in (0..self.axes).flat_map(|axis| self.places.all(axis)).filter(|(_, other, _)| *other == peer) {
            self.blocks[spot.block].touch(spot.lane, contact);
        }
    }

    /// Replaces the force of a hand \[N\], in one run.
    pub(super) fn set_hand<const A: usize>(&mut self, peer: usize, run: usize, force: [f64; A]) {
        for (axis, force) in force.into_iter().enumerate() {
            let Spot { block, lane } = self.places.spot(axis, peer, run);
            let hands = &mut self.blocks[block].hand.0;
            hands[lane] = force;
            // The last run of the last peer fills the unused lanes, so unused lanes move alike.
            if peer + 1 == self.places.peers && run + 1 == self.places.runs {
                hands[lane..].fill(force);
            }
        }
    }

    /// Replaces the number of ticks that the law looks back. The latest known ticks stay; earlier ticks get the oldest known motion.
    pub(super) fn set_lag(&mut self, lag: usize) {
        let known = self.past.len() / self.blocks.len();
        if lag == known {
            return;
        }
        // Ticks before the oldest known tick saturate to the oldest known tick.
        let place = |tick: usize| (self.oldest + (tick + known).saturating_sub(lag)) % known * self.blocks.len();
        self.past = match known {
            0 => (0..lag).flat_map(|_| self.blocks.iter().map(|block| block.object)).collect(),
            _ => (0..lag).flat_map(|tick| self.past[place(tick)..][..self.blocks.len()].iter().copied()).collect(),
        };
        self.oldest = 0;
    }

    /// Computes the forces of all peers by the law and moves all bodies to the next tick.
    ///
    /// The law is chosen here at each tick, so all loops over ticks share one compiled function for each law.
    #[inline(always)]
    pub(super) fn advance<const L: usize>(&mut self, processor: pulp::Arch, law: &BuiltIn<Lanes>) -> Moved<L> {
        law.visit(Advance::<L> { blocks: self, processor })
    }

    #[inline(always)]
    fn advance_by<const L: usize>(&mut self, law: &impl LawOfLanes) -> Moved<L> {
        let (mut discrepancy, mut size) = ([0.0; L], Lanes::ZERO);
        let per_axis = self.places.blocks();
        let (remembered, lag) = (law.remembered() * WIDTH, law.looks_back());
        let oldest = self.oldest * self.axes * per_axis;
        for axis in 0..self.axes {
            // Extremes are taken before the move, because the discrepancy belongs to the present tick.
            self.extremes = [Lanes::splat(f64::INFINITY), Lanes::splat(f64::NEG_INFINITY)];
            for place in axis * per_axis..(axis + 1) * per_axis {
                let block = &mut self.blocks[place];
                // Most laws use neither past, lead nor memory, and the compiler then leaves out this code.
                let past = if lag > 0 { std::mem::replace(&mut self.past[oldest + place], block.object) } else { block.object };
                let lead = self.leads.get(place).unwrap_or(&Lanes::ZERO);
                let memory = if remembered > 0 { &mut self.memory[place * remembered..(place + 1) * remembered] } else { &mut [] };
                let [low, high] = &mut self.extremes;
                *low = low.smaller(block.object.position);
                *high = high.larger(block.object.position);
                // The usual case in one pass over the lanes; walls, delays and one-sided contacts need the forces as values.
                if self.walls.is_none() && self.late.is_none() && block.contacts.is_none() {
                    block.tick(law, &past, lead, memory, &self.object_map);
                } else {
                    let mut forces = block.forces(block.coupling(), law, &past, lead, memory);
                    if let Some(walls) = &self.walls {
                        block.add_walls(walls, &mut forces.on_object);
                    }
                    if let Some(late) = &mut self.late {
                        forces = late[place].exchange(forces);
                    }
                    block.advance(&self.object_map, &forces);
                }
                // A number that is not finite makes the sum not finite, so one sum per lane replaces a check of each number.
                size = size + block.size();
            }
            let [low, high] = self.extremes;
            let distances = distances::<L>(low, high);
            // A comparison instead of `max`: the compiler turns it into one instruction, and NaN changes nothing.
            for run in 0..L {
                discrepancy[run] = if distances[run] > discrepancy[run] { distances[run] } else { discrepancy[run] };
            }
        }
        // The ring moves on once per tick, after all blocks of all axes have replaced their oldest motion.
        if lag > 0 {
            self.oldest = if self.oldest + 1 == lag { 0 } else { self.oldest + 1 };
        }
        Moved { discrepancy, finite: self.finite(size) }
    }

    /// Returns whether all numbers of each run are finite. `size` is the sum of the magnitudes of all positions and velocities, indexed by lane.
    #[inline(always)]
    fn finite<const L: usize>(&self, size: Lanes) -> [bool; L] {
        // A finite sum means that every magnitude is finite. An infinite sum can also come from overflow, so each number is then checked.
        let [a, b, c, d, e, f, g, h] = (size & self.goes_on).0;
        if ((a + e) + (b + f)) + ((c + g) + (d + h)) < f64::INFINITY { [true; L] } else { self.look_at_each() }
    }

    #[cold]
    fn look_at_each<const L: usize>(&self) -> [bool; L] {
        let mut finite = [true; L];
        for axis in 0..self.axes {
            for (Spot { block, lane }, _, run) in self.places.all(axis) {
                let block = &self.blocks[block];
                let motions = [&block.device, &block.object].map(|motions| lane_of(motions, lane));
                finite[run] &= motions.iter().all(|motion| motion.position.is_finite() && motion.velocity.is_finite());
            }
        }
        finite
    }
}

/// Returns whether a device must be moved: the device may touch its copy, or an observer sees the device.
pub(super) fn moves(scene: &Scene, peer: usize, devices: Option<&[DeviceChoice]>) -> bool {
    scene.touches(peer) || devices.is_some_and(|devices| devices[peer] == DeviceChoice::Simulated)
}

/// Visitor of [`Blocks::advance`] with the law by its own type.
struct Advance<'a, const L: usize> {
    blocks: &'a mut Blocks,
    processor: pulp::Arch,
}

impl<const L: usize> LawVisitor<Lanes> for Advance<'_, L> {
    type Output = Moved<L>;

    #[inline(always)]
    fn visit<W: Coefficients<Coefficient = Lanes, Of<f64>: Law<f64>>>(self, law: &W) -> Moved<L> {
        let Self { blocks, processor } = self;
        let tick = Tick { blocks, law };
        // The widest registers: most of a tick is arithmetic on lanes.
        on_widest(processor, tick)
    }
}

/// Motion of a tick as a task compiled for each kind of processor.
struct Tick<'a, W, const L: usize> {
    blocks: &'a mut Blocks,
    law: &'a W,
}

impl<W: LawOfLanes, const L: usize> NullaryFnOnce for Tick<'_, W, L> {
    type Output = Moved<L>;

    #[inline(always)]
    fn call(self) -> Moved<L> {
        self.blocks.advance_by(self.law)
    }
}

/// Visitor of [`Blocks::seen`] with the law by its own type.
struct Look<'a> {
    blocks: &'a Blocks,
    place: usize,
}

impl LawVisitor<Lanes> for Look<'_> {
    type Output = Seen;

    fn visit<W: Coefficients<Coefficient = Lanes, Of<f64>: Law<f64>>>(self, law: &W) -> Seen {
        self.blocks.seen_by(law, self.place)
    }
}

/// Returns the step map of the copies of these scenes. Lane l has the map of run l modulo the number of runs.
fn object_map(scenes: &[&Scene]) -> StepMap<Lanes> {
    let mut map = ZERO_MAP;
    for lane in 0..WIDTH {
        // Peers with one clock and one mass per run share the map, so peer 0 represents all copies of its run.
        let scene = scenes[lane % scenes.len()];
        set_map(&mut map, lane, &scene.copy_config(0).plant().step(scene.peers[0].clock.tick, scene.integrator));
    }
    map
}

/// Returns the distance from the least to the greatest position of each run \[m\].
#[inline(always)]
fn distances<const L: usize>(mut low: Lanes, mut high: Lanes) -> [f64; L] {
    // Lanes of a run are L apart, and L divides the width: halving leaves one lane for each run.
    let mut width = WIDTH;
    while width > L {
        width /= 2;
        for lane in 0..width {
            (low.0[lane], high.0[lane]) = (smaller(low.0[lane], low.0[lane + width]), larger(high.0[lane], high.0[lane + width]));
        }
    }
    std::array::from_fn(|run| high.0[run] - low.0[run])
}
