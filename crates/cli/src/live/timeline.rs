//! The keys of links that the timeline of a scene changes while it runs.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use cohaptic_control::LinkEditor;
use cohaptic_scene::LinkKeys;
use cohaptic_units::Instant;

use crate::realtime::KeyedLinks;

/// Keys that links have from an instant on: the links by their numbers.
pub(super) type Planned = VecDeque<(Instant, Vec<(usize, LinkKeys)>)>;

/// How far a session is, for onlookers: shared between two threads, of which one writes.
#[derive(Clone, Debug, Default)]
pub(super) struct Elapsed(Arc<AtomicU64>);

impl Elapsed {
    pub(super) fn set(&self, now: Instant) {
        self.0.store(now.as_nanos(), Ordering::Relaxed);
    }

    fn get(&self) -> Instant {
        Instant::from_nanos(self.0.load(Ordering::Relaxed))
    }
}

/// The links of a session, which its timeline changes too: what it sets replaces what somebody has changed before.
pub(super) struct TimedLinks {
    pub(super) links: KeyedLinks,
    pub(super) planned: Planned,
    pub(super) elapsed: Elapsed,
}

impl LinkEditor for TimedLinks {
    fn keys(&self, link: usize) -> Vec<(String, String)> {
        let now = self.elapsed.get();
        let past = self.planned.iter().take_while(|(at, _)| *at <= now).flat_map(|(_, links)| links);
        match past.filter(|(changed, _)| *changed == link).last() {
            Some((_, keys)) => keys.iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect(),
            None => self.links.keys(link),
        }
    }

    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String> {
        let now = self.elapsed.get();
        let past = self.planned.partition_point(|(at, _)| *at <= now);
        for (link, keys) in self.planned.drain(..past).flat_map(|(_, changed)| changed) {
            self.links.keys[link] = keys;
        }
        self.links.change(links, keys)
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn keys_follow_the_timeline_and_changes_are_laid_over_what_it_says() {
        let delay = |text: &str| LinkKeys::default().with("delay", text);
        let (changes, made) = channel();
        let elapsed = Elapsed::default();
        let at = |millis: u64| Instant::from_nanos(millis * 1_000_000);
        let planned = [(at(100), vec![(0, delay("2ms"))]), (at(200), vec![(0, delay("3ms"))])].into();
        let links = KeyedLinks { keys: vec![delay("1ms"), delay("1ms")], folder: PathBuf::new(), changes };
        let mut links = TimedLinks { links, planned, elapsed: elapsed.clone() };
        let shown = |links: &TimedLinks, link| links.keys(link)[0].1.clone();
        assert_eq!(shown(&links, 0), "1ms");
        elapsed.set(at(150));
        assert_eq!((shown(&links, 0), shown(&links, 1)), ("2ms".to_owned(), "1ms".to_owned()));
        links.change(&[0], &[("loss".to_owned(), "0.5".to_owned())]).unwrap();
        assert_eq!(made.try_recv().unwrap().keys.to_string(), "{ delay = \"2ms\", loss = 0.5 }");
        elapsed.set(at(250));
        assert_eq!(links.keys(0), [("delay".to_owned(), "3ms".to_owned())]);
    }
}
