//! Torques between orientations: from a copy to the mean of the other copies, and from a copy to its device.
//!
//! The torque of a pair descends tr P(I − RᵢᵀRⱼ) with P = diag(½·ΣKR − KR), the energy of springs between equal points of two copies. The mean M̄ of the
//! other copies' matrices gives the mean of the pair torques, so a tick costs O(1) for any number of peers. M̄ is no rotation, and must not be made a
//! rotation. At half a turn the torque is zero, and no rule decides the direction of the way back.

use core::array::from_fn;

use super::algebra::{add, apply, apply_transposed, by_component, cross, scale, subtract, transposed_product, twice_axial};
use super::{Matrix3, Real, Triple};
use crate::Gains;

/// Returns τT \[N·m\] towards the other copies, in the body axes of the copy. The torque acts on the copy with the opposite sign.
///
/// `own`: R and ω. `mean`: the means M̄ and w̄ of R and of the angular velocity in world axes over the other copies. `gains`: KR [N·m/rad], where no
/// component exceeds the sum of the two other components, and BR [N·m·s/rad], both about the body's axes.
#[must_use]
#[inline(always)]
pub fn aligning_torque<N: Real>(own: (&Matrix3<N>, Triple<N>), mean: (&Matrix3<N>, Triple<N>), gains: &Gains<Triple<N>>) -> Triple<N> {
    let [spring, damper] = aligning_parts(own, mean, gains);
    add(damper, spring)
}

/// Returns the two parts of [`aligning_torque`]: of the springs, and of the dampers.
#[inline(always)]
pub(super) fn aligning_parts<N: Real>(own: (&Matrix3<N>, Triple<N>), mean: (&Matrix3<N>, Triple<N>), gains: &Gains<Triple<N>>) -> [Triple<N>; 2] {
    let (stiffness, half) = (gains.stiffness, N::of(0.5));
    // P has non-negative entries exactly if no component of KR exceeds the sum of the two other components.
    let sum = half * (stiffness[0] + stiffness[1] + stiffness[2]);
    let weights: Triple<N> = from_fn(|axis| sum - stiffness[axis]);
    // τT = BR∘(ω − Rᵀ·w̄) − 2·vee sk(RᵀM̄·P)
    let apart = transposed_product(own.0, mean.0).map(|row| by_component(row, weights));
    let damped = by_component(gains.damping, subtract(own.1, apply_transposed(own.0, mean.1)));
    [twice_axial(&apart).map(|component| -component), damped]
}

/// Returns τC \[N·m\] of a device that grasps a copy, in the body axes of the copy: KCR·vee sk(RᵀRH) + BCR·(RᵀRH·ωH − ω). The torque acts on the copy.
///
/// `copy` and `device`: R and ω of each body, the angular velocity in the axes of the body. `coupling`: KCR [N·m/rad] and BCR [N·m·s/rad].
#[must_use]
#[inline(always)]
pub fn turning_torque<N: Real>(copy: (&Matrix3<N>, Triple<N>), device: (&Matrix3<N>, Triple<N>), coupling: &Gains<N>) -> Triple<N> {
    let apart = transposed_product(copy.0, device.0);
    // `twice_axial` is twice the axial vector of the skew part, hence the half.
    let spring = scale(twice_axial(&apart), coupling.stiffness * N::of(0.5));
    add(spring, scale(subtract(apply(&apart, device.1), copy.1), coupling.damping))
}

/// Returns the torque \[N·m\], in the body axes of a copy, of a force FC \[N\] in world axes that acts at `grasp` \[m\] from the centre of mass: r×RᵀFC.
#[must_use]
#[inline(always)]
pub(crate) fn lever<N: Real>(copy: &Matrix3<N>, grasp: Triple<N>, force: Triple<N>) -> Triple<N> {
    cross(grasp, in_body_axes(copy, force))
}

/// Returns the torque \[N·m\] on a device, in handle axes, that belongs to its τC on a copy: −RHᵀ·R·τC.
#[must_use]
#[inline(always)]
pub(super) fn reaction<N: Real>(copy: &Matrix3<N>, device: &Matrix3<N>, torque: Triple<N>) -> Triple<N> {
    in_body_axes(device, apply(copy, torque)).map(|component| -component)
}

/// Returns a vector of world axes in the axes of a body with the matrix R: Rᵀ·v.
#[must_use]
#[inline(always)]
pub(super) fn in_body_axes<N: Real>(matrix: &Matrix3<N>, vector: Triple<N>) -> Triple<N> {
    apply_transposed(matrix, vector)
}
