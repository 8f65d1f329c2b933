//! A link with mean delays and no losses: each random part is replaced by a stated part.

use std::time::Duration;

use cohaptic_units::Bytes;
use cohaptic_units::print::Span;
use cohaptic_wan::{
    Chance, Counts, Delay, Discipline, Fate, FateLog, Impairments, Layout, LinkConfig, LinkModel, Loss, Order, Outages, Pattern, Service, SlotGap,
    Slots, Sojourn,
};

/// A link without chance, and sentences about the replaced parts.
#[derive(Clone, Debug)]
pub(crate) struct Nominal {
    pub(crate) config: LinkConfig,
    pub(crate) replaced: Vec<String>,
    /// Names of the random ones among the replaced parts.
    pub(crate) chance: Vec<&'static str>,
}

/// The replaced parts of a link, in the order of replacement.
#[derive(Default)]
struct Replaced {
    words: Vec<String>,
    chance: Vec<&'static str>,
}

impl Replaced {
    /// Notes a part with an end and without chance.
    fn end(&mut self, words: &str) {
        self.words.push(words.to_owned());
    }

    /// Notes a random part by its name.
    fn chance(&mut self, name: &'static str, words: String) {
        self.words.push(words);
        self.chance.push(name);
    }
}

impl Nominal {
    /// Returns the nominal link for samples of the size `size`. Samples understand congestion marks.
    pub(crate) fn of(model: &LinkModel, size: Bytes) -> Self {
        let only = |delay, words: String, chance: &[&'static str]| Self {
            config: LinkConfig { delay: Delay::constant(delay), ..LinkConfig::default() },
            replaced: vec![words],
            chance: chance.to_vec(),
        };
        let mean = model.mean_delay();
        match model {
            LinkModel::Fixed(config) => stripped(config, size),
            // A recording ends and stability concerns an endless motion, so the recording cannot stand for the link.
            LinkModel::Replay(log) => {
                let mean = mean_delivered(log);
                only(
                    mean,
                    format!("a recording of fates, which ends, is replaced by the mean delay of what it delivered, {}, and no loss", Span(mean)),
                    &[],
                )
            }
            LinkModel::Modulated(_) => only(
                mean,
                format!("a link that changes by chance is replaced by the mean of the delays of its states, {}, alone", Span(mean)),
                &["random changes of a link"],
            ),
            LinkModel::Kernel(_) => {
                only(mean, format!("Linux's netem is replaced by its mean delay, {}, alone", Span(mean)), &["the chance of Linux's netem"])
            }
        }
    }

    /// Returns the delay of the link, if the link does nothing but delay.
    pub(crate) fn constant(&self) -> Option<Duration> {
        // With equal delays no sample overtakes another, and with one stage there is one order of stages: order and layout have no effect.
        let plain = LinkConfig { order: Order::default(), layout: Layout::default(), ..self.config.clone() };
        plain.is_constant_delay().then(|| self.config.delay.mean())
    }

    /// Returns whether the fates of samples do not depend on the instant of the first sample.
    pub(crate) fn is_timeless(&self) -> bool {
        self.cycle().is_none() && self.config.outages.is_empty()
    }

    /// Returns the longest period of the time-dependent parts of the link; `None` without such parts.
    pub(crate) fn cycle(&self) -> Option<Duration> {
        let LinkConfig { outages, loss, bottleneck, trace, .. } = &self.config;
        let outage = outages.random().map(|random| random.up.mean() + random.down.mean());
        let loss = pattern(loss, Counts::Nanoseconds).and_then(Pattern::period).map(Duration::from_nanos);
        let service = bottleneck
            .as_ref()
            .and_then(|bottleneck| if let Service::Recorded(recording) = &bottleneck.service { Some(recording.period()) } else { None });
        [outage, loss, service, trace.as_ref().and_then(cohaptic_wan::PathTrace::period)].into_iter().flatten().max()
    }

    /// Returns the number of packets after which a pattern of losses begins anew; 1 without such a pattern.
    pub(crate) fn packet_cycle(&self) -> u64 {
        pattern(&self.config.loss, Counts::Packets).and_then(Pattern::period).unwrap_or(1)
    }

    /// Returns the rate of the queue with the fewest samples per second [bit/s], and the size of a sample in that queue \[bit\]; `None` without queues.
    #[expect(clippy::cast_precision_loss, reason = "a rate, compared with a tolerance")]
    pub(crate) fn rate(&self, size: Bytes) -> Option<(f64, f64)> {
        // Framing adds bytes per packet, so two queues are compared by samples per second and not by bits per second.
        let bits = |bytes: Bytes| bytes.get() as f64 * 8.0;
        let line = self.config.bottleneck.as_ref().map(|line| match &line.service {
            Service::Rate(rate) => (rate.as_bits_per_sec() as f64, bits(line.framing.on_the_line(size))),
            Service::Recorded(recording) => (recording.mean_rate(), bits(line.framing.on_the_line(size))),
        });
        let bucket = self.config.token_bucket.map(|bucket| (bucket.rate.as_bits_per_sec() as f64, bits(bucket.framing.on_the_line(size))));
        line.into_iter().chain(bucket).min_by(|one, other| (one.0 / one.1).total_cmp(&(other.0 / other.1)))
    }
}

fn stripped(config: &LinkConfig, size: Bytes) -> Nominal {
    let mut replaced = Replaced::default();
    let mut config = config.clone();
    // Each random part is replaced by its mean where a mean keeps the meaning of the part, and left out otherwise.
    if config.delay.jitter().is_some() {
        let mean = config.delay.mean();
        replaced.chance("jitter", format!("jitter is replaced by the mean delay, {}", Span(mean)));
        config.delay = Delay::constant(mean);
    }
    if let Some(extra) = config.listed.extra_delay() {
        let mean = Duration::try_from_secs_f64(extra.mean).unwrap_or(Duration::MAX);
        replaced.chance("random extra delay", format!("{} is replaced by its mean delay, {}", config.listed.words().join(", then "), Span(mean)));
        config.listed = Impairments::default();
        config.delay = Delay::constant(config.delay.mean().saturating_add(mean));
    }
    // No sample is larger than the MTU then, so the MTU has no effect.
    if config.mtu.is_some_and(|mtu| size <= mtu) {
        config.mtu = None;
    }
    config.outages = outages(&config.outages, &mut replaced);
    if config.marks_instead_of_loss {
        // Samples understand marks, so a mark in place of a loss loses no sample.
        config.loss = Loss::None;
        config.marks_instead_of_loss = false;
    }
    config.loss = loss(config.loss, &mut replaced);
    if !config.duplication.is_never() {
        replaced.chance("duplication", "duplication is left out".to_owned());
        config.duplication = Chance::default();
    }
    if config.corruption.take().is_some() {
        replaced.chance("corruption", "corruption is left out".to_owned());
    }
    if config.reorder.take().is_some() {
        replaced.chance("reordering", "reordering on purpose is left out".to_owned());
    }
    if let Some(bottleneck) = &mut config.bottleneck {
        let what = match bottleneck.discipline {
            Discipline::Red(_) => Some("random early detection"),
            Discipline::Pie(_) => Some("PIE"),
            Discipline::TailDrop | Discipline::HeadDrop | Discipline::CoDel(_) | Discipline::DualPi2(_) | Discipline::FqCoDel(_) => None,
        };
        if let Some(what) = what {
            replaced.chance(what, format!("{what} is replaced by the limit of the queue alone"));
            bottleneck.discipline = Discipline::TailDrop;
        }
    }
    match config.cross_traffic.take() {
        Some(traffic) if traffic.is_random() => replaced.chance("cross-traffic", "cross-traffic is left out".to_owned()),
        Some(_) => replaced.end("recorded cross-traffic, which ends, is left out"),
        None => {}
    }
    config.slots = config.slots.map(|slots| regular(slots, &mut replaced));
    if let Some(trace) = config.trace.take() {
        let certain = trace.without_chance();
        if certain != trace {
            replaced.chance("random loss", "random loss of a recorded path is left out".to_owned());
        }
        if certain.period().is_some() {
            config.trace = Some(certain);
        } else {
            // After its last row a recorded path stays as in the last row, so this row describes the endless motion.
            replaced.end("a recorded path, which ends, is replaced by its last row");
            let (delay, loss) = certain.last();
            config.delay = Delay::constant(config.delay.mean().saturating_add(delay));
            if loss.get() > 0.0 {
                config.loss = everything();
            }
        }
    }
    Nominal { config, replaced: replaced.words, chance: replaced.chance }
}

/// Returns the repeating outages with spans of fixed length, and the idle outages. Outages with drawn spans are left out, and so are outages at given
/// times, because given times end.
fn outages(given: &Outages, replaced: &mut Replaced) -> Outages {
    let mut kept = Outages::default();
    if !given.scheduled().is_empty() {
        replaced.end("outages at given times are left out, because they end");
    }
    if let Some(random) = given.random() {
        if matches!((random.up, random.down), (Sojourn::Fixed(_), Sojourn::Fixed(_))) {
            kept = kept.clone().with_random(random).unwrap_or(kept);
        } else {
            replaced.chance("random outages", "random outages are left out".to_owned());
        }
    }
    if let Some(idle) = given.idle() {
        kept = kept.clone().with_idle(idle).unwrap_or(kept);
    }
    kept
}

fn loss(given: Loss, replaced: &mut Replaced) -> Loss {
    if given == Loss::None {
        return Loss::None;
    }
    if let Loss::Pattern(pattern) = given {
        if pattern.period().is_some() {
            return Loss::Pattern(pattern);
        }
        replaced.end("losses at given places are left out, because they end");
        return Loss::None;
    }
    let mean = given.mean();
    if mean == Some(1.0) {
        // The loss of every sample is not random.
        return everything();
    }
    if mean != Some(0.0) {
        replaced.chance("random loss", "random loss is left out".to_owned());
    }
    Loss::None
}

/// Returns the pattern of losses, if the losses are a pattern counted in these units.
fn pattern(loss: &Loss, counts: Counts) -> Option<&Pattern> {
    if let Loss::Pattern(pattern) = loss { Some(pattern).filter(|pattern| pattern.counts() == counts) } else { None }
}

fn everything() -> Loss {
    let first: core::ops::Range<u64> = 0..1;
    Pattern::of_packets(Vec::from([first]), Some(1)).map_or(Loss::None, Loss::Pattern)
}

fn regular(slots: Slots, replaced: &mut Replaced) -> Slots {
    let (mean, random) = match slots.gap() {
        SlotGap::Between { min, max } => (*min + (*max - *min) / 2, min != max),
        SlotGap::Drawn(delay) => (delay.mean(), delay.jitter().is_some()),
    };
    if random {
        replaced.chance("random gaps between slots", format!("random gaps between slots are replaced by their mean, {}", Span(mean)));
    }
    let mut regular = Slots::drawn(Delay::constant(mean));
    (regular.packets, regular.bytes) = (slots.packets, slots.bytes);
    regular
}

fn mean_delivered(log: &FateLog) -> Duration {
    // Copies are left out: the first packet of a sample brings the sample.
    let delays =
        log.records().iter().filter(|record| record.copy == 0 && matches!(record.fate, Fate::Delivered(_))).map(|record| record.at - record.offered);
    let (sum, count) = delays.fold((0_u128, 0_u128), |(sum, count), delay| (sum + delay.as_nanos(), count + 1));
    Duration::from_nanos(u64::try_from(sum / count.max(1)).unwrap_or(u64::MAX))
}
