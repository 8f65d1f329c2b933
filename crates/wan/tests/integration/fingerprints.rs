//! A fingerprint of what each stage, each law and each kind of link does to 2,000 packets, kept in `fingerprints.txt`.
//!
//! A change of one is a change of recorded results. If it is meant, write them anew, and say in the commit why:
//!
//! ```text
//! COHAPTIC_WRITE_FINGERPRINTS=1 cargo test -p cohaptic-wan --test integration fingerprints
//! ```

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_units::{Bytes, Ecn, Instant};
use cohaptic_wan::netem::Netem;
use cohaptic_wan::{
    Between, Bottleneck, Bursts, Cells, Chance, Checksum, CoDel, Correlation, Corruption, CrossTraffic, Delay, DeliveryTrace, Discipline,
    Displacement, DualPi2, FateLog, FateRow, Flips, FourState, FqCoDel, Framing, GilbertElliott, GilbertElliottInTime, IdleOutages, Jitter,
    KernelNetem, Layout, LinkConfig, LinkModel, LinkName, Loss, Modulated, Modulator, OnOff, Order, Outage, Outages, PacketInfo, PathTrace, Pattern,
    Peak, Pie, Poisson, QueueLimit, RandomOutages, Red, Reorder, Service, Slots, Sojourn, TokenBucket,
};

use crate::any_link::{JITTERS, KERNEL_WORDS, all_events, micros};
use crate::random_links::{probability, rate};

/// FNV-1a, 64 bits.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// 2,000 packets of 40 to 1,439 bytes, 100 µs to 700 µs apart: about 15 Mbit/s.
fn traffic() -> Vec<(Duration, PacketInfo)> {
    (0..2_000)
        .map(|n: u64| {
            (
                micros(100 * (1 + n % 7)),
                PacketInfo { size: Bytes::new(40 + n * 37 % 1_400), ecn: if n.is_multiple_of(2) { Ecn::Capable0 } else { Ecn::NotCapable } },
            )
        })
        .collect()
}

fn fingerprint(model: LinkModel) -> u64 {
    let log = FateLog::new(all_events(model, &traffic()).iter().map(|event| event.record)).unwrap();
    let rows: Vec<String> = log.records().iter().map(|record| format!("{}\n", FateRow(*record))).collect();
    hash(rows.concat().as_bytes())
}

/// Every stage, law and kind, by name.
fn models() -> Vec<(String, LinkModel)> {
    let p = probability;
    let bytes = Bytes::new;
    let base = || LinkConfig { delay: Delay::constant(Duration::from_millis(5)), ..LinkConfig::default() };
    let mut models: Vec<(String, LinkModel)> = Vec::new();
    let mut add = |name: &str, config: LinkConfig| models.push((name.into(), config.into()));
    let chance = Chance::correlated(p(0.1), 0.3).unwrap();
    let sojourn = Sojourn::Erlang(Duration::from_millis(20), 3);

    add("constant delay", base());
    add("mtu", LinkConfig { mtu: Some(bytes(1_000)), ..base() });
    let outages = || Outages::new(vec![Outage { from: Instant::from_nanos(100_000_000), to: Instant::from_nanos(200_000_000) }]).unwrap();
    add("scheduled outages", LinkConfig { outages: outages(), ..base() });
    for (name, up) in [
        ("fixed", Sojourn::Fixed(Duration::from_millis(30))),
        ("exponential", Sojourn::Exponential(Duration::from_millis(30))),
        ("uniform", Sojourn::Uniform(Duration::from_millis(5), Duration::from_millis(30))),
        ("erlang", sojourn),
    ] {
        add(
            &format!("random outages, {name}"),
            LinkConfig { outages: outages().with_random(RandomOutages { up, down: sojourn }).unwrap(), ..base() },
        );
    }
    add(
        "idle outages",
        LinkConfig { outages: Outages::default().with_idle(IdleOutages { after: micros(650), down: micros(900) }).unwrap(), ..base() },
    );
    let losses = [
        ("independent", Loss::Independent(p(0.1))),
        ("correlated", Loss::Correlated(chance)),
        ("gilbert-elliott", Loss::GilbertElliott(GilbertElliott { p: p(0.05), r: p(0.3), h: p(0.1), k: p(0.99) })),
        (
            "in time",
            Loss::GilbertElliottInTime(GilbertElliottInTime::new(Duration::from_millis(20), Duration::from_millis(4), p(0.1), p(0.99)).unwrap()),
        ),
        ("four states", Loss::FourState(FourState::new(p(0.05), p(0.3), p(0.2), p(0.4), p(0.02)).unwrap())),
        (
            "four states by bursts",
            Loss::FourState(FourState::from_bursts(Bursts { loss: 0.05, length: 10.0, density: 0.8, isolated: 0.005, good_run: 3.0 }).unwrap()),
        ),
        ("pattern of packets", Loss::Pattern(Pattern::of_packets(vec![3..5, 9..10], Some(20)).unwrap())),
        (
            "pattern in time",
            Loss::Pattern(Pattern::in_time(&[Instant::ZERO..Instant::from_nanos(3_000_000)], Some(Duration::from_millis(31))).unwrap()),
        ),
    ];
    for (name, loss) in losses {
        add(&format!("loss, {name}"), LinkConfig { loss, ..base() });
    }
    add("marks instead of loss", LinkConfig { loss: Loss::Independent(p(0.2)), marks_instead_of_loss: true, ..base() });
    add("duplication", LinkConfig { duplication: chance, ..base() });
    for (name, bits) in [("bits", Flips::Bits { packets: chance, count: 3 }), ("rate", Flips::Rate(p(1e-4)))] {
        for checksum in [Checksum::Discards, Checksum::Passes] {
            let corruption = Some(Corruption { bits, within: Some(8..400), checksum });
            add(&format!("corruption, {name}, {checksum:?}"), LinkConfig { corruption, ..base() });
        }
    }
    add("limit", LinkConfig { limit: Some(10), ..base() });

    let cells = Framing { overhead: 28, cells: Some(Cells { payload: 48.try_into().unwrap(), overhead: 5 }) };
    let bucket = TokenBucket { rate: rate(12_000_000), burst: bytes(4_000), peak: None, framing: Framing::default(), limit: None };
    let peak = Some(Peak { rate: rate(30_000_000), burst: bytes(1_600) });
    add("token bucket", LinkConfig { token_bucket: Some(bucket), ..base() });
    add("token bucket, peak", LinkConfig { token_bucket: Some(TokenBucket { peak, limit: Some(QueueLimit::Packets(20)), ..bucket }), ..base() });
    add(
        "token bucket, cells",
        LinkConfig {
            token_bucket: Some(TokenBucket { framing: cells, limit: Some(QueueLimit::Time(Duration::from_millis(9))), ..bucket }),
            ..base()
        },
    );

    let line = Bottleneck { limit: Some(QueueLimit::Packets(30)), ..Bottleneck::at_rate(rate(12_000_000)) };
    let red = |ecn| Discipline::Red(Red::new(bytes(4_000), bytes(14_000), p(0.1), 0.02, bytes(700), ecn).unwrap());
    let codel = |ecn| Discipline::CoDel(CoDel { target: Duration::from_millis(2), interval: Duration::from_millis(20), mtu: bytes(1_500), ecn });
    for (name, limit) in
        [("packets", QueueLimit::Packets(20)), ("bytes", QueueLimit::Bytes(bytes(15_000))), ("time", QueueLimit::Time(Duration::from_millis(9)))]
    {
        add(&format!("bottleneck, limit in {name}"), LinkConfig { bottleneck: Some(Bottleneck { limit: Some(limit), ..line.clone() }), ..base() });
    }
    let fq_codel = Discipline::FqCoDel(FqCoDel { quantum: 700.try_into().unwrap(), ..FqCoDel::default() });
    let pie = Discipline::Pie(Pie { target: Duration::from_millis(2), burst: Duration::ZERO, mtu: bytes(500), ecn: true });
    for (name, discipline) in [
        ("head drop", Discipline::HeadDrop),
        ("red", red(false)),
        ("red, ecn", red(true)),
        ("codel", codel(false)),
        ("codel, ecn", codel(true)),
        ("fq-codel", fq_codel),
        ("pie, ecn", pie),
        ("dualpi2", Discipline::DualPi2(DualPi2 { target: Duration::from_millis(2), tupdate: Duration::from_millis(3), ..DualPi2::default() })),
    ] {
        add(&format!("bottleneck, {name}"), LinkConfig { bottleneck: Some(Bottleneck { discipline, ..line.clone() }), ..base() });
    }
    for (name, framing) in [("cells", cells), ("negative overhead", Framing { overhead: -100, cells: None })] {
        add(&format!("bottleneck, {name}"), LinkConfig { bottleneck: Some(Bottleneck { framing, ..line.clone() }), ..base() });
    }
    let service = Service::Recorded(DeliveryTrace::parse("1\n1\n2\n5\n", cohaptic_wan::MAHIMAHI_BYTES).unwrap());
    add("bottleneck, recorded", LinkConfig { bottleneck: Some(Bottleneck { service, ..line.clone() }), ..base() });
    let poisson = CrossTraffic::poisson(Poisson { rate: rate(4_000_000), size: bytes(1_500) }).unwrap();
    let ten = Duration::from_millis(10);
    let on_off = OnOff { sources: 3, peak: rate(4_000_000), size: bytes(500), on: ten, off: ten, shape: 1.4 };
    for (name, cross_traffic) in [("poisson", poisson), ("on-off", CrossTraffic::on_off(on_off).unwrap())] {
        for (beside, discipline) in
            [("tail drop", Discipline::TailDrop), ("head drop", Discipline::HeadDrop), ("red", red(true)), ("codel", codel(false))]
        {
            let bottleneck = Some(Bottleneck { discipline, ..line.clone() });
            add(&format!("cross-traffic, {name}, {beside}"), LinkConfig { bottleneck, cross_traffic: Some(cross_traffic.clone()), ..base() });
        }
    }

    let mut slots = Slots::new(Duration::from_millis(1), Duration::from_millis(8)).unwrap();
    add("slots", LinkConfig { slots: Some(slots.clone()), ..base() });
    (slots.packets, slots.bytes) = (7.try_into().ok(), 5_000.try_into().ok());
    add("slots, shares", LinkConfig { slots: Some(slots.clone()), ..base() });
    for (name, how) in [
        ("jump", Displacement::Jump { gap: 5.try_into().unwrap() }),
        ("behind", Displacement::Behind { packets: 3.try_into().unwrap(), at_most: micros(900) }),
        ("later", Displacement::Later { by: Duration::from_millis(2) }),
    ] {
        add(&format!("reorder, {name}"), LinkConfig { reorder: Some(Reorder { packets: chance, how }), ..base() });
    }
    let recording = "t,delay,loss\n0,0.020,0\n0.1,0.040,0.1\n0.2,,\n0.22,0.010,0\n0.3,0.03,0\n";
    for (name, between) in [("steps", Between::Steps), ("lines", Between::Lines)] {
        add(&format!("path trace, {name}"), LinkConfig { trace: Some(PathTrace::parse(recording, between, true).unwrap()), ..base() });
    }
    for delay in JITTERS.iter().step_by(2) {
        let jitter = delay.jitter().unwrap();
        let law = match &jitter.distribution {
            cohaptic_wan::Distribution::Empirical(_) => "Empirical".to_owned(),
            cohaptic_wan::Distribution::Table(_) => "Table".to_owned(),
            other => format!("{other:?}"),
        };
        let memory = match jitter.correlation {
            Correlation::PerPacket(_) => "correlated by packet",
            Correlation::InTime(_) => "correlated in time",
            Correlation::PartlyInTime { .. } => "partly correlated in time",
            _ => "independent",
        };
        add(&format!("jitter, {law}, {memory}"), LinkConfig { delay: delay.clone(), ..LinkConfig::default() });
    }
    let wide = Jitter::new(Duration::from_millis(1), cohaptic_wan::Distribution::Normal);
    let jittery = LinkConfig { delay: Delay::with_jitter(Duration::from_millis(5), wide).unwrap(), ..base() };
    add("in any order", jittery.clone());
    add("in order", LinkConfig { order: Order::InOrder, ..jittery.clone() });
    let all = LinkConfig {
        outages: outages(),
        loss: Loss::Correlated(chance),
        duplication: chance,
        corruption: Some(Corruption { bits: Flips::Rate(p(1e-5)), within: None, checksum: Checksum::Passes }),
        limit: Some(60),
        token_bucket: Some(TokenBucket { peak, ..bucket }),
        bottleneck: Some(Bottleneck { discipline: codel(true), ..line }),
        slots: Some(slots),
        reorder: Some(Reorder { packets: chance, how: Displacement::Later { by: micros(700) } }),
        ..jittery
    };
    add("all stages, physical", all.clone());
    add("all stages, as in netem", LinkConfig { layout: Layout::Netem, ..all.clone() });

    let modulator = Modulator::from_rates("cell", &[vec![0.0, 50.0, 10.0], vec![60.0, 0.0, 40.0], vec![90.0, 5.0, 0.0]]).unwrap();
    let states = vec![base(), all.clone(), LinkConfig { loss: Loss::Independent(p(0.5)), ..base() }];
    models.push(("modulated".into(), Modulated::new(modulator, states).unwrap().into()));
    let log = FateLog::new(all_events(all, &traffic()[..1_000]).iter().map(|event| event.record)).unwrap();
    models.push(("replay".into(), LinkModel::Replay(Arc::new(log))));
    for words in KERNEL_WORDS {
        let netem = Netem::parse(words).unwrap();
        let exact = netem.to_link_config(&mut |_| None);
        models.extend(exact.map(|config| (format!("exact: {words}"), config.into())));
        models.push((format!("kernel: {words}"), KernelNetem::new(netem, Vec::new()).unwrap().into()));
    }
    models
}

#[test]
fn fingerprints_are_those_recorded() {
    assert_eq!(hash(b"foobar"), 0x8594_4171_f739_67e8, "FNV-1a as published");
    assert_eq!(LinkName::between("left", "right").as_str(), "left->right");
    let text: String = models().into_iter().map(|(name, model)| format!("{:016x} {name}\n", fingerprint(model))).collect();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/integration/fingerprints.txt");
    if std::env::var_os("COHAPTIC_WRITE_FINGERPRINTS").is_some() {
        std::fs::write(&file, &text).unwrap();
    }
    let recorded = std::fs::read_to_string(&file).unwrap().replace("\r\n", "\n");
    let changed: Vec<(&str, &str)> = recorded.lines().zip(text.lines()).filter(|(before, now)| before != now).collect();
    assert!(recorded == text, "recorded and found: {changed:#?}\nIf it is meant: COHAPTIC_WRITE_FINGERPRINTS=1, and read the head of this file");
    // No two models do the same, so that each is really there.
    let distinct: std::collections::BTreeSet<&str> = text.lines().map(|line| &line[..16]).collect();
    assert_eq!(distinct.len(), text.lines().count());
}
