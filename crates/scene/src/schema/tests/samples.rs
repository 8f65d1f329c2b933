//! Sample files in which every table of the catalogue occurs.

use std::path::{Path, PathBuf};

use cohaptic_linkfile::router::RouterFile;
use cohaptic_linkfile::{ExecFile, RelayFile, TcpRelayFile};

use crate::schema::FileSchema;
use crate::{Scene, SceneError, scene_files};

/// Five scenes with every table and every key that the shipped scenes leave out.
pub(super) const SCENES: [&str; 5] = [
    r#"
    scene = { duration = "4s" }
    object = { mass = 1, enclosure = { min = -1, max = 1, stiffness = 100, damping = 1 } }
    coordination = { strategy = "average-position", stiffness = 1, update = "8ms" }
    simulation = { integrator = "rk4" }
    topology = {}
    peer = { kind = "falcon", falcon = {}, inverse3 = { service = "ws://127.0.0.1:10001/", origin = [0, 0, 0], reading-age = "10ms" }, pointer = {}, silence = {}, coupling = { stiffness = 1 }, device = { mass = 1 } }
    peers = [
        { name = "a", hand = { sine = { amplitude = 1, frequency = 1 } }, clock = { offset = "1ms" }, contact = { push = "+x" } },
        { name = "b", hand = { arm = { mass = 0, damping = 1, stiffness = 1 }, follows = { sine = { amplitude = 1, frequency = 1 } } }, clock = { drift = "1ppm" } },
        { name = "c", hand = { arm = { mass = 0, damping = 1, stiffness = 1 }, follows = { position = 1 } }, uplink = { delay = "1ms" }, downlink = { loss = 0.1 } },
        { name = "d", kind = "simulated", device = { exchange-every = 4, exchange-age = 1 }, hand = { operator = { arm = { mass = 0.4 }, sees = "a" } } },
    ]
    modulators = [{ name = "cell", states = [
        { name = "good", sojourn = { fixed = "1s" }, next = { bad = 1 } },
        { name = "bad", sojourn = { erlang = { mean = "1s", stages = 2 } }, next = "good" },
    ] }]
    link = { modulated = { by = "cell", good = { delay = "1ms" }, bad = { loss = "5%" } } }
    timeline = [
        { at = "1s", link = { from = "a", to = "b" }, set = { delay = "2ms" } },
        { at = "2s", peer = "a", set = { contact = "grasp" } },
        { at = "3s", coordination = { stiffness = 2, damping = 1, send-when = { position = 0.001 } } },
        { at = "3s", coordination = { smoothed-average-position = { lag = "1ms" }, extrapolated = { horizon = "1ms" }, local-damping = { damping = 1 } } },
        { at = "3s", coordination = { local-lag = { lag = "1ms" }, passivity-control = { reserve = 1 }, set-position = { damping = 1, ceiling = 1 } } },
    ]
    [task]
    kind = "track"
    sines = [{ amplitude = 0.1, frequency = 0.5 }]
    fail = { force = 8 }
    [measure]
    names = ["energy_j", "peers.a.energy_j", "viscosity_n_s_m"]
    travel = { peer = "b", distance = 0.1, axis = "x" }
    band = 0.002
    probe = { peer = "a" }
    [expect]
    measures = [{ name = "energy_j", min = 0, max = 1 }]
    discrepancy = { max = 1 }
    task = { outcome = "done", time = { max = "4s" } }
    position = [{ peer = "a", at = "1s", min = 0 }]
    travel = [{ peer = "a", distance = 0.1, max = "1s" }]
    loss = [{ link = { uplink = "c" }, max = 1 }, { link = { from = "a", to = "b" }, max = 1 }]
    delay = [{ link = { downlink = "c" }, max = "1s" }]
    "#,
    r#"
    scene = { duration = "4s", count = 8 }
    object = { mass = 1 }
    coordination = { strategy = "average-position", stiffness = 1, update = "8ms", pull = "sum", smoothed-average-position = {}, extrapolated = {}, local-damping = { age = "1ms" }, local-lag = {}, passivity-control = {}, set-position = {}, wave = {}, client-server = {}, send-when = { velocity = "10%", position = 0.001, heartbeat = "1s" } }
    peer = { device = { mass = 1 }, contact = "none" }
    link = { rate = "1Mbit", queue = { limit = "64kB", discipline = { codel = {} } }, cells = { payload = "48B" } }
    links = [
        { from = "peer1", to = "peer2", queue = { limit = "64kB", discipline = { red = { min = "5kB", max = "15kB" } } } },
        { from = "peer4", to = "peer1", queue = { limit = "64kB", discipline = { fq-codel = { quantum = "300B" } } } },
        { from = "peer4", to = "peer2", queue = { limit = "64kB", discipline = { pie = { target = "20ms" } } } },
        { from = "peer4", to = "peer3", queue = { limit = "64kB", discipline = { dualpi2 = { coupling-factor = 1 } } } },
        { from = "peer1", to = "peer3", token-bucket = { rate = "1Mbit", burst = "9kB", peak = { rate = "2Mbit", burst = "1500B" } } },
        { from = "peer1", to = "peer4", slots = { min = "10ms" }, jitter = { sd = "1ms" }, delay = "20ms" },
        { from = "peer1", to = "peer5", outage = { random = { up = "3s", down = { uniform = ["1s", "2s"] } }, idle = { after = "1s", down = "1s" } } },
        { from = "peer1", to = "peer6", outage = [{ from = "1s", to = "2s" }], loss = { times = [{ from = "1s", to = "2s" }], every = "3s" } },
        { from = "peer1", to = "peer7", duplicate = { probability = 0.1, correlation = 0.1 }, corrupt = { probability = 0.1 } },
        { from = "peer1", to = "peer8", reorder = { probability = 0.1, behind = 1, at-most = "9ms" }, loss = { correlated = { probability = 0.1 } } },
        { from = "peer2", to = "peer1", loss = { gilbert-elliott = { p = 0.1 } } },
        { from = "peer2", to = "peer3", loss = { gilbert-elliott = { mean-good = "1s", mean-bad = "1s" } } },
        { from = "peer2", to = "peer4", loss = { states = { p13 = 0.1 } } },
        { from = "peer2", to = "peer5", loss = { bursts = { loss = 0.1, length = 5 } } },
        { from = "peer2", to = "peer6", loss = { packets = [3, "10-19"], every = 100 } },
        { from = "peer2", to = "peer7", corrupt = { bit-error-rate = 1e-6 } },
        { from = "peer2", to = "peer8", delay = "20ms", slots = { delay = "10ms", jitter = "1ms" } },
        { from = "peer3", to = "peer2", reorder = { probability = 0.1 } },
        { from = "peer3", to = "peer4", cross-traffic = { poisson = { rate = "100kbit", size = "1500B" } } },
        { from = "peer3", to = "peer5", cross-traffic = { on-off = { sources = 3, peak = "200kbit", size = "1500B", on = "1s", off = "2s", shape = 1.5 } } },
        { from = "peer3", to = "peer1", netem = "delay 1ms", netem-profile = "exact" },
    ]
    "#,
    r#"
    scene = { duration = "4s", count = 2 }
    object = { mass = 1 }
    coordination = { strategy = "average-position", stiffness = 1, update = "8ms" }
    peer = { device = { mass = 1 }, contact = "none" }
    link = { delay = "20ms", jitter = { sd = "2ms", distribution = { table = "data/two-sided.dist" } } }
    links = [{ from = "peer1", to = "peer2", trace = { file = "data/path.csv" } }, { from = "peer2", to = "peer1", trace = { file = "data/line.trace" } }]
    simulation = {}
    measure = { travel = {} }
    topology = { kind = "star", hub = "peer1", role = "peer" }
    "#,
    r#"
    scene = { duration = "4s", axes = 3 }
    object = { mass = 1, inertia = [0.01, 0.02, 0.02], rotational-damping = 0.001, angular-velocity = [0, 0, 1] }
    coordination = { strategy = "average-position", stiffness = 1, update = "8ms", rotational-stiffness = [1, 1, 1], rotational-damping = 0.1 }
    simulation = {}
    peer = { device = { mass = 1 }, coupling = { stiffness = 1 } }
    peers = [
        { name = "a", device = { inertia = 0.001 }, coupling = { rotational-stiffness = 1 }, hand = { torque = [0, 0, 0.1] } },
        { name = "b", device = { inertia = 0.001 }, coupling = { rotational-stiffness = 1 }, hand = { sine = { amplitude = [0, 0, 0], frequency = 1, torque = [0, 1, 0] } } },
        { name = "c", grasp = [0.1, 0, 0], orientation = [1, 0, 0, 0.1], angular-velocity = 0 },
    ]
    timeline = [{ at = "2s", peer = "a", set = { hand = { force = [1, 0, 0], torque = [0, 0, 0.2] } } }, { at = "3s", coordination = { rotational-stiffness = 2, rotational-damping = [0.1, 0, 0] } }]
    [expect]
    rotation-discrepancy = { max = 1 }
    orientation = [{ peer = "a", at = "1s", of = [1, 0, 0, 0], max = 3 }]
    [task]
    kind = "carry"
    level = 0.2
    gap = { peers = ["a", "b"], min = 0.01, max = 0.2 }
    targets = [[0.1, 0, 0], [0, 0, 0]]
    order = "shuffled"
    radius = 0.01
    orientations = [[1, 0, 0, 0.2], [1, 0, 0, 0]]
    angle = 0.1
    end = "stop"
    "#,
    r#"
    scene = { duration = "4s", axes = 2, count = 2 }
    object = { mass = 1 }
    coordination = { strategy = "average-position", stiffness = 1, update = "8ms" }
    peer = { device = { mass = 1 }, coupling = { stiffness = 1 } }
    task = { kind = "path", points = [[0, 0], [0.1, 0]], width = 0.02, leave = "fail", who = "any" }
    "#,
];

const RELAY: &str = r#"
    relay = {}
    programs = [{ name = "left", port = "127.0.0.1:7001" }, { name = "right", port = "127.0.0.1:7002", address = "127.0.0.1:9002" }]
    modulators = [{ name = "cell", states = [{ name = "good", sojourn = "1s" }, { name = "bad", sojourn = "1s" }] }]
    link = { delay = "20ms" }
    links = [{ from = "left", to = "right", loss = "1%" }]
    timeline = [{ at = "1s", link = { from = "left", to = "right" }, set = { delay = "8ms" } }, { at = "2s", link = "all", set = { loss = 0.1 } }]
"#;

const RELAY_TCP: &str = r#"
    relay = {}
    [[proxies]]
    name = "store"
    listen = "127.0.0.1:7379"
    to = "127.0.0.1:6379"
    forth = { delay = "20ms", close-after = { after = "2s" }, reset-after = { after = "2s" }, stall = { after = "1s" } }
    back = { rate = "1Mbit", slice = { size = "100B" }, cut-after = { size = "1kB" }, slow-close = { time = "1s" } }
"#;

const ROUTER: [&str; 2] = [
    r#"
    router = { default = { left-to-right = "wan", right-to-left = "pass" }, memory = { packets = 10 } }
    left = { tun = "left0" }
    right = { tun = "right0", namespace = "lab" }
    links = { wan = { delay = "24ms" } }
    modulators = [{ name = "cell", states = [{ name = "good", sojourn = "1s" }, { name = "bad", sojourn = "1s" }] }]
    rules = [{ from = "left", protocol = "tcp", port = "5000-5999", link = "pass" }, { source = "10.0.0.0/8", destination = "10.1.0.1", link = "drop" }]
    "#,
    "router.default = \"pass\"\nrouter.memory = {}\nleft.interface = \"eth1\"\nright.interface = \"eth2\"\n",
];

const EXEC: &str = r#"
    exec = { world = "internet" }
    hosts = [{ name = "server", command = ["sleep", "1"], ready = "listening" }, { name = "client", command = "curl http://server/", main = true }]
    modulators = [{ name = "cell", states = [{ name = "good", sojourn = "1s" }, { name = "bad", sojourn = "1s" }] }]
    link = { delay = "20ms" }
    links = [{ from = "client", to = "internet", loss = "1%" }]
"#;

/// A text of a kind of file, and the path under which the text is read.
pub(super) struct Sample {
    pub(super) kind: FileSchema,
    pub(super) path: PathBuf,
    pub(super) text: String,
}

pub(super) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the texts above, the data of the integration tests of this crate, and every shipped scene.
pub(super) fn samples() -> Vec<Sample> {
    let of = |kind, text: &str| Sample { kind, path: root().join("scenarios/network/sample.toml"), text: text.to_owned() };
    let mut samples: Vec<Sample> = SCENES.iter().map(|text| of(FileSchema::Scene, text)).collect();
    samples.push(of(FileSchema::Relay, RELAY));
    samples.push(of(FileSchema::Exec, EXEC));
    samples.push(of(FileSchema::RelayTcp, RELAY_TCP));
    samples.extend(ROUTER.iter().map(|text| of(FileSchema::Router, text)));
    let mut files = scene_files(&root().join("scenarios")).unwrap();
    files.push(root().join("crates/scene/tests/integration/data/every-key.toml"));
    samples.extend(files.into_iter().map(|path| Sample { kind: FileSchema::Scene, text: std::fs::read_to_string(&path).unwrap(), path }));
    samples
}

/// Reads a sample and returns its content as text. Samples with equal content give equal texts.
pub(super) fn read(sample: &Sample, overrides: &[String]) -> Result<String, SceneError> {
    let (text, path) = (&sample.text, &sample.path);
    match sample.kind {
        FileSchema::Scene => Scene::parse(text, path, overrides).map(|scene| format!("{scene:?}")),
        FileSchema::Relay => RelayFile::parse(text, path, overrides).map(|relay| format!("{relay:?}")),
        FileSchema::Exec => ExecFile::parse(text, path, overrides).map(|exec| format!("{exec:?}")),
        FileSchema::RelayTcp => TcpRelayFile::parse(text, path, overrides).map(|relay| {
            // Configurations of the streams, not their keys as written, which a relay keeps for live control.
            let streams: Vec<_> =
                relay.proxies.iter().map(|proxy| (&proxy.name, proxy.listen, proxy.to, &proxy.forth.config, &proxy.back.config)).collect();
            format!("{:?} {:?} {:?} {:?} {streams:?}", relay.title, relay.seed, relay.most_bytes, relay.tolerance)
        }),
        FileSchema::Router => RouterFile::parse(text, path, overrides).map(|router| {
            // The models of the links, not their keys as written, which a router keeps for live control.
            let links: Vec<_> = router.links.iter().map(|link| (&link.name, &link.model)).collect();
            format!("{:?} {:?} {:?} {:?} {links:?} {:?} {:?}", router.seed, router.memory, router.left, router.right, router.rules, router.default)
        }),
    }
}
