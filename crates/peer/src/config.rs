//! The parameters of a peer. Each is finite and not negative, a mass above zero: whoever makes one has checked that.

use crate::Signal;

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
pub struct Gains {
    /// Stiffness [N/m].
    pub stiffness: f64,
    /// Damping [N·s/m].
    pub damping: f64,
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
    /// FC along an axis \[N\], through a coupling KC and BC, of a device that is `gap` \[m\] from the copy and moves away from it with `speed` [m/s]: xH − xO
    /// and vH − vO.
    #[must_use]
    #[inline(always)]
    pub fn force_along(self, axis: usize, coupling: Gains, gap: f64, speed: f64) -> f64 {
        let Gains { stiffness: k_c, damping: b_c } = coupling;
        match self {
            Self::None => 0.0,
            //= Rakhsha & Constantinescu 2015, eq. (9): FC = KC·(xH − xO) + BC·(vH − vO)
            Self::Grasp => k_c * gap + b_c * speed,
            Self::Push(direction) => {
                let sign = if direction.positive { 1.0 } else { -1.0 };
                let depth = sign * gap;
                if axis != direction.axis || depth <= 0.0 {
                    return 0.0;
                }
                sign * (k_c * depth + b_c * (sign * speed)).max(0.0)
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
