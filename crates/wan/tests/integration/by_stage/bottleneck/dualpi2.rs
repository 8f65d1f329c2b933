//! DualPI2 by the pseudocode of RFC 9332, appendix A: `dualpi2_enqueue`, `dualpi2_dequeue` with drops on overload, `dualpi2_update` and `recur`, in its names.
//! The scheduler is the one of Linux: a credit in which each byte sent from one queue weighs as much as the other queue's share of the line.

use std::time::Duration;

use cohaptic_units::Ecn;
use cohaptic_wan::{DropCause, DualPi2};

use super::super::dropped;
use super::{Line, Queued};

/// State in the names of the RFC.
#[derive(Clone, Copy, Default)]
pub(super) struct Coupled {
    p: f64,
    prevq: f64,
    lq_count: f64,
    cq_count: f64,
    credit: f64,
    /// Instant of the latest look at the timer \[ns\].
    looked: u64,
}

impl Coupled {
    pub(super) fn begun(now: u64) -> Self {
        Self { looked: now, ..Self::default() }
    }
}

fn recur(count: &mut f64, likelihood: f64) -> bool {
    *count += likelihood;
    if *count > 1.0 {
        *count -= 1.0;
        return true;
    }
    false
}

fn is_in_lq(queued: &Queued) -> bool {
    queued.marked || matches!(queued.packet.ecn, Ecn::Capable1 | Ecn::Congestion)
}

impl Line {
    /// Runs the timer, up to `now` and at `now` itself.
    pub(super) fn dualpi2_update(&mut self, dualpi2: &DualPi2, now: u64) {
        let every = u64::try_from(dualpi2.tupdate.as_nanos()).unwrap();
        let mut time = (self.coupled.looked / every + 1) * every;
        while time <= now {
            let queuing = |lq: bool| {
                let first = self.queue.iter().find(|queued| is_in_lq(queued) == lq);
                Duration::from_nanos(first.map_or(0, |queued| time - queued.came)).as_secs_f64()
            };
            let curq = queuing(true).max(queuing(false));
            let coupled = &mut self.coupled;
            coupled.p = coupled.p + dualpi2.alpha * (curq - dualpi2.target.as_secs_f64()) + dualpi2.beta * (curq - coupled.prevq);
            coupled.p = coupled.p.clamp(0.0, 1.0);
            coupled.prevq = curq;
            time += every;
        }
        self.coupled.looked = now;
    }

    pub(super) fn dualpi2_dequeue(&mut self, dualpi2: &DualPi2, now: u64) -> Option<Queued> {
        self.dualpi2_update(dualpi2, now);
        let k = f64::from(dualpi2.coupling_factor.get());
        let (p_cl, p_c) = ((k * self.coupled.p).min(1.0), self.coupled.p * self.coupled.p);
        let share = dualpi2.classic_protection.get();
        loop {
            let first = |lq: bool| self.queue.iter().position(|queued| is_in_lq(queued) == lq);
            let (serves_lq, place) = match (first(true), first(false)) {
                (None, None) => {
                    self.coupled.credit = 0.0;
                    return None;
                }
                (Some(place), None) => (true, place),
                (None, Some(place)) => (false, place),
                (Some(lq), Some(cq)) => {
                    if self.coupled.credit <= 0.0 {
                        (true, lq)
                    } else {
                        (false, cq)
                    }
                }
            };
            let mut pkt = self.queue.remove(place);
            let others_wait = |lq: bool| self.queue.iter().any(|queued| is_in_lq(queued) == lq);
            let (lq_waits, cq_waits) = (others_wait(true), others_wait(false));
            let is_overload = p_cl >= 1.0;
            if serves_lq {
                if is_overload {
                    if recur(&mut self.coupled.lq_count, p_c) {
                        self.said.push(dropped(pkt.packet, now, DropCause::DualPi2, pkt.marked));
                        continue;
                    }
                    pkt.marked |= recur(&mut self.coupled.lq_count, p_cl);
                } else {
                    let has_waited = u128::from(now - pkt.came) > dualpi2.step_thresh.as_nanos();
                    let native = if lq_waits && has_waited { 1.0 } else { 0.0 };
                    pkt.marked |= recur(&mut self.coupled.lq_count, p_cl.max(native));
                }
                if cq_waits {
                    self.coupled.credit += share * pkt.packet.size as f64;
                }
            } else {
                if recur(&mut self.coupled.cq_count, p_c) {
                    if pkt.packet.ecn == Ecn::NotCapable || is_overload {
                        self.said.push(dropped(pkt.packet, now, DropCause::DualPi2, pkt.marked));
                        continue;
                    }
                    pkt.marked = true;
                }
                if lq_waits {
                    self.coupled.credit -= (1.0 - share) * pkt.packet.size as f64;
                }
            }
            return Some(pkt);
        }
    }
}
