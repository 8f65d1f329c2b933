//! Eight devices with copies of the object along one axis, and the motion of a tick.

use cohaptic_peer::coordination::{Law, Observation};
use cohaptic_peer::tick::{forces, grasp, on_device, on_object};
use cohaptic_peer::{Contact, Enclosure, Gains, Motion, StepMap};

use super::law::{LawOfLanes, memory_of_lane};
use super::{Lanes, Mask, Motions, WIDTH, lane_of, set_lane};

/// Eight devices with their copies of the object, along one axis.
#[derive(Clone, Debug)]
pub(in crate::arrays) struct Block {
    pub(super) device: Motions,
    pub(super) object: Motions,
    /// Mean of the samples held.
    pub(super) mean: Motions,
    /// Force of a hand on each device \[N\].
    pub(super) hand: Lanes,
    /// Coupling gains KC \[N/m\] and BC \[N·s/m\].
    pub(super) coupling: Gains<Lanes>,
    /// Lanes with a grasp between device and copy.
    pub(super) grasps: Mask,
    pub(super) device_map: StepMap<Lanes>,
    /// Contacts of all eight lanes. `None` if no lane has ever had a one-sided contact along this axis.
    pub(super) contacts: Option<Box<[Contact; WIDTH]>>,
    pub(super) axis: usize,
    /// `true` if any of the devices is tied to ground, so its step map has no free motion.
    pub(super) is_tied: bool,
}

/// Forces of a tick on eight peers \[N\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Forces {
    /// Coupling force FC.
    pub(super) coupling: Lanes,
    /// Force on the copy: FC − FT, plus the force of the walls.
    pub(super) on_object: Lanes,
}

/// Forces of late lanes.
#[derive(Clone, Debug)]
pub(super) struct Late {
    /// Forces computed at the latest tick.
    pub(super) computed: Forces,
    /// Lanes with forces applied a tick late.
    pub(super) is_late: Mask,
}

pub(super) const ZERO_MAP: StepMap<Lanes> = StepMap::new([[Lanes::ZERO; 2]; 2], [Lanes::ZERO; 2]);

/// Step map without motion. Without force the map keeps even the sign of a zero, hence the entries of −0.
pub(super) const RESTING: StepMap = StepMap::new([[0.0, -0.0], [0.0, 0.0]], [-0.0, 0.0]);

impl Forces {
    pub(super) const NONE: Self = Self { coupling: Lanes::ZERO, on_object: Lanes::ZERO };
}

/// Replaces the step map of one lane.
pub(super) fn set_map(maps: &mut StepMap<Lanes>, lane: usize, map: &StepMap) {
    // The numbers come in the order in which `map` visits the coefficients of a step map.
    let (state, force) = map.coefficients();
    let mut numbers = state.into_iter().flatten().chain(force);
    *maps = maps.map(|lanes| {
        let mut lanes = *lanes;
        lanes.0[lane] = numbers.next().unwrap_or_default();
        lanes
    });
}

/// Computes [`Block::tick`]. Each array is a separate reference, so the compiler knows that no lane reads a number written by another lane.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "each by a reference of its own")]
fn tick_of_lanes<const TIED: bool, L: LawOfLanes>(
    devices: &mut Motions,
    objects: &mut Motions,
    (means, pasts, leads): (&Motions, &Motions, &Lanes),
    memory: &mut [f64],
    hands: &Lanes,
    (coupling, grasps): (&Gains<Lanes>, &Mask),
    device_map: &StepMap<Lanes>,
    (law, object_map): (&L, &StepMap<Lanes>),
) {
    let remembered = law.remembered();
    for lane in 0..WIDTH {
        let (mut device, mut object) = (lane_of(devices, lane), lane_of(objects, lane));
        let gains = coupling.map(|gain| gain.0[lane]);
        let touch = |apart| grasps.keep(lane, grasp(&gains, apart));
        let seen = Observation { own: object, past: lane_of(pasts, lane), mean: lane_of(means, lane), lead: leads.0[lane] };
        let memory = memory_of_lane(memory, remembered, lane);
        // Forces first, motion after: the forces belong to the state at the tick.
        let (coupling, on_object) = forces(device, touch, &seen, &law.of_lane(lane), memory);
        let map = device_map.map(|coefficient| coefficient.0[lane]);
        // A free body has two coefficients less. The branch is on a constant and costs nothing.
        if TIED {
            map.advance(&mut device, on_device(hands.0[lane], coupling));
        } else {
            map.advance_free(&mut device, on_device(hands.0[lane], coupling));
        }
        object_map.map(|coefficient| coefficient.0[lane]).advance_free(&mut object, on_object);
        set_lane(devices, lane, device);
        set_lane(objects, lane, object);
    }
}

impl Block {
    pub(super) fn empty(axis: usize) -> Self {
        let zero = Lanes::ZERO;
        let rest = Motion { position: zero, velocity: zero };
        Self {
            device: rest,
            object: rest,
            mean: rest,
            hand: zero,
            coupling: Gains { stiffness: zero, damping: zero },
            grasps: Mask::NONE,
            device_map: ZERO_MAP,
            contacts: None,
            axis,
            is_tied: false,
        }
    }

    /// Replaces the contact of a lane.
    pub(super) fn touch(&mut self, lane: usize, contact: Contact) {
        self.grasps.set(lane, contact == Contact::Grasp);
        // The list is made at the first one-sided contact along this axis, from the contacts of all lanes so far.
        if matches!(contact, Contact::Push(direction) if direction.axis == self.axis) {
            let grasps = self.grasps;
            let so_far = |lane| if grasps.get(lane) { Contact::Grasp } else { Contact::None };
            self.contacts.get_or_insert_with(|| Box::new(std::array::from_fn(so_far)));
        }
        if let Some(contacts) = &mut self.contacts {
            contacts[lane] = contact;
        }
    }

    /// Computes forces and motion of a tick in one pass, if no forces but grasps, hands and the law act.
    #[inline(always)]
    pub(super) fn tick<L: LawOfLanes>(&mut self, law: &L, past: &Motions, lead: &Lanes, memory: &mut [f64], object_map: &StepMap<Lanes>) {
        let common = (law, object_map);
        let Self { device, object, mean, hand, coupling, grasps, device_map, .. } = self;
        let (seen, touch) = ((&*mean, past, lead), (&*coupling, &*grasps));
        if self.is_tied {
            tick_of_lanes::<true, L>(device, object, seen, memory, hand, touch, device_map, common);
        } else {
            tick_of_lanes::<false, L>(device, object, seen, memory, hand, touch, device_map, common);
        }
    }

    /// Returns the coupling force FC of each lane \[N\].
    #[inline(always)]
    pub(super) fn coupling(&self) -> Lanes {
        let apart = |lane| lane_of(&self.device, lane).relative_to(lane_of(&self.object, lane));
        let mut coupling = Lanes::ZERO;
        for lane in 0..WIDTH {
            coupling.0[lane] = grasp(&self.coupling.map(|gain| gain.0[lane]), apart(lane));
        }
        // Lanes without a grasp have gains too, so the mask removes their forces, signs of zeros included.
        coupling = coupling & self.grasps;
        // One-sided contacts depend on the sign of the depth, a branch per lane, and replace the forces of all lanes.
        if let Some(contacts) = &self.contacts {
            for lane in 0..WIDTH {
                let gains = self.coupling.map(|gain| gain.0[lane]);
                coupling.0[lane] = contacts[lane].force_along(self.axis, &gains, apart(lane));
            }
        }
        coupling
    }

    #[inline(always)]
    pub(super) fn observation(&self, past: &Motions, lead: &Lanes, lane: usize) -> Observation {
        Observation { own: lane_of(&self.object, lane), past: lane_of(past, lane), mean: lane_of(&self.mean, lane), lead: lead.0[lane] }
    }

    /// Returns the positions of the copies \[m\].
    pub(in crate::arrays) const fn positions(&self) -> &[f64; WIDTH] {
        &self.object.position.0
    }

    /// Returns the forces of a tick, without walls.
    #[inline(always)]
    pub(super) fn forces<L: LawOfLanes>(&self, coupling: Lanes, law: &L, past: &Motions, lead: &Lanes, memory: &mut [f64]) -> Forces {
        let mut on_copy = Lanes::ZERO;
        let remembered = law.remembered();
        for lane in 0..WIDTH {
            let seen = self.observation(past, lead, lane);
            let coordination = law.of_lane(lane).force(&seen, memory_of_lane(memory, remembered, lane));
            on_copy.0[lane] = on_object(coupling.0[lane], coordination);
        }
        Forces { coupling, on_object: on_copy }
    }

    #[inline(never)]
    pub(super) fn add_walls(&self, walls: &[Option<Enclosure>], on_object: &mut Lanes) {
        for lane in 0..WIDTH {
            if let Some(walls) = &walls[lane % walls.len()] {
                on_object.0[lane] += walls.force_along(self.axis, self.object.position.0[lane], self.object.velocity.0[lane]);
            }
        }
    }

    /// Moves devices and copies to the next tick.
    #[inline(always)]
    pub(super) fn advance(&mut self, object_map: &StepMap<Lanes>, forces: &Forces) {
        // A lane's device and copy move independently of each other: their forces are known.
        for lane in 0..WIDTH {
            let map = self.device_map.map(|coefficient| coefficient.0[lane]);
            let mut device = lane_of(&self.device, lane);
            let force = on_device(self.hand.0[lane], forces.coupling.0[lane]);
            if self.is_tied {
                map.advance(&mut device, force);
            } else {
                map.advance_free(&mut device, force);
            }
            set_lane(&mut self.device, lane, device);
            let mut object = lane_of(&self.object, lane);
            object_map.map(|coefficient| coefficient.0[lane]).advance_free(&mut object, forces.on_object.0[lane]);
            set_lane(&mut self.object, lane, object);
        }
    }

    #[inline(always)]
    // Sums of absolute values: a NaN or an infinity of any body survives the addition.
    pub(super) fn size(&self) -> Lanes {
        let size = |motions: &Motions| motions.position.abs() + motions.velocity.abs();
        size(&self.device) + size(&self.object)
    }
}

impl Late {
    /// Stores the forces computed now, and returns the acting forces: in late lanes the forces of the previous tick.
    #[inline(always)]
    pub(super) fn exchange(&mut self, forces: Forces) -> Forces {
        let applied = Forces {
            // A late lane applies the forces of the tick before. The others apply theirs at once, in the same instructions.
            coupling: self.is_late.choose(self.computed.coupling, forces.coupling),
            on_object: self.is_late.choose(self.computed.on_object, forces.on_object),
        };
        self.computed = forces;
        applied
    }
}
