//! Which key lies along which axis, and which has a panel for each of its values.

use cohaptic_campaign::{CampaignPlan, Variation};
use cohaptic_picture::{Axis, cell_edges};

use crate::axis_of_key;

/// The most panels beside each other.
const MOST_PANELS: usize = 12;
/// The most combinations that a picture shows.
const MOST_CELLS: usize = 100_000;
/// The most names beneath each other.
const MOST_NAMES: usize = 24;

/// The keys of a campaign, arranged in a picture.
pub(super) struct Arranged {
    pub(super) keys: Keys,
    /// The keys with a panel for each of their values: places among the keys of the plan, and how many values each has.
    panels: Vec<(usize, usize)>,
    /// How many keys are varied.
    of: usize,
}

/// The keys along the axes.
pub(super) enum Keys {
    /// One of names.
    Names(Along),
    /// One of numbers.
    Line(Along),
    /// Two of numbers: along x and y.
    Grid(Box<(Along, Along)>),
}

/// A key along an axis.
pub(crate) struct Along {
    /// Its place among the keys of the plan.
    pub(crate) key: usize,
    /// Its values, rising; of names their numbers from below.
    pub(crate) values: Vec<f64>,
    /// The place of each value among those of the key.
    pub(crate) places: Vec<usize>,
    logarithmic: bool,
    /// With the range of names; numbers have none yet.
    axis: Axis,
    is_names: bool,
}

impl Arranged {
    /// `None` if no key has several values; an error in words if there would be too much to see.
    pub(super) fn new(plan: &CampaignPlan) -> Result<Option<Self>, String> {
        let varied: Vec<(usize, &Variation)> = plan.variations().iter().enumerate().filter(|(_, vary)| vary.count() > 1).collect();
        let numbers: Vec<(usize, Along)> =
            varied.iter().filter_map(|(key, vary)| Along::of_numbers(*key, vary).map(|along| (*key, along))).take(2).collect();
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
        let cells = arranged.keys.along().iter().map(|along| along.values.len()).product::<usize>() * panels;
        if cells > MOST_CELLS {
            return Err(format!("{cells} combinations are more than the {MOST_CELLS} of the largest picture"));
        }
        Ok(Some(arranged))
    }

    /// How many panels there are beside each other.
    pub(super) fn facets(&self) -> usize {
        self.panels.iter().map(|(_, count)| count).product()
    }

    /// What a panel shows, in words, behind what all of them show; empty if there is one alone and nothing to be said.
    pub(super) fn title(&self, plan: &CampaignPlan, facet: usize, what: &str) -> String {
        let places = self.places(facet, &[]);
        let texts: Vec<String> = self.panels.iter().map(|(key, _)| plan.variations()[*key].label(places[*key])).collect();
        match (texts.is_empty(), what.is_empty()) {
            (true, _) => String::new(),
            (false, true) => texts.join(", "),
            (false, false) => format!("{}: {what}", texts.join(", ")),
        }
    }

    /// The combination at these places along the axes, in a panel.
    pub(super) fn combination(&self, plan: &CampaignPlan, facet: usize, at: &[usize]) -> usize {
        usize::try_from(plan.combination(&self.places(facet, at))).unwrap_or(usize::MAX)
    }

    /// Which value each key of the plan has.
    fn places(&self, facet: usize, at: &[usize]) -> Vec<usize> {
        let mut places = vec![0; self.of];
        let mut left = facet;
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
    /// `None` if the values are not all different numbers.
    pub(crate) fn of_numbers(key: usize, vary: &Variation) -> Option<Self> {
        let numbers: Vec<f64> = (0..vary.count()).map(|place| vary.number(place).filter(|number| number.is_finite())).collect::<Option<_>>()?;
        let mut places: Vec<usize> = (0..numbers.len()).collect();
        places.sort_by(|one, other| numbers[*one].total_cmp(&numbers[*other]));
        let values: Vec<f64> = places.iter().map(|place| numbers[*place]).collect();
        if values.windows(2).any(|pair| pair[0] >= pair[1]) {
            return None;
        }
        let axis = axis_of_key(vary.key(), vary.unit());
        let logarithmic = vary.is_logarithmic();
        let axis = if logarithmic { axis.logarithmic() } else { axis };
        Some(Self { key, values, places, logarithmic, axis, is_names: false })
    }

    /// The first value is the uppermost, as in the command.
    fn of_names(key: usize, vary: &Variation) -> Result<Self, String> {
        let count = vary.count();
        if count > MOST_NAMES {
            return Err(format!(
                "{} has {count} values that are no different numbers, and at most {MOST_NAMES} are drawn beneath each other",
                vary.key()
            ));
        }
        let places: Vec<usize> = (0..count).rev().collect();
        let values = (0..count).map(|place| f64::from(u32::try_from(place).unwrap_or(u32::MAX))).collect();
        // A long key has no room beside a few rows: a note says which it is.
        let axis = Axis::new("").categories(places.iter().map(|place| vary.value_text(*place)));
        Ok(Self { key, values, places, logarithmic: false, axis, is_names: true })
    }

    /// The axis from the first to the last value, of names with half a step around them.
    pub(crate) fn axis(&self) -> Axis {
        match (self.values.first(), self.values.last()) {
            (Some(first), Some(last)) if !self.is_names => self.axis.clone().range(*first, *last),
            _ => self.axis.clone(),
        }
    }

    /// Where the cells around the values begin and end.
    pub(crate) fn edges(&self) -> Vec<f64> {
        cell_edges(&self.values, self.logarithmic)
    }
}
