//! Picture of a link: the delay of each packet, the distribution of the delays, and the rate of what arrived.

use cohaptic_picture::{Axis, Line, Look, Panel, Picture, Rug};
use cohaptic_units::Instant;
use cohaptic_wan::{CrossCounts, Fate, PacketRecord};

/// Greatest number of packets in the picture, a minute at 333 packets a second. Later packets are left out, and the picture says so.
const MOST: usize = 20_000;
/// Number of quantiles that the distribution is drawn from.
const QUANTILES: u32 = 400;
/// Number of intervals over which the rate is averaged.
const BINS: usize = 120;

/// Packets of a link for a picture.
#[derive(Clone, Debug, Default)]
pub struct LinkPicture {
    /// Instant of sending \[s\] and delay \[ms\] of each packet, by number. The delay of a lost packet is NaN.
    packets: Vec<(f64, f64)>,
    /// Instant of arrival \[s\] and length \[bit\] of each packet and each copy.
    arrived: Vec<(f64, f64)>,
    /// Number of packets that are not in the picture.
    left_out: u64,
}

/// Counts of the cross-traffic of a link, from time to time.
#[derive(Clone, Debug, Default)]
pub struct CrossSamples {
    /// Instant \[s\], and bytes offered by then.
    samples: Vec<(f64, u64)>,
}

impl CrossSamples {
    /// Adds the counts at an instant, in order of time. Counts beyond the packets of a picture are of no use, and are left out.
    pub fn record(&mut self, at: Instant, counts: CrossCounts) {
        if self.samples.len() <= MOST {
            self.samples.push((at.as_secs_f64(), counts.bytes));
        }
    }

    /// Returns the rate \[kbit/s\] of the cross packets until `end` \[s\], averaged over intervals about as long as those of the packets, each at its beginning
    /// \[s\]. Empty without cross packets.
    fn rates(&self, end: f64) -> Vec<(f64, f64)> {
        #[expect(clippy::cast_precision_loss, reason = "120")]
        let width = end / BINS as f64;
        let mut rates = Vec::new();
        let mut begin = self.samples.first().copied().unwrap_or_default();
        for &(at, bytes) in self.samples.iter().take_while(|(at, _)| *at <= end) {
            // Samples may be closer than the intervals, and the last sample may have the instant of the sample before.
            if at - begin.0 >= width && at > begin.0 {
                #[expect(clippy::cast_precision_loss, reason = "below 2^53 bytes")]
                rates.push((begin.0, (bytes - begin.1) as f64 * 8.0 / (at - begin.0) / 1e3));
                begin = (at, bytes);
            }
        }
        if rates.iter().any(|(_, rate)| *rate > 0.0) { rates } else { Vec::new() }
    }
}

impl LinkPicture {
    /// Adds a record, in any order.
    pub fn record(&mut self, record: &PacketRecord) {
        let place = usize::try_from(record.sequence).unwrap_or(usize::MAX);
        if place >= MOST {
            // A packet has several records. The end of copy 0 comes once per packet, so each packet is counted once.
            self.left_out += u64::from(record.copy == 0 && record.fate.is_end());
            return;
        }
        if place >= self.packets.len() {
            // Packets may end out of order, so the places of earlier packets are made as well, and filled by later records.
            self.packets.resize(place + 1, (f64::NAN, f64::NAN));
        }
        let sent = record.offered.as_secs_f64();
        if record.copy == 0 {
            self.packets[place].0 = sent;
        }
        if let Fate::Delivered(at) = record.fate {
            // Copies count in the rate of arrival, but the delay of a packet is the delay of copy 0.
            if record.copy == 0 {
                self.packets[place].1 = at.saturating_duration_since(record.offered).as_secs_f64() * 1e3;
            }
            #[expect(clippy::cast_precision_loss, reason = "below 2^27")]
            self.arrived.push((at.as_secs_f64(), record.size.get() as f64 * 8.0));
        }
    }

    /// Returns the picture as SVG. `title` is the link in words. The rate of cross packets stands beside the rate of what arrived, where there are some.
    #[must_use]
    pub fn svg(&self, title: &str, crossed: &CrossSamples) -> String {
        let lost: Vec<f64> = self.packets.iter().filter(|(_, delay)| delay.is_nan()).map(|(sent, _)| *sent).collect();
        let mut delays = Panel::new(Axis::new("sent at").unit("s"), Axis::new("delay").unit("ms").include(0.0))
            // The line is broken at each lost packet, because the delay of a lost packet is NaN.
            .with(Line::new(self.packets.iter().copied(), Look::of(0)).named("delay"));
        if !lost.is_empty() {
            delays = delays.with(Rug::new(lost, Look::of(1)).named("lost"));
        }
        let distribution = Panel::new(Axis::new("delay").unit("ms").include(0.0), Axis::new("share at or below").range(0.0, 1.0))
            .with(Line::new(self.quantiles(), Look::of(0)));
        let end = self.arrived.iter().map(|(at, _)| *at).fold(0.0, f64::max);
        let cross = crossed.rates(end);
        let name = if cross.is_empty() { "arrived at" } else { "arrived, or met the queue at" };
        let arrived = Line::steps(self.rates(), Look::of(0));
        let mut rates = Panel::new(Axis::new(name).unit("s"), Axis::new("rate").unit("kbit/s").include(0.0));
        rates = if cross.is_empty() {
            rates.with(arrived)
        } else {
            rates.with(Line::steps(cross, Look::of(1)).named("cross-traffic")).with(arrived.named("arrived"))
        };
        let mut picture = Picture::new(title).aspect(0.4).panel(delays).panel(distribution).panel(rates);
        if self.left_out > 0 {
            picture = picture.note(format!("the first {MOST} packets; {} later ones are left out", self.left_out));
        }
        picture.svg()
    }

    /// Returns delays \[ms\], each with the share of arrived packets whose delay is at most as long. Of many packets only some are returned, because a picture
    /// has no more points across.
    fn quantiles(&self) -> Vec<(f64, f64)> {
        let mut delays: Vec<f64> = self.packets.iter().map(|(_, delay)| *delay).filter(|delay| !delay.is_nan()).collect();
        delays.sort_by(f64::total_cmp);
        let Some(last) = delays.len().checked_sub(1) else { return Vec::new() };
        (0..=QUANTILES)
            .map(|number| {
                let share = f64::from(number) / f64::from(QUANTILES);
                #[expect(
                    clippy::cast_precision_loss,
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "at most the number of packets"
                )]
                let place = (share * last as f64).round() as usize;
                (delays[place], share)
            })
            .collect()
    }

    /// Returns the rate \[kbit/s\] of what arrived, averaged over intervals of equal length, each at its beginning \[s\].
    fn rates(&self) -> Vec<(f64, f64)> {
        let end = self.arrived.iter().map(|(at, _)| *at).fold(0.0, f64::max);
        // Without an arrival after the beginning, the intervals have no length to divide by.
        if end == 0.0 {
            return Vec::new();
        }
        #[expect(clippy::cast_precision_loss, reason = "120")]
        let width = end / BINS as f64;
        let mut bits = [0.0; BINS];
        for (at, length) in &self.arrived {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and no larger than the number of intervals")]
            let place = (at / width) as usize;
            // The last arrival lies at the end of the last interval.
            bits[place.min(BINS - 1)] += length;
        }
        #[expect(clippy::cast_precision_loss, reason = "120")]
        let rate = |(place, bits): (usize, &f64)| (place as f64 * width, bits / width / 1e3);
        bits.iter().enumerate().map(rate).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Packets of 1000 bits a millisecond: 1000 kbit/s, from one sample to the next that is far enough away.
    #[test]
    fn rates_of_cross_packets_are_those_between_samples() {
        let mut crossed = CrossSamples::default();
        for milli in 0..=240_u64 {
            // Silent in the second half.
            let bytes = 125 * milli.min(120);
            crossed.record(Instant::from_nanos(milli * 1_000_000), CrossCounts { offered: milli, dropped: 0, bytes });
        }
        // Intervals of the picture are a little shorter than 2 ms, so each takes two samples.
        let rates = crossed.rates(0.239);
        assert_eq!(rates.len(), 119);
        assert!(rates.iter().all(|(at, rate)| (rate - if *at < 0.1199 { 1000.0 } else { 0.0 }).abs() < 1e-6), "{rates:?}");
        // What came after the last packet of the picture is not in the picture.
        assert!(crossed.rates(0.1).iter().all(|(at, _)| *at < 0.1));
        assert!(CrossSamples::default().rates(1.0).is_empty());
    }
}
