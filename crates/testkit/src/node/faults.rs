//! What breaks while nodes run, and is mended.

use std::any::Any;
use std::fmt;

use super::run::is_another;
use super::{Node, NodeRun};
use crate::bed::place;
use crate::core::network_node;
use crate::link::ToLink;
use crate::trace::Happening;

impl NodeRun {
    /// Cuts the way from one node to another: what is sent from now on is lost, and what would arrive. The way back is as before.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn cut(&mut self, from: &str, to: &str) {
        self.set_cut(from, to, true);
    }

    /// Mends the way from one node to another.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn mend(&mut self, from: &str, to: &str) {
        self.set_cut(from, to, false);
    }

    /// Cuts all ways, in both directions, between the nodes of one group and those of another.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn partition(&mut self, one: &[&str], other: &[&str]) {
        for (from, to) in one.iter().flat_map(|from| other.iter().map(move |to| (from, to))) {
            self.cut(from, to);
            self.cut(to, from);
        }
    }

    /// Mends all ways.
    pub fn mend_all(&mut self) {
        let names = self.names.clone();
        for (from, to) in names.iter().flat_map(|from| names.iter().map(move |to| (from, to))) {
            self.mend(from, to);
        }
    }

    /// The link from one node to another is another one from now on. What is in it follows the rules of [`cohaptic_wan::Link::set_model`].
    ///
    /// # Panics
    ///
    /// If there is no such node, both are the same, or the words are none.
    pub fn set_link(&mut self, from: &str, to: &str, link: impl ToLink) {
        let (from_place, to_place) = (place(&self.names, from), place(&self.names, to));
        assert!(from_place != to_place, "node `{from}` has no link to itself");
        self.ask_touched();
        let changed = self.network.set_link(self.now, network_node(from_place), network_node(to_place), link.to_link());
        debug_assert_eq!(changed, Ok(()), "nodes are checked, and time does not go back");
        self.recording.note(self.now, Happening::Relinked(from_place, to_place));
        self.take_events();
        self.hand_over();
    }

    /// The node is gone, at once, and given back. What it has sent is on its way still; what arrives for it is lost.
    ///
    /// # Panics
    ///
    /// If there is none of that name, it is down already, or of another type.
    pub fn crash<T: Node>(&mut self, name: &str) -> T {
        // First the type: a node of another one stays.
        let _: &T = self.node(name);
        let place = place(&self.names, name);
        self.ask_touched();
        self.up[place] = false;
        self.deadlines.set(place, None);
        self.recording.note(self.now, Happening::Crashed(place));
        let node = self.nodes[place].take().map(|node| -> Box<dyn Any> { node });
        match node.and_then(|node| node.downcast().ok()) {
            Some(node) => *node,
            None => is_another::<T>(name),
        }
    }

    /// A node is there again, of whatever type, at the place and with the addresses of the one that crashed. It is asked at once what it wants.
    ///
    /// # Panics
    ///
    /// If there is none of that name, or it is up.
    pub fn restart(&mut self, name: &str, node: impl Node) {
        let place = place(&self.names, name);
        assert!(!self.up[place], "node `{name}` is up; `crash` it before another one takes its place");
        self.ask_touched();
        self.up[place] = true;
        self.nodes[place] = Some(Box::new(node));
        self.recording.note(self.now, Happening::Restarted(place));
        self.touch(place);
        self.ask_touched();
    }

    /// Whether the node is up.
    ///
    /// # Panics
    ///
    /// If there is none of that name.
    #[must_use]
    pub fn is_up(&self, name: &str) -> bool {
        self.up[place(&self.names, name)]
    }

    /// Notes something in the record: what a node computes, say, so that two runs are compared by it too.
    pub fn note(&mut self, text: impl fmt::Display) {
        if self.traces {
            self.recording.note(self.now, Happening::Note(text.to_string()));
        }
    }

    fn set_cut(&mut self, from: &str, to: &str, cut: bool) {
        let (from, to) = (place(&self.names, from), place(&self.names, to));
        self.ask_touched();
        let pair = from * self.names.len() + to;
        if from != to && std::mem::replace(&mut self.cut[pair], cut) != cut {
            self.recording.note(self.now, if cut { Happening::Cut(from, to) } else { Happening::Mended(from, to) });
        }
    }
}
