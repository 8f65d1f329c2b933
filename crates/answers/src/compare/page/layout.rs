//! Arranges the keys of a comparison: a key along the pictures, and keys with a panel per value.

use cohaptic_campaign::Variation;

use crate::campaign::Along;

/// Greatest number of panels of a picture.
const MOST_PANELS: usize = 16;
/// Greatest number of panels side by side.
const MOST_COLUMNS: usize = 4;

/// Returns the number of panels side by side.
pub(super) const fn columns_of(panels: usize) -> usize {
    match panels {
        1 => 1,
        2 | 4 => 2,
        _ => 3,
    }
}

/// The varied keys other than the strategy, arranged in pictures.
pub(super) struct Layout {
    /// The first key of numbers, along x; `None` without a key of numbers.
    pub(super) x: Option<Along>,
    /// Further keys with several values: index of the key, and number of values.
    facets: Vec<(usize, usize)>,
    /// Number of values of each key.
    counts: Vec<usize>,
}

impl Layout {
    pub(super) fn of(keys: &[Variation]) -> Self {
        let counts: Vec<usize> = keys.iter().map(Variation::count).collect();
        // A key with one value needs neither an axis nor panels.
        let x = keys.iter().enumerate().filter(|(_, key)| key.count() > 1).find_map(|(place, key)| Along::of_numbers(place, key));
        let along = x.as_ref().map(|along| along.key);
        let facets = counts.iter().copied().enumerate().filter(|(place, count)| *count > 1 && Some(*place) != along).collect();
        Self { x, facets, counts }
    }

    /// Returns the number of panels of a picture.
    pub(super) fn panels(&self) -> usize {
        self.facets.iter().map(|(_, count)| count).product()
    }

    /// Returns the number of panels side by side. If several keys have panels, a row has the values of the last key, so that panels which differ in nothing
    /// else stand beside each other.
    pub(super) fn columns(&self) -> usize {
        match self.facets.as_slice() {
            [_, .., (_, last)] if *last <= MOST_COLUMNS => *last,
            _ => columns_of(self.panels()),
        }
    }

    /// Returns the reason, in words, why pictures are not drawn; `None` for drawn pictures.
    pub(super) fn undrawn(&self, keys: &[Variation]) -> Option<String> {
        let names: Vec<&str> = self.facets.iter().map(|(key, _)| keys[*key].key()).collect();
        (self.panels() > MOST_PANELS).then(|| {
            format!(
                "No pictures: a panel for each value of {} would be {} panels, and at most {MOST_PANELS} are drawn.",
                names.join(" and "),
                self.panels()
            )
        })
    }

    /// Returns the title of a panel, the values as `KEY=VALUE`; empty for a single panel.
    pub(super) fn title(&self, keys: &[Variation], panel: usize) -> String {
        let places = self.places(panel, None);
        self.facets.iter().map(|(key, _)| keys[*key].label(places[*key])).collect::<Vec<String>>().join(", ")
    }

    /// Returns the combination of the keys in a panel, at index `at` along x.
    pub(super) fn other(&self, panel: usize, at: Option<usize>) -> usize {
        // A combination is a number in a mixed base, with the last key as the lowest digit.
        self.places(panel, at).into_iter().zip(&self.counts).fold(0, |other, (place, count)| other * count + place)
    }

    /// Returns the key along y of a map: the only key with panels, if the values of the key are numbers.
    pub(super) fn y(&self, keys: &[Variation]) -> Option<Along> {
        match (&self.x, self.facets.as_slice()) {
            (Some(_), [(key, _)]) => Along::of_numbers(*key, &keys[*key]),
            _ => None,
        }
    }

    fn places(&self, panel: usize, at: Option<usize>) -> Vec<usize> {
        let mut places = vec![0; self.counts.len()];
        // The number of the panel is a number in a mixed base too, over the keys with panels.
        let mut left = panel;
        for (key, count) in self.facets.iter().rev() {
            places[*key] = left % count;
            left /= count;
        }
        if let (Some(x), Some(at)) = (&self.x, at) {
            places[x.key] = x.places[at];
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(texts: &[&str]) -> Vec<Variation> {
        texts.iter().map(|text| Variation::parse(text).unwrap()).collect()
    }

    #[test]
    fn the_first_key_of_numbers_is_along_the_pictures_and_the_others_have_panels() {
        let keys = keys(&["peer.contact=none,grasp", "link.delay=24ms,8ms,16ms", "link.loss=0,0.5"]);
        let layout = Layout::of(&keys);
        assert_eq!((layout.x.as_ref().map(|along| along.key), layout.panels(), layout.undrawn(&keys)), (Some(1), 4, None));
        assert_eq!(layout.title(&keys, 1), "peer.contact=none, link.loss=0.5");
        // Values rise along x: 8 ms is the second value in the command. With grasp and 0.5 the combination is 6 + 2 + 1.
        assert_eq!(layout.other(3, Some(0)), 9);
        assert!(layout.y(&keys).is_none());
    }

    #[test]
    fn a_row_of_panels_has_the_values_of_the_last_key() {
        for (texts, columns) in [
            (&["a=1,2", "b=x,y", "c=1,2,3,4"][..], 4),
            (&["a=1,2", "b=x,y", "c=1,2,3,4,5"], 3),
            (&["a=1,2", "c=1,2,3,4,5"], 3),
            (&["a=1,2", "b=x,y"], 2),
            (&["a=1,2"], 1),
        ] {
            assert_eq!(Layout::of(&keys(texts)).columns(), columns, "{texts:?}");
        }
    }

    #[test]
    fn every_combination_has_one_place() {
        for texts in [&["a=1,2,3", "b=1,2"][..], &["b=x,y", "a=3,1,2"], &["a=x,y"], &[]] {
            let keys = keys(texts);
            let layout = Layout::of(&keys);
            let along: Vec<Option<usize>> = layout.x.as_ref().map_or_else(|| vec![None], |x| (0..x.values.len()).map(Some).collect());
            let mut found: Vec<usize> =
                (0..layout.panels()).flat_map(|panel| along.iter().map(move |at| (panel, *at))).map(|(panel, at)| layout.other(panel, at)).collect();
            found.sort_unstable();
            assert_eq!(found, (0..keys.iter().map(Variation::count).product()).collect::<Vec<usize>>());
        }
    }

    #[test]
    fn too_many_panels_are_not_drawn() {
        let keys = keys(&["a=1,2", "b=1..17/17"]);
        assert!(Layout::of(&keys).undrawn(&keys).is_some_and(|why| why.contains("17 panels")));
    }
}
