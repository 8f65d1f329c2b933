//! Rows of text that go nowhere: what it costs to write down what happens, without the disk.

use std::convert::Infallible;
use std::io::{Sink, Write as _, sink};

use cohaptic_harness::{Observer, PacketRow, TickRow};
use cohaptic_scene::Scene;
use cohaptic_wan::Fate;

/// The columns of `trajectory.csv` or of `packets.csv`, line by line into a sink.
#[derive(Debug)]
pub(super) struct CsvSink {
    names: Vec<String>,
    ticks: bool,
    line: Vec<u8>,
    sink: Sink,
}

impl CsvSink {
    /// Every tick of every peer.
    pub(super) fn trajectory(scene: &Scene) -> Self {
        Self::new(scene, true)
    }

    /// Every packet.
    pub(super) fn packets(scene: &Scene) -> Self {
        Self::new(scene, false)
    }

    fn new(scene: &Scene, ticks: bool) -> Self {
        Self { names: scene.peers.iter().map(|peer| peer.name.clone()).collect(), ticks, line: Vec::new(), sink: sink() }
    }

    fn number(&mut self, value: f64) {
        self.line.push(b',');
        self.line.extend_from_slice(ryu::Buffer::new().format(value).as_bytes());
    }

    fn end(&mut self) {
        self.line.push(b'\n');
        let Ok(()) = self.sink.write_all(&self.line) else { return };
        self.line.clear();
    }

    fn text(&mut self, text: impl std::fmt::Display) {
        // Memory takes everything.
        let _ = write!(self.line, "{text}");
    }
}

impl Observer for CsvSink {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        self.ticks
    }

    fn wants_packets(&self) -> bool {
        !self.ticks
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        self.text(row.at.as_nanos());
        self.line.push(b',');
        self.line.extend_from_slice(self.names[row.peer].as_bytes());
        for axis in 0..row.coupling_force.len() {
            for body in [row.device, row.object, row.target] {
                self.number(body.position[axis]);
                self.number(body.velocity[axis]);
            }
            self.number(row.coupling_force[axis]);
            self.number(row.coordination_force[axis]);
        }
        self.end();
        Ok(())
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        let [from, to] = [row.path.from.index(), row.path.to.index()].map(|peer| self.names[peer].clone());
        self.text(format_args!("{from}->{to},{},{},", row.sequence, row.offered.as_nanos()));
        if let Fate::Delivered(at) = row.fate {
            self.text(at.as_nanos());
        }
        self.text(format_args!(",{}", row.fate.name()));
        self.end();
        Ok(())
    }
}
