//! The tick of a peer as runs and analyses compute it: one text of the equations for one peer, for eight lanes, and for the columns of a response.

use cohaptic_peer::coordination::{Law, Observation};
use cohaptic_peer::tick::{forces, grasp, on_device};
use cohaptic_peer::{Motion, StepMap};

use crate::by_hand::{Eight, Numbers, Tick};

/// One peer on one axis.
#[inline(never)]
pub fn one(tick: &Tick<f64>, law: &impl Law<f64>, numbers: &mut Numbers<f64>, ticks: u32) {
    let [mut device, mut own, mean] = bodies(|place| numbers[place]);
    for _ in 0..ticks {
        let (coupling, on_object) =
            forces(device, |apart| grasp(&tick.coupling, apart), &Observation { own, past: own, mean, lead: 0.0 }, law, &mut []);
        tick.device.advance_free(&mut device, on_device(tick.hand, coupling));
        tick.object.advance_free(&mut own, on_object);
    }
    [numbers[0], numbers[1], numbers[2], numbers[3]] = [device.position, device.velocity, own.position, own.velocity];
}

/// Eight peers, each with coefficients of its own; `law` gives the law of a lane.
#[inline(never)]
pub fn eight<L: Law<f64>>(tick: &Tick<Eight>, law: impl Fn(usize) -> L, numbers: &mut Numbers<Eight>, ticks: u32) {
    for _ in 0..ticks {
        for lane in 0..8 {
            let [mut device, mut own, mean] = bodies(|place| numbers[place].0[lane]);
            let coupling = tick.coupling.map(|gain| gain.0[lane]);
            let (coupling, on_object) =
                forces(device, |apart| grasp(&coupling, apart), &Observation { own, past: own, mean, lead: 0.0 }, &law(lane), &mut []);
            let of_lane = |map: &StepMap<Eight>| map.map(|coefficient| coefficient.0[lane]);
            of_lane(&tick.device).advance_free(&mut device, on_device(tick.hand.0[lane], coupling));
            of_lane(&tick.object).advance_free(&mut own, on_object);
            (numbers[0].0[lane], numbers[1].0[lane]) = (device.position, device.velocity);
            (numbers[2].0[lane], numbers[3].0[lane]) = (own.position, own.velocity);
        }
    }
}

/// The columns of a response, without hands.
#[inline(never)]
#[expect(clippy::needless_range_loop, reason = "a column of six rows at once")]
pub fn columns<const C: usize>(tick: &Tick<f64>, law: &impl Law<f64>, numbers: &mut Numbers<[f64; C]>, ticks: u32) {
    let tick = *tick;
    for _ in 0..ticks {
        for column in 0..C {
            let [mut device, mut own, mean] = bodies(|place| numbers[place][column]);
            let (coupling, on_object) =
                forces(device, |apart| grasp(&tick.coupling, apart), &Observation { own, past: own, mean, lead: 0.0 }, law, &mut []);
            tick.device.advance(&mut device, -coupling);
            tick.object.advance(&mut own, on_object);
            (numbers[0][column], numbers[1][column]) = (device.position, device.velocity);
            (numbers[2][column], numbers[3][column]) = (own.position, own.velocity);
        }
    }
}

/// Device, copy, and the mean of the samples held.
#[inline(always)]
fn bodies(number: impl Fn(usize) -> f64) -> [Motion; 3] {
    let motion = |place: usize| Motion { position: number(2 * place), velocity: number(2 * place + 1) };
    [motion(0), motion(1), motion(2)]
}
