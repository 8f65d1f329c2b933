//! Faults of links and nodes during a run.

use std::any::Any;
use std::fmt;

use super::run::is_another;
use super::{Node, NodeRun};
use crate::link::ToLink;
use crate::trace::Happening;

impl NodeRun {
    /// Cuts the path from a node to another node: packets that are sent or would arrive from now on are lost. The path back is not changed.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn cut(&mut self, from: &str, to: &str) {
        self.set_cut(from, to, true);
    }

    /// Ends the cut of the path from a node to another node.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn mend(&mut self, from: &str, to: &str) {
        self.set_cut(from, to, false);
    }

    /// Cuts all paths, in both directions, between the nodes of one group and the nodes of another group.
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

    /// Ends the cuts of all paths.
    pub fn mend_all(&mut self) {
        self.ask_touched();
        self.wire.mend_all();
    }

    /// Replaces the link from a node to another node. Packets inside the link follow the rules of [`cohaptic_wan::Link::set_model`].
    ///
    /// # Panics
    ///
    /// If there is no such node, if both nodes are the same, or if the words describe no link.
    pub fn set_link(&mut self, from: &str, to: &str, link: impl ToLink) {
        let path = self.names.path(from, to);
        assert!(path.from != path.to, "node `{from}` has no link to itself; name two nodes");
        // Packets of touched nodes are sent over the old link, because the test touched the nodes before this call.
        self.ask_touched();
        self.wire.set_link(self.now(), path, link.to_link());
        self.take_arrivals();
        self.hand_over();
    }

    /// Crashes the node at once, and returns the node. Packets from the node stay under way; packets that arrive for the node are lost.
    ///
    /// # Panics
    ///
    /// If no node has the name, the node is down already, or it is of another type.
    pub fn crash<T: Node>(&mut self, name: &str) -> T {
        // The type is checked first, so that a node of another type stays in the run.
        let _: &T = self.node(name);
        let id = self.id(name);
        // Packets that the test has given to the node leave before the crash.
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

    /// Puts a node of any type in the place of a crashed node, with the same addresses. The node is asked at once for packets and its deadline.
    ///
    /// # Panics
    ///
    /// If no node has the name, or it is up.
    pub fn restart(&mut self, name: &str, node: impl Node) {
        let id = self.id(name);
        assert!(!self.up[id.index()], "node `{name}` is up: `crash` the node before `restart` puts another in its place");
        self.ask_touched();
        self.up[id.index()] = true;
        self.nodes[id.index()] = Some(Box::new(node));
        self.wire.note(Happening::Restarted(id));
        self.touch(id);
        self.ask_touched();
    }

    /// Returns whether the node is up.
    ///
    /// # Panics
    ///
    /// If no node has the name.
    #[must_use]
    pub fn is_up(&self, name: &str) -> bool {
        self.up[self.id(name).index()]
    }

    /// Adds a note to the record, such as a result of a node. [`Nodes::run_twice`](super::Nodes::run_twice) compares notes as well.
    pub fn note(&mut self, text: impl fmt::Display) {
        if self.wire.recording().traces {
            self.wire.note(Happening::Note(text.to_string()));
        }
    }

    fn set_cut(&mut self, from: &str, to: &str, cut: bool) {
        let path = self.names.path(from, to);
        // Packets of touched nodes are sent before the cut or its end, in the order of the calls of the test.
        self.ask_touched();
        self.wire.set_cut(path, cut);
    }
}
