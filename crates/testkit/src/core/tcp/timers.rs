//! Timers of connections, and the removal of connections whose TIME-WAIT has ended.

use cohaptic_tcp::State;
use cohaptic_units::Instant;

use super::{ConnId, Core, Tcp};

impl Tcp {
    pub(super) fn set_timer(&mut self, id: ConnId, due: Option<Instant>) {
        let Some(end) = self.connections.find(id.0) else { return };
        let (host, before) = (end.host, end.timer);
        if before == due {
            return;
        }
        if let Some(before) = before {
            self.timers.remove(&(before, host, id));
        }
        if let Some(due) = due {
            self.timers.insert((due, host, id));
        }
        self.end_mut(id).timer = due;
    }
}

impl Core {
    /// Returns the next event. `others` is the next event of the network and of the timers of programs.
    pub(in crate::core) fn with_tcp_timers(&mut self, others: Option<Instant>) -> Option<Instant> {
        let first = self.tcp.timers.first().map(|(at, ..)| *at);
        // Only probes of stuck connections are left. They would let time pass for ever, so the run counts as having no event.
        match (first, others) {
            (Some(_), None) if self.is_stuck() => None,
            _ => crate::wire::earlier(first, others),
        }
    }

    /// Returns whether no connection can make progress by itself. The caller has checked that no packet is on its way and no program waits for time. A
    /// connection is stuck if its only timers probe a window that the program of the peer keeps closed, or ask whether the peer is there, and the peer has
    /// answered since a program last called.
    ///
    /// A connection must have been seen twice with a different deadline since the last call: the deadline moves when a probe was answered.
    fn is_stuck(&mut self) -> bool {
        let calls = self.tcp.calls;
        let Tcp { timers, connections, .. } = &mut self.tcp;
        let mut is_stuck = true;
        for (at, _, id) in &*timers {
            let end = connections.get_mut(id.0);
            // A connection that no program holds gives up by itself, so it is not stuck.
            let is_answered = end.is_held && (end.machine.is_held_by_window() || end.machine.is_only_kept_alive());
            if !is_answered || end.looked_at.0 != calls {
                end.looked_at = (calls, Some(*at));
            }
            is_stuck &= is_answered && end.looked_at != (calls, Some(*at));
            if !is_answered {
                break;
            }
        }
        is_stuck
    }

    /// Fires the timers that are due, sorted by time, host and connection.
    pub(in crate::core) fn fire_tcp_timers(&mut self) {
        let now = self.now();
        if self.tcp.timers.first().is_none_or(|(at, ..)| *at > now) {
            return;
        }
        // Tokio's clock may have jumped to a timer that the test bed does not know. Connections that are stuck stay so until a program calls.
        if self.wire.next().is_none() && self.timers.next().is_none() && self.is_stuck() {
            return;
        }
        while let Some((_, _, id)) = self.tcp.timers.first().copied().filter(|(at, ..)| *at <= now) {
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
