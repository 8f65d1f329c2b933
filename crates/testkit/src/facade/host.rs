//! A host of the test bed for `cohaptic-sockets`.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use cohaptic_sockets::{Host, Signals, Stop};
use cohaptic_wan::NodeId;

use crate::core::Shared;
use crate::current;
use crate::resolve;
use crate::task::OtherTasks;

/// A host for tasks that tokio polls.
pub(super) struct OfBed {
    pub(super) host: NodeId,
    pub(super) shared: Arc<Shared>,
    pub(super) others: Arc<OtherTasks>,
}

impl Host for OfBed {
    fn name(&self) -> String {
        self.shared.names()[self.host.index()].clone()
    }

    fn look_up(&self, name: &str, port: u16) -> io::Result<Vec<SocketAddr>> {
        resolve::elsewhere(&self.shared, name, port)
    }

    fn note_fault(&self, text: &str) {
        self.shared.note_fault(text);
    }

    fn within(&self, act: &mut dyn FnMut()) {
        current::on_host(Some(self.host), act);
    }

    fn keep(&self, stop: Box<dyn Stop>) {
        self.others.keep(self.host, stop);
    }

    fn listen_for(&self, number: i32) -> Box<dyn Signals> {
        Box::new(self.others.signals.listen(self.host, number))
    }
}
