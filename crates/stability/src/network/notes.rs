//! Sentences about the replaced parts of links, for users.

use std::collections::BTreeMap;

use cohaptic_scene::Scene;

use super::nominal::Nominal;

/// Returns a line for each replaced part, with the links that have the part.
pub(crate) fn notes(scene: &Scene, links: &[Nominal], uplinks: &[Option<Nominal>], downlinks: &[Option<Nominal>]) -> Vec<String> {
    let mut firsts: Vec<Option<(usize, usize)>> = vec![None; links.len()];
    for (pair, config) in scene.links.exceptions() {
        firsts[config].get_or_insert(pair);
    }
    let mut notes = Notes::default();
    for ((nominal, first), (_, count)) in links.iter().zip(&firsts).zip(scene.links.used()) {
        for words in &nominal.replaced {
            let place = first.map(|(from, to)| format!("the link from {} to {}", scene.peers[from].name, scene.peers[to].name));
            notes.add(words, place.unwrap_or_else(|| if count == 1 { "one link".to_owned() } else { "most links".to_owned() }), count);
        }
    }
    for (direction, lines) in [("uplink", uplinks), ("downlink", downlinks)] {
        for (peer, nominal) in scene.peers.iter().zip(lines) {
            for words in nominal.iter().flat_map(|nominal| &nominal.replaced) {
                notes.add(words, format!("the {direction} of {}", peer.name), 1);
            }
        }
    }
    notes.lines(scene.links.is_uniform())
}

/// Lines to be printed: equal words become one line, which counts the links.
#[derive(Default)]
struct Notes<'a> {
    /// Words in the order in which they were added.
    order: Vec<&'a str>,
    /// The first place of each line of words, and the number of links.
    places: BTreeMap<&'a str, (String, u64)>,
}

impl<'a> Notes<'a> {
    fn add(&mut self, words: &'a str, place: String, count: u64) {
        let known = self.places.entry(words).or_insert_with(|| {
            self.order.push(words);
            (place, 0)
        });
        known.1 += count;
    }

    fn lines(self, uniform: bool) -> Vec<String> {
        let line = |words: &str| {
            let (place, count) = &self.places[words];
            match place.as_str() {
                "most links" if uniform => format!("every link: {words}"),
                "most links" | "one link" => format!("{count} links: {words}"),
                place if *count == 1 => format!("{place}: {words}"),
                place => format!("{count} links, such as {place}: {words}"),
            }
        };
        self.order.iter().map(|words| line(words)).collect()
    }
}
