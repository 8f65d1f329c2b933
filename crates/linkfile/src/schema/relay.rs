//! The keys of a relay file.

use super::link::{LINK_CHANGE, LINK_ENTRY, LINK_TABLE, LINKS_BETWEEN, MODULATOR};
use cohaptic_wan::parameters::{Form, Table, optional, required, usual};

/// The top of a relay file.
pub static ROOT: Table = Table::of(&[&[
    optional("relay", Form::Table(&RELAY), "Seed and limits"),
    required("programs", Form::List(&Form::Table(&PROGRAM)), "The programs, at least two"),
    optional("modulators", Form::List(&Form::Table(&MODULATOR)), "Chains of states that links follow"),
    optional("link", Form::Table(&LINK_TABLE), "Holds for every link that does not say otherwise; without it links are ideal"),
    optional("links", Form::List(&Form::Table(&LINK_ENTRY)), "One direction of one pair each: its own keys are laid over those of [link]"),
    optional("timeline", Form::List(&Form::Table(&TIMELINE)), "Changes while the relay runs"),
]]);
static RELAY: Table = Table::of(&[&[
    optional("title", Form::Text, "A line for people; without it the name of the file"),
    usual("seed", Form::Integer(0, i64::MAX.unsigned_abs()), "0", "Seed of all random numbers"),
    usual("allow-remote", Form::Boolean, "false", "Whether ports and addresses may be on other machines"),
    usual("most-packets", Form::Integer(1, 1 << 24), "262144", "The most datagrams in flight at once"),
    usual("most-bytes", Form::Size, "\"64MB\"", "The most bytes of datagrams in flight at once"),
    usual("forget-after", Form::Duration, "\"30s\"", "A learnt address that is silent for so long may be replaced"),
    usual("tolerance", Form::Duration, "\"1ms\"", "Later than this is late"),
]]);
static PROGRAM: Table = Table::of(&[&[
    required("name", Form::Text, "Its name, which names its links: unique, not all, without space and without . > / , and quotes"),
    required("port", Form::Like(&["127.0.0.1:7001"]), "The address that stands for it: a program that sends there speaks to it"),
    optional("address", Form::Like(&["127.0.0.1:9001"]), "Where it sends from and listens; without it learnt from the first datagram that it sends"),
]]);
static TIMELINE: Table = Table::of(&[&[
    required("at", Form::Duration, "When, from the beginning"),
    required("link", LINKS_BETWEEN, "Which links change: all, or one by its ends"),
    required("set", Form::Table(&LINK_CHANGE), "The keys that change"),
]]);
