//! Parameters of a peer. Every number is finite and not negative, and masses are above zero. The caller that makes a parameter checks this.

use alloc::boxed::Box;

use crate::gains::{Gains, grasp};
use crate::operator::OperatorConfig;
use crate::{Motion, Signal, State};

/// A haptic device: a mass with viscous damping.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DeviceConfig {
    /// Mass mH \[kg\], above zero.
    pub mass: f64,
    /// Viscous damping bH [N·s/m].
    pub damping: f64,
}

/// Mass and damping of a peer's copy of the shared virtual object.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CopyConfig {
    /// Mass of this copy, mO/N where the object's mass is split \[kg\], above zero.
    pub mass: f64,
    /// Viscous damping bO of this copy [N·s/m].
    pub damping: f64,
}

/// Impedance of an arm that holds the device.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ArmConfig {
    /// Mass that the arm adds to the device \[kg\].
    pub mass: f64,
    /// Damping towards the wanted motion [N·s/m].
    pub damping: f64,
    /// Stiffness towards the wanted motion [N/m].
    pub stiffness: f64,
}

impl ArmConfig {
    /// Returns the force of the arm's spring and damper at the wanted motion \[N\], on a device whose plant has the same spring and damper to ground.
    #[must_use]
    #[inline]
    pub fn force<const A: usize>(&self, wanted: &State<A>) -> [f64; A] {
        core::array::from_fn(|axis| self.stiffness * wanted.position[axis] + self.damping * wanted.velocity[axis])
    }
}

/// Action of the user's hand on the device.
#[derive(Clone, PartialEq, Debug)]
pub enum Hand {
    /// A force on the device \[N\], sampled at each tick and held.
    Force(Signal),
    /// An arm with an impedance around a wanted motion, sampled at each tick and held.
    Arm {
        /// Impedance of the arm.
        arm: ArmConfig,
        /// Wanted motion \[m\].
        follows: Signal,
    },
    /// An arm with an impedance around the wanted motion of a modelled person. The driver computes this motion at each tick.
    Operator {
        /// Impedance of the arm.
        arm: ArmConfig,
        /// Model of the person.
        operator: Box<OperatorConfig>,
    },
}

impl Hand {
    /// Returns the impedance of an arm; `None` for a force.
    #[must_use]
    pub const fn arm(&self) -> Option<ArmConfig> {
        match self {
            Self::Arm { arm, .. } | Self::Operator { arm, .. } => Some(*arm),
            Self::Force(_) => None,
        }
    }

    /// Returns the model of a person; `None` for any other hand.
    #[must_use]
    pub fn operator(&self) -> Option<&OperatorConfig> {
        if let Self::Operator { operator, .. } = self { Some(operator) } else { None }
    }
}

/// Contact between the device and the copy of the object.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Contact {
    /// Coupling in both directions, on every axis: FC = KC·(xH − xO) + BC·(vH − vO).
    #[default]
    Grasp,
    /// No contact: FC = 0.
    None,
    /// One-sided contact: the device is a frictionless finger that can push the object in one direction and cannot pull it.
    ///
    /// While the device is past the object's surface in that direction (s·(xH − xO) > 0 with s = ±1) the force along it is
    /// max(0, s·(KC·(xH − xO) + BC·(vH − vO))); otherwise, and on the other axes, it is zero.
    Push(Direction),
}

impl Contact {
    /// Returns FC along an axis \[N\], through a coupling KC and BC, of a device with the motion `apart` relative to the copy: xH − xO and vH − vO.
    #[must_use]
    #[inline(always)]
    pub fn force_along(self, axis: usize, coupling: &Gains, apart: Motion) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Grasp => grasp(coupling, apart),
            Self::Push(direction) => {
                // In coordinates that point in the direction of the push, every finger pushes towards plus.
                let sign = if direction.positive { 1.0 } else { -1.0 };
                let inwards = Motion { position: sign * apart.position, velocity: sign * apart.velocity };
                if axis != direction.axis || inwards.position <= 0.0 {
                    return 0.0;
                }
                // A finger that leaves fast would be pulled back by the damper; a contact can only push.
                sign * grasp(coupling, inwards).max(0.0)
            }
        }
    }
}

/// A direction along an axis: `+x`, `-z`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Direction {
    /// Index of the axis: 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// `true` if the direction points towards larger coordinates.
    pub positive: bool,
}
