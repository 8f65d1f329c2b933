//! The bodies of all peers and how they move: eight numbers have the same done to them at once.
//!
//! The formulas are those of [`cohaptic_peer::Peer`], in its order of operations, so that every bit is the same.

use cohaptic_peer::{Contact, Enclosure, Gains, HandForce, Plant, State, StepMap};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::eight::{Eight, Mask, WIDTH, larger, smaller};
use super::place::{Places, Spot};

/// All bodies on all axes.
#[derive(Clone, Debug)]
pub(super) struct Blocks<const A: usize> {
    places: Places,
    blocks: Vec<Block>,
    common: Common,
    /// The forces computed at the latest tick, where anybody applies them a tick late.
    late: Option<Vec<Late>>,
    /// The walls of each run, where any has some.
    walls: Option<Vec<Option<Enclosure>>>,
    /// Hands whose force varies: peer, run and force.
    hands: Vec<(usize, usize, HandForce<A>)>,
    /// The runs that have not ended.
    goes_on: Mask,
}

/// Eight devices with their copies of the object, along one axis.
#[derive(Clone, Debug)]
struct Block {
    device_x: Eight,
    device_v: Eight,
    object_x: Eight,
    object_v: Eight,
    /// The mean of the samples held.
    target_x: Eight,
    target_v: Eight,
    hand: Eight,
    /// KC and BC.
    stiffness: Eight,
    damping: Eight,
    grasps: Mask,
    device: Map,
    /// The contacts of all eight, if any of them is one-sided.
    contacts: Option<Box<[Contact; WIDTH]>>,
    axis: usize,
    /// Whether anything ties one of the devices to ground.
    is_tied: bool,
}

/// What is the same for all peers of a run.
#[derive(Clone, Debug)]
struct Common {
    /// KT and BT towards the mean.
    stiffness: Eight,
    damping: Eight,
    object: Map,
}

/// Eight step maps: the increments of (x, v) by (x, v), row by row, and by the held force.
#[derive(Clone, Debug)]
struct Map {
    state: [[Eight; 2]; 2],
    force: [Eight; 2],
}

/// Forces that are applied a tick late.
#[derive(Clone, Debug)]
struct Late {
    coupling: Eight,
    on_object: Eight,
    is_late: Mask,
}

/// Positions along each axis, the least and the greatest of each run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved<const L: usize> {
    /// The largest distance along an axis between two copies, before they moved \[m\].
    pub(super) discrepancy: [f64; L],
    /// Whether everything is a finite number, after it moved.
    pub(super) finite: [bool; L],
}

impl Map {
    const ZERO: Self = Self { state: [[Eight::ZERO; 2]; 2], force: [Eight::ZERO; 2] };

    fn set(&mut self, lane: usize, map: &StepMap) {
        let (state, force) = map.coefficients();
        for (eight, number) in self.state.iter_mut().flatten().zip(state.iter().flatten()) {
            eight.0[lane] = *number;
        }
        for (eight, number) in self.force.iter_mut().zip(force) {
            eight.0[lane] = number;
        }
    }

    /// [`StepMap::advance_free`].
    #[inline(always)]
    fn advance_free(&self, x: &mut Eight, v: &mut Eight, force: Eight) {
        let before = *v;
        *x = *x + (self.state[0][1] * before + self.force[0] * force);
        *v = before + (self.state[1][1] * before + self.force[1] * force);
    }

    /// [`StepMap::advance`].
    #[inline(always)]
    fn advance(&self, x: &mut Eight, v: &mut Eight, force: Eight) {
        let (x0, v0) = (*x, *v);
        *x = x0 + (self.state[0][0] * x0 + self.state[0][1] * v0 + self.force[0] * force);
        *v = v0 + (self.state[1][0] * x0 + self.state[1][1] * v0 + self.force[1] * force);
    }
}

impl<const A: usize> Blocks<A> {
    /// The bodies of runs of these scenes, with the gains towards the mean of each.
    pub(super) fn new(places: Places, scenes: &[&Scene], gains: &[Gains]) -> Self {
        let tick = scenes[0].peers[0].clock.tick;
        let mut common = Common { stiffness: Eight::ZERO, damping: Eight::ZERO, object: Map::ZERO };
        for lane in 0..WIDTH {
            let run = lane % places.runs;
            common.stiffness.0[lane] = gains[run].stiffness;
            common.damping.0[lane] = gains[run].damping;
            common.object.set(lane, &scenes[run].copy_config().plant().step(tick, scenes[run].integrator));
        }
        let step = |plant: Plant, run: usize| plant.step(tick, scenes[run].integrator);
        let hands: Vec<(usize, usize, HandForce<A>)> = (0..places.peers)
            .flat_map(|peer| (0..places.runs).map(move |run| (peer, run)))
            .map(|(peer, run)| (peer, run, HandForce::of(scenes[run].peers[peer].hand.as_ref())))
            .collect();
        let mut blocks = Vec::with_capacity(A * places.blocks());
        let mut late = Vec::with_capacity(A * places.blocks());
        for axis in 0..A {
            blocks.extend((0..places.blocks()).map(|_| Block::empty(axis)));
            late.extend((0..places.blocks()).map(|_| Late { coupling: Eight::ZERO, on_object: Eight::ZERO, is_late: Mask::NONE }));
            for (spot, peer, run) in places.all(axis) {
                let (spec, config) = (&scenes[run].peers[peer], scenes[run].peer_config(peer));
                let initial: State<A> = scenes[run].initial_state(peer);
                let block: &mut Block = &mut blocks[spot.block];
                block.device_x.0[spot.lane] = initial.position[axis];
                block.object_x.0[spot.lane] = initial.position[axis];
                block.object_v.0[spot.lane] = initial.velocity[axis];
                late[spot.block].is_late.set(spot.lane, config.compute_delay);
                block.touch(axis, spot.lane, config.contact);
                if config.contact == Contact::None {
                    // Nothing depends on its device.
                    continue;
                }
                let map = step(spec.device.plant(spec.hand.as_ref()), run);
                block.is_tied |= !map.is_free();
                block.device.set(spot.lane, &map);
                block.device_v.0[spot.lane] = initial.velocity[axis];
                block.stiffness.0[spot.lane] = config.coupling.stiffness;
                block.damping.0[spot.lane] = config.coupling.damping;
                let hand = &hands[peer * places.runs + run].2;
                block.hand.0[spot.lane] = hand.constant().map_or(0.0, |force| force[axis]);
            }
        }
        let any_late = scenes.iter().any(|scene| scene.peers.iter().any(|peer| peer.compute_delay));
        let walls: Vec<Option<Enclosure>> = scenes.iter().map(|scene| scene.object.enclosure).collect();
        let touches = |peer: usize, run: usize| scenes[run].peers[peer].contact != Contact::None;
        let varies = |(peer, run, hand): &(usize, usize, HandForce<A>)| hand.constant().is_none() && touches(*peer, *run);
        Self {
            places,
            blocks,
            common,
            late: any_late.then_some(late),
            walls: walls.iter().any(Option::is_some).then_some(walls),
            hands: hands.into_iter().filter(varies).collect(),
            goes_on: Mask::ALL,
        }
    }

    /// A copy of the object.
    #[inline(always)]
    pub(super) fn object(&self, axis: usize, peer: usize, run: usize) -> (f64, f64) {
        let Spot { block, lane } = self.places.spot(axis, peer, run);
        let block = &self.blocks[block];
        (block.object_x.0[lane], block.object_v.0[lane])
    }

    /// Replaces the mean of the samples that a peer holds, in all runs.
    #[inline(always)]
    pub(super) fn set_target<const L: usize>(&mut self, axis: usize, peer: usize, x: [f64; L], v: [f64; L]) {
        for run in 0..L {
            let Spot { block, lane } = self.places.spot(axis, peer, run);
            let block = &mut self.blocks[block];
            block.target_x.0[lane] = x[run];
            block.target_v.0[lane] = v[run];
        }
        if L < WIDTH && peer + 1 == self.places.peers {
            let Spot { block, lane } = self.places.spot(axis, peer, L - 1);
            let block = &mut self.blocks[block];
            block.target_x.0[lane..].fill(x[L - 1]);
            block.target_v.0[lane..].fill(v[L - 1]);
        }
    }

    /// A run has ended: it is not looked at any more whether its numbers are finite.
    pub(super) fn end(&mut self, run: usize) {
        for lane in (run..WIDTH).step_by(self.places.runs) {
            self.goes_on.set(lane, false);
        }
    }

    /// Hands whose force varies take what it is now.
    pub(super) fn move_hands(&mut self, now: Instant) {
        for (peer, run, hand) in &self.hands {
            let force = hand.at(now);
            for (axis, force) in force.into_iter().enumerate() {
                let Spot { block, lane } = self.places.spot(axis, *peer, *run);
                let block = &mut self.blocks[block];
                block.hand.0[lane] = force;
                if peer + 1 == self.places.peers && run + 1 == self.places.runs {
                    block.hand.0[lane..].fill(force);
                }
            }
        }
    }

    /// Everybody computes forces and moves to the next tick.
    #[inline(always)]
    pub(super) fn advance<const L: usize>(&mut self) -> Moved<L> {
        let (mut discrepancy, mut size) = ([0.0; L], Eight::ZERO);
        let per_axis = self.places.blocks();
        for axis in 0..A {
            let (mut low, mut high) = (Eight::splat(f64::INFINITY), Eight::splat(f64::NEG_INFINITY));
            for place in axis * per_axis..(axis + 1) * per_axis {
                let block = &mut self.blocks[place];
                low = block.object_x.smaller(low);
                high = block.object_x.larger(high);
                let (mut coupling, mut on_object) = block.forces(&self.common);
                if let Some(walls) = &self.walls {
                    block.add_walls(walls, &mut on_object);
                }
                if let Some(late) = &mut self.late {
                    (coupling, on_object) = late[place].exchange(coupling, on_object);
                }
                block.advance(&self.common, coupling, on_object);
                size = size + block.size();
            }
            let distances = distances::<L>(low, high);
            for run in 0..L {
                discrepancy[run] = if distances[run] > discrepancy[run] { distances[run] } else { discrepancy[run] };
            }
        }
        Moved { discrepancy, finite: self.finite(size) }
    }

    /// Whether everything in each run is finite, where `size` is the sum of the sizes of all that moves.
    #[inline(always)]
    fn finite<const L: usize>(&self, size: Eight) -> [bool; L] {
        // A sum of sizes is finite only if they all are. Were it not for overflow it would also be so the other way round.
        let [a, b, c, d, e, f, g, h] = (size & self.goes_on).0;
        if ((a + e) + (b + f)) + ((c + g) + (d + h)) < f64::INFINITY { [true; L] } else { self.look_at_each() }
    }

    #[cold]
    fn look_at_each<const L: usize>(&self) -> [bool; L] {
        let mut finite = [true; L];
        for axis in 0..A {
            for (Spot { block, lane }, _, run) in self.places.all(axis) {
                let block = &self.blocks[block];
                let numbers = [block.device_x, block.device_v, block.object_x, block.object_v];
                finite[run] &= numbers.iter().all(|numbers| numbers.0[lane].is_finite());
            }
        }
        finite
    }
}

/// The distance from the least to the greatest of each run.
#[inline(always)]
fn distances<const L: usize>(mut low: Eight, mut high: Eight) -> [f64; L] {
    let mut width = WIDTH;
    while width > L {
        width /= 2;
        for lane in 0..width {
            (low.0[lane], high.0[lane]) = (smaller(low.0[lane], low.0[lane + width]), larger(high.0[lane], high.0[lane + width]));
        }
    }
    std::array::from_fn(|run| high.0[run] - low.0[run])
}

impl Block {
    fn empty(axis: usize) -> Self {
        let zero = Eight::ZERO;
        Self {
            device_x: zero,
            device_v: zero,
            object_x: zero,
            object_v: zero,
            target_x: zero,
            target_v: zero,
            hand: zero,
            stiffness: zero,
            damping: zero,
            grasps: Mask::NONE,
            device: Map::ZERO,
            contacts: None,
            axis,
            is_tied: false,
        }
    }

    fn touch(&mut self, axis: usize, lane: usize, contact: Contact) {
        match contact {
            Contact::None => {}
            Contact::Grasp => self.grasps.set(lane, true),
            Contact::Push(direction) if direction.axis != axis => {}
            Contact::Push(_) => {
                let grasps = self.grasps;
                let so_far = |lane| if grasps.get(lane) { Contact::Grasp } else { Contact::None };
                self.contacts.get_or_insert_with(|| Box::new(std::array::from_fn(so_far)));
            }
        }
        if let Some(contacts) = &mut self.contacts {
            contacts[lane] = contact;
        }
    }

    /// FC, and FC − FT.
    #[inline(always)]
    fn forces(&self, common: &Common) -> (Eight, Eight) {
        let (gap, speed) = (self.device_x - self.object_x, self.device_v - self.object_v);
        //= Rakhsha & Constantinescu 2015, eq. (9): FC = KC·(xH − xO) + BC·(vH − vO)
        let mut coupling = (self.stiffness * gap + self.damping * speed) & self.grasps;
        if let Some(contacts) = &self.contacts {
            for lane in 0..WIDTH {
                let gains = Gains { stiffness: self.stiffness.0[lane], damping: self.damping.0[lane] };
                coupling.0[lane] = contacts[lane].force_along(self.axis, gains, gap.0[lane], speed.0[lane]);
            }
        }
        //= Rakhsha & Constantinescu 2015, eq. (10): FT = KT·(xO − xd) + BT·(vO − vd)
        let coordination = common.stiffness * (self.object_x - self.target_x) + common.damping * (self.object_v - self.target_v);
        (coupling, coupling - coordination)
    }

    #[inline(never)]
    fn add_walls(&self, walls: &[Option<Enclosure>], on_object: &mut Eight) {
        for lane in 0..WIDTH {
            if let Some(walls) = &walls[lane % walls.len()] {
                on_object.0[lane] += walls.force_along(self.axis, self.object_x.0[lane], self.object_v.0[lane]);
            }
        }
    }

    #[inline(always)]
    fn advance(&mut self, common: &Common, coupling: Eight, on_object: Eight) {
        //= Rakhsha & Constantinescu 2015, eq. (7): mH·aH = Fh − FC − bH·vH
        let on_device = self.hand - coupling;
        if self.is_tied {
            self.device.advance(&mut self.device_x, &mut self.device_v, on_device);
        } else {
            self.device.advance_free(&mut self.device_x, &mut self.device_v, on_device);
        }
        common.object.advance_free(&mut self.object_x, &mut self.object_v, on_object);
    }

    #[inline(always)]
    fn size(&self) -> Eight {
        (self.device_x.abs() + self.device_v.abs()) + (self.object_x.abs() + self.object_v.abs())
    }
}

impl Late {
    /// Remembers the forces computed now, and gives those that are applied.
    #[inline(always)]
    fn exchange(&mut self, coupling: Eight, on_object: Eight) -> (Eight, Eight) {
        let applied = (self.is_late.choose(self.coupling, coupling), self.is_late.choose(self.on_object, on_object));
        (self.coupling, self.on_object) = (coupling, on_object);
        applied
    }
}
