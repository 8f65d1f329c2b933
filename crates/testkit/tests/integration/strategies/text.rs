//! Text of links and networks: printed links read back, and any other text is refused with the place of the fault.

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{ImpairedLink, ImpairedNetwork, Stage, any_link, any_network};
use cohaptic_wan::netem::Netem;
use cohaptic_wan::{LinkModel, NodeId};

proptest! {
    #[test]
    fn a_link_reads_back(link in any_link()) {
        prop_assert_eq!(&link.to_string().parse::<ImpairedLink>().unwrap(), &link);
        let words = Netem::parse(&link.to_string()).unwrap();
        if link.is_ideal() {
            prop_assert!(LinkModel::from(words.to_link_config(&mut |_| None).unwrap()).as_fixed() == Some(&link.config()));
        } else {
            prop_assert_eq!(&words, link.netem());
        }
        let debug = format!("{link:?}");
        let pasted = debug.strip_prefix("ImpairedLink::words(\"").unwrap().strip_suffix("\")").unwrap();
        prop_assert_eq!(ImpairedLink::words(pasted), link);
    }

    #[test]
    fn a_network_reads_back(network in (1..8_usize).prop_flat_map(any_network)) {
        prop_assert_eq!(&network.to_string().parse::<ImpairedNetwork>().unwrap(), &network);
        prop_assert_eq!(&network.to_string().replace('\n', ";").parse::<ImpairedNetwork>().unwrap(), &network);
        let debug = format!("{network:?}");
        let pasted = debug.strip_prefix("ImpairedNetwork::words(\"").unwrap().strip_suffix("\")").unwrap();
        prop_assert_eq!(ImpairedNetwork::words(pasted), network);
    }

    #[test]
    fn reading_never_panics(text in "(?s).{0,60}", lines in "([0-9]{1,5} hosts?\n)?([a-e] ?-> ?[a-e]: ?[a-z0-9 %]{0,20}[\n;]){0,3}") {
        for text in [&text, &lines] {
            let _ = text.parse::<ImpairedLink>();
            let _ = text.parse::<ImpairedNetwork>();
        }
    }
}

#[test]
fn words_that_say_nothing_are_the_ideal_link() {
    for words in ["", "  ", "delay 0s", "delay 0"] {
        assert_eq!(ImpairedLink::words(words), ImpairedLink::ideal(), "{words:?}");
    }
    assert_eq!(format!("{:?}", ImpairedLink::ideal()), "ImpairedLink::words(\"delay 0s\")");
    // Options of zero are said, but impair nothing.
    for words in ["loss 0%", "duplicate 0%", "corrupt 0%", "delay 0s reorder 0%", "seed 5"] {
        let link = ImpairedLink::words(words);
        assert!(link.is_ideal() && link.stages().is_empty(), "{words}");
        assert_eq!(link.to_string().parse::<ImpairedLink>().unwrap(), link);
    }
}

#[test]
fn one_impairment_is_one_stage() {
    let counts: [(&str, &[Stage]); 8] = [
        ("delay 10ms", &[Stage::Delay]),
        ("delay 10ms 2ms 25% distribution normal", &[Stage::Jitter]),
        ("delay 10ms reorder 25% 50% gap 3", &[Stage::Reorder]),
        ("delay 10ms 2ms reorder 25%", &[Stage::Jitter, Stage::Reorder]),
        ("loss gemodel 1% 10% ecn", &[Stage::Loss]),
        ("limit 5 rate 1mbit", &[Stage::Limit, Stage::Rate]),
        ("slot 1ms packets 3", &[Stage::Slot]),
        ("corrupt 1% duplicate 1%", &[Stage::Corrupt, Stage::Duplicate]),
    ];
    for (words, stages) in counts {
        assert_eq!(ImpairedLink::words(words).stages(), stages, "{words}");
    }
}

#[test]
fn hosts_are_called_as_columns_are() {
    for (node, name) in [(0, "a"), (25, "z"), (26, "aa"), (27, "ab"), (26 * 27 - 1, "zz"), (26 * 27, "aaa"), (u16::MAX, "crxp")] {
        assert_eq!(ImpairedNetwork::name(NodeId(node)), name);
    }
}

#[test]
fn what_is_no_network_is_refused() {
    let refused = [
        ("", "\"\" is not a number of hosts: expected a first line such as \"3 hosts\", with 1 to 1000"),
        ("a -> b: delay 3ms", "\"a -> b: delay 3ms\" is not a number of hosts: expected a first line such as \"3 hosts\", with 1 to 1000"),
        ("0 hosts", "\"0 hosts\" is not a number of hosts: expected a first line such as \"3 hosts\", with 1 to 1000"),
        ("2 hosts; a - b", "\"a - b\" is not a link: expected a line such as \"a -> b: delay 24ms\""),
        ("2 hosts; a -> c: loss 1%", "\"a -> c: loss 1%\" is not a link between two of the hosts a to b"),
        ("2 hosts; a -> a: loss 1%", "\"a -> a: loss 1%\" is not a link between two of the hosts a to b"),
        ("2 hosts; a -> b: loss 1%; a -> b: loss 1%", "the link a -> b is given twice: expected one line for each link"),
        ("2 hosts; a -> b: loss 300%", "a -> b:\nloss 300%\n     ^^^^ expected a percentage from 0 to 100"),
        ("2 hosts; a -> b: delay 1ms 2ms", "a -> b:\ndelay: uniform jitter of 2ms around 1ms begins below zero: expected a jitter of at most 1ms"),
    ];
    for (text, message) in refused {
        assert_eq!(text.parse::<ImpairedNetwork>().unwrap_err().to_string(), message);
    }
    assert!("delay 1ms 1ms distribution mine".parse::<ImpairedLink>().unwrap_err().to_string().contains("there is no such table"));
}

#[test]
#[should_panic(expected = "expected a percentage from 0 to 100")]
fn words_in_a_test_that_are_no_link_stop_it() {
    let _ = ImpairedLink::words("loss 101%");
}
