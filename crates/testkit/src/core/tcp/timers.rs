//! Timers of connections, and the removal of connections whose TIME-WAIT has ended.

use std::collections::BTreeSet;

use cohaptic_tcp::State;
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use super::{ConnId, Core, Tcp};

/// Deadlines of connections, sorted by time, host and connection.
///
/// Most deadlines move on with each segment, and few are reached. So the entry of a connection may lie before the deadline: such an entry moves on once the
/// entry is at the front. A deadline that moves back moves the entry at once, so that no entry lies after a deadline.
#[derive(Debug, Default)]
pub(super) struct Timers(BTreeSet<(Instant, NodeId, ConnId)>);

impl Tcp {
    /// Sets the deadline of a connection.
    pub(super) fn set_timer(&mut self, id: ConnId, due: Option<Instant>) {
        let end = self.connections.get_mut(id.0);
        end.due = due;
        if due.is_some_and(|due| end.entry.is_none_or(|entry| due < entry)) {
            self.move_entry(id);
        }
    }

    /// Removes the entry of a connection with its deadline.
    pub(super) fn remove_timer(&mut self, id: ConnId) {
        if let Some(end) = self.connections.find_mut(id.0) {
            end.due = None;
            self.move_entry(id);
        }
    }

    /// Moves the entry of a connection to its deadline, or removes the entry if there is no deadline.
    fn move_entry(&mut self, id: ConnId) {
        let end = self.connections.get_mut(id.0);
        let before = std::mem::replace(&mut end.entry, end.due);
        if let Some(before) = before {
            self.timers.0.remove(&(before, end.host, id));
        }
        if let Some(due) = end.due {
            self.timers.0.insert((due, end.host, id));
        }
    }

    /// Returns the first deadline and its connection.
    fn first_timer(&mut self) -> Option<(Instant, ConnId)> {
        loop {
            let (at, _, id) = *self.timers.0.first()?;
            if self.end(id).due == Some(at) {
                return Some((at, id));
            }
            self.move_entry(id);
        }
    }

    /// Returns all deadlines, in their order.
    fn all_timers(&mut self) -> Vec<(Instant, NodeId, ConnId)> {
        // Entries before their deadline are moved first, so that every entry tells the true deadline.
        let old: Vec<_> = self.timers.0.iter().filter(|(at, _, id)| self.end(*id).due != Some(*at)).map(|(.., id)| *id).collect();
        old.into_iter().for_each(|id| self.move_entry(id));
        self.timers.0.iter().copied().collect()
    }
}

impl Core {
    /// Returns the next event. `others` is the next event of the network and of the timers of programs.
    pub(in crate::core) fn with_tcp_timers(&mut self, others: Option<Instant>) -> Option<Instant> {
        let first = self.tcp.first_timer().map(|(at, _)| at);
        // Only probes of stuck connections are left. The probes would let time pass for ever, so the run counts as having no event.
        match (first, others) {
            (Some(_), None) if self.is_stuck() => None,
            _ => crate::wire::earlier(first, others),
        }
    }

    /// Returns whether no connection can make progress by itself. The caller has checked that no packet is under way and no program waits for time. A
    /// connection is stuck if its only timers are probes of a window kept closed by the program of the peer, or keep-alive probes, and the peer has answered
    /// since a program last called.
    ///
    /// A connection must have been seen twice with different deadlines since the last call: the deadline moves when a probe was answered.
    fn is_stuck(&mut self) -> bool {
        let calls = self.tcp.calls;
        let mut is_stuck = true;
        for (at, _, id) in self.tcp.all_timers() {
            let end = self.tcp.end_mut(id);
            // A connection without a program gives up by itself, and so is not stuck.
            let is_answered = end.is_held && (end.machine.is_held_by_window() || end.machine.is_only_kept_alive());
            if !is_answered || end.looked_at.0 != calls {
                end.looked_at = (calls, Some(at));
            }
            is_stuck &= is_answered && end.looked_at != (calls, Some(at));
            if !is_answered {
                break;
            }
        }
        is_stuck
    }

    /// Fires the timers that are due, sorted by time, host and connection.
    pub(in crate::core) fn fire_tcp_timers(&mut self) {
        let now = self.now();
        if self.tcp.first_timer().is_none_or(|(at, _)| at > now) {
            return;
        }
        // Tokio's clock may have jumped to a timer that the test bed does not know. Connections that are stuck stay so until a program calls.
        if self.wire.next().is_none() && self.timers.next().is_none() && self.is_stuck() {
            return;
        }
        while let Some((_, id)) = self.tcp.first_timer().filter(|(at, _)| *at <= now) {
            // The deadline has passed. If `settle` sets no new deadline, the next call of `first_timer` removes the entry.
            self.tcp.set_timer(id, None);
            let end = self.tcp.end_mut(id);
            end.machine.handle_timeout(now);
            if end.is_unreachable(now) {
                end.machine.abort();
            }
            self.settle(id);
            self.take_arrivals();
        }
    }

    /// Removes connections whose TIME-WAIT has ended. The end of TIME-WAIT has no visible effect, so no timer is needed: removal takes place when a new
    /// connection comes.
    pub(super) fn forget_old(&mut self) {
        let now = self.now();
        while let Some((_, id)) = self.tcp.time_waits.front().copied().filter(|(ends, _)| *ends <= now) {
            self.tcp.time_waits.pop_front();
            // The connection may be gone already, and its index may belong to a newer connection.
            let Some(end) = self.tcp.connections.find(id.0) else { continue };
            match end.machine.time_wait_ends().filter(|_| end.is_in_time_wait) {
                // A repeated FIN has restarted TIME-WAIT.
                Some(ends) if ends > now => self.tcp.time_waits.push_back((ends, id)),
                Some(_) => {
                    self.tcp.end_mut(id).machine.handle_timeout(now);
                    debug_assert_eq!(self.tcp.end(id).machine.state(), State::Closed, "TIME-WAIT is over");
                    self.forget_if_over(id);
                }
                None => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_tcp::{Connection, TcpConfig};

    use super::*;

    /// Deadlines move on, move back and vanish, and mostly change several times before anybody asks for the first one.
    #[test]
    fn the_first_deadline_is_the_least_of_all() {
        const COUNT: usize = 5;
        let mut tcp = Tcp::new(1, COUNT);
        let address = "10.0.0.1:1".parse().unwrap();
        let connection = || Connection::connect(Instant::ZERO, TcpConfig::default(), address, address, 0).unwrap();
        let ids: Vec<ConnId> = (0..COUNT).map(|host| tcp.insert(NodeId::new(host), connection())).collect();
        let mut dues = [None; COUNT];
        let mut state = 1u32;
        for _ in 0..5000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let draw = (state >> 4) as usize;
            let (index, is_none, at) = (draw % COUNT, (draw / 5).is_multiple_of(4), draw / 20 % 50);
            dues[index] = (!is_none).then_some(Instant::from_nanos(at as u64));
            tcp.set_timer(ids[index], dues[index]);
            let mut all: Vec<_> = (0..COUNT).filter_map(|index| Some((dues[index]?, NodeId::new(index), ids[index]))).collect();
            all.sort_unstable();
            match draw / 1000 % 8 {
                0 => assert_eq!(tcp.all_timers(), all),
                1 | 2 => assert_eq!(tcp.first_timer(), all.first().map(|(at, _, id)| (*at, *id))),
                _ => {}
            }
        }
        ids.into_iter().for_each(|id| tcp.remove_timer(id));
        assert!(tcp.timers.0.is_empty() && tcp.first_timer().is_none());
    }
}
