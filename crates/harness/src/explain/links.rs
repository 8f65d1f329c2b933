//! Links in words: each stage that is configured, with its numbers, in the order in which packets pass them.

use std::time::Duration;

use cohaptic_units::Probability;
use cohaptic_units::print::{Counted, Span};
use cohaptic_wan::{
    Bottleneck, Chance, Checksum, Correlation, Corruption, Counts, Delay, Discipline, Displacement, Distribution, Flips, Framing, Jitter, Layout,
    LinkConfig, LinkModel, Loss, Order, Outages, QueueLimit, Reorder, Service, SlotGap, Slots, Sojourn, TokenBucket,
};

/// What kind of link it is.
pub(super) fn describe_link(model: &LinkModel) -> String {
    match model {
        LinkModel::Fixed(config) => describe_config(config),
        LinkModel::Modulated(modulated) => {
            let states = modulated.modulator().states().iter().zip(modulated.configs()).enumerate().map(|(place, (state, config))| {
                let lasts = state.sojourn.map_or_else(|| "for ever".to_owned(), sojourn);
                format!("state {} ({lasts}): {}", place + 1, describe_config(config))
            });
            format!("as \"{}\" goes; {}", modulated.modulator().name(), states.collect::<Vec<_>>().join("; "))
        }
        LinkModel::Replay(log) => format!("a replay of {}, and nothing after it", Counted(log.packets(), "packet")),
        LinkModel::Kernel(netem) => format!("netem of Linux 6.6, to the bit: {}", netem.words()),
    }
}

/// What the stages of a configuration do.
fn describe_config(config: &LinkConfig) -> String {
    let LinkConfig { mtu, outages, loss, marks_instead_of_loss, duplication, corruption, limit, token_bucket, .. } = config;
    let mut stages = Vec::new();
    stages.extend(mtu.map(|mtu| format!("packets of at most {mtu}")));
    stages.extend(describe_outages(outages));
    stages.extend(describe_loss(loss).map(|loss| if *marks_instead_of_loss { format!("{loss} (marked, not lost)") } else { loss }));
    stages.extend((!duplication.is_never()).then(|| format!("{} sent twice", chance(*duplication))));
    stages.extend(corruption.as_ref().map(describe_corruption));
    stages.extend(limit.map(|limit| format!("at most {} inside", Counted(limit, "packet"))));
    stages.extend(token_bucket.map(|bucket| describe_bucket(&bucket)));
    stages.extend(config.bottleneck.as_ref().map(describe_bottleneck));
    stages.extend(config.slots.as_ref().map(describe_slots));
    stages.extend(config.reorder.as_ref().map(describe_reorder));
    stages.extend(config.trace.as_ref().map(|trace| format!("a recorded delay of at least {}, and its loss", Span(trace.least()))));
    stages.push(describe_delay(&config.delay));
    if config.order == Order::InOrder {
        stages.push("in order".into());
    }
    let text = stages.join(", then ");
    match config.layout {
        Layout::Netem => format!("{text} (rate and slots behind the delay, as in netem)"),
        Layout::Physical => text,
    }
}

fn describe_outages(outages: &Outages) -> Option<String> {
    let mut kinds = Vec::new();
    if !outages.scheduled().is_empty() {
        kinds.push(Counted(outages.scheduled().len(), "outage").to_string());
    }
    kinds.extend(outages.random().map(|random| format!("random outages (up {}, down {})", sojourn(random.up), sojourn(random.down))));
    kinds.extend(outages.idle().map(|idle| format!("an outage of {} after {} without a packet", Span(idle.down), Span(idle.after))));
    (!kinds.is_empty()).then(|| kinds.join(" and "))
}

fn describe_loss(loss: &Loss) -> Option<String> {
    let mean = loss.mean().map_or_else(String::new, |mean| format!(", {} on average", percent(mean)));
    Some(match loss {
        Loss::None => return None,
        Loss::Independent(probability) => format!("independent loss {}", percent(probability.get())),
        Loss::Correlated(packets) => format!("loss of {}", chance(*packets)),
        Loss::GilbertElliott(_) => format!("Gilbert-Elliott loss{mean}"),
        Loss::GilbertElliottInTime(chain) => {
            let (good, bad) = chain.mean_times();
            format!("Gilbert-Elliott loss in time (good {}, bad {}){mean}", Span(good), Span(bad))
        }
        Loss::FourState(_) => format!("four-state loss{mean}"),
        Loss::Pattern(pattern) => match pattern.counts() {
            Counts::Packets => format!("loss of chosen packets{mean}"),
            Counts::Nanoseconds => format!("loss at chosen times{mean}"),
        },
    })
}

fn describe_corruption(corruption: &Corruption) -> String {
    let bits = match corruption.bits {
        Flips::Bits { packets, count } => format!("{} flipped in {}", Counted(count, "bit"), chance(packets)),
        Flips::Rate(rate) => format!("each bit flipped with {:e}", rate.get()),
    };
    let within = corruption.within.as_ref().map_or_else(String::new, |range| format!(", bytes {} to {}", range.start, range.end - 1));
    let checksum = match corruption.checksum {
        Checksum::Discards => "discarded on arrival",
        Checksum::Passes => "handed over",
    };
    format!("{bits}{within} ({checksum})")
}

fn describe_bucket(bucket: &TokenBucket) -> String {
    let peak = bucket.peak.map_or_else(String::new, |peak| format!(", peak {} in bursts of {}", peak.rate, peak.burst));
    let framing = framing(bucket.framing);
    format!("queue ({}) before a token bucket of {} at {}{peak}{framing}", limit(bucket.limit), bucket.burst, bucket.rate)
}

fn describe_bottleneck(bottleneck: &Bottleneck) -> String {
    let discipline = match bottleneck.discipline {
        Discipline::TailDrop => String::new(),
        Discipline::HeadDrop => ", head-drop".into(),
        Discipline::Red(_) => ", RED".into(),
        Discipline::CoDel(codel) => format!(", CoDel {} in {}", Span(codel.target), Span(codel.interval)),
    };
    let service = match &bottleneck.service {
        Service::Rate(rate) => rate.to_string(),
        Service::Recorded(trace) => format!("a recorded line of {:.3} Mbit/s on average", trace.mean_rate() / 1e6),
    };
    format!("queue ({}{discipline}) before {service}{}", limit(bottleneck.limit), framing(bottleneck.framing))
}

fn limit(limit: Option<QueueLimit>) -> String {
    match limit {
        None => "unlimited".into(),
        Some(QueueLimit::Packets(packets)) => Counted(packets, "packet").to_string(),
        Some(QueueLimit::Bytes(bytes)) => bytes.to_string(),
        Some(QueueLimit::Time(wait)) => Span(wait).to_string(),
    }
}

fn framing(framing: Framing) -> String {
    let overhead = if framing.overhead == 0 { String::new() } else { format!(", {:+} bytes a packet", framing.overhead) };
    let cells = framing.cells.map_or_else(String::new, |cells| format!(", in cells of {}+{} bytes", cells.payload, cells.overhead));
    overhead + &cells
}

fn describe_slots(slots: &Slots) -> String {
    let gap = match slots.gap() {
        SlotGap::Between { min, max } if min == max => format!("every {}", Span(*min)),
        SlotGap::Between { min, max } => format!("every {} to {}", Span(*min), Span(*max)),
        SlotGap::Drawn(gap) => format!("every {}", mean_and_jitter(gap)),
    };
    let packets = slots.packets.map(|packets| Counted(packets.get(), "packet").to_string());
    let bytes = slots.bytes.map(|bytes| Counted(bytes.get(), "byte").to_string());
    let share: Vec<String> = [packets, bytes].into_iter().flatten().collect();
    format!("slots {gap}{}", if share.is_empty() { String::new() } else { format!(" for {}", share.join(" or ")) })
}

fn describe_reorder(reorder: &Reorder) -> String {
    let packets = chance(reorder.packets);
    match reorder.how {
        Displacement::Jump { gap } if gap.get() == 1 => format!("{packets} jump ahead"),
        Displacement::Jump { gap } => format!("{packets} of every {gap}th packet jump ahead"),
        Displacement::Behind { packets: count, at_most } => format!("{packets} held until {count} have passed, at most {}", Span(at_most)),
        Displacement::Later { by } => format!("{packets} later by {}", Span(by)),
    }
}

fn describe_delay(delay: &Delay) -> String {
    format!("delay {}", mean_and_jitter(delay))
}

fn mean_and_jitter(delay: &Delay) -> String {
    let mean = Span(delay.mean());
    let Some(Jitter { sd, distribution, floor, correlation }) = delay.jitter() else { return mean.to_string() };
    let floor = if *floor == Duration::ZERO { String::new() } else { format!(", never below {}", Span(*floor)) };
    let memory = match correlation {
        Correlation::None => String::new(),
        Correlation::PerPacket(correlation) => format!(", correlation {correlation} from packet to packet"),
        Correlation::InTime(time) => format!(", correlated over {}", Span(*time)),
    };
    format!("{mean}, {} jitter of {}{floor}{memory}", law(distribution), Span(*sd))
}

const fn law(distribution: &Distribution) -> &'static str {
    match distribution {
        Distribution::Normal => "normal",
        Distribution::Uniform => "uniform",
        Distribution::Pareto => "Pareto",
        Distribution::ParetoNormal => "Pareto-normal",
        Distribution::LogNormal => "lognormal",
        Distribution::Gamma => "gamma",
        Distribution::Weibull => "Weibull",
        Distribution::Laplace => "Laplace",
        Distribution::Empirical(_) => "measured",
        Distribution::Table(_) => "tabulated",
    }
}

fn sojourn(sojourn: Sojourn) -> String {
    let law = match sojourn {
        Sojourn::Fixed(_) => "always",
        Sojourn::Exponential(_) => "exponential,",
        Sojourn::Uniform(..) => "uniform,",
        Sojourn::Erlang(..) => "Erlang,",
    };
    format!("{law} {}", Span(sojourn.mean()))
}

/// How often it happens: `1%`, or with the correlation from one packet to the next.
fn chance(chance: Chance) -> String {
    let often = percent(Probability::get(chance.probability()));
    if chance.correlation() == 0.0 { often } else { format!("{often} (correlation {})", chance.correlation()) }
}

/// A fraction as a percentage, to six places.
fn percent(fraction: f64) -> String {
    format!("{}%", (fraction * 1e8).round() / 1e6)
}

#[cfg(test)]
mod tests {
    use cohaptic_scene::Scene;
    use std::path::Path;

    use super::*;

    fn described(keys: &str) -> String {
        let text = format!(
            "modulators = [{{ name = \"cell\", states = [{{ name = \"a\", sojourn = \"2s\" }}, {{ name = \"b\", sojourn = {{ fixed = \"1s\" }} }}] }}]\n\
             scene = {{ duration = \"1s\", count = 2 }}\nobject.mass = 1\npeer.contact = \"none\"\npeer.device.mass = 1\n\
             coordination = {{ strategy = \"average-position\", stiffness = 1, update = \"8ms\" }}\n[link]\n{keys}"
        );
        let scene = Scene::parse(&text, Path::new("x.toml"), &[]).unwrap_or_else(|error| panic!("{error}"));
        describe_link(scene.links.between(0, 1))
    }

    #[test]
    fn every_stage_is_described_with_its_numbers() {
        for (keys, expected) in [
            ("mtu = \"100B\"", "packets of at most 100B, then delay 0s"),
            ("outage.random = { up = \"30s\", down = { fixed = \"1s\" } }", "random outages (up exponential, 30s, down always 1s), then delay 0s"),
            ("outage.idle = { after = \"10s\", down = \"2s\" }", "an outage of 2s after 10s without a packet, then delay 0s"),
            ("loss.correlated = { probability = \"5%\", correlation = 0.5 }", "loss of 5% (correlation 0.5), then delay 0s"),
            (
                "loss.gilbert-elliott = { mean-good = \"160ms\", mean-bad = \"40ms\" }",
                "Gilbert-Elliott loss in time (good 160ms, bad 40ms), 20% on average, then delay 0s",
            ),
            ("loss = \"1%\"\nmark-instead-of-loss = true", "independent loss 1% (marked, not lost), then delay 0s"),
            ("loss = { packets = [0], every = 10 }", "loss of chosen packets, 10% on average, then delay 0s"),
            ("duplicate = 0.25", "25% sent twice, then delay 0s"),
            (
                "corrupt = { probability = \"1%\", bits = 3, bytes = \"8-15\", checksum = \"passes\" }",
                "3 bits flipped in 1%, bytes 8 to 15 (handed over), then delay 0s",
            ),
            ("limit = \"9 packets\"", "at most 9 packets inside, then delay 0s"),
            (
                "token-bucket = { rate = \"1Mbit\", burst = \"10kB\", limit = \"50ms\" }",
                "queue (50ms) before a token bucket of 10000B at 1Mbit, then delay 0s",
            ),
            (
                "rate = \"1Mbit\"\noverhead = \"-14B\"\ncells.payload = \"48B\"\nqueue = { limit = \"9 packets\", discipline = \"codel\" }",
                "queue (9 packets, CoDel 5ms in 100ms) before 1Mbit, -14 bytes a packet, in cells of 48+0 bytes, then delay 0s",
            ),
            ("slots = { min = \"10ms\", packets = 2 }", "slots every 10ms for 2 packets, then delay 0s"),
            ("reorder = { probability = \"5%\", behind = 1, at-most = \"50ms\" }", "5% held until 1 have passed, at most 50ms, then delay 0s"),
            (
                "delay = \"24ms\"\njitter = { sd = \"2ms\", distribution = \"gamma\", floor = \"20ms\", correlation-time = \"1s\" }",
                "delay 24ms, gamma jitter of 2ms, never below 20ms, correlated over 1s",
            ),
            ("netem = \"delay 20ms\"", "delay 20ms (rate and slots behind the delay, as in netem)"),
            ("netem = \"delay 20ms\"\nnetem-profile = \"kernel-6.6\"", "netem of Linux 6.6, to the bit: delay 20ms"),
            (
                "modulated = { by = \"cell\", b = { delay = \"9ms\" } }",
                "as \"cell\" goes; state 1 (exponential, 2s): delay 0s; state 2 (always 1s): delay 9ms",
            ),
        ] {
            assert_eq!(described(keys), expected);
        }
    }
}
