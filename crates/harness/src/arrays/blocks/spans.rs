//! Steps of clocks that drift: two spans between ticks, which differ by a nanosecond, and a map for each.

use cohaptic_peer::StepMap;
use cohaptic_scene::Scene;

use super::block::{RESTING, ZERO_MAP, set_map};
use super::{Blocks, Lanes, Mask};
use crate::arrays::lanes::WIDTH;
use crate::arrays::place::{Places, Spot};

/// The maps of the shorter and of the longer span of each peer of one run.
#[derive(Clone, Debug)]
pub(super) struct Spans {
    /// Of devices, by block.
    devices: Vec<[StepMap<Lanes>; 2]>,
    /// Of copies, by block of peers.
    objects: Vec<[StepMap<Lanes>; 2]>,
    /// The peers whose span is the longer one, by block of peers.
    are_long: Vec<Mask>,
    /// Of copies over their present spans, by block of peers.
    present: Vec<StepMap<Lanes>>,
}

/// The map of the span of each lane.
fn chosen(are_long: Mask, [short, long]: &[StepMap<Lanes>; 2]) -> StepMap<Lanes> {
    let (state, force) = long.coefficients();
    let mut longer = state.into_iter().flatten().chain(force);
    short.map(|lanes| longer.next().map_or(*lanes, |longer| are_long.choose(longer, *lanes)))
}

impl Spans {
    /// The maps of that number of axes, with devices that rest; `None` if no clock drifts.
    pub(super) fn of(places: Places, scenes: &[&Scene], axes: usize) -> Option<Self> {
        scenes[0].peers.iter().any(|peer| peer.clock.drift.parts_per_billion() != 0).then(|| {
            let blocks = places.blocks();
            let mut devices = vec![[ZERO_MAP; 2]; axes * blocks];
            for maps in devices.iter_mut().flatten() {
                (0..WIDTH).for_each(|lane| set_map(maps, lane, &RESTING));
            }
            let mut spans =
                Self { devices, objects: vec![[ZERO_MAP; 2]; blocks], are_long: vec![Mask::NONE; blocks], present: vec![ZERO_MAP; blocks] };
            spans.set_objects(places, scenes);
            spans
        })
    }

    /// How a device moves over its shorter and over its longer span.
    pub(super) fn set_device(&mut self, Spot { block, lane }: Spot, (short, long): (&StepMap, &StepMap)) {
        let [of_short, of_long] = &mut self.devices[block];
        set_map(of_short, lane, short);
        set_map(of_long, lane, long);
    }

    /// Copies move as those of that scene.
    pub(super) fn set_objects(&mut self, places: Places, scenes: &[&Scene]) {
        let plant = scenes[0].copy_config(0).plant();
        for (Spot { block, lane }, peer, _) in places.all(0) {
            let (short, long) = scenes[0].peers[places.first + peer].clock.spans();
            for (maps, span) in self.objects[block].iter_mut().zip([short, long]) {
                set_map(maps, lane, &plant.step(span, scenes[0].integrator));
            }
        }
        for ((present, are_long), maps) in self.present.iter_mut().zip(&self.are_long).zip(&self.objects) {
            *present = chosen(*are_long, maps);
        }
    }

    /// How the copies of a block of peers move over their present spans.
    pub(super) fn object_map(&self, block: usize) -> &StepMap<Lanes> {
        &self.present[block]
    }
}

impl Blocks {
    /// The next step of these peers takes the longer span, of all others the shorter one; by block of peers.
    pub(in crate::arrays) fn set_spans(&mut self, are_long: &[Mask]) {
        let Some(spans) = &mut self.spans else { return };
        let per_axis = spans.are_long.len();
        for (block, are_long) in are_long.iter().enumerate() {
            if spans.are_long[block] == *are_long {
                continue;
            }
            spans.are_long[block] = *are_long;
            spans.present[block] = chosen(*are_long, &spans.objects[block]);
            for place in (block..self.blocks.len()).step_by(per_axis) {
                self.blocks[place].device_map = chosen(*are_long, &spans.devices[place]);
            }
        }
    }
}
