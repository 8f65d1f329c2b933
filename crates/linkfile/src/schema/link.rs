//! The keys of a link, and of the modulators that links follow.

use super::form::{Form, Key, Table, Words, number, optional, required, usual};
use crate::reading::values::{CORRELATION, FRACTION, PACKETS, WEIGHT};

const NONE: Form = Form::Words(&[("none", "takes away what it is laid over")]);
const UNLIMITED: Form = Form::Words(&[("unlimited", "takes away the limit that it is laid over")]);
const MOST: u64 = i64::MAX.unsigned_abs();
const MOST_OF_32_BITS: u64 = u32::MAX as u64;

/// What a link does.
pub const LINK: [Key; 18] = [
    usual("delay", Form::Duration, "\"0s\"", "One-way propagation delay; the mean if there is jitter"),
    optional("jitter", JITTER, "Standard deviation of the delay, with a normal law, or a table that also names law, floor and memory"),
    usual("order", Form::Words(&ORDERS), "\"allow-reordering\"", "Whether a packet with a shorter delay overtakes those before it"),
    usual("loss", LOSS, "0", "Probability that a packet is lost, or a model of bursts, or chosen packets"),
    usual("mark-instead-of-loss", Form::Boolean, "false", "What would be lost is marked instead (ECN)"),
    usual("duplicate", CHANCE, "0", "Probability that a packet is sent twice"),
    usual("corrupt", CORRUPT, "0", "Probability that a bit of a packet is flipped, or a table that says which bits and what the receiver does"),
    usual("reorder", REORDER, "0", "Probability that a packet jumps ahead of those before it, or a table that says how packets leave their place"),
    usual("rate", Form::AnyOf(&[Form::Rate, UNLIMITED]), "\"unlimited\"", "How fast packets are sent, in bits per second"),
    optional("queue", Form::Table(&QUEUE), "How much may wait for the line, and which packets are dropped. Needs rate or a recorded line"),
    usual("overhead", SIGNED_SIZE, "\"0B\"", "What each packet costs beyond its own size. Needs rate or a recorded line"),
    usual("cells", Form::AnyOf(const { &[Form::Table(&CELLS), NONE] }), "\"none\"", "Packets travel in whole cells. Needs rate or a recorded line"),
    usual("token-bucket", Form::AnyOf(const { &[Form::Table(&TOKEN_BUCKET), NONE] }), "\"none\"", "How much may leave in bursts"),
    usual(
        "slots",
        Form::AnyOf(const { &[Form::Table(&SLOTS), NONE] }),
        "\"none\"",
        "The line sends only now and then, all that has gathered or so much of it",
    ),
    usual("mtu", Form::AnyOf(&[Form::Size, UNLIMITED]), "\"unlimited\"", "Larger packets are dropped"),
    usual("limit", Form::Like(&["1000 packets", "unlimited"]), "\"unlimited\"", "How many packets may be inside, waiting and propagating together"),
    usual("outage", OUTAGE, "[]", "When the link is down: a list of spans, or a table"),
    usual(
        "trace",
        Form::AnyOf(const { &[Form::File, Form::Table(&TRACE)] }),
        "\"none\"",
        "A recorded line or path, from a file; \"none\" takes it away",
    ),
];

/// What kind of link it is, which cannot change with the state of a modulator.
pub const LINK_KIND: [Key; 4] = [
    usual(
        "modulated",
        Form::AnyOf(const { &[Form::Table(&MODULATED), NONE] }),
        "\"none\"",
        "Keys that hold while a modulator is in one of its states",
    ),
    usual(
        "replay",
        Form::File,
        "\"none\"",
        "A log of fates: the n-th packet meets the fate of the n-th of the log. Takes away all other keys; \"none\" takes it away",
    ),
    usual("netem", NETEM, "\"none\"", "The link in the words of tc-netem. Takes away all other keys; \"none\" takes it away"),
    usual("netem-profile", Form::Words(&PROFILES), "\"exact\"", "The meaning of the words of netem"),
];

/// Keys of a link alone.
pub static LINK_TABLE: Table = Table::of(&[&LINK, &LINK_KIND]);
/// Keys that hold in a state of a modulator.
static STATE: Table = Table::over(&[&LINK]);
/// Keys of a link that change.
pub static LINK_CHANGE: Table = Table::over(&[&LINK, &LINK_KIND]);

const ORDERS: [(&str, &str); 2] =
    [("allow-reordering", "a packet with a shorter delay overtakes"), ("in-order", "a packet with a shorter delay waits for those before it")];
const PROFILES: [(&str, &str); 2] = [("exact", "what the words say"), ("kernel-6.6", "what Linux 6.6 does when it is told so")];
const NETEM: Form = Form::Like(&["delay 20ms 5ms 25% distribution normal loss gemodel 1% 10%", "none"]);
const SIGNED_SIZE: Form = Form::Like(&["28B", "-14B"]);

const CHANCE: Form = Form::AnyOf(&[Form::Probability, Form::Table(&CHANCE_TABLE)]);
static CHANCE_TABLE: Table = Table::of(&[&CHANCES]);
const CHANCES: [Key; 2] = [
    optional("probability", Form::Probability, "The fraction of packets that it happens to"),
    usual("correlation", number(CORRELATION), "0", "Correlation of what happens to a packet with what happened to the one before"),
];

const JITTER: Form = Form::AnyOf(&[Form::Duration, Form::Table(&JITTER_TABLE)]);
static JITTER_TABLE: Table = Table::of(&[&[
    optional("sd", Form::Duration, "Standard deviation. Must be given, but for measured delays: theirs then"),
    usual("distribution", Form::AnyOf(const { &[Form::Words(&LAWS), Form::Table(&LAW_FILE)] }), "\"normal\"", "The law of the delay"),
    usual("floor", Form::Duration, "\"0s\"", "No packet is faster"),
    usual("correlation", number(CORRELATION), "0", "Correlation of a packet's delay with that of the one before"),
    optional("correlation-time", Form::Duration, "In place of correlation: the time over which delays forget, whatever is sent"),
]]);
const LAWS: [(&str, &str); 8] = [
    ("normal", "Gaussian, cut off at the floor"),
    ("uniform", "equally likely between two ends"),
    ("pareto", "a heavy tail above"),
    ("paretonormal", "the mixture of tc-netem"),
    ("lognormal", "above the floor, with a long tail"),
    ("gamma", "above the floor, as many small delays add up"),
    ("weibull", "above the floor"),
    ("laplace", "two exponentials, back to back"),
];
static LAW_FILE: Table = Table::of(&[&[
    optional("table", Form::File, "A .dist table as tc reads it"),
    optional("empirical", Form::File, "A CSV file of measured delays with the header delay, in seconds"),
]]);

const LOSS: Form = Form::AnyOf(&[Form::Probability, Form::Table(&LOSS_TABLE)]);
static LOSS_TABLE: Table = Table::of(&[&[
    optional("gilbert-elliott", Form::Table(&GILBERT_ELLIOTT), "Bursts: a good and a bad state, for each packet or in time"),
    optional("states", Form::Table(&FOUR_STATES), "Bursts: the four states of tc-netem"),
    optional("bursts", Form::Table(&BURSTS), "Bursts by their fraction and length"),
    optional("correlated", CHANCE, "Each packet with a correlation to the one before"),
    optional("packets", Form::List(&Form::AnyOf(const { &[Form::Integer(0, MOST), Form::Like(&["10-19"])] })), "Those packets, counted from 0"),
    optional("times", Form::List(&Form::Table(&SPAN)), "Whatever is sent then"),
    optional(
        "every",
        Form::AnyOf(&[Form::Integer(1, MOST), Form::Duration]),
        "Beside packets or times: the pattern repeats after this number of packets, or after this time",
    ),
]]);
static GILBERT_ELLIOTT: Table = Table::of(&[&[
    optional("p", Form::Probability, "Probability of going from good to bad at each packet"),
    optional("r", Form::Probability, "Probability of going back; without it 1 - p"),
    optional("mean-good", Form::Duration, "In place of p: the mean time in the good state"),
    optional("mean-bad", Form::Duration, "In place of r: the mean time in the bad state"),
    usual("h", Form::Probability, "0", "Probability of getting through in the bad state"),
    usual("k", Form::Probability, "1", "Probability of getting through in the good state"),
]]);
static FOUR_STATES: Table = Table::of(&[&[
    required("p13", Form::Probability, "From receiving to a burst of loss"),
    optional("p31", Form::Probability, "From a burst of loss to receiving; without it 1 - p13"),
    usual("p32", Form::Probability, "0", "From a burst of loss to receiving within a burst"),
    usual("p23", Form::Probability, "1", "From receiving within a burst to loss"),
    usual("p14", Form::Probability, "0", "From receiving to a single loss"),
]]);
static BURSTS: Table = Table::of(&[&[
    required("loss", Form::Probability, "The mean fraction lost"),
    required("length", number(PACKETS), "The mean length of a burst"),
    usual("density", Form::Probability, "1", "The fraction lost within bursts"),
    usual("isolated", Form::Probability, "0", "The fraction lost outside of bursts"),
    usual("good-run", number(PACKETS), "1", "The mean number received in a row within a burst"),
]]);
static SPAN: Table = Table::of(&[&[
    required("from", Form::Duration, "When it begins, from the beginning of the scene"),
    required("to", Form::Duration, "When it ends, from the beginning of the scene"),
]]);

const CORRUPT: Form = Form::AnyOf(&[Form::Probability, Form::Table(&CORRUPT_TABLE)]);
static CORRUPT_TABLE: Table = Table::of(&[
    &CHANCES,
    &[
        usual("bits", Form::Integer(1, MOST_OF_32_BITS), "1", "How many different bits of such a packet are flipped"),
        optional("bit-error-rate", Form::Probability, "In place of probability and bits: each bit by itself"),
        optional("bytes", Form::Like(&["8-15"]), "The first and the last byte that may be hit, counted from 0"),
        usual("checksum", Form::Words(&CHECKSUMS), "\"discards\"", "What the receiver does with a damaged packet"),
    ],
]);
const CHECKSUMS: [(&str, &str); 2] = [("discards", "it is dropped when it arrives"), ("passes", "it is taken, and the peer's own checks decide")];

const REORDER: Form = Form::AnyOf(&[Form::Probability, Form::Table(&REORDER_TABLE)]);
static REORDER_TABLE: Table = Table::of(&[
    &CHANCES,
    &[
        usual("gap", Form::Integer(1, MOST_OF_32_BITS), "1", "Such a packet jumps ahead, at most one in this number of packets"),
        optional("behind", Form::Integer(1, MOST_OF_32_BITS), "Such a packet is held until this number of others has passed it; needs at-most"),
        optional("at-most", Form::Duration, "How long a packet is held behind others at most"),
        optional("later", Form::Duration, "Such a packet takes so much longer"),
    ],
]);

static QUEUE: Table = Table::of(&[&[
    required("limit", LIMIT, "How much may wait"),
    usual("discipline", Form::AnyOf(const { &[Form::Words(&DISCIPLINES), Form::Table(&DISCIPLINE)] }), "\"tail-drop\"", "Which packets are dropped"),
]]);
const LIMIT: Form = Form::Like(&["100 packets", "64kB", "50ms", "unlimited"]);
const DISCIPLINES: [(&str, &str); 4] = [
    ("tail-drop", "the newest when the queue is full"),
    ("head-drop", "the oldest when the queue is full"),
    ("codel", "the oldest when they wait too long for too long"),
    ("red", "some of the newest, the more the longer the queue is on average; needs a limit in bytes"),
];
static DISCIPLINE: Table = Table::of(&[&[
    optional("codel", Form::Table(&CODEL), "The oldest when they wait more than the target for an interval"),
    optional("red", Form::Table(&RED), "Some of the newest when the average queue is above min, all above max"),
]]);
static CODEL: Table = Table::of(&[&[
    usual("target", Form::Duration, "\"5ms\"", "How long packets may wait"),
    usual("interval", Form::Duration, "\"100ms\"", "For how long they may wait longer"),
    usual("mtu", Form::Size, "\"1500B\"", "Nothing is dropped with so much or less waiting"),
    usual("ecn", Form::Boolean, "false", "Packets are marked where they would be dropped"),
]]);
static RED: Table = Table::of(&[&[
    required("min", Form::Size, "The average queue at which dropping begins"),
    required("max", Form::Size, "The average queue at which everything is dropped"),
    usual("max-probability", Form::Probability, "\"10%\"", "Probability of a drop just below max"),
    usual("weight", number(FRACTION), "0.002", "Weight of the newest length in the average"),
    usual("mean-packet", Form::Size, "\"500B\"", "Size of a packet, for the time when the line is idle"),
    usual("ecn", Form::Boolean, "false", "Packets are marked where they would be dropped"),
]]);
static CELLS: Table =
    Table::of(&[&[required("payload", Form::Size, "What a cell carries"), usual("overhead", Form::Size, "\"0B\"", "What a cell costs beyond that")]]);
static TOKEN_BUCKET: Table = Table::of(&[&[
    required("rate", Form::Rate, "How fast the bucket fills"),
    required("burst", Form::Size, "What the bucket holds"),
    optional("peak", Form::Table(&PEAK), "A second, smaller bucket, which limits how fast a burst leaves"),
    usual("limit", LIMIT, "\"unlimited\"", "How much may wait for tokens"),
    usual("overhead", SIGNED_SIZE, "\"0B\"", "What each packet costs beyond its own size"),
]]);
static PEAK: Table =
    Table::of(&[&[required("rate", Form::Rate, "How fast a burst leaves"), required("burst", Form::Size, "At least the largest packet")]]);
static SLOTS: Table = Table::of(&[&[
    optional("min", Form::Duration, "The shortest time from slot to slot"),
    optional("max", Form::Duration, "The longest time from slot to slot; without it min"),
    optional("delay", Form::Duration, "In place of min and max: the mean time from slot to slot"),
    optional("jitter", JITTER, "Beside delay: how the time from slot to slot varies"),
    optional("packets", Form::Integer(1, MOST), "How many packets leave in a slot at most"),
    optional("bytes", Form::Size, "How many bytes leave in a slot at most"),
]]);

const OUTAGE: Form = Form::AnyOf(&[Form::List(&Form::Table(&SPAN)), Form::Table(&OUTAGE_TABLE)]);
static OUTAGE_TABLE: Table = Table::of(&[&[
    usual("scheduled", Form::List(&Form::Table(&SPAN)), "[]", "Spans in order, none within another"),
    optional("random", Form::Table(&RANDOM_OUTAGE), "By chance, beginning up"),
    optional("idle", Form::Table(&IDLE_OUTAGE), "When nothing was sent for some time"),
]]);
static RANDOM_OUTAGE: Table =
    Table::of(&[&[required("up", SOJOURN, "How long the link is up"), required("down", SOJOURN, "How long the link is down")]]);
static IDLE_OUTAGE: Table = Table::of(&[&[
    required("after", Form::Duration, "For how long nothing was sent"),
    required("down", Form::Duration, "For how long the link is down then"),
]]);

const SOJOURN: Form = Form::AnyOf(&[Form::Duration, Form::Table(&SOJOURN_TABLE)]);
static SOJOURN_TABLE: Table = Table::of(&[&[
    optional("exponential", Form::Duration, "By chance without memory, with this mean; a plain duration means the same"),
    optional("fixed", Form::Duration, "Always so long"),
    optional("uniform", Form::Pair(&Form::Duration), "The shortest and the longest span, and all between as likely"),
    optional("erlang", Form::Table(&ERLANG), "The sum of several exponential stages"),
]]);
static ERLANG: Table = Table::of(&[&[
    required("mean", Form::Duration, "The mean of all stages together"),
    required("stages", Form::Integer(1, 1000), "How many stages"),
]]);

static TRACE: Table = Table::of(&[&[
    required("file", Form::File, "Instants of delivery in milliseconds, one a line (mahimahi), or a CSV with t,delay or t,delay,loss in seconds"),
    usual("bytes", Form::Size, "\"1504B\"", "What leaves at each instant of delivery"),
    usual("between", Form::Words(&BETWEEN), "\"steps\"", "What holds between two rows of a recorded path"),
    usual("repeat", Form::Boolean, "false", "Whether a recorded path begins anew after its end"),
]]);
const BETWEEN: [(&str, &str); 2] = [("steps", "the earlier row"), ("lines", "a delay on the line between both")];

static MODULATED: Table = Table::with_others(
    &[&[required("by", Form::Text, "The name of a modulator; beside it keys of the link under the names of its states")]],
    &Form::Table(&STATE),
);

/// Entries `[[modulators]]`.
pub static MODULATOR: Table = Table::of(&[&[
    required("name", Form::Text, "What links call it, without space or dot"),
    required("states", Form::List(&Form::Table(&MODULATOR_STATE)), "Its states; the first is the one in the beginning"),
]]);
static MODULATOR_STATE: Table = Table::of(&[&[
    required("name", Form::Text, "The name of the state, without space or dot, and not by"),
    optional("sojourn", SOJOURN, "How long it lasts; without it for ever"),
    optional(
        "next",
        Form::AnyOf(const { &[Form::Text, Form::Table(&WEIGHTS)] }),
        "Which state follows: a name, or names with weights; without it each other one alike",
    ),
]]);
static WEIGHTS: Table = Table::with_others(&[], &number(WEIGHT));

/// The two ends of a link.
pub const ENDS: [Key; 2] =
    [required("from", Form::Text, "The name of the one that sends"), required("to", Form::Text, "The name of the one that receives")];
/// An entry `[\[links\]]`.
pub static LINK_ENTRY: Table = Table::over(&[&ENDS, &LINK, &LINK_KIND]);

/// The word for every link.
pub const ALL_LINKS: Words = &[("all", "every link")];
static ENDS_TABLE: Table = Table::of(&[&ENDS]);
/// Which links a change is of.
pub const LINKS_BETWEEN: Form = Form::AnyOf(&[Form::Words(ALL_LINKS), Form::Table(&ENDS_TABLE)]);
