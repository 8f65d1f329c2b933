//! The tick of a peer written by hand for one peer, for eight lanes and for the columns of a response: what [`crate::kernel`] is measured against.

use cohaptic_peer::{Gains, StepMap};

/// The coefficients of a tick.
#[derive(Clone, Copy, Debug)]
pub struct Tick<C> {
    /// KC and BC.
    pub coupling: Gains<C>,
    /// KT and BT.
    pub coordination: Gains<C>,
    /// The step of the device, which nothing ties to ground.
    pub device: StepMap<C>,
    /// The step of the copy.
    pub object: StepMap<C>,
    /// The force of the hand.
    pub hand: C,
}

/// The numbers of a tick: device, copy, and the mean of the samples held, each as position and velocity.
pub type Numbers<N> = [N; 6];

#[inline(always)]
fn tick(tick: &Tick<f64>, numbers: &mut Numbers<f64>) {
    let [xh, vh, x, v, xd, vd] = *numbers;
    let ((device, on_device), (object, on_object)) = (tick.device.coefficients(), tick.object.coefficients());
    let coupling = tick.coupling.stiffness * (xh - x) + tick.coupling.damping * (vh - v);
    let coordination = tick.coordination.stiffness * (x - xd) + tick.coordination.damping * (v - vd);
    let (force_on_object, force_on_device) = (coupling - coordination, tick.hand - coupling);
    numbers[0] = xh + (device[0][1] * vh + on_device[0] * force_on_device);
    numbers[1] = vh + (device[1][1] * vh + on_device[1] * force_on_device);
    numbers[2] = x + (object[0][1] * v + on_object[0] * force_on_object);
    numbers[3] = v + (object[1][1] * v + on_object[1] * force_on_object);
}

/// One peer on one axis.
#[inline(never)]
pub fn one(tick: &Tick<f64>, numbers: &mut Numbers<f64>, ticks: u32) {
    for _ in 0..ticks {
        self::tick(tick, numbers);
    }
}

/// Eight numbers, aligned to a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Eight(pub [f64; 8]);

/// Eight peers, each with coefficients of its own.
#[inline(never)]
pub fn eight(tick: &Tick<Eight>, numbers: &mut Numbers<Eight>, ticks: u32) {
    let ((device, on_device), (object, on_object)) = (tick.device.coefficients(), tick.object.coefficients());
    for _ in 0..ticks {
        let [xh, vh, x, v, xd, vd] = *numbers;
        for i in 0..8 {
            let coupling = tick.coupling.stiffness.0[i] * (xh.0[i] - x.0[i]) + tick.coupling.damping.0[i] * (vh.0[i] - v.0[i]);
            let coordination = tick.coordination.stiffness.0[i] * (x.0[i] - xd.0[i]) + tick.coordination.damping.0[i] * (v.0[i] - vd.0[i]);
            let (force_on_object, force_on_device) = (coupling - coordination, tick.hand.0[i] - coupling);
            numbers[0].0[i] = xh.0[i] + (device[0][1].0[i] * vh.0[i] + on_device[0].0[i] * force_on_device);
            numbers[1].0[i] = vh.0[i] + (device[1][1].0[i] * vh.0[i] + on_device[1].0[i] * force_on_device);
            numbers[2].0[i] = x.0[i] + (object[0][1].0[i] * v.0[i] + on_object[0].0[i] * force_on_object);
            numbers[3].0[i] = v.0[i] + (object[1][1].0[i] * v.0[i] + on_object[1].0[i] * force_on_object);
        }
    }
}

/// The columns of a response to C unknowns.
#[inline(never)]
#[expect(clippy::needless_range_loop, reason = "a column of six rows at once")]
pub fn columns<const C: usize>(tick: &Tick<f64>, numbers: &mut Numbers<[f64; C]>, ticks: u32) {
    let ((device, on_device), (object, on_object)) = (tick.device.coefficients(), tick.object.coefficients());
    for _ in 0..ticks {
        for i in 0..C {
            let [xh, vh, x, v, xd, vd] = [numbers[0][i], numbers[1][i], numbers[2][i], numbers[3][i], numbers[4][i], numbers[5][i]];
            let coupling = tick.coupling.stiffness * (xh - x) + tick.coupling.damping * (vh - v);
            let coordination = tick.coordination.stiffness * (x - xd) + tick.coordination.damping * (v - vd);
            let force = coupling - coordination;
            numbers[0][i] = xh + (device[0][0] * xh + device[0][1] * vh + on_device[0] * -coupling);
            numbers[1][i] = vh + (device[1][0] * xh + device[1][1] * vh + on_device[1] * -coupling);
            numbers[2][i] = x + (object[0][0] * x + object[0][1] * v + on_object[0] * force);
            numbers[3][i] = v + (object[1][0] * x + object[1][1] * v + on_object[1] * force);
        }
    }
}
