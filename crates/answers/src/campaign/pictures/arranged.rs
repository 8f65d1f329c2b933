//! Arranges the keys of a campaign in a picture: keys along the axes, and keys with one panel per value.

use cohaptic_campaign::{CampaignPlan, Variation};
use cohaptic_picture::{Axis, cell_edges};

use crate::axis_of_key;

/// Greatest number of panels of a picture.
const MOST_PANELS: usize = 12;
/// Greatest number of combinations in a picture.
const MOST_CELLS: usize = 100_000;
/// Greatest number of named rows of a panel.
const MOST_NAMES: usize = 24;

/// The keys of a campaign, arranged in a picture.
pub(super) struct Arranged {
    pub(super) keys: Keys,
    /// Keys with one panel per value: index of the key in the plan, and number of values.
    panels: Vec<(usize, usize)>,
    /// Number of keys of the plan.
    of: usize,
}

/// The keys along the axes.
pub(super) enum Keys {
    /// A key of names, along y.
    Names(Along),
    /// A key of numbers, along x.
    Line(Along),
    /// Two keys of numbers, along x and y.
    Grid(Box<(Along, Along)>),
}

/// A key of the plan whose values lie along an axis of the picture.
pub(crate) struct Along {
    /// Index of the key in the plan.
    pub(crate) key: usize,
    /// Values in rising order; for a key of names, the numbers of the rows from below.
    pub(crate) values: Vec<f64>,
    /// For each entry of `values`, the index of the value in the key.
    pub(crate) places: Vec<usize>,
    logarithmic: bool,
    /// Axis of the key; only a key of names has a range here.
    axis: Axis,
    is_names: bool,
}

impl Arranged {
    /// Arranges the keys of a plan. `Ok(None)`: no key has several values. `Err`: the reason, in words, why the picture would be too large.
    pub(super) fn new(plan: &CampaignPlan) -> Result<Option<Self>, String> {
        let varied: Vec<(usize, &Variation)> = plan.variations().iter().enumerate().filter(|(_, vary)| vary.count() > 1).collect();
        let numbers: Vec<(usize, Along)> =
            varied.iter().filter_map(|(key, vary)| Along::of_numbers(*key, vary).map(|along| (*key, along))).take(2).collect();
        // Two keys of numbers at most lie along the axes. Every further key gets panels.
        let mut numbers = numbers.into_iter();
        let keys = match (numbers.next(), numbers.next(), varied.first()) {
            (Some((_, x)), Some((_, y)), _) => Keys::Grid(Box::new((x, y))),
            (Some((_, x)), None, _) => Keys::Line(x),
            (None, _, Some((key, vary))) => Keys::Names(Along::of_names(*key, vary)?),
            (None, _, None) => return Ok(None),
        };
        let along = keys.along();
        let panels = varied.iter().filter(|(key, _)| along.iter().all(|along| along.key != *key)).map(|(key, vary)| (*key, vary.count()));
        let arranged = Self { panels: panels.collect(), of: plan.variations().len(), keys };
        let panels = arranged.panels.iter().try_fold(1_usize, |all, (_, count)| all.checked_mul(*count)).unwrap_or(usize::MAX);
        if panels > MOST_PANELS {
            let keys: Vec<&str> = arranged.panels.iter().map(|(key, _)| plan.variations()[*key].key()).collect();
            return Err(format!("a panel for each value of {} would be {panels} panels, and at most {MOST_PANELS} are drawn", keys.join(" and ")));
        }
        // The number of panels is small here, so the product cannot overflow: each key has at most a million values.
        let cells = arranged.keys.along().iter().map(|along| along.values.len()).product::<usize>() * panels;
        if cells > MOST_CELLS {
            return Err(format!("{cells} combinations are more than the {MOST_CELLS} of the largest picture"));
        }
        Ok(Some(arranged))
    }

    /// Returns the number of panels.
    pub(super) fn facets(&self) -> usize {
        self.panels.iter().map(|(_, count)| count).product()
    }

    /// Returns the title of a panel: the values of the panel's keys, followed by `what`, the content of the panel. Empty for a single panel.
    pub(super) fn title(&self, plan: &CampaignPlan, facet: usize, what: &str) -> String {
        let places = self.places(facet, &[]);
        let texts: Vec<String> = self.panels.iter().map(|(key, _)| plan.variations()[*key].label(places[*key])).collect();
        match (texts.is_empty(), what.is_empty()) {
            (true, _) => String::new(),
            (false, true) => texts.join(", "),
            (false, false) => format!("{}: {what}", texts.join(", ")),
        }
    }

    /// Returns the combination at these indices along the axes, in panel `facet`.
    pub(super) fn combination(&self, plan: &CampaignPlan, facet: usize, at: &[usize]) -> usize {
        usize::try_from(plan.combination(&self.places(facet, at))).unwrap_or(usize::MAX)
    }

    /// Returns the index of the value of each key of the plan, in panel `facet` and at the indices `at` along the axes.
    fn places(&self, facet: usize, at: &[usize]) -> Vec<usize> {
        let mut places = vec![0; self.of];
        let mut left = facet;
        // The panel's number is a number in a mixed base, with the last key as the lowest digit.
        for (key, count) in self.panels.iter().rev() {
            places[*key] = left % count;
            left /= count;
        }
        for (along, at) in self.keys.along().into_iter().zip(at) {
            places[along.key] = along.places[*at];
        }
        places
    }
}

impl Keys {
    fn along(&self) -> Vec<&Along> {
        match self {
            Self::Names(along) | Self::Line(along) => vec![along],
            Self::Grid(both) => vec![&both.0, &both.1],
        }
    }
}

impl Along {
    /// Makes an axis of a key of numbers. `None` if the values are not all different finite numbers.
    pub(crate) fn of_numbers(key: usize, vary: &Variation) -> Option<Self> {
        let numbers: Vec<f64> = (0..vary.count()).map(|place| vary.number(place).filter(|number| number.is_finite())).collect::<Option<_>>()?;
        let mut places: Vec<usize> = (0..numbers.len()).collect();
        places.sort_by(|one, other| numbers[*one].total_cmp(&numbers[*other]));
        let values: Vec<f64> = places.iter().map(|place| numbers[*place]).collect();
        // Equal numbers, such as 1 and 1.0, would lie at the same place of the axis.
        if values.windows(2).any(|pair| pair[0] >= pair[1]) {
            return None;
        }
        let axis = axis_of_key(vary.key(), vary.unit());
        let logarithmic = vary.is_logarithmic();
        let axis = if logarithmic { axis.logarithmic() } else { axis };
        Some(Self { key, values, places, logarithmic, axis, is_names: false })
    }

    /// Makes an axis of a key of names. The first value is the uppermost row, as in the command.
    fn of_names(key: usize, vary: &Variation) -> Result<Self, String> {
        let count = vary.count();
        if count > MOST_NAMES {
            return Err(format!(
                "{} has {count} values that are no different numbers, and at most {MOST_NAMES} are drawn beneath each other",
                vary.key()
            ));
        }
        // Row 0 is the lowest, so the values are listed in reverse.
        let places: Vec<usize> = (0..count).rev().collect();
        let values = (0..count).map(|place| f64::from(u32::try_from(place).unwrap_or(u32::MAX))).collect();
        // A long key has no room beside a few rows. A note below the picture names the key.
        let axis = Axis::new("").categories(places.iter().map(|place| vary.value_text(*place)));
        Ok(Self { key, values, places, logarithmic: false, axis, is_names: true })
    }

    /// Returns the axis from the first to the last value; for names, with half a row beyond the ends.
    pub(crate) fn axis(&self) -> Axis {
        match (self.values.first(), self.values.last()) {
            (Some(first), Some(last)) if !self.is_names => self.axis.clone().range(*first, *last),
            _ => self.axis.clone(),
        }
    }

    /// Returns the edges of the cells around the values, one more than values.
    pub(crate) fn edges(&self) -> Vec<f64> {
        cell_edges(&self.values, self.logarithmic)
    }
}
