//! Stability regions over KT × KC as in the paper's Figures 3 and 4, for every reading of the paper.
//!
//! According to the paper each copy has the mass mO/N and Td is a delay; according to its Section 5 the delay is that of a round trip. So each region is
//! computed for both masses, and for 8 ms and 4 ms one way. Cells are analysed at their centres, so the share of stable cells is the midpoint rule for the
//! area.

use std::path::Path;

use cohaptic_stability::{Family, Grid, KeyRange, Map};

use crate::Watch;
use crate::case::{Case, Mass, Strategy};
use crate::{Options, PaperError};

/// Numbers of peers in the figures.
pub(crate) const PEERS: [usize; 5] = [2, 3, 4, 5, 8];
/// Upper end of KT and KC in the figures, from 0 \[N/m\].
pub(crate) const HIGHEST: f64 = 6000.0;

/// Parameters common to the regions of a panel.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Setting {
    /// Damping BT = BC \[N·s/m\].
    pub(crate) damping: f64,
    pub(crate) mass: Mass,
    /// Delay one way \[µs\].
    pub(crate) delay_us: u32,
}

/// Stability region of a strategy and a number of peers.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Region {
    pub(crate) setting: Setting,
    pub(crate) strategy: Strategy,
    pub(crate) peers: usize,
    pub(crate) map: Map,
}

/// All regions of the figures.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Atlas {
    pub(crate) regions: Vec<Region>,
}

impl Setting {
    /// Returns all settings in the order of the figures.
    pub(crate) fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for damping in [0.0, 5.0] {
            for mass in Mass::BOTH {
                all.extend([8000, 4000].map(|delay_us| Self { damping, mass, delay_us }));
            }
        }
        all
    }

    pub(crate) fn words(&self) -> String {
        format!("BT = BC = {} N·s/m, {}, {} ms one way", self.damping, self.mass.words(), self.delay_us / 1000)
    }

    /// Returns the scene of a strategy and a number of peers, with the paper's gains.
    pub(crate) fn case(&self, strategy: Strategy, peers: usize) -> Case {
        let Self { damping, mass, delay_us } = *self;
        // The figures have BT = BC.
        Case { damping, coupling_damping: damping, mass, delay_us, ..Case::paper(strategy, peers) }
    }
}

impl Region {
    /// Returns the stable share of the square, from 0 to 1.
    pub(crate) fn area(&self) -> f64 {
        share(self.cells().filter(|stable| *stable).count(), self.cells().count())
    }

    fn cells(&self) -> impl Iterator<Item = bool> + '_ {
        self.map.radius.iter().flatten().map(|radius| *radius < 1.0)
    }
}

/// Returns the ratio of two counts; 0 for a `whole` of 0.
pub(crate) fn share(part: usize, whole: usize) -> f64 {
    let number = |count: usize| f64::from(u32::try_from(count).unwrap_or(u32::MAX));
    number(part) / number(whole.max(1))
}

impl Atlas {
    /// Returns setting, strategy and number of peers of all regions, in the order of the computation.
    fn wanted() -> Vec<(Setting, Strategy, usize)> {
        let strategies =
            |setting| Strategy::BOTH.into_iter().flat_map(move |strategy| PEERS.into_iter().map(move |peers| (setting, strategy, peers)));
        Setting::all().into_iter().flat_map(strategies).collect()
    }

    /// Returns the number of regions.
    pub(crate) fn size(_options: Options) -> usize {
        Self::wanted().len()
    }

    /// Computes all regions; counts a step of `watch` per region.
    pub(crate) fn fill(options: Options, watch: &dyn Watch) -> Result<Self, PaperError> {
        let cells: u32 = if options.quick { 30 } else { 150 };
        // Half of a cell: the grid points lie at the centres of the cells.
        let half = HIGHEST / (2.0 * f64::from(cells));
        let range = |key: &str| KeyRange { key: key.to_owned(), low: half, high: HIGHEST - half, unit: String::new() };
        let side = usize::try_from(cells).unwrap_or(1);
        let mut regions: Vec<Region> = Vec::new();
        for (setting, strategy, peers) in Self::wanted() {
            let case = setting.case(strategy, peers);
            let keys = vec![range("coordination.stiffness"), range("peer.coupling.stiffness")];
            let family = Family::new(&case.text(), Path::new("paper.toml"), &[], keys)?;
            let map = Map::fill(&family, Grid::new(side, side)?, |_| (), || watch.stops())?;
            // The map stays incomplete only if the watcher ended the work.
            if !map.is_complete() {
                return Err(PaperError::Stopped);
            }
            watch.one_more();
            regions.push(Region { setting, strategy, peers, map });
        }
        Ok(Self { regions })
    }

    /// Returns the region of a strategy and a number of peers.
    pub(crate) fn region(&self, setting: Setting, strategy: Strategy, peers: usize) -> Option<&Region> {
        self.regions.iter().find(|region| region.setting == setting && region.strategy == strategy && region.peers == peers)
    }

    /// Returns the stable shares, indexed like [`PEERS`].
    pub(crate) fn areas(&self, setting: Setting, strategy: Strategy) -> Vec<f64> {
        PEERS.iter().filter_map(|peers| self.region(setting, strategy, *peers)).map(Region::area).collect()
    }

    /// Returns the share of the square that is stable with PD and unstable with AP.
    pub(crate) fn only_pd(&self, setting: Setting, peers: usize) -> f64 {
        match (self.region(setting, Strategy::Ap, peers), self.region(setting, Strategy::Pd, peers)) {
            // Both maps have the same grid, so equal positions are equal gains.
            (Some(ap), Some(pd)) => share(ap.cells().zip(pd.cells()).filter(|(ap, pd)| *pd && !ap).count(), ap.cells().count()),
            _ => 0.0,
        }
    }
}
