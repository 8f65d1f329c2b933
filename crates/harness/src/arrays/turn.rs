//! Eight copies that turn, and devices that turn with them.

use cohaptic_peer::rotation::{
    Attitude, Matrix3, RotationMethod, RotationStep, Triple, aligning_torque, half_turns, in_body_axes, lever, point_of, reaction, turning_torque,
};
use cohaptic_peer::{Gains, Motion, Signal, State};
use cohaptic_units::Instant;

use super::blocks::Block;
use super::lanes::{Lanes, Mask, WIDTH};

/// What all copies of a run have in common.
#[derive(Clone, Debug)]
pub(super) struct Shared {
    pub(super) step: Steps,
    /// KR and BR.
    pub(super) gains: Gains<Triple<Lanes>>,
}

/// The steps of eight bodies, all by one method.
#[derive(Clone, Debug)]
pub(super) struct Steps(RotationStep<Lanes>);

/// Eight copies, each with its device.
#[derive(Clone, Debug)]
pub(super) struct Turn {
    pub(super) attitude: Attitude<Lanes>,
    /// M̄ by rows, and w̄.
    pub(super) mean: [Lanes; 12],
    grasp: Triple<Lanes>,
    pub(super) handles: Option<Box<Handles>>,
    late: Option<Box<Late>>,
}

/// The devices that turn.
#[derive(Clone, Debug)]
pub(super) struct Handles {
    attitude: Attitude<Lanes>,
    step: Steps,
    /// KCR and BCR.
    coupling: Gains<Lanes>,
    /// Those that grasp their copies.
    grasps: Mask,
    /// Those that are there.
    present: Mask,
    /// What turns the hand of each, and its torque now in world axes.
    hands: [Option<Signal>; WIDTH],
    torque: Triple<Lanes>,
    /// Those that have such a hand.
    held: Mask,
}

/// Forces and torques of a tick, before any of them acts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Computed {
    /// FC.
    pub(super) coupling: Triple<Lanes>,
    /// Without those of the coordination.
    pub(super) torques: Torques,
    /// τT without what the law damps.
    pub(super) aligning: Triple<Lanes>,
}

/// Torques on copies, and on devices but for those of hands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Torques {
    pub(super) on_copy: Triple<Lanes>,
    on_device: Triple<Lanes>,
}

/// Torques that are applied a tick late.
#[derive(Clone, Debug)]
struct Late {
    computed: Torques,
    is_late: Mask,
}

const NOTHING: Triple<Lanes> = [Lanes::ZERO; 3];

#[inline(always)]
fn lane_of<const K: usize>(lanes: &[Lanes; K], lane: usize) -> [f64; K] {
    std::array::from_fn(|place| lanes[place].0[lane])
}

#[inline(always)]
fn set_lane<const K: usize>(lanes: &mut [Lanes; K], lane: usize, numbers: [f64; K]) {
    for place in 0..K {
        lanes[place].0[lane] = numbers[place];
    }
}

#[inline(always)]
fn attitude_of(attitudes: &Attitude<Lanes>, lane: usize) -> Attitude {
    Attitude { orientation: lane_of(&attitudes.orientation, lane), rate: lane_of(&attitudes.rate, lane) }
}

#[inline(always)]
fn set_attitude(attitudes: &mut Attitude<Lanes>, lane: usize, attitude: &Attitude) {
    set_lane(&mut attitudes.orientation, lane, attitude.orientation);
    set_lane(&mut attitudes.rate, lane, attitude.rate);
}

#[inline(always)]
fn gains_of(gains: &Gains<Triple<Lanes>>, lane: usize) -> Gains<Triple> {
    Gains { stiffness: lane_of(&gains.stiffness, lane), damping: lane_of(&gains.damping, lane) }
}

#[inline(always)]
fn matrix_of(lanes: &[Lanes; 9], lane: usize) -> Matrix3 {
    std::array::from_fn(|row| std::array::from_fn(|column| lanes[3 * row + column].0[lane]))
}

const REST: Attitude<Lanes> = Attitude { orientation: [Lanes([1.0; WIDTH]), Lanes::ZERO, Lanes::ZERO, Lanes::ZERO], rate: NOTHING };

fn size_of(attitude: &Attitude<Lanes>) -> Lanes {
    attitude.orientation.iter().chain(&attitude.rate).fold(Lanes::ZERO, |sum, part| sum + part.abs())
}

impl Steps {
    /// Steps by that method that move nothing.
    pub(super) fn of(step: &RotationStep) -> Self {
        Self(step.map(|_| Lanes::ZERO))
    }

    pub(super) fn set(&mut self, lane: usize, step: &RotationStep) {
        let mut numbers = Vec::new();
        let _ = step.map(|coefficient| numbers.push(*coefficient));
        let mut numbers = numbers.into_iter();
        self.0 = self.0.map(|lanes| {
            let mut lanes = *lanes;
            lanes.0[lane] = numbers.next().unwrap_or_default();
            lanes
        });
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> RotationStep {
        self.0.map(|coefficient| coefficient.0[lane])
    }

    /// [`RotationStep::advance`] of each.
    #[inline(always)]
    fn advance(&self, bodies: &mut Attitude<Lanes>, torques: &Triple<Lanes>) {
        if self.0.method() != RotationMethod::Exponential {
            self.advance_each(bodies, torques);
            return;
        }
        for _ in 0..self.0.steps() {
            let (mut rates, mut sigmas, mut squares) = (NOTHING, NOTHING, [0.0; WIDTH]);
            for (lane, square) in squares.iter_mut().enumerate() {
                let step = self.lane(lane);
                let (rate, sigma) = step.exponential(lane_of(&bodies.rate, lane), step.forced(lane_of(torques, lane)));
                *square = sigma[0] * sigma[0] + sigma[1] * sigma[1] + sigma[2] * sigma[2];
                set_lane(&mut rates, lane, rate);
                set_lane(&mut sigmas, lane, sigma);
            }
            bodies.rate = rates;
            let (cosines, sines) = half_turns(&squares);
            for lane in 0..WIDTH {
                let mut body = attitude_of(bodies, lane);
                body.turn_by(lane_of(&sigmas, lane), (cosines[lane], sines[lane]));
                set_lane(&mut bodies.orientation, lane, body.orientation);
            }
        }
    }

    #[inline(never)]
    fn advance_each(&self, bodies: &mut Attitude<Lanes>, torques: &Triple<Lanes>) {
        for lane in 0..WIDTH {
            let mut body = attitude_of(bodies, lane);
            self.lane(lane).advance(&mut body, lane_of(torques, lane));
            set_attitude(bodies, lane, &body);
        }
    }
}

impl Turn {
    pub(super) fn at_rest() -> Self {
        Self { attitude: REST, mean: [Lanes::ZERO; 12], grasp: NOTHING, handles: None, late: None }
    }

    /// The copy of a lane begins so.
    pub(super) fn begin(&mut self, lane: usize, attitude: Attitude, grasp: Triple, is_late: bool) {
        set_attitude(&mut self.attitude, lane, &attitude);
        set_lane(&mut self.grasp, lane, grasp);
        if is_late {
            let nothing = Torques { on_copy: NOTHING, on_device: NOTHING };
            self.late.get_or_insert_with(|| Box::new(Late { computed: nothing, is_late: Mask::NONE })).is_late.set(lane, true);
        }
    }

    #[inline(always)]
    pub(super) fn attitude(&self, lane: usize) -> Attitude {
        attitude_of(&self.attitude, lane)
    }

    /// Computes the torques of a tick and turns. Gives FC along each axis, of the blocks of these copies and their devices.
    #[inline(always)]
    pub(super) fn tick(&mut self, shared: &Shared, blocks: [&Block; 3]) -> Triple<Lanes> {
        let Computed { coupling, mut torques, aligning } = self.compute(shared, blocks);
        for (on_copy, aligning) in torques.on_copy.iter_mut().zip(&aligning) {
            *on_copy = *on_copy - *aligning;
        }
        if let Some(late) = &mut self.late {
            torques = late.exchange(torques);
        }
        shared.step.advance(&mut self.attitude, &torques.on_copy);
        if let Some(handles) = &mut self.handles {
            handles.advance(&torques.on_device);
        }
        coupling
    }

    /// Forces and torques of a tick, of the blocks of these copies and their devices.
    #[inline(always)]
    pub(super) fn compute(&self, shared: &Shared, blocks: [&Block; 3]) -> Computed {
        let mut matrices = [Lanes::ZERO; 9];
        let still = Motion { position: Lanes::ZERO, velocity: Lanes::ZERO };
        let mut points = [still; 3];
        for lane in 0..WIDTH {
            let (copy, centres) = (self.attitude(lane), blocks.map(|block| block.object_of(lane)));
            let centre = State { position: centres.map(|centre| centre.position), velocity: centres.map(|centre| centre.velocity) };
            let matrix = copy.matrix();
            let point = point_of::<3>(&matrix, copy.rate, lane_of(&self.grasp, lane), &centre);
            let [[a, b, c], [d, e, f], [g, h, i]] = matrix;
            set_lane(&mut matrices, lane, [a, b, c, d, e, f, g, h, i]);
            for (axis, points) in points.iter_mut().enumerate() {
                points.position.0[lane] = point.position[axis];
                points.velocity.0[lane] = point.velocity[axis];
            }
        }
        let coupling: Triple<Lanes> = std::array::from_fn(|axis| blocks[axis].coupling(&points[axis]));
        let (mut levers, mut aligning) = (NOTHING, NOTHING);
        for lane in 0..WIDTH {
            let (matrix, rate) = (matrix_of(&matrices, lane), lane_of(&self.attitude.rate, lane));
            let [a, b, c, d, e, f, g, h, i, p, q, r] = lane_of(&self.mean, lane);
            let mean = [[a, b, c], [d, e, f], [g, h, i]];
            set_lane(&mut levers, lane, lever(&matrix, lane_of(&self.grasp, lane), lane_of(&coupling, lane)));
            set_lane(&mut aligning, lane, aligning_torque((&matrix, rate), (&mean, [p, q, r]), &gains_of(&shared.gains, lane)));
        }
        let mut torques = Torques { on_copy: levers, on_device: NOTHING };
        if let Some(handles) = &self.handles {
            handles.couple(&matrices, &self.attitude.rate, &mut torques);
        }
        Computed { coupling, torques, aligning }
    }

    /// How the device of a lane is turned; `None` if it does not turn.
    pub(super) fn device(&self, lane: usize) -> Option<Attitude> {
        self.handles.as_ref().filter(|handles| handles.present.get(lane)).map(|handles| attitude_of(&handles.attitude, lane))
    }

    /// The sum of the sizes of all numbers of each lane.
    #[inline(always)]
    pub(super) fn size(&self) -> Lanes {
        let copies = size_of(&self.attitude);
        self.handles.as_ref().map_or(copies, |handles| copies + size_of(&handles.attitude))
    }

    pub(super) fn is_finite(&self, lane: usize) -> bool {
        let handles = self.handles.as_ref().map(|handles| attitude_of(&handles.attitude, lane));
        self.attitude(lane).is_finite() && handles.is_none_or(|handle| handle.is_finite())
    }
}

impl Handles {
    /// No device turns, and those that will do it by steps like that one.
    pub(super) fn none(step: &RotationStep) -> Self {
        Self {
            attitude: REST,
            step: Steps::of(step),
            coupling: Gains { stiffness: Lanes::ZERO, damping: Lanes::ZERO },
            grasps: Mask::NONE,
            present: Mask::NONE,
            hands: [const { None }; WIDTH],
            torque: NOTHING,
            held: Mask::NONE,
        }
    }

    /// The device of a lane turns, and begins so.
    pub(super) fn begin(&mut self, lane: usize, attitude: Attitude, step: &RotationStep, coupling: &Gains, grasps: bool) {
        set_attitude(&mut self.attitude, lane, &attitude);
        self.step.set(lane, step);
        (self.coupling.stiffness.0[lane], self.coupling.damping.0[lane]) = (coupling.stiffness, coupling.damping);
        self.grasps.set(lane, grasps);
        self.present.set(lane, true);
    }

    /// Whether the device of a lane grasps its copy from now on.
    pub(super) fn set_grasps(&mut self, lane: usize, grasps: bool) {
        self.grasps.set(lane, grasps && self.present.get(lane));
    }

    /// What turns the hand of a lane from now on, if its device turns.
    pub(super) fn set_hand(&mut self, lane: usize, hand: Option<&Signal>) {
        self.hands[lane] = hand.filter(|_| self.present.get(lane)).cloned();
    }

    /// Hands take the torque of now.
    pub(super) fn move_hands(&mut self, now: Instant) {
        for lane in 0..WIDTH {
            self.held.set(lane, self.hands[lane].is_some());
            if let Some(hand) = &self.hands[lane] {
                set_lane(&mut self.torque, lane, hand.value::<3>(now));
            }
        }
    }

    /// Adds τC, and what it does to devices.
    #[inline(always)]
    fn couple(&self, matrices: &[Lanes; 9], rates: &Triple<Lanes>, torques: &mut Torques) {
        let (mut added, mut reactions) = (NOTHING, NOTHING);
        for lane in 0..WIDTH {
            let (matrix, handle) = (matrix_of(matrices, lane), attitude_of(&self.attitude, lane));
            let turned = handle.matrix();
            let coupling = self.coupling.map(|gain| gain.0[lane]);
            let torque = turning_torque((&matrix, lane_of(rates, lane)), (&turned, handle.rate), &coupling);
            set_lane(&mut reactions, lane, reaction(&matrix, &turned, torque));
            set_lane(&mut added, lane, torque);
        }
        for axis in 0..3 {
            torques.on_copy[axis] = self.grasps.choose(torques.on_copy[axis] + added[axis], torques.on_copy[axis]);
            torques.on_device[axis] = reactions[axis] & self.grasps;
        }
    }

    #[inline(always)]
    fn advance(&mut self, on_device: &Triple<Lanes>) {
        let mut torques = NOTHING;
        for lane in 0..WIDTH {
            let hand = in_body_axes(&attitude_of(&self.attitude, lane).matrix(), lane_of(&self.torque, lane));
            for axis in 0..3 {
                torques[axis].0[lane] = self.held.keep(lane, hand[axis]) + on_device[axis].0[lane];
            }
        }
        self.step.advance(&mut self.attitude, &torques);
    }
}

impl Late {
    /// Remembers the torques computed now, and gives those that are applied.
    #[inline(always)]
    fn exchange(&mut self, torques: Torques) -> Torques {
        let choose = |late: &Triple<Lanes>, now: &Triple<Lanes>| std::array::from_fn(|axis| self.is_late.choose(late[axis], now[axis]));
        let applied =
            Torques { on_copy: choose(&self.computed.on_copy, &torques.on_copy), on_device: choose(&self.computed.on_device, &torques.on_device) };
        self.computed = torques;
        applied
    }
}
