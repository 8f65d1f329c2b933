//! A steady stream of packets over a single link.

use std::iter;
use std::time::Duration;

use cohaptic_units::Instant;
use cohaptic_wan::{Link, PacketInfo, PacketRecord};

/// Packets of equal size, sent at equal intervals from instant zero on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SteadyStream {
    /// Number of packets.
    pub packets: u64,
    /// Interval between two packets.
    pub every: Duration,
    /// Size and headers of each packet.
    pub info: PacketInfo,
}

impl SteadyStream {
    /// Returns the instant of sending packet `number`, or the last countable instant for a later one.
    #[must_use]
    pub fn sent(&self, number: u64) -> Instant {
        let nanos = self.every.as_nanos().saturating_mul(number.into());
        Instant::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }

    /// Sends the stream over a new link and waits for all arrivals. Calls `on_record` with each fate in order of time. Calls `keep_going` before every
    /// 64th packet with the number of packets sent so far and the link; `false` ends the stream. Returns the number of packets sent.
    ///
    /// # Errors
    ///
    /// The first error of `on_record`.
    pub fn over<E>(
        &self,
        link: &mut Link<()>,
        mut on_record: impl FnMut(&PacketRecord) -> Result<(), E>,
        mut keep_going: impl FnMut(u64, &Link<()>) -> bool,
    ) -> Result<u64, E> {
        let mut fault = None;
        let mut take = |record: &PacketRecord| match on_record(record) {
            Ok(()) => true,
            Err(error) => {
                fault = Some(error);
                false
            }
        };
        let sent = self.run_over(link, &mut take, &mut keep_going);
        fault.map_or(Ok(sent), Err)
    }

    /// The loop of [`SteadyStream::over`], compiled once here. With generic closures, each caller would compile the link again, at the level of the caller's
    /// crate. The stream ends at the first record for which `on_record` returns `false`.
    fn run_over(
        &self,
        link: &mut Link<()>,
        on_record: &mut dyn FnMut(&PacketRecord) -> bool,
        keep_going: &mut dyn FnMut(u64, &Link<()>) -> bool,
    ) -> u64 {
        let mut drain = |link: &mut Link<()>| iter::from_fn(|| link.poll_event()).all(|event| on_record(&event.record));
        let mut sent = 0;
        while sent < self.packets && (!sent.is_multiple_of(64) || keep_going(sent, link)) {
            // Cannot fail: the instants grow with the number, and no other code uses the link.
            let _ = link.handle_packet(self.sent(sent), self.info, ());
            sent += 1;
            if !drain(link) {
                return sent;
            }
        }
        // Lets the packets still inside the link arrive.
        let _ = link.handle_timeout(Instant::MAX);
        drain(link);
        sent
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_units::{Bytes, Ecn};
    use cohaptic_wan::{Delay, Fate, LinkConfig, LinkName};

    use super::*;

    const STREAM: SteadyStream =
        SteadyStream { packets: 3000, every: Duration::from_millis(2), info: PacketInfo { size: Bytes::new(64), ecn: Ecn::NotCapable } };

    fn link() -> Link<()> {
        let config = LinkConfig { delay: Delay::constant(Duration::from_millis(5)), ..LinkConfig::default() };
        Link::new(1, &LinkName::between("sender", "receiver"), config)
    }

    #[test]
    fn every_packet_is_sent_at_its_time_and_heard_of() {
        let mut records = Vec::new();
        let sent = STREAM.over(
            &mut link(),
            |record| {
                records.push(*record);
                Ok::<(), ()>(())
            },
            |_, _| true,
        );
        assert_eq!(sent, Ok(3000));
        assert_eq!(records.len(), 3000);
        for (number, record) in (0..).zip(&records) {
            assert_eq!((record.sequence, record.offered.as_nanos()), (number, number * 2_000_000));
            assert!(matches!(record.fate, Fate::Delivered(at) if at.as_nanos() == number * 2_000_000 + 5_000_000));
        }
    }

    #[test]
    fn it_ends_when_it_is_asked_to_and_at_an_error() {
        let mut heard = 0;
        let sent = STREAM.over(
            &mut link(),
            |_| {
                heard += 1;
                Ok::<(), ()>(())
            },
            |sent, _| sent < 2048,
        );
        assert_eq!((sent, heard), (Ok(2048), 2048));
        assert_eq!(STREAM.over(&mut link(), |record| if record.sequence < 7 { Ok(()) } else { Err(record.sequence) }, |_, _| true), Err(7));
    }
}
