//! TCP of hosts that crash, and of programs that are killed.

use cohaptic_tcp::Connection;
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use super::{ConnId, Core, Gone, ListenId};

impl Core {
    fn connections_of(&self, host: NodeId) -> Vec<ConnId> {
        self.tcp.connections.iter().filter(|(_, end)| end.host == host).map(|(place, _)| ConnId(place)).collect()
    }

    fn listeners_of(&self, host: NodeId) -> Vec<ListenId> {
        self.tcp.listeners.iter().filter(|(_, listener)| listener.host == host).map(|(place, _)| ListenId(place)).collect()
    }

    /// Crashes the TCP of a host. All connections and listeners are forgotten without a segment to the peers.
    pub(in crate::core) fn crash_tcp(&mut self, host: NodeId) {
        let gone = Gone { at: self.now(), is_killed: false };
        for id in self.listeners_of(host) {
            let listener = self.tcp.listeners.get_mut(id.0);
            (listener.half_open, listener.waiting, listener.gone) = Default::default();
            listener.gone = Some(gone);
            listener.wakers.wake(&mut self.woken);
            let hold = listener.hold;
            self.tcp.ports.release(hold);
        }
        // A connection stays in memory while a program holds its handle, so that the next call of the program can return the error.
        for id in self.connections_of(host) {
            let end = self.tcp.end_mut(id);
            end.gone.get_or_insert(gone);
            end.listener = None;
            // A crashed host sends nothing. The peers notice the crash by their own timers, or by the reset that answers their next segment after a restart.
            silence(&mut end.machine, gone.at);
            let hold = end.hold.take();
            end.readers.wake(&mut self.woken);
            end.writers.wake(&mut self.woken);
            self.recount(id);
            self.tcp.set_timer(id, None);
            self.tcp.unroute(id);
            hold.into_iter().for_each(|hold| self.tcp.ports.release(hold));
            if !self.tcp.end(id).is_held {
                self.remove_connection(id);
            }
        }
        // Segments on the loopback of the host are in the memory of the crashed system.
        self.tcp.loopback.retain(|(of, _)| *of != host);
    }

    /// Closes the connections and listeners that the killed program held, as if the program had dropped them.
    pub(in crate::core) fn kill_tcp(&mut self, host: NodeId) {
        let gone = Gone { at: self.now(), is_killed: true };
        for id in self.listeners_of(host) {
            let listener = self.tcp.listeners.get_mut(id.0);
            // A listener that was gone before has stopped already.
            if listener.gone.replace(gone).is_none() {
                listener.wakers.wake(&mut self.woken);
                self.stop_listening(id);
            }
        }
        for id in self.connections_of(host) {
            let end = self.tcp.end_mut(id);
            // Only streams in the hands of the program are closed here. Connections of the backlog ended with their listener, and dropped streams close by
            // themselves.
            if !end.is_held || end.gone.is_some() {
                continue;
            }
            end.gone = Some(gone);
            end.readers.wake(&mut self.woken);
            end.writers.wake(&mut self.woken);
            end.machine.close(gone.at);
            self.after_call(id);
        }
    }
}

/// Ends a connection without a segment to the peer: the function takes out and drops the segments of the abort.
fn silence(machine: &mut Connection, now: Instant) {
    machine.close(now);
    machine.abort();
    while machine.poll_transmit(now).is_some() {}
}
