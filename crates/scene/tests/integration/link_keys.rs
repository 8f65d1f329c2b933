//! Keys of a link: from the text of a scene to the configuration of the emulator.

use core::num::{NonZeroU32, NonZeroU64};
use core::time::Duration;
use std::path::Path;
use std::sync::Arc;

use cohaptic_scene::{ChangeKind, Scene};
use cohaptic_units::{Bytes, Instant, Probability, Rate};
use cohaptic_wan::law::DistTable;
use cohaptic_wan::{
    Between, Bottleneck, Bursts, Cells, Chance, Checksum, CoDel, Correlation, Corruption, CrossRecording, CrossTraffic, Delay, DeliveryTrace,
    Discipline, Displacement, Distribution, DualPi2, FateLog, Flips, FourState, FqCoDel, Framing, GilbertElliottInTime, IdleOutages, Jitter,
    LinkConfig, LinkModel, Loss, MAHIMAHI_BYTES, Modulator, ModulatorState, OnOff, Outage, Outages, PathTrace, Pattern, Peak, Pie, Poisson,
    QueueLimit, RandomOutages, Red, Reorder, Service, Slots, Sojourn, TokenBucket,
};

const MS: Duration = Duration::from_millis(1);

/// Scene of two peers, to which the keys of the link are appended.
pub(crate) const SCENE: &str = "scene = { duration = \"9s\", count = 2 }\nobject.mass = 1\npeer = { contact = \"none\", device.mass = 1 }\n\
                     coordination = { strategy = \"average-position\", stiffness = 1, update = \"8ms\" }\n";

/// Returns the path of the scene. Keys of the tests name files in the same folder.
pub(crate) fn path() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/integration/data/links.toml"))
}

fn scene(text: &str, overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(&format!("{SCENE}{text}"), path(), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

fn model(keys: &str) -> LinkModel {
    scene(&format!("[link]\n{keys}"), &[]).links.between(0, 1).clone()
}

fn config(keys: &str) -> LinkConfig {
    model(keys).as_fixed().unwrap().clone()
}

/// Returns the message with which a scene is refused, without the folders in paths.
pub(crate) fn refused(text: &str, overrides: &[&str]) -> String {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let error = Scene::parse(&format!("{SCENE}{text}"), path(), &overrides).expect_err(text).to_string();
    let folder = path().parent().unwrap().display().to_string();
    error.replace(&format!("{folder}/"), "")
}

fn p(value: f64) -> Probability {
    Probability::new(value).unwrap()
}

fn at(millis: u64) -> Instant {
    Instant::from_nanos(millis * 1_000_000)
}

fn data(name: &str) -> String {
    std::fs::read_to_string(path().with_file_name(name)).unwrap()
}

#[test]
fn every_law_and_memory_of_jitter_is_read() {
    let jitter = |keys: &str| config(&format!("delay = \"24ms\"\njitter = {keys}")).delay.jitter().unwrap().clone();
    for (name, law) in [
        ("normal", Distribution::Normal),
        ("uniform", Distribution::Uniform),
        ("pareto", Distribution::Pareto),
        ("paretonormal", Distribution::ParetoNormal),
        ("lognormal", Distribution::LogNormal),
        ("gamma", Distribution::Gamma),
        ("weibull", Distribution::Weibull),
        ("laplace", Distribution::Laplace),
    ] {
        assert_eq!(jitter(&format!("{{ sd = \"2ms\", distribution = \"{name}\" }}")), Jitter::new(2 * MS, law));
    }
    let remembering = |correlation| Jitter { floor: 20 * MS, correlation, ..Jitter::new(2 * MS, Distribution::Gamma) };
    let text = |key| format!("{{ sd = \"2ms\", distribution = \"gamma\", floor = \"20ms\", {key} }}");
    assert_eq!(jitter(&text("correlation = 0.25")), remembering(Correlation::PerPacket(0.25)));
    assert_eq!(jitter(&text("correlation-time = \"50ms\"")), remembering(Correlation::InTime(50 * MS)));
    let partly = remembering(Correlation::PartlyInTime { time: 50 * MS, share: 0.6 });
    assert_eq!(jitter(&text("correlation-time = \"50ms\", correlation-share = 0.6")), partly);
    assert_eq!(jitter(&text("correlation-time = \"50ms\", correlation-share = 1")), remembering(Correlation::InTime(50 * MS)));
    assert_eq!(jitter(&text("correlation = 0")), remembering(Correlation::None));
    let table = Distribution::Table(Arc::new(DistTable::parse(&data("steps.dist")).unwrap()));
    assert_eq!(jitter("{ sd = \"2ms\", distribution = { table = \"steps.dist\" } }"), Jitter::new(2 * MS, table));
}

#[test]
fn measured_delays_bring_their_own_mean_and_deviation() {
    // Quantiles 20, 22 and 30 ms, linear between: mean (21 + 26)/2 = 23.5 ms, E[x²] = (20² + 20·22 + 22² + 22² + 22·30 + 30²)/6.
    let own = config("jitter = { distribution = { empirical = \"delays.csv\" } }").delay;
    let sd = ((400.0 + 440.0 + 484.0 + 484.0 + 660.0 + 900.0) / 6.0_f64 - 23.5 * 23.5).sqrt();
    assert_eq!(own.mean(), Duration::from_micros(23_500));
    assert!((own.jitter().unwrap().sd.as_secs_f64() * 1e3 - sd).abs() < 1e-6);
    let stretched = config("delay = \"50ms\"\njitter = { sd = \"1ms\", distribution = { empirical = \"delays.csv\" } }").delay;
    assert_eq!((stretched.mean(), stretched.jitter().unwrap().sd), (50 * MS, MS));
}

#[test]
fn every_kind_of_loss_is_read() {
    let loss = |text: &str| config(&format!("loss = {text}")).loss;
    let in_time = GilbertElliottInTime::new(160 * MS, 40 * MS, p(0.5), p(0.99)).unwrap();
    assert_eq!(loss("{ gilbert-elliott = { mean-good = \"160ms\", mean-bad = \"40ms\", h = 0.5, k = 0.99 } }"), Loss::GilbertElliottInTime(in_time));
    let states = |p31, p32, p23, p14| Loss::FourState(FourState::new(p(0.01), p(p31), p(p32), p(p23), p(p14)).unwrap());
    assert_eq!(loss("{ states = { p13 = \"1%\" } }"), states(0.99, 0.0, 1.0, 0.0));
    assert_eq!(loss("{ states = { p13 = 0.01, p31 = 0.3, p32 = 0.2, p23 = 0.5, p14 = 0.02 } }"), states(0.3, 0.2, 0.5, 0.02));
    let bursts = Bursts { loss: 0.04, length: 5.0, density: 0.8, isolated: 0.005, good_run: 1.25 };
    assert_eq!(
        loss("{ bursts = { loss = \"4%\", length = 5, density = 0.8, isolated = \"0.5%\", good-run = 1.25 } }"),
        Loss::FourState(FourState::from_bursts(bursts).unwrap())
    );
    let plain = Bursts { loss: 0.02, length: 5.0, density: 1.0, isolated: 0.0, good_run: 1.0 };
    assert_eq!(loss("{ bursts = { loss = 0.02, length = 5 } }"), Loss::FourState(FourState::from_bursts(plain).unwrap()));
    assert_eq!(loss("{ correlated = { probability = \"5%\", correlation = 0.5 } }"), Loss::Correlated(Chance::correlated(p(0.05), 0.5).unwrap()));
    assert_eq!(loss("{ packets = [3, \"10-19\"], every = 100 }"), Loss::Pattern(Pattern::of_packets(vec![3..4, 10..20], Some(100)).unwrap()));
    assert_eq!(loss("{ packets = [3, 5] }"), Loss::Pattern(Pattern::of_packets(vec![3..4, 5..6], None).unwrap()));
    assert_eq!(
        loss("{ times = [{ from = \"100ms\", to = \"200ms\" }], every = \"1s\" }"),
        Loss::Pattern(Pattern::in_time(&[at(100)..at(200)], Some(1000 * MS)).unwrap())
    );
    assert!(config("loss = 0.1\nmark-instead-of-loss = true").marks_instead_of_loss);
}

#[test]
fn copies_damage_and_disorder_are_read() {
    let half = Chance::correlated(p(0.5), 0.25).unwrap();
    let table = "probability = 0.5, correlation = 0.25";
    assert_eq!(config("duplicate = \"1%\"").duplication, Chance::independent(p(0.01)));
    assert_eq!(config(&format!("duplicate = {{ {table} }}")).duplication, half);

    let corrupt = |text: &str| config(&format!("corrupt = {text}")).corruption;
    let whole = |bits| Corruption { bits, within: None, checksum: Checksum::Discards };
    assert_eq!(corrupt("0.01"), Some(whole(Flips::Bits { packets: Chance::independent(p(0.01)), count: 1 })));
    assert_eq!(corrupt(&format!("{{ {table}, bits = 3 }}")), Some(whole(Flips::Bits { packets: half, count: 3 })));
    let hit = Corruption { within: Some(8..16), checksum: Checksum::Passes, ..whole(Flips::Rate(p(1e-6))) };
    assert_eq!(corrupt("{ bit-error-rate = 1e-6, bytes = \"8-15\", checksum = \"passes\" }"), Some(hit));
    assert_eq!((corrupt("0"), corrupt("{ bit-error-rate = 0, checksum = \"discards\" }")), (None, None));

    let reorder = |text: &str| config(&format!("reorder = {text}")).reorder;
    let count = |count| NonZeroU32::new(count).unwrap();
    let how = |how| Some(Reorder { packets: half, how });
    assert_eq!(reorder("\"25%\""), Some(Reorder { packets: Chance::independent(p(0.25)), how: Displacement::Jump { gap: count(1) } }));
    assert_eq!(reorder(&format!("{{ {table}, gap = 5 }}")), how(Displacement::Jump { gap: count(5) }));
    assert_eq!(reorder(&format!("{{ {table}, behind = 2, at-most = \"50ms\" }}")), how(Displacement::Behind { packets: count(2), at_most: 50 * MS }));
    assert_eq!(reorder(&format!("{{ {table}, later = \"10ms\" }}")), how(Displacement::Later { by: 10 * MS }));
    assert_eq!(reorder("0"), None);
}

#[test]
fn lines_queues_and_limits_are_read() {
    let mbit = Rate::bits_per_sec(1_000_000).unwrap();
    let line = |limit, discipline| Some(Bottleneck { limit, discipline, ..Bottleneck::at_rate(mbit) });
    let queue = |text: &str| config(&format!("rate = \"1Mbit\"\nqueue = {text}")).bottleneck;
    assert_eq!(queue("{ limit = \"50ms\", discipline = \"head-drop\" }"), line(Some(QueueLimit::Time(50 * MS)), Discipline::HeadDrop));
    assert_eq!(queue("{ limit = \"unlimited\", discipline = \"codel\" }"), line(None, Discipline::CoDel(CoDel::default())));
    let codel = CoDel { target: 2 * MS, interval: 30 * MS, mtu: Bytes::new(100), ecn: true };
    assert_eq!(
        queue("{ limit = \"9 packets\", discipline.codel = { target = \"2ms\", interval = \"30ms\", mtu = \"100B\", ecn = true } }"),
        line(Some(QueueLimit::Packets(9)), Discipline::CoDel(codel))
    );
    let packets = Some(QueueLimit::Packets(10_240));
    assert_eq!(queue("{ limit = \"10240 packets\", discipline = \"fq-codel\" }"), line(packets, Discipline::FqCoDel(FqCoDel::default())));
    let table = "target = \"2ms\", interval = \"30ms\", mtu = \"100B\", ecn = true, quantum = \"300B\", flows = 16";
    let fq_codel = FqCoDel { codel, quantum: 300.try_into().unwrap(), flows: 16.try_into().unwrap() };
    assert_eq!(queue(&format!("{{ limit = \"10240 packets\", discipline.fq-codel = {{ {table} }} }}")), line(packets, Discipline::FqCoDel(fq_codel)));
    assert_eq!(queue("{ limit = \"10240 packets\", discipline = \"pie\" }"), line(packets, Discipline::Pie(Pie::default())));
    let pie = Pie { target: 2 * MS, burst: 30 * MS, mtu: Bytes::new(100), ecn: true };
    assert_eq!(
        queue("{ limit = \"10240 packets\", discipline.pie = { target = \"2ms\", burst = \"30ms\", mtu = \"100B\", ecn = true } }"),
        line(packets, Discipline::Pie(pie))
    );
    assert_eq!(queue("{ limit = \"10240 packets\", discipline = \"dualpi2\" }"), line(packets, Discipline::DualPi2(DualPi2::default())));
    let table =
        "target = \"2ms\", tupdate = \"3ms\", alpha = 0.5, beta = 4, coupling-factor = 3, step-thresh = \"0ms\", classic-protection = \"20%\"";
    let dualpi2 = DualPi2 {
        target: 2 * MS,
        tupdate: 3 * MS,
        alpha: 0.5,
        beta: 4.0,
        coupling_factor: 3.try_into().unwrap(),
        step_thresh: Duration::ZERO,
        classic_protection: p(0.2),
    };
    assert_eq!(queue(&format!("{{ limit = \"10240 packets\", discipline.dualpi2 = {{ {table} }} }}")), line(packets, Discipline::DualPi2(dualpi2)));
    for (key, said) in [
        ("coupling-factor = 0", "coupling-factor: 0 is out of range: expected an integer from 1 to 255"),
        ("beta = -1", "beta: -1 is out of range: expected a number of at least zero [Hz]"),
    ] {
        let error = refused(&format!("link = {{ rate = \"1Mbit\", queue = {{ limit = \"9 packets\", discipline.dualpi2 = {{ {key} }} }} }}"), &[]);
        assert!(error.contains(said), "{error}");
    }
    for (key, said) in [
        ("quantum = \"0B\"", "quantum: a queue cannot send 0B in its turn: expected a size from 1B to 4294967295B"),
        ("flows = 0", "flows: 0 is out of range: expected an integer from 1 to 65536"),
    ] {
        let error = refused(&format!("link = {{ rate = \"1Mbit\", queue = {{ limit = \"9 packets\", discipline.fq-codel = {{ {key} }} }} }}"), &[]);
        assert!(error.contains(said), "{error}");
    }
    let red = |min, max, most, weight, packet, ecn| {
        Discipline::Red(Red::new(Bytes::new(min), Bytes::new(max), p(most), weight, Bytes::new(packet), ecn).unwrap())
    };
    let bytes = |bytes| Some(QueueLimit::Bytes(Bytes::new(bytes)));
    assert_eq!(queue("{ limit = \"60kB\", discipline = \"red\" }"), line(bytes(60_000), red(10_000, 30_000, 0.1, 0.002, 500, false)));
    assert_eq!(
        queue(
            "{ limit = \"9kB\", discipline.red = { min = \"1kB\", max = \"3kB\", max-probability = 0.2, weight = 0.1, mean-packet = \"64B\", ecn = true } }"
        ),
        line(bytes(9_000), red(1_000, 3_000, 0.2, 0.1, 64, true))
    );
    let cells = Cells { payload: NonZeroU32::new(48).unwrap(), overhead: 5 };
    let framed = config("rate = \"1Mbit\"\noverhead = \"-14B\"\ncells = { payload = \"48B\", overhead = \"5B\" }").bottleneck.unwrap();
    assert_eq!(framed.framing, Framing { overhead: -14, cells: Some(cells) });

    let bucket = TokenBucket {
        rate: mbit,
        burst: Bytes::new(10_000),
        peak: Some(Peak { rate: Rate::bits_per_sec(2_000_000).unwrap(), burst: Bytes::new(1500) }),
        framing: Framing { overhead: 28, cells: None },
        limit: Some(QueueLimit::Packets(7)),
    };
    let text = "token-bucket = { rate = \"1Mbit\", burst = \"10kB\", peak = { rate = \"2Mbit\", burst = \"1500B\" }, limit = \"7 packets\", overhead = \"28B\" }";
    assert_eq!(config(text).token_bucket, Some(bucket));

    let mut slots = Slots::new(10 * MS, 20 * MS).unwrap();
    (slots.packets, slots.bytes) = (NonZeroU64::new(3), NonZeroU64::new(1500));
    assert_eq!(config("slots = { min = \"10ms\", max = \"20ms\", packets = 3, bytes = \"1500B\" }").slots, Some(slots));
    assert_eq!(config("slots = { min = \"10ms\" }").slots, Some(Slots::new(10 * MS, 10 * MS).unwrap()));
    let drawn = Delay::with_jitter(10 * MS, Jitter::new(MS, Distribution::Normal)).unwrap();
    assert_eq!(config("slots = { delay = \"10ms\", jitter = \"1ms\" }").slots, Some(Slots::drawn(drawn)));

    let both = config("mtu = \"1500B\"\nlimit = \"1000 packets\"");
    assert_eq!((both.mtu, both.limit), (Some(Bytes::new(1500)), Some(1000)));
}

#[test]
fn every_source_of_cross_traffic_is_read() {
    let traffic = |text: &str| config(&format!("rate = \"12Mbit\"\ncross-traffic = {text}")).cross_traffic;
    let rate = |bits| Rate::bits_per_sec(bits).unwrap();
    let poisson = |bits, size| Some(CrossTraffic::poisson(Poisson { rate: rate(bits), size: Bytes::new(size) }).unwrap());
    assert_eq!(traffic("{ poisson = { rate = \"6Mbit\" } }"), poisson(6_000_000, 1500));
    assert_eq!(traffic("{ poisson = { rate = \"6Mbit\", size = \"40B\" } }"), poisson(6_000_000, 40));
    let on_off = |size, shape| {
        let on_off = OnOff { sources: 10, peak: rate(2_000_000), size: Bytes::new(size), on: 200 * MS, off: 800 * MS, shape };
        Some(CrossTraffic::on_off(on_off).unwrap())
    };
    let keys = "sources = 10, peak = \"2Mbit\", on = \"200ms\", off = \"800ms\"";
    assert_eq!(traffic(&format!("{{ on-off = {{ {keys} }} }}")), on_off(1500, 1.5));
    assert_eq!(traffic(&format!("{{ on-off = {{ {keys}, size = \"500B\", shape = 1.2 }} }}")), on_off(500, 1.2));
    let recording = CrossRecording::parse(&data("cross.csv")).unwrap();
    assert_eq!(traffic("{ trace = \"cross.csv\" }"), Some(CrossTraffic::recorded(recording)));
    assert_eq!(traffic("\"none\""), None);
    // More than the line carries, before a queue with a limit.
    let limited = config("rate = \"1Mbit\"\nqueue.limit = \"9 packets\"\ncross-traffic.poisson.rate = \"6Mbit\"");
    assert_eq!(limited.cross_traffic, poisson(6_000_000, 1500));
    // A recorded line is a line. Inherited cross-traffic goes with the rate that is taken away.
    assert!(config("trace = \"line.trace\"\ncross-traffic = { poisson = { rate = \"1kbit\" } }").cross_traffic.is_some());
    let taken = scene(
        "[link]\nrate = \"12Mbit\"\ncross-traffic = { poisson = { rate = \"6Mbit\" } }\n[[links]]\nfrom = \"peer1\"\nto = \"peer2\"\nrate = \"unlimited\"",
        &[],
    );
    assert_eq!(taken.links.between(0, 1).as_fixed().unwrap().cross_traffic, None);
}

#[test]
fn every_kind_of_outage_is_read() {
    let s = |seconds| Duration::from_secs(seconds);
    let outage = |text: &str| config(&format!("outage = {text}")).outages;
    let random = |up, down| Outages::default().with_random(RandomOutages { up, down }).unwrap();
    assert_eq!(outage("{ random = { up = \"30s\", down = { fixed = \"1s\" } } }"), random(Sojourn::Exponential(s(30)), Sojourn::Fixed(s(1))));
    assert_eq!(
        outage("{ random = { up = { uniform = [\"1s\", \"2s\"] }, down = { erlang = { mean = \"4s\", stages = 4 } } } }"),
        random(Sojourn::Uniform(s(1), s(2)), Sojourn::Erlang(s(4), 4))
    );
    let all = Outages::new(vec![Outage { from: at(1000), to: at(2000) }])
        .unwrap()
        .with_random(RandomOutages { up: Sojourn::Exponential(s(3)), down: Sojourn::Exponential(s(1)) })
        .unwrap()
        .with_idle(IdleOutages { after: s(10), down: s(2) })
        .unwrap();
    let text = "{ scheduled = [{ from = \"1s\", to = \"2s\" }], random = { up = { exponential = \"3s\" }, down = \"1s\" }, idle = { after = \"10s\", down = \"2s\" } }";
    assert_eq!(outage(text), all);
}

#[test]
fn recordings_are_told_apart_by_their_first_line() {
    let path = |between, repeats| Some(PathTrace::parse(&data("path.csv"), between, repeats).unwrap());
    assert_eq!(config("trace = \"path.csv\"").trace, path(Between::Steps, false));
    assert_eq!(config("trace = { file = \"path.csv\", between = \"lines\", repeat = true }").trace, path(Between::Lines, true));
    // Times since 1970, less those of the first row.
    assert_eq!(config("trace = { file = \"since-1970.csv\", start = \"first\" }").trace, path(Between::Steps, false));
    assert_eq!(config("trace = { file = \"path.csv\", start = \"zero\" }").trace, path(Between::Steps, false));
    let line = |bytes| Some(Service::Recorded(DeliveryTrace::parse(&data("line.trace"), bytes).unwrap()));
    let bottleneck = config("trace = \"line.trace\"\nqueue.limit = \"9 packets\"").bottleneck.unwrap();
    assert_eq!((Some(bottleneck.service), bottleneck.limit), (line(MAHIMAHI_BYTES), Some(QueueLimit::Packets(9))));
    let service = |keys: &str| config(keys).bottleneck.map(|bottleneck| bottleneck.service);
    assert_eq!(service("trace = { file = \"line.trace\", bytes = \"1500B\" }"), line(Bytes::new(1500)));
    // A recorded path says nothing of what a line can deliver.
    assert_eq!(service("rate = \"1Mbit\"\ntrace = \"path.csv\""), Some(Service::Rate(Rate::bits_per_sec(1_000_000).unwrap())));
    let log = FateLog::parse(&data("fates.csv")).unwrap();
    assert_eq!(model("replay = \"fates.csv\""), LinkModel::Replay(Arc::new(log)));
}

#[test]
fn the_words_of_tc_are_read_for_both_profiles() {
    let words = "delay 20ms 5ms 25% distribution steps loss gemodel 1% 10%";
    let netem = cohaptic_wan::netem::Netem::parse(words).unwrap();
    let table = Arc::new(DistTable::parse(&data("steps.dist")).unwrap());
    let exact = netem.to_link_config(&mut |_| Some(Arc::clone(&table))).unwrap();
    assert_eq!(model(&format!("netem = \"{words}\"")), LinkModel::Fixed(exact));
    assert_eq!(model(&format!("netem = '{words}'\nnetem-profile = \"exact\"")), model(&format!("netem = \"{words}\"")));
    let LinkModel::Kernel(kernel) = model(&format!("netem = \"{words}\"\nnetem-profile = \"kernel-6.6\"")) else { panic!("the kernel's") };
    assert_eq!(*kernel.words(), netem);
}

pub(crate) const CELL: &str = "[[modulators]]\nname = \"cell\"\nstates = [{ name = \"good\", sojourn = \"2s\", next = { bad = 1, worse = 3 } }, \
                    { name = \"bad\", sojourn = { fixed = \"1s\" } }, { name = \"worse\", next = \"good\", sojourn = \"1s\" }]\n";

#[test]
fn a_modulated_link_has_a_configuration_for_each_state() {
    let text = "[link]\nloss = 0.5\nqueue = { limit = \"9 packets\" }\nrate = \"1Mbit\"\n\
                modulated = { by = \"cell\", bad = { delay = \"80ms\" }, worse = { loss = 1, rate = \"2Mbit\" } }\n\
                [[links]]\nfrom = \"peer2\"\nto = \"peer1\"\nmodulated = \"none\"";
    let scene = scene(&format!("{CELL}{text}"), &[]);
    let LinkModel::Modulated(modulated) = scene.links.between(0, 1) else { panic!("modulated") };
    let s = |sojourn: fn(Duration) -> Sojourn, seconds| Some(sojourn(Duration::from_secs(seconds)));
    let states = vec![
        ModulatorState { sojourn: s(Sojourn::Exponential, 2), next: vec![0.0, 1.0, 3.0] },
        ModulatorState { sojourn: s(Sojourn::Fixed, 1), next: vec![1.0, 0.0, 1.0] },
        ModulatorState { sojourn: s(Sojourn::Exponential, 1), next: vec![1.0, 0.0, 0.0] },
    ];
    assert_eq!(*modulated.modulator(), Modulator::new("cell", states).unwrap());
    let base = scene.links.between(1, 0).as_fixed().unwrap();
    let [good, bad, worse] = modulated.configs() else { panic!("three states") };
    assert_eq!(good, base);
    assert_eq!(*bad, LinkConfig { delay: Delay::constant(80 * MS), ..base.clone() });
    assert_eq!((&worse.loss, worse.bottleneck.as_ref().unwrap().limit), (&Loss::Independent(p(1.0)), Some(QueueLimit::Packets(9))));
}

#[test]
fn what_says_everything_takes_away_what_it_is_laid_over() {
    let links = "[link]\ndelay = \"24ms\"\nloss = 0.1\n[[links]]\nfrom = \"peer1\"\nto = \"peer2\"\nnetem = \"delay 5ms\"\n";
    let scene_of = |rest: &str, set: &[&str]| scene(&format!("{links}{rest}"), set);
    let there = |scene: &Scene| scene.links.between(0, 1).as_fixed().unwrap().clone();
    let five = scene_of("", &[]);
    assert_eq!((there(&five).delay, there(&five).loss), (Delay::constant(5 * MS), Loss::None));
    // And is taken away by "none".
    let none = scene_of("", &["links.peer1.peer2.netem=none"]);
    assert_eq!(none.links.between(0, 1), none.links.between(1, 0));
    let back = scene_of("[[timeline]]\nat = \"1s\"\nlink = \"all\"\nset = { netem = \"none\", delay = \"9ms\" }", &[]);
    let ChangeKind::AllLinks(links) = &back.timeline[0].what else { panic!("links") };
    assert!(links.configs().iter().all(|config| config.mean_delay() == 9 * MS && config.as_fixed().unwrap().loss == Loss::Independent(p(0.1))));
    // An override of a whole link counts as laid over it.
    let set = scene("[link]\ndelay = \"24ms\"\nloss = 0.1", &["link.replay=fates.csv"]);
    assert!(matches!(set.links.between(0, 1), LinkModel::Replay(_)));
    let rate = scene("[link]\nrate = \"1Mbit\"\n[[links]]\nfrom = \"peer1\"\nto = \"peer2\"\ntrace = \"line.trace\"", &[]);
    assert!(matches!(there(&rate).bottleneck.unwrap().service, Service::Recorded(_)));
}

#[test]
fn lines_changes_and_overrides_take_the_same_keys() {
    let peers = "[[peers]]\nname = \"peer1\"\nuplink = { duplicate = \"1%\", slots.min = \"10ms\" }\ndownlink = { netem = \"delay 1ms\" }\n";
    let with_lines = scene(peers, &[]);
    let uplink = with_lines.peers[0].uplink.as_ref().unwrap().as_fixed().unwrap();
    assert_eq!((uplink.duplication, uplink.slots.is_some()), (Chance::independent(p(0.01)), true));
    assert_eq!(with_lines.peers[0].downlink.as_ref().unwrap().mean_delay(), MS);

    let change = "[link]\ndelay = \"24ms\"\n[[timeline]]\nat = \"1s\"\nlink = \"all\"\n\
                  set = { reorder = \"5%\", corrupt = 0.1, jitter = { sd = \"1ms\", distribution = \"uniform\" }, outage.idle = { after = \"1s\", down = \"1s\" } }";
    let ChangeKind::AllLinks(links) = scene(change, &[]).timeline[0].what.clone() else { panic!("links") };
    let changed = links.between(0, 1).as_fixed().unwrap();
    assert!(changed.reorder.is_some() && changed.corruption.is_some() && changed.outages.idle().is_some());
    assert_eq!(changed.delay, Delay::with_jitter(24 * MS, Jitter::new(MS, Distribution::Uniform)).unwrap());

    let set = |text: &str| scene(CELL, &[text]).links.between(0, 1).clone();
    assert_eq!(set("link.loss.bursts={ loss = 0.02, length = 5 }"), model("loss.bursts = { loss = 0.02, length = 5 }"));
    assert_eq!(set("link.corrupt.bit-error-rate=1e-6"), model("corrupt.bit-error-rate = 1e-6"));
    assert_eq!(set("link.netem=delay 20ms"), model("netem = \"delay 20ms\""));
    assert_eq!(set("link.limit=3 packets"), model("limit = \"3 packets\""));
}

#[test]
fn modulators_can_be_changed_by_name_or_place() {
    let text = format!("link.modulated = {{ by = \"cell\" }}\n{CELL}");
    for path in ["modulators.cell.states.bad.sojourn", "modulators.0.states.1.sojourn"] {
        let scene = scene(&text, &[&format!("{path}=7s")]);
        let LinkModel::Modulated(modulated) = scene.links.between(0, 1) else { panic!("modulated") };
        assert_eq!(modulated.modulator().states()[1].sojourn, Some(Sojourn::Exponential(Duration::from_secs(7))));
    }
}
