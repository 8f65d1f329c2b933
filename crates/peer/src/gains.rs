//! Springs with dampers: the coupling of a device with its copy, and the coordination of a copy with the other copies.

use crate::{Motion, Number};

/// A spring and a damper side by side: the virtual coupling (KC, BC) or the coordination (KT, BT).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Gains<C = f64> {
    /// Stiffness [N/m].
    pub stiffness: C,
    /// Damping [N·s/m].
    pub damping: C,
}

impl<C: Copy> Gains<C> {
    /// Returns the gains with `gain` applied to each, the stiffness first.
    #[must_use]
    #[inline(always)]
    pub fn map<D>(&self, mut gain: impl FnMut(&C) -> D) -> Gains<D> {
        Gains { stiffness: gain(&self.stiffness), damping: gain(&self.damping) }
    }
}

impl<N: Number> Gains<N> {
    /// Returns the force of the spring and the damper \[N\], where `apart` is the motion of one end relative to the other end.
    #[must_use]
    pub fn force(&self, apart: Motion<N>) -> N {
        self.stiffness * apart.position + self.damping * apart.velocity
    }
}

impl Gains {
    /// Returns both gains times `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { stiffness: self.stiffness * factor, damping: self.damping * factor }
    }
}

/// Returns FC \[N\] of a device that grasps its copy, where `apart` is the motion of the device relative to the copy: xH − xO and vH − vO.
#[must_use]
#[inline(always)]
pub fn grasp<N: Number>(coupling: &Gains<N>, apart: Motion<N>) -> N {
    //= Rakhsha & Constantinescu 2015, eq. (9): FC = KC·(xH − xO) + BC·(vH − vO)
    coupling.force(apart)
}

/// Returns FT \[N\] towards a desired motion, where `apart` is the motion of the copy relative to the desired motion: xO − xd and vO − vd.
#[must_use]
#[inline(always)]
pub fn coordinate<N: Number>(coordination: &Gains<N>, apart: Motion<N>) -> N {
    //= Rakhsha & Constantinescu 2015, eq. (10): FT = KT·(xO − xd) + BT·(vO − vd)
    coordination.force(apart)
}
