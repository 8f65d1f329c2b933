//! The parameters of a peer. Each is finite and not negative, a mass above zero: the function that makes one checks that.

use crate::tick::grasp;
use crate::{Motion, Number, Signal};

/// A haptic device: a mass with viscous damping.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DeviceConfig {
    /// Mass mH \[kg\], above zero.
    pub mass: f64,
    /// Viscous damping bH [N·s/m].
    pub damping: f64,
}

/// A spring and a damper side by side: the virtual coupling (KC, BC) or the coordination (KT, BT).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Gains<C = f64> {
    /// Stiffness [N/m].
    pub stiffness: C,
    /// Damping [N·s/m].
    pub damping: C,
}

impl<C: Copy> Gains<C> {
    /// Each gain replaced by what `gain` makes of it, the stiffness first.
    #[must_use]
    #[inline(always)]
    pub fn map<D>(&self, mut gain: impl FnMut(&C) -> D) -> Gains<D> {
        Gains { stiffness: gain(&self.stiffness), damping: gain(&self.damping) }
    }
}

impl<N: Number> Gains<N> {
    /// The force of the spring and the damper \[N\], where `apart` is the motion of one end relative to the other.
    #[must_use]
    #[inline(always)]
    pub fn force(&self, apart: Motion<N>) -> N {
        self.stiffness * apart.position + self.damping * apart.velocity
    }
}

impl Gains {
    /// Both gains times `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { stiffness: self.stiffness * factor, damping: self.damping * factor }
    }
}

/// One peer's copy of the shared virtual object.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CopyConfig {
    /// Mass of this copy, mO/N where the object's mass is split \[kg\], above zero.
    pub mass: f64,
    /// Viscous damping bO of this copy [N·s/m].
    pub damping: f64,
}

/// The impedance of an arm that holds the device.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ArmConfig {
    /// Mass that the arm adds to the device \[kg\].
    pub mass: f64,
    /// Damping towards the wanted motion [N·s/m].
    pub damping: f64,
    /// Stiffness towards the wanted motion [N/m].
    pub stiffness: f64,
}

/// What the user's hand does to the device.
#[derive(Clone, PartialEq, Debug)]
pub enum Hand {
    /// A force on the device \[N\], sampled at each tick and held.
    Force(Signal),
    /// An arm of that impedance around a wanted motion \[m\], itself sampled at each tick and held.
    Arm {
        /// The impedance.
        arm: ArmConfig,
        /// The wanted motion \[m\].
        follows: Signal,
    },
}

impl Hand {
    /// The impedance of an arm; `None` for a force.
    #[must_use]
    pub const fn arm(&self) -> Option<ArmConfig> {
        match self {
            Self::Arm { arm, .. } => Some(*arm),
            Self::Force(_) => None,
        }
    }
}

/// How the device touches the copy of the object.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Contact {
    /// Coupled both ways, on every axis: FC = KC·(xH − xO) + BC·(vH − vO).
    #[default]
    Grasp,
    /// Not at all: FC = 0.
    None,
    /// One-sided: the device is a frictionless finger that can push the object in one direction and cannot pull it.
    ///
    /// While the device is past the object's surface in that direction (s·(xH − xO) > 0 with s = ±1) the force along it is
    /// max(0, s·(KC·(xH − xO) + BC·(vH − vO))); otherwise, and on the other axes, it is zero.
    Push(Direction),
}

impl Contact {
    /// FC along an axis \[N\], through a coupling KC and BC, of a device with the motion `apart` relative to the copy: xH − xO and vH − vO.
    #[must_use]
    #[inline(always)]
    pub fn force_along(self, axis: usize, coupling: &Gains, apart: Motion) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Grasp => grasp(coupling, apart),
            Self::Push(direction) => {
                let sign = if direction.positive { 1.0 } else { -1.0 };
                let inwards = Motion { position: sign * apart.position, velocity: sign * apart.velocity };
                if axis != direction.axis || inwards.position <= 0.0 {
                    return 0.0;
                }
                sign * grasp(coupling, inwards).max(0.0)
            }
        }
    }
}

/// A direction along an axis: `+x`, `-z`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Direction {
    /// The axis, 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// Towards larger coordinates.
    pub positive: bool,
}
