//! The torques that tie orientations: of a copy to the mean of the others, and of a copy to the device that grasps it.
//!
//! The torque of a pair descends tr P(I − RᵢᵀRⱼ) with P = diag(½·ΣKR − KR): springs between equal points of two copies. It is O(1) a tick for any number of
//! peers, because the mean M̄ of the others' matrices gives the mean of the pair torques. M̄ is no rotation, and must not be made one. Half a turn apart the
//! torque is zero; there is no rule that says which way to turn back.

use core::array::from_fn;

use super::algebra::{add, apply, apply_transposed, by_component, cross, scale, subtract, transposed_product, twice_axial};
use super::{Matrix3, Real, Triple};
use crate::Gains;

/// τT \[N·m\] that draws a copy to the others, in its body axes. It acts on the copy with the opposite sign.
///
/// `own`: R and ω. `mean`: the means M̄ and w̄ of the others' R and of their angular velocities in world axes. `gains`: KR [N·m/rad], of which none is above
/// the sum of the others, and BR [N·m·s/rad], each about the body's axes.
#[must_use]
#[inline(always)]
pub fn aligning_torque<N: Real>(own: (&Matrix3<N>, Triple<N>), mean: (&Matrix3<N>, Triple<N>), gains: &Gains<Triple<N>>) -> Triple<N> {
    let [spring, damper] = aligning_parts(own, mean, gains);
    add(damper, spring)
}

/// The two parts of [`aligning_torque`]: of the springs, and of the dampers.
#[inline(always)]
pub(super) fn aligning_parts<N: Real>(own: (&Matrix3<N>, Triple<N>), mean: (&Matrix3<N>, Triple<N>), gains: &Gains<Triple<N>>) -> [Triple<N>; 2] {
    let (stiffness, half) = (gains.stiffness, N::of(0.5));
    let sum = half * (stiffness[0] + stiffness[1] + stiffness[2]);
    let weights: Triple<N> = from_fn(|axis| sum - stiffness[axis]);
    // τT = BR∘(ω − Rᵀ·w̄) − 2·vee sk(RᵀM̄·P)
    let apart = transposed_product(own.0, mean.0).map(|row| by_component(row, weights));
    let damped = by_component(gains.damping, subtract(own.1, apply_transposed(own.0, mean.1)));
    [twice_axial(&apart).map(|component| -component), damped]
}

/// τC \[N·m\] of a device that grasps a copy, in the body axes of the copy, on which it acts: KCR·vee sk(RᵀRH) + BCR·(RᵀRH·ωH − ω).
///
/// `copy` and `device`: R and ω of each, the angular velocity in its own axes. `coupling`: KCR [N·m/rad] and BCR [N·m·s/rad].
#[must_use]
#[inline(always)]
pub fn turning_torque<N: Real>(copy: (&Matrix3<N>, Triple<N>), device: (&Matrix3<N>, Triple<N>), coupling: &Gains<N>) -> Triple<N> {
    let apart = transposed_product(copy.0, device.0);
    let spring = scale(twice_axial(&apart), coupling.stiffness * N::of(0.5));
    add(spring, scale(subtract(apply(&apart, device.1), copy.1), coupling.damping))
}

/// The torque \[N·m\], in the body axes of a copy, of the force FC that grasps it at `grasp` from its centre: r×RᵀFC.
#[must_use]
#[inline(always)]
pub fn lever<N: Real>(copy: &Matrix3<N>, grasp: Triple<N>, force: Triple<N>) -> Triple<N> {
    cross(grasp, in_body_axes(copy, force))
}

/// The torque \[N·m\] on a device, in handle axes, of the τC that it exerts on a copy: −RHᵀ·R·τC.
#[must_use]
#[inline(always)]
pub fn reaction<N: Real>(copy: &Matrix3<N>, device: &Matrix3<N>, torque: Triple<N>) -> Triple<N> {
    in_body_axes(device, apply(copy, torque)).map(|component| -component)
}

/// A vector in world axes, in the axes of a body with that R: Rᵀ·v.
#[must_use]
#[inline(always)]
pub fn in_body_axes<N: Real>(matrix: &Matrix3<N>, vector: Triple<N>) -> Triple<N> {
    apply_transposed(matrix, vector)
}
