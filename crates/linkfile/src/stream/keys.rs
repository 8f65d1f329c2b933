//! Declarations of the keys of a stream: the keys of a link, and the keys of the faults of TCP.

use cohaptic_wan::parameters::{Form, Key, Table, optional, required, usual};

use crate::link::keys::LINK;

/// Share of the connections with a fault.
const SHARE: [Key; 1] = [usual("for", Form::Probability, "\"100%\"", "Share of the connections that have the fault; the seed says which")];

static CLOSE: Table = Table::of(&[&[required("after", Form::Duration, "Age of the connection at its close")], &SHARE]);
static RESET: Table = Table::of(&[&[required("after", Form::Duration, "Age of the connection at its reset")], &SHARE]);
static STALL: Table = Table::of(&[
    &[
        required("after", Form::Duration, "Age of the connection at the beginning"),
        optional("length", Form::PositiveDuration, "Length of the span; until the connection ends by default"),
    ],
    &SHARE,
]);
static SLICE: Table = Table::of(&[
    &[
        required("size", Form::Size, "Mean size of a piece"),
        usual("variation", Form::Size, "\"0B\"", "Greatest deviation from the mean size, uniformly distributed"),
        usual("gap", Form::Duration, "\"0s\"", "Least time between two pieces"),
    ],
    &SHARE,
]);
static CUT: Table = Table::of(&[&[required("size", Form::Size, "Bytes that reach the receiver before the close")], &SHARE]);
static SLOW: Table = Table::of(&[&[required("time", Form::Duration, "Time between the last byte and the end of the stream")], &SHARE]);

const NONE: Form = Form::Words(&[("none", "the fault is not configured")]);

/// Keys of a stream beside the keys of a link.
pub(crate) const FAULTS: [Key; 7] = [
    optional(
        "buffer",
        Form::Size,
        "Most bytes of a connection that the relay holds in this direction: the sender waits beyond that. By default 64 KiB more than the line carries during its delay, or 6 MiB without a rate",
    ),
    optional(
        "close-after",
        Form::AnyOf(const { &[Form::Duration, Form::Table(&CLOSE), NONE] }),
        "Age at which the connection is closed, in both directions",
    ),
    optional(
        "reset-after",
        Form::AnyOf(const { &[Form::Duration, Form::Table(&RESET), NONE] }),
        "Age at which the connection is reset, at both ends",
    ),
    optional(
        "stall",
        Form::AnyOf(const { &[Form::Duration, Form::Table(&STALL), NONE] }),
        "Age from which on nothing reaches the receiver; bytes are held",
    ),
    optional(
        "slice",
        Form::AnyOf(const { &[Form::Size, Form::Table(&SLICE), NONE] }),
        "Size of the pieces into which bytes are cut, each written by itself",
    ),
    optional(
        "cut-after",
        Form::AnyOf(const { &[Form::Size, Form::Table(&CUT), NONE] }),
        "Bytes after which the connection is closed, in both directions; further bytes are lost",
    ),
    optional(
        "slow-close",
        Form::AnyOf(const { &[Form::Duration, Form::Table(&SLOW), NONE] }),
        "Time by which the end of the stream comes later than the last byte could",
    ),
];

/// Keys of a link that a stream has.
const LINE: [Key; 5] = [of_link("delay"), of_link("jitter"), of_link("rate"), of_link("netem"), of_link("profile")];

/// Table of one direction of a proxy.
pub(crate) static STREAM: Table = Table::of(&[&LINE, &FAULTS]);

/// Returns the key of a link with this name. A name that no link has fails to compile.
#[expect(clippy::panic, reason = "while the program is compiled")]
const fn of_link(name: &str) -> Key {
    // Loops, because iterators and comparisons of texts cannot run in a constant.
    let mut group = 0;
    while group < LINK.len() {
        let mut place = 0;
        while place < LINK[group].len() {
            if is_equal(LINK[group][place].name.as_bytes(), name.as_bytes()) {
                return LINK[group][place];
            }
            place += 1;
        }
        group += 1;
    }
    panic!("no link has this key")
}

const fn is_equal(one: &[u8], other: &[u8]) -> bool {
    let mut place = 0;
    while place < one.len() && place < other.len() && one[place] == other[place] {
        place += 1;
    }
    place == one.len() && place == other.len()
}
