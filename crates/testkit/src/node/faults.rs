//! What breaks while nodes run, and is mended.

use std::any::Any;
use std::fmt;

use super::run::is_another;
use super::{Node, NodeRun};
use crate::link::ToLink;
use crate::trace::Happening;

impl NodeRun {
    /// Cuts the way from one node to another: packets that are sent or would arrive from now on are lost. The way back is as before.
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
        self.ask_touched();
        self.wire.mend_all();
    }

    /// The link from one node to another is another one from now on. Packets in it follow the rules of [`cohaptic_wan::Link::set_model`].
    ///
    /// # Panics
    ///
    /// If there is no such node, both are the same, or the words are none.
    pub fn set_link(&mut self, from: &str, to: &str, link: impl ToLink) {
        let path = self.names.path(from, to);
        assert!(path.from != path.to, "node `{from}` has no link to itself");
        self.ask_touched();
        self.wire.set_link(self.now(), path, link.to_link());
        self.take_arrivals();
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
        let id = self.id(name);
        self.ask_touched();
        self.up[id.index()] = false;
        self.deadlines.set(id.index(), None);
        self.wire.note(Happening::Crashed(id));
        let node = self.nodes[id.index()].take().map(|node| -> Box<dyn Any> { node });
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
        let id = self.id(name);
        assert!(!self.up[id.index()], "node `{name}` is up; `crash` it before another one takes its place");
        self.ask_touched();
        self.up[id.index()] = true;
        self.nodes[id.index()] = Some(Box::new(node));
        self.wire.note(Happening::Restarted(id));
        self.touch(id);
        self.ask_touched();
    }

    /// Whether the node is up.
    ///
    /// # Panics
    ///
    /// If there is none of that name.
    #[must_use]
    pub fn is_up(&self, name: &str) -> bool {
        self.up[self.id(name).index()]
    }

    /// Notes something in the record: what a node computes, say, so that two runs are compared by it too.
    pub fn note(&mut self, text: impl fmt::Display) {
        if self.wire.recording().traces {
            self.wire.note(Happening::Note(text.to_string()));
        }
    }

    fn set_cut(&mut self, from: &str, to: &str, cut: bool) {
        let path = self.names.path(from, to);
        self.ask_touched();
        self.wire.set_cut(path, cut);
    }
}
