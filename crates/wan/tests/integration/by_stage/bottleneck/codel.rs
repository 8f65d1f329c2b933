//! CoDel by the pseudocode of RFC 8289, and FQ-CoDel by the text of RFC 8290.

use std::collections::BTreeMap;

use cohaptic_wan::{CoDel, Discipline, DropCause, FqCoDel};

use super::super::{Packet, dropped, flow};
use super::{Line, Queued};

/// CoDel, in the names of RFC 8289.
#[derive(Clone, Copy, Default)]
pub(super) struct Control {
    first_above_time: Option<u64>,
    drop_next: u64,
    count: u64,
    lastcount: u64,
    dropping: bool,
}

impl Line {
    /// Number of the queue of a packet.
    fn number(&self, packet: Packet) -> u32 {
        if let Discipline::FqCoDel(fq_codel) = self.config.bottleneck.discipline { flow(packet.number) % fq_codel.flows.get() } else { 0 }
    }

    fn control(&mut self, number: u32) -> &mut Control {
        self.controls.entry(number).or_default()
    }

    /// The oldest packet of a queue.
    pub(super) fn pop(&mut self, number: u32) -> Option<Queued> {
        let place = self.queue.iter().position(|queued| self.number(queued.packet) == number)?;
        Some(self.queue.remove(place))
    }

    /// RFC 8290, section 4.2.
    pub(super) fn deque_in_turn(&mut self, fq_codel: &FqCoDel, now: u64) -> Option<Queued> {
        loop {
            let is_new = !self.new.is_empty();
            let list = if is_new { &mut self.new } else { &mut self.old };
            let (number, credit) = *list.first()?;
            if credit <= 0 {
                list.remove(0);
                self.old.push((number, credit + i64::from(fq_codel.quantum.get())));
                continue;
            }
            let packet = self.deque(&fq_codel.codel, number, now);
            let list = if is_new { &mut self.new } else { &mut self.old };
            match packet {
                Some(queued) => {
                    list[0].1 -= i64::try_from(queued.packet.size).unwrap();
                    return Some(queued);
                }
                None => {
                    list.remove(0);
                    if is_new && !self.old.is_empty() {
                        self.old.push((number, credit));
                    }
                }
            }
        }
    }

    /// Puts the queue of a packet into the list of new ones, unless it is in a list.
    pub(super) fn lists(&mut self, fq_codel: &FqCoDel, packet: Packet) {
        let number = self.number(packet);
        if self.new.iter().chain(&self.old).all(|(listed, _)| *listed != number) {
            self.new.push((number, fq_codel.quantum.get().into()));
        }
    }

    /// RFC 8290, section 4.1, and Linux: drops half of the bytes of the longest queue from its head. Scripts are too short for the 64 packets.
    fn drop_from_longest(&mut self, now: u64) {
        let mut bytes: BTreeMap<u32, u64> = BTreeMap::new();
        for queued in &self.queue {
            *bytes.entry(self.number(queued.packet)).or_default() += queued.packet.size;
        }
        let most = *bytes.values().max().unwrap();
        let number = *bytes.iter().find(|(_, bytes)| **bytes == most).unwrap().0;
        let mut gone = 0;
        while let Some(queued) = self.pop(number) {
            self.control(number).count += 1;
            self.said.push(dropped(queued.packet, now, DropCause::QueueFull, queued.marked));
            gone += queued.packet.size;
            if gone >= most / 2 {
                return;
            }
        }
    }

    pub(super) fn offer_to_flow(&mut self, fq_codel: &FqCoDel, now: u64, packet: Packet) {
        self.lists(fq_codel, packet);
        self.queue.push(Queued { packet, came: now, marked: false });
        if self.sending.is_none() {
            return self.send_next(now);
        }
        loop {
            let Some(place) = self.queue.iter().position(|queued| queued.packet.number == packet.number) else { return };
            // The limit is asked without the newest packet in the queue, because a packet does not wait before itself.
            let newest = self.queue.remove(place);
            let is_full = self.is_full(now, packet.size);
            self.queue.insert(place, newest);
            if !is_full {
                return;
            }
            self.drop_from_longest(now);
        }
    }

    /// RFC 8289, section 5.5: the packet, and whether it may be dropped.
    fn dodequeue(&mut self, codel: &CoDel, number: u32, now: u64) -> Option<(Queued, bool)> {
        let Some(p) = self.pop(number) else {
            self.control(number).first_above_time = None;
            return None;
        };
        let bytes = self.bytes();
        let control = self.control(number);
        let mut ok_to_drop = false;
        let sojourn_time = now - p.came;
        if u128::from(sojourn_time) < codel.target.as_nanos() || bytes <= codel.mtu.get() {
            control.first_above_time = None;
        } else {
            match control.first_above_time {
                None => control.first_above_time = Some(now + u64::try_from(codel.interval.as_nanos()).unwrap()),
                Some(first_above_time) => ok_to_drop = now >= first_above_time,
            }
        }
        Some((p, ok_to_drop))
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "microseconds")]
    fn control_law(codel: &CoDel, t: u64, count: u64) -> u64 {
        t + (codel.interval.as_nanos() as f64 / (count as f64).sqrt()).round_ties_even() as u64
    }

    /// Pseudo-code of RFC 8289, section 5.6. An ECN-capable packet that would be dropped is marked and sent, as in Linux.
    pub(super) fn deque(&mut self, codel: &CoDel, number: u32, now: u64) -> Option<Queued> {
        let mut r = self.dodequeue(codel, number, now);
        let marks = |p: &Queued| codel.ecn && p.packet.ecn.is_capable();
        if self.control(number).dropping {
            if !r.is_some_and(|(_, ok_to_drop)| ok_to_drop) {
                self.control(number).dropping = false;
            }
            while now >= self.control(number).drop_next && self.control(number).dropping {
                let (mut p, _) = r.unwrap();
                self.control(number).count += 1;
                if marks(&p) {
                    p.marked = true;
                    let control = self.control(number);
                    control.drop_next = Self::control_law(codel, control.drop_next, control.count);
                    return Some(p);
                }
                self.said.push(dropped(p.packet, now, DropCause::CoDel, p.marked));
                r = self.dodequeue(codel, number, now);
                if r.is_some_and(|(_, ok_to_drop)| ok_to_drop) {
                    let control = self.control(number);
                    control.drop_next = Self::control_law(codel, control.drop_next, control.count);
                } else {
                    self.control(number).dropping = false;
                }
            }
        } else if let Some((mut p, true)) = r {
            if marks(&p) {
                p.marked = true;
                r = Some((p, true));
            } else {
                self.said.push(dropped(p.packet, now, DropCause::CoDel, p.marked));
                r = self.dodequeue(codel, number, now);
            }
            self.control(number).dropping = true;
            let control = self.control(number);
            let delta = control.count - control.lastcount;
            // Before the first drop there is no control that it could go on with.
            let recently =
                control.lastcount > 0 && i128::from(now) - i128::from(control.drop_next) < 16 * i128::try_from(codel.interval.as_nanos()).unwrap();
            control.count = if delta > 1 && recently { delta } else { 1 };
            control.drop_next = Self::control_law(codel, now, control.count);
            control.lastcount = control.count;
        }
        r.map(|(p, _)| p)
    }
}
