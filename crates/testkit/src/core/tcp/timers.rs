//! Timers of connections, and the end of TIME-WAIT.

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
    /// The next event, if that is when the network and the timers of programs want to be woken.
    pub(in crate::core) fn with_tcp_timers(&mut self, others: Option<Instant>) -> Option<Instant> {
        let first = self.tcp.timers.first().map(|(at, ..)| *at);
        match (first, others) {
            (Some(_), None) if self.is_stuck() => None,
            _ => crate::wire::earlier(first, others),
        }
    }

    /// Whether no packet is on its way, no program waits for time, and all that connections do is to ask for windows that programs keep closed, or whether a peer
    /// is there: each has been answered since a program last called.
    ///
    /// It looks twice at each connection: what a deadline was that has moved since was answered.
    fn is_stuck(&mut self) -> bool {
        let calls = self.tcp.calls;
        let Tcp { timers, connections, .. } = &mut self.tcp;
        let mut is_stuck = true;
        for (at, _, id) in &*timers {
            let end = connections.get_mut(id.0);
            // What no program holds is given up by itself.
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

    /// The timers that are due go off, in the order of hosts and connections.
    pub(in crate::core) fn fire_tcp_timers(&mut self) {
        let now = self.now();
        if self.tcp.timers.first().is_none_or(|(at, ..)| *at > now) {
            return;
        }
        // Tokio's clock may have jumped to a timer of its own: connections that are stuck stay so until a program calls.
        if self.wire.next().is_none() && self.timers.next().is_none() && self.is_stuck() {
            return;
        }
        while let Some((_, _, id)) = self.tcp.timers.first().copied().filter(|(at, ..)| *at <= now) {
            self.tcp.set_timer(id, None);
            self.tcp.end_mut(id).machine.handle_timeout(now);
            self.settle(id);
            self.take_arrivals();
        }
    }

    /// Forgets connections whose TIME-WAIT is over: nothing is seen of it, so that it is done when others come.
    pub(super) fn forget_old(&mut self) {
        let now = self.now();
        while let Some((_, id)) = self.tcp.time_waits.front().copied().filter(|(ends, _)| *ends <= now) {
            self.tcp.time_waits.pop_front();
            let Some(end) = self.tcp.connections.find(id.0) else { continue };
            match end.machine.time_wait_ends().filter(|_| end.is_in_time_wait) {
                // A FIN that came again has made it longer.
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
