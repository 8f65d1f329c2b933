//! The pictures of a campaign over its varied keys: quantiles of the discrepancy, shares of diverged runs, and verdicts.

mod arranged;
mod panels;
mod scale;
mod verdicts;

use cohaptic_campaign::{CampaignPlan, MOST_COMBINATIONS_OF_QUANTILES, MOST_RUNS_OF_QUANTILES, Quantiles, Report};
use cohaptic_picture::{Panel, Picture, Size};

use super::Finished;
use crate::LAW;
pub(crate) use arranged::Along;
use arranged::{Arranged, Keys};
use scale::Scale;

/// Pictures and notes on missing pictures.
#[derive(Clone, Debug, Default)]
pub struct Drawn {
    /// Pictures, each with the name of its file.
    pub pictures: Vec<(&'static str, Picture)>,
    /// Reasons for missing pictures, in words.
    pub notes: Vec<String>,
}

/// Content shared by all pictures of a campaign.
struct Sheet<'a> {
    title: &'a str,
    plan: &'a CampaignPlan,
    report: &'a Report,
    arranged: Arranged,
    size: Size,
}

/// Draws `discrepancy.svg`, and `verdicts.svg` for a campaign with verdicts. Draws nothing if no key has several values.
#[must_use]
pub fn pictures(finished: &Finished, size: Size) -> Drawn {
    let Finished { title, plan, report, .. } = finished;
    let arranged = match Arranged::new(plan) {
        Ok(Some(arranged)) => arranged,
        Ok(None) => return Drawn::default(),
        Err(why) => return Drawn { pictures: Vec::new(), notes: vec![format!("no picture is drawn: {why}")] },
    };
    let sheet = Sheet { title, plan, report, arranged, size };
    let mut drawn = Drawn::default();
    // The report leaves the quantiles out beyond a limit of memory.
    if report.quantiles.is_empty() {
        drawn.notes.push(format!(
            "no picture of the discrepancy is drawn: its quantiles would take too much memory; they are computed of at most {MOST_RUNS_OF_QUANTILES} runs of each \
             of {MOST_COMBINATIONS_OF_QUANTILES} combinations"
        ));
    } else {
        drawn.pictures.push(("discrepancy.svg", sheet.discrepancy()));
    }
    if !report.judgements.is_empty() {
        drawn.pictures.push(("verdicts.svg", verdicts::picture(&sheet)));
    }
    drawn
}

impl Sheet<'_> {
    /// Draws the quantiles of the discrepancy, and below these the shares of diverged runs if any run diverged.
    fn discrepancy(&self) -> Picture {
        let (each, diverged) = (self.plan.runs_of_each(), self.report.diverged());
        let scale = Scale::of(&self.report.quantiles);
        let mut picture = self.picture();
        if each > 1 {
            let which = if diverged > 0 { " that did not diverge" } else { "" };
            picture = picture.note(format!("Quantiles of the runs{which}, of which each combination has {each}."));
        }
        let panels = |title: &str, panel: &dyn Fn(usize) -> Panel| -> Vec<Panel> {
            let titled = |facet: usize| panel(facet).titled(self.arranged.title(self.plan, facet, title));
            (0..self.arranged.facets()).map(titled).collect()
        };
        let shares = if diverged > 0 { panels("diverged", &|facet| self.shares(facet)) } else { Vec::new() };
        picture.panels(panels("", &|facet| self.quantiles(facet, &scale))).panels(shares)
    }

    /// Returns an empty picture with a layout suited to the panels.
    fn picture(&self) -> Picture {
        let is_grid = matches!(self.arranged.keys, Keys::Grid(..));
        let columns = match self.arranged.facets() {
            1 => 1,
            // Heat maps have colour bars, which need room beside each panel.
            _ if is_grid && self.size.is_narrow() => 1,
            2..=4 => 2,
            _ if is_grid => 2,
            _ => 3,
        };
        let picture = Picture::new(self.title).size(self.size).columns(columns);
        match &self.arranged.keys {
            Keys::Names(along) => {
                // The height grows with the number of rows, so that a few rows stay close and many rows have room for their names.
                let aspect = 0.06 * f64::from(u32::try_from((1 + along.values.len()) * columns).unwrap_or(u32::MAX));
                picture.aspect(aspect).note(format!("The rows are the values of {}.", self.plan.variations()[along.key].key()))
            }
            Keys::Line(_) | Keys::Grid(..) if columns == 1 => picture.aspect(0.45),
            Keys::Line(_) | Keys::Grid(..) => picture.aspect(0.7),
        }
    }

    fn quantiles(&self, facet: usize, scale: &Scale) -> Panel {
        match &self.arranged.keys {
            Keys::Names(along) => panels::quantiles_by_name(self, along, facet, scale),
            Keys::Line(along) => panels::quantiles_along(self, along, facet, scale),
            Keys::Grid(both) => panels::medians_of_cells(self, (&both.0, &both.1), facet, scale),
        }
    }

    /// Returns the panel with the shares of diverged runs. `facet`: index of the panel.
    fn shares(&self, facet: usize) -> Panel {
        match &self.arranged.keys {
            Keys::Names(along) => panels::shares_by_name(self, along, facet),
            Keys::Line(along) => panels::shares_along(self, along, facet),
            Keys::Grid(both) => panels::shares_of_cells(self, (&both.0, &both.1), facet),
        }
    }

    /// Returns the name of the coordination law of all combinations. `None` if the law is a varied key, because the titles of the panels name it then.
    fn law(&self) -> Option<&'static str> {
        if self.plan.variations().iter().any(|vary| vary.key() == LAW) {
            return None;
        }
        // The scene of a combination that was left out cannot be read.
        let first = (0..self.plan.combinations()).find(|combination| !self.report.refused.contains_key(combination))?;
        self.plan.scene(first).ok().map(|scene| scene.coordination.strategy.name())
    }

    /// Returns the combination at these indices along the axes, in panel `facet`.
    fn combination(&self, facet: usize, at: &[usize]) -> usize {
        self.arranged.combination(self.plan, facet, at)
    }

    fn quantiles_of(&self, combination: usize) -> Option<Quantiles> {
        self.report.quantiles.get(combination).copied().flatten()
    }

    /// Returns the share of diverged runs of a combination, from 0 to 1; NaN for a combination without a report.
    fn share(&self, combination: usize) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "fewer runs than 2^52")]
        self.report.combinations.get(combination).map_or(f64::NAN, |combination| combination.diverged as f64 / combination.runs.max(1) as f64)
    }
}

/// Name of the axis of shares.
const SHARE: &str = "Share of runs that diverged";
