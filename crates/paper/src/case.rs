//! A scene of the paper, given by the numbers that occur in the paper's claims.

use std::fmt::Write as _;
use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::{Method, Radius, analyse};

use crate::PaperError;

/// Law of coordination.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Strategy {
    /// Average-position coordination, equation (4).
    Ap,
    /// Proportional-derivative coordination, equation (1).
    Pd,
}

/// Mass of each copy of the object.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Mass {
    /// mO/N, as printed in the paper.
    Split,
    /// mO.
    Whole,
}

/// A scene of equal peers with equal links. The first `touching` peers touch the object.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Case {
    pub(crate) strategy: Strategy,
    pub(crate) peers: usize,
    pub(crate) mass: Mass,
    /// Coordination stiffness KT \[N/m\].
    pub(crate) stiffness: f64,
    /// Coordination damping BT \[N·s/m\].
    pub(crate) damping: f64,
    /// Stiffness KC of the coupling to the device \[N/m\].
    pub(crate) coupling_stiffness: f64,
    /// Damping BC of the coupling to the device \[N·s/m\].
    pub(crate) coupling_damping: f64,
    /// Delay of each link, one way \[µs\].
    pub(crate) delay_us: u32,
    /// Number of peers touching the object, at most `peers`.
    pub(crate) touching: usize,
    /// `true` if all gains are scaled with the number of peers.
    pub(crate) scaled: bool,
}

impl Strategy {
    pub(crate) const BOTH: [Self; 2] = [Self::Ap, Self::Pd];

    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Ap => "AP",
            Self::Pd => "PD",
        }
    }

    pub(crate) const fn key(self) -> &'static str {
        match self {
            Self::Ap => "average-position",
            Self::Pd => "proportional-derivative",
        }
    }
}

impl Mass {
    pub(crate) const BOTH: [Self; 2] = [Self::Split, Self::Whole];

    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Split => "mO/N per copy",
            Self::Whole => "mO per copy",
        }
    }
}

impl Case {
    /// Returns the scene of the paper's Section 4 for N peers: KT = 1000 N/m, BT = BC = 5 N·s/m, KC = 3500 N/m, Td = Tn = 8 ms, all peers touching.
    pub(crate) const fn paper(strategy: Strategy, peers: usize) -> Self {
        Self {
            strategy,
            peers,
            mass: Mass::Split,
            stiffness: 1000.0,
            damping: 5.0,
            coupling_stiffness: 3500.0,
            coupling_damping: 5.0,
            delay_us: 8000,
            touching: peers,
            scaled: false,
        }
    }

    /// Returns the same scene with another strategy.
    pub(crate) const fn with(self, strategy: Strategy) -> Self {
        Self { strategy, ..self }
    }

    /// Returns the text of the scene file.
    pub(crate) fn text(&self) -> String {
        let Self { strategy, peers, mass, stiffness, damping, coupling_stiffness, coupling_damping, delay_us, touching, scaled } = *self;
        let scaling = if scaled { "\nscaling = \"inverse-n\"" } else { "" };
        let coupling_scaling = if scaled { ", scaling = \"inverse-n\"" } else { "" };
        let split = mass == Mass::Split;
        // `:?` keeps the decimal point of a whole number, because TOML tells integers and floats apart.
        let mut text = format!(
            "[scene]\ntitle = \"{}\"\nduration = \"7s\"\ncount = {peers}\n\n[object]\nmass = 0.45\nsplit-mass = {split}\n\n[coordination]\n\
             strategy = \"{}\"\nstiffness = {stiffness:?}\ndamping = {damping:?}\nupdate = \"8ms\"{scaling}\n\n[peer]\ncontact = \"none\"\n\
             device = {{ mass = 0.1, damping = 5.0 }}\ncoupling = {{ stiffness = {coupling_stiffness:?}, damping = {coupling_damping:?}{coupling_scaling} }}\n\n[link]\n\
             delay = \"{}ms\"\n",
            self.words(),
            strategy.key(),
            f64::from(delay_us) / 1000.0
        );
        // If all peers touch, the line is removed: the default contact then holds for all peers, without entries of their own.
        if touching == peers {
            text = text.replace("contact = \"none\"\n", "");
        }
        for peer in 1..=touching {
            if touching < peers {
                let _ = write!(text, "\n[[peers]]\nname = \"peer{peer}\"\ncontact = \"grasp\"\n");
            }
        }
        text
    }

    pub(crate) fn scene(&self) -> Result<Scene, PaperError> {
        Ok(Scene::parse(&self.text(), Path::new("paper.toml"), &[])?)
    }

    /// Returns the spectral radius of the scene over a frame of 8 ms.
    pub(crate) fn radius(&self) -> Result<Radius, PaperError> {
        Ok(analyse(&self.scene()?, Method::Reduced)?.radius)
    }

    /// Describes the case for people.
    pub(crate) fn words(&self) -> String {
        let Self { strategy, peers, mass, stiffness, damping, coupling_stiffness, coupling_damping, delay_us, touching, scaled } = *self;
        let touch = if touching == peers { "all touch".to_owned() } else { format!("{touching} of {peers} touch") };
        let scaled = if scaled { ", gains scaled" } else { "" };
        format!(
            "{}, N = {peers}, KT = {stiffness} N/m, BT = {damping}, KC = {coupling_stiffness} N/m, BC = {coupling_damping} N·s/m, {} ms one way, {}, {touch}{scaled}",
            strategy.word(),
            f64::from(delay_us) / 1000.0,
            mass.words()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reference is crates/stability/tests/reference/radii.json, computed with 50 digits by another program.
    #[test]
    fn cases_have_the_radii_of_the_reference() {
        let anchor = Case::paper(Strategy::Ap, 3);
        let section_5 = Case { delay_us: 24_000, touching: 2, ..anchor };
        let pushed = Case { touching: 1, ..section_5 };
        for (case, expected) in [
            (anchor, 0.896_488_138_569_304_6),
            (section_5, 1.002_672_697_2),
            (section_5.with(Strategy::Pd), 0.978_014_835_7),
            (Case { stiffness: 2100.0, ..section_5 }, 1.014_391_773_5),
            (pushed, 1.038_068_528_9),
            (pushed.with(Strategy::Pd), 0.999_598_764_5),
            (Case { mass: Mass::Whole, delay_us: 24_000, stiffness: 100.0, ..Case::paper(Strategy::Pd, 4) }, 0.890_996_318_4),
        ] {
            let radius = case.radius().unwrap().value;
            assert!((radius - expected).abs() < 2e-10, "{}: {radius} {expected}", case.words());
        }
    }
}
