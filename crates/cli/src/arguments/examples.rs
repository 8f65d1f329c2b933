//! Text below the help of every command: examples that can be typed as they stand, and the exit status.

const EXIT_STATUS: &str = "Exit status: 0 done, 1 an expectation failed, 2 a bad argument or scene, 3 an input or output error, 130 interrupted, \
    141 standard output was closed.";

/// Returns the examples of a command, and the meanings of the exit status.
pub(super) fn after(examples: &[&str]) -> String {
    let mut text = "Examples:\n".to_owned();
    for example in examples {
        text.push_str("  ");
        text.push_str(example);
        text.push('\n');
    }
    text.push('\n');
    text.push_str(EXIT_STATUS);
    text
}

/// Returns the examples of `exec`, and the meanings of the exit status, which is that of the command.
pub(super) fn of_exec() -> String {
    after(EXEC).replace(
        EXIT_STATUS,
        "Exit status: that of the command, 128 plus the number of the signal that ended it, 125 if cohaptic failed, 126 if the command cannot be executed, \
        127 if it is not found. With --seeds or --runs 0 if no run failed, and else the status of the last run that failed.",
    )
}

/// Commands of other programs that make files for `fit`, after the examples.
const MEASUREMENTS: &str = "\
Programs whose files are read, and the command that makes a good measurement:
  irtt client -i 10ms -d 10m --stats=both -o line.json HOST    each way by itself: --direction up, down
  ping -D -i 0.01 -c 60000 HOST > line.txt                     round trips: --split even, or a share
  iperf3 -c HOST -t 60 -J > rate.json                          the rate up; with -R down; a lower bound
  iperf3 -c HOST -u -b 5M -R -t 60 -J > rate.json              loss and rate of datagrams down
CSV files of LENS, traces of CellReplay (light and heavy) and JSON of netem-trace are read too.
";

/// Returns the examples of `fit`, the programs whose files `fit` reads, and the meanings of the exit status.
pub(super) fn after_measurements(examples: &[&str]) -> String {
    after(examples).replace(EXIT_STATUS, &format!("{MEASUREMENTS}\n{EXIT_STATUS}"))
}

/// Returns the examples of the program, the meanings of the exit status, and on systems other than Linux the commands that need Linux.
pub(super) fn of_program() -> String {
    let needs = if cfg!(target_os = "linux") {
        ""
    } else {
        "\n\nThese commands need Linux: exec, falcon, inverse3, join, live, play, relay without --tcp, router."
    };
    after(PROGRAM) + needs
}

const PROGRAM: &[&str] =
    &["cohaptic init", "cohaptic run scene.toml", "cohaptic run scenarios/paper/5-1-ap-2100.toml --set link.delay=40ms", "cohaptic check scenarios"];

pub(super) const RUN: &[&str] = &[
    "cohaptic run scenarios/paper/5-1-ap-2100.toml",
    "cohaptic run scene.toml --seed 7 --set link.loss=5% --out out",
    "cohaptic run scene.toml --against coordination.strategy=proportional-derivative",
    "cohaptic init - | cohaptic run - --json",
];

pub(super) const CHECK: &[&str] = &[
    "cohaptic check scenarios",
    "cohaptic check scenarios/paper --threads 2 --json",
    "cohaptic check scene.toml --set link.delay=40ms --page check.html",
];

pub(super) const EXPLAIN: &[&str] = &[
    "cohaptic explain scenarios/network/rate-and-queue.toml",
    "cohaptic explain scene.toml --set scene.axes=3",
    "cohaptic explain scene.toml --cost --out cost",
];

pub(super) const CAMPAIGN: &[&str] = &[
    "cohaptic campaign scene.toml --vary link.delay=8ms..48ms/6 --runs 100 --out delays",
    "cohaptic campaign scene.toml --vary coordination.stiffness=10..1000/5:log --out gains",
    "cohaptic campaign scene.toml --vary link.loss=0%..30%/7 --verdicts --size one-column --out losses",
    "cohaptic campaign scene.toml --runs 100000 --out many --shard 3/8",
];

pub(super) const COMPARE: &[&str] = &[
    "cohaptic compare scene.toml --strategies average-position,wave --vary link.delay=8ms,48ms --out a",
    "cohaptic compare scene.toml --strategies 'wave{impedance=5},wave{impedance=50}' --runs 20 --out b",
    "cohaptic compare scene.toml --preset field --out field",
];

pub(super) const STABILITY: &[&str] =
    &["cohaptic stability point scenarios/paper/5-1-ap-2100.toml", "cohaptic stability boundary scene.toml --along coordination.stiffness=100..6000"];

pub(super) const POINT: &[&str] = &[
    "cohaptic stability point scenarios/paper/5-1-ap-2100.toml",
    "cohaptic stability point scenarios/paper/5-1-pd-1000.toml --losses-in-a-row 2",
    "cohaptic stability point scenarios/coordination/n5.toml --graph ring",
];

pub(super) const MAP: &[&str] = &[
    "cohaptic stability map scene.toml --x object.mass=0.1..2 --y link.delay=0ms..40ms --grid 40x40",
    "cohaptic stability map scene.toml --x object.mass=0.1..2 --y object.damping=0..10 --prove",
    "cohaptic stability map - --x link.delay=0ms..40ms --y object.mass=0.1..2 --grid 9x9 --out map",
];

pub(super) const BOUNDARY: &[&str] = &[
    "cohaptic stability boundary scene.toml --along coordination.stiffness=100..6000",
    "cohaptic stability boundary scene.toml --along link.delay=0ms..60ms --tolerance 0.1 --out boundary",
];

pub(super) const ADMITTANCE: &[&str] = &[
    "cohaptic admittance scenarios/coordination/n3.toml --peer left --at 0.01,0.1,1,10,100",
    "cohaptic admittance scene.toml --peer left --to 60 --curve link.delay=40ms --out bode",
];

pub(super) const LIVE: &[&str] = &[
    "cohaptic live scenarios/live/two-and-a-program.toml --control",
    "cohaptic live scene.toml --for 30s --listen 127.0.0.1:7400 --out session",
    "cohaptic live --new-key session.key",
];

pub(super) const JOIN: &[&str] = &[
    "cohaptic join 192.0.2.7:7400 lab.toml --peer left --device falcon --key-file session.key",
    "cohaptic join 127.0.0.1:7400 lab.toml --peer left --device simulated --for 30s --out left",
];

pub(super) const PLAY: &[&str] =
    &["cohaptic play", "cohaptic play scene.toml --set link.delay=60ms --out played", "cohaptic play --control 0.0.0.0:8080 --allow-remote"];

pub(super) const STUDY: &[&str] =
    &["cohaptic study run studies/pull/study.toml --dry-run --out dry", "cohaptic study verify dry", "cohaptic study forget P07 dry"];

pub(super) const STUDY_RUN: &[&str] = &[
    "cohaptic study run studies/pull/study.toml --dry-run --times 100 --out dry",
    "cohaptic study run studies/pull/study.toml --out data --control 0.0.0.0:8080 --allow-remote",
];

pub(super) const STUDY_FOLDER: &[&str] = &["cohaptic study report dry", "cohaptic study verify dry"];

pub(super) const STUDY_FORGET: &[&str] = &["cohaptic study forget P07 dry"];

pub(super) const RELAY: &[&str] = &[
    "cohaptic relay --listen 127.0.0.1:7000 --to 127.0.0.1:9000 delay 24ms 2ms loss 1%",
    "cohaptic relay --listen 127.0.0.1:7000 --to 127.0.0.1:9000 delay=24ms --back delay=40ms loss=1%",
    "cohaptic relay relay.toml --set link.delay=8ms --set programs.left.port=127.0.0.1:7101 --for 1min",
    "cohaptic relay --tcp --listen 127.0.0.1:7000 --to 127.0.0.1:9000 delay 24ms rate 10mbit reset-after 5s for 10%",
];

pub(super) const ROUTER: &[&str] =
    &["cohaptic router router.toml --control", "cohaptic router router.toml --set links.wan.delay=8ms --set router.seed=7 --for 1min"];

const EXEC: &[&str] = &[
    "cohaptic exec 'delay 50ms loss 1%' -- curl http://host:8000/",
    "cohaptic exec 'delay 50ms loss 1%' --back 'delay 50ms rate 10mbit' -- python3 client.py",
    "cohaptic exec 'delay 20ms 5ms' --listen 8080 -- node server.js",
    "cohaptic exec net.toml --set link.loss=5% --out out",
    "cohaptic exec 'delay 20ms loss 5%' --loopback --seeds 1..40 -- python3 -m pytest",
    "cohaptic exec 'delay 20ms' --lose 'command->world:0' --runs 10 -- npm test",
];

pub(super) const TOKIO: &[&str] = &["cohaptic tokio", "cohaptic tokio --sim tests/network"];

pub(super) const TEST: &[&str] = &["cohaptic test", "cohaptic test -p server --test network -- --nocapture"];

pub(super) const FALCON: &[&str] = &["cohaptic falcon probe", "cohaptic falcon watch --simulated --for 2s"];

pub(super) const FALCON_PROBE: &[&str] = &["cohaptic falcon probe", "cohaptic falcon probe --serial FALCON01 --for 5s --json"];

pub(super) const FALCON_HOME: &[&str] = &["cohaptic falcon home --firmware firmware.bin", "cohaptic falcon home --simulated --virtual-time"];

pub(super) const FALCON_WATCH: &[&str] = &[
    "cohaptic falcon watch --for 10s --csv grip.csv",
    "cohaptic falcon watch --spring 200 --damping 2 --limit 1",
    "cohaptic falcon watch --force 0,0,0.3 --for 5s",
];

pub(super) const FALCON_SIMULATE: &[&str] =
    &["cohaptic falcon simulate", "cohaptic falcon simulate --hand swaying --drop 0.1% --garbage 0.1% --for 10s"];

pub(super) const INVERSE3: &[&str] = &["cohaptic inverse3 probe", "cohaptic inverse3 watch --simulated --for 2s"];

pub(super) const INVERSE3_PROBE: &[&str] = &["cohaptic inverse3 probe", "cohaptic inverse3 probe --device 04C3 --for 5s --json"];

pub(super) const INVERSE3_WATCH: &[&str] =
    &["cohaptic inverse3 watch --for 10s --csv cursor.csv", "cohaptic inverse3 watch --spring 100 --damping 1 --limit 1"];

pub(super) const INVERSE3_SIMULATE: &[&str] = &[
    "cohaptic inverse3 simulate --force 0,0,0.5 --fault late=1% --fault restart@3s+500ms",
    "cohaptic inverse3 simulate --listen 127.0.0.1:10001 --format 3.1",
];

pub(super) const LINK: &[&str] = &[
    "cohaptic link delay 20ms 5ms 25% loss 1%",
    "cohaptic link delay=24ms loss=1% --packets 1000000 --fates fates.csv",
    "cohaptic link starlink/down rate=50Mbit --every 8ms",
    "cohaptic link starlink --show",
    "cohaptic link --from fates.csv --json",
];

pub(super) const FIT: &[&str] = &[
    "cohaptic fit fates.csv --out link.toml",
    "cohaptic fit line.json --direction up --out uplink.toml",
    "cohaptic fit line.txt --split even",
    "cohaptic fit sender.pcapng receiver.pcapng --port 5000 --skew",
];

pub(super) const PAPER: &[&str] = &["cohaptic paper --quick", "cohaptic paper --out paper"];

pub(super) const INIT: &[&str] =
    &["cohaptic init", "cohaptic init four.toml --from paper/5-1 --peers 4", "cohaptic init - --from network/jitter-normal", "cohaptic init --list"];

pub(super) const SCHEMA: &[&str] = &["cohaptic schema > scene.schema.json", "cohaptic schema relay", "cohaptic schema router"];

pub(super) const COMPLETIONS: &[&str] =
    &["cohaptic completions bash > ~/.local/share/bash-completion/completions/cohaptic", "cohaptic completions zsh > _cohaptic"];

pub(super) const MAN: &[&str] = &["cohaptic man > cohaptic.1", "cohaptic man stability map", "cohaptic man --out man1"];
