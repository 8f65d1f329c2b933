//! Registry of the measures of a run: names, units and descriptions. `[measure]`, `[expect]`, the catalogue of keys, columns and documents are made from this
//! list.

use crate::Scene;

macro_rules! registry {
    ($($measure:ident: $scope:ident, $name:literal, $unit:literal, $about:literal;)+) => {
        /// A measure: a number that summarises a run.
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
        pub enum Measure {
            $(#[doc = concat!($about, ".")] $measure,)+
        }

        impl Measure {
            /// Every measure, in the order of display.
            pub const ALL: &'static [Self] = &[$(Self::$measure,)+];

            /// Returns the name, which ends in the unit if there is one. The full name of a measure of a peer begins with the peer's name: see
            /// [`MeasureName::text`].
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$measure => $name,)+
                }
            }

            /// Returns the name as a list of names shows it: with `peers.NAME.` in front if each peer has a value.
            #[must_use]
            pub const fn pattern(self) -> &'static str {
                match self {
                    $(Self::$measure => pattern!($scope, $name),)+
                }
            }

            /// Returns the unit.
            #[must_use]
            pub const fn unit(self) -> &'static str {
                match self {
                    $(Self::$measure => $unit,)+
                }
            }

            /// Returns the description, without the final full stop.
            #[must_use]
            pub const fn about(self) -> &'static str {
                match self {
                    $(Self::$measure => $about,)+
                }
            }

            /// Returns the scope: the run as a whole, or each peer.
            #[must_use]
            pub const fn scope(self) -> Scope {
                match self {
                    $(Self::$measure => Scope::$scope,)+
                }
            }
        }
    };
}

macro_rules! pattern {
    (Run, $name:literal) => {
        $name
    };
    (Peer, $name:literal) => {
        concat!("peers.NAME.", $name)
    };
}

/// Scope of a measure.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Scope {
    /// The run as a whole has a value.
    Run,
    /// Each peer has a value.
    Peer,
}

registry! {
    DiscrepancyRms: Run, "discrepancy_rms_m", "m", "Root mean square over instants of the discrepancy, the largest distance along an axis between two copies";
    DiscrepancyP50: Run, "discrepancy_p50_m", "m", "Median over instants of the discrepancy";
    DiscrepancyP95: Run, "discrepancy_p95_m", "m", "Quantile of 95 % over instants of the discrepancy";
    DiscrepancyP99: Run, "discrepancy_p99_m", "m", "Quantile of 99 % over instants of the discrepancy";
    Travel: Run, "travel_s", "s", "First tick at which a copy is measure.travel.distance away from its beginning; no value if it never is";
    Settling: Run, "settling_s", "s", "Instant after the last one with a discrepancy above measure.band, 0 if there is none; no value if it is above at the end";
    ForcePeak: Run, "force_peak_n", "N", "Largest component of the coordination force F_T, over peers and ticks";
    ForceRms: Run, "force_rms_n", "N", "Root mean square of the components of F_T, over peers and ticks";
    ForceJump: Run, "force_jump_n", "N", "Largest change of a component of F_T from a tick to the next one of the same peer";
    FeltPeak: Run, "felt_peak_n", "N", "Largest component of the coupling force F_C, over peers and ticks";
    FeltRms: Run, "felt_rms_n", "N", "Root mean square of the components of F_C, over peers and ticks";
    FeltJump: Run, "felt_jump_n", "N", "Largest change of a component of F_C from a tick to the next one of the same peer";
    Energy: Run, "energy_j", "J", "Energy that the coordination has injected into all copies by the end: the work of its held forces less the loss in its damping";
    EnergyPeak: Run, "energy_peak_j", "J", "Largest value of that energy after any instant, at least 0";
    PeerEnergy: Peer, "energy_j", "J", "Part of that energy which was injected into the copy of this peer";
    Viscosity: Run, "viscosity_n_s_m", "N·s/m", "Real part of the impedance that the hand of the probe meets at its frequency, over the second half of the scene";
    EffectiveMass: Run, "effective_mass_kg", "kg", "Imaginary part of that impedance by the angular frequency";
    PacketRate: Run, "packets_per_s", "1/s", "Packets that all peers offer to the network per second";
    BitRate: Run, "sent_bits_per_s", "bit/s", "Bits of the datagrams in these packets per second";
    AgeMean: Run, "age_mean_s", "s", "Mean age of held samples, tick less sampling, over ticks and pairs of peers from the first arrival on";
    AgeP99: Run, "age_p99_s", "s", "Quantile of 99 % of that age";
    TaskTime: Run, "task_time_s", "s", "Time from the start of the task to its end; no value for a task that is not done";
    Throughput: Run, "throughput_bit_s", "bit/s", "Information rate of the movements to reached targets, by the spread of their ends; no value for fewer than two";
    MotionForce: Run, "motion_force_n", "N", "Mean over ticks of the task of the norm of the sum of the coupling forces of all peers";
    InternalForce: Run, "internal_force_n", "N", "Mean over ticks of the task of the part of the coupling forces that cancels, the smaller of the sums of positive and negative forces along each axis";
    TaskError: Peer, "error_rms_m", "m", "Root mean square over ticks of the task of the distance between the copy of this peer and the target";
    Overshoot: Peer, "overshoot_m", "m", "Largest distance of the copy of this peer beyond a target of the task, along the line from the target before";
    Outside: Peer, "outside_s", "s", "Time for which the copy of this peer was outside of the held target after the first entry, or outside of the lane of a path";
    Effort: Peer, "effort_n2_s", "N²·s", "Integral over the task of the squared norm of the coupling force of this peer";
    Given: Peer, "given_j", "J", "Work of the hand and device of this peer on the object over the task, without the negative work";
    Taken: Peer, "taken_j", "J", "Negative work of the hand and device of this peer on the object over the task";
    LoadShare: Peer, "load_share", "", "Mean over ticks of the task of this peer's part of the coupling forces that act in the direction of their sum";
    Submovements: Peer, "submovements", "", "Maxima of the speed of the copy of this peer over the task, each after a rise and before a fall of at least 5 mm/s";
    Sparc: Peer, "sparc", "", "Smoothness of the motion of the copy of this peer over the task, by the spectral arc length of its speed";
    Ldlj: Peer, "ldlj", "", "Smoothness of the motion of the copy of this peer over the task, by the logarithm of its dimensionless jerk";
    Lag: Peer, "lag_s", "s", "Shift in time of the target, or of the copy of the first peer, with the least root mean square distance from the copy of this peer";
    LagResidual: Peer, "lag_residual_m", "m", "Least root mean square distance, at that shift";
}

/// A measure of the run, or a measure together with a peer.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct MeasureName {
    /// The measure.
    pub measure: Measure,
    /// Index in [`Scene::peers`]; `None` for a measure of the run.
    pub peer: Option<usize>,
}

impl MeasureName {
    /// Returns every measure of a scene with this number of peers, in the order of display. Measures of a task are left out unless the scene has a task.
    #[must_use]
    pub fn all(peers: usize, has_task: bool) -> Vec<Self> {
        let mut names = Vec::new();
        for &measure in Measure::ALL.iter().filter(|measure| has_task || !measure.is_of_task()) {
            match measure.scope() {
                Scope::Run => names.push(Self { measure, peer: None }),
                Scope::Peer => names.extend((0..peers).map(|peer| Self { measure, peer: Some(peer) })),
            }
        }
        names
    }

    /// Returns the name in documents and columns: `energy_j`, `peers.left.energy_j`.
    ///
    /// # Panics
    ///
    /// If the scene has no such peer.
    #[must_use]
    pub fn text(self, scene: &Scene) -> String {
        match self.peer {
            None => self.measure.name().to_owned(),
            Some(peer) => self.measure.of_peer(&scene.peers[peer].name),
        }
    }
}

impl Measure {
    /// Returns whether the measure belongs to a task, and has no meaning in a scene without a task.
    #[must_use]
    pub const fn is_of_task(self) -> bool {
        match self {
            Self::TaskTime
            | Self::Throughput
            | Self::MotionForce
            | Self::InternalForce
            | Self::TaskError
            | Self::Overshoot
            | Self::Outside
            | Self::Effort
            | Self::Given
            | Self::Taken
            | Self::LoadShare
            | Self::Submovements
            | Self::Sparc
            | Self::Ldlj
            | Self::Lag
            | Self::LagResidual => true,
            Self::DiscrepancyRms
            | Self::DiscrepancyP50
            | Self::DiscrepancyP95
            | Self::DiscrepancyP99
            | Self::Travel
            | Self::Settling
            | Self::ForcePeak
            | Self::ForceRms
            | Self::ForceJump
            | Self::FeltPeak
            | Self::FeltRms
            | Self::FeltJump
            | Self::Energy
            | Self::EnergyPeak
            | Self::PeerEnergy
            | Self::Viscosity
            | Self::EffectiveMass
            | Self::PacketRate
            | Self::BitRate
            | Self::AgeMean
            | Self::AgeP99 => false,
        }
    }

    /// Returns the name of this measure for the peer with this name.
    #[must_use]
    pub fn of_peer(self, peer: &str) -> String {
        format!("peers.{peer}.{}", self.name())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn patterns_are_unique_and_names_end_in_the_unit() {
        let patterns: BTreeSet<&str> = Measure::ALL.iter().map(|measure| measure.pattern()).collect();
        assert_eq!(patterns.len(), Measure::ALL.len());
        for measure in Measure::ALL {
            let unit = match measure.unit() {
                "1/s" => "_per_s".to_owned(),
                "bit/s" if *measure == Measure::BitRate => "_bits_per_s".to_owned(),
                // Ratios and counts have no unit.
                "" => String::new(),
                unit => format!("_{}", unit.replace(['·', '/'], "_").replace('²', "2").to_lowercase()),
            };
            assert!(measure.name().ends_with(&unit), "{} in {}", measure.name(), measure.unit());
        }
    }
}
