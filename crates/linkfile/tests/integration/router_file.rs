//! Router files: a file with every key, and the faults that a file may have.

use std::path::Path;
use std::time::Duration;

use cohaptic_linkfile::FileError;
use cohaptic_linkfile::router::{Attachment, InterfaceSpec, Memory, Network, Ports, Protocol, RouterFile, RuleSpec, Side, Target, TunSpec};
use cohaptic_tests_common::properties;
use cohaptic_units::Bytes;
use cohaptic_wan::{Delay, LinkConfig};
use proptest::prelude::*;

const EVERY_KEY: &str = r#"
[router]
seed    = 7
memory  = { packets = 1000, bytes = "2MB" }
default = { left-to-right = "up", right-to-left = "pass" }

[left]
tun       = "left0"
addresses = ["10.1.0.1/24", "fd00:1::1/64"]
mtu       = 1400
namespace = "blue"

[right]
tun      = "right0"
existing = true
offloads = false

[links.up]
delay = "24ms"

[links.slow-one]
modulated = { by = "weather", good = { delay = "10ms" }, bad = { delay = "90ms" } }

[[modulators]]
name   = "weather"
states = [{ name = "good", sojourn = "2s" }, { name = "bad", sojourn = "1s" }]

[[rules]]
from        = "left"
source      = "10.1.0.0/24"
destination = "10.2.0.7"
protocol    = "tcp"
source-port = "1024-65535"
destination-port = 443
link        = "slow-one"

[[rules]]
protocol = 89
link     = "drop"

[[rules]]
port = " 5000 - 5001 "
link = "up"
"#;

fn parse(text: &str) -> Result<RouterFile, FileError> {
    RouterFile::parse(text, Path::new("router.toml"), &[])
}

fn network(text: &str) -> Option<Network> {
    Some(text.parse().unwrap())
}

#[test]
fn every_key_is_read() {
    let file = parse(EVERY_KEY).unwrap();
    assert_eq!((file.seed, file.memory), (7, Memory { packets: 1000, bytes: Bytes::new(2_000_000) }));
    assert_eq!(file.default, [Target::Link(0), Target::Pass]);
    let addresses = vec!["10.1.0.1/24".parse().unwrap(), "fd00:1::1/64".parse().unwrap()];
    let left = TunSpec { name: "left0".to_owned(), existing: false, addresses, mtu: Some(1400), offloads: true, namespace: Some("blue".to_owned()) };
    assert_eq!(file.left, Attachment::Tun(left));
    let right = TunSpec { name: "right0".to_owned(), existing: true, addresses: Vec::new(), mtu: None, offloads: false, namespace: None };
    assert_eq!(file.right, Attachment::Tun(right));
    let up = LinkConfig { delay: Delay::constant(Duration::from_millis(24)), ..LinkConfig::default() };
    assert_eq!((file.links[0].name.as_str(), &file.links[0].model), ("up", &up.into()));
    assert_eq!(file.link_index("slow-one"), Some(1));
    assert_eq!(file.links[0].keys.to_string(), "{ delay = \"24ms\" }");
    // The keys make the same links again, modulators among them.
    assert!(file.links.iter().all(|link| link.keys.model(Path::new("")).unwrap() == link.model));
    let any = RuleSpec {
        from: None,
        source: None,
        destination: None,
        protocol: None,
        source_port: None,
        destination_port: None,
        port: None,
        target: Target::Drop,
    };
    let first = RuleSpec {
        from: Some(Side::Left),
        source: network("10.1.0.0/24"),
        destination: network("10.2.0.7"),
        protocol: Some(Protocol::TCP),
        source_port: Some(Ports { first: 1024, last: 65_535 }),
        destination_port: Some(Ports { first: 443, last: 443 }),
        port: None,
        target: Target::Link(1),
    };
    let second = RuleSpec { protocol: Some(Protocol(89)), ..any.clone() };
    let third = RuleSpec { port: Some(Ports { first: 5000, last: 5001 }), target: Target::Link(0), ..any };
    assert_eq!(file.rules, [first, second, third]);
}

#[test]
fn what_is_not_said_has_a_default() {
    let file =
        parse("router = { default = \"pass\" }\nleft = { interface = \"eth1\" }\nright = { interface = \"eth2\", namespace = \"/run/x\" }").unwrap();
    assert_eq!((file.seed, file.memory, file.default), (0, Memory::default(), [Target::Pass; 2]));
    assert!(file.links.is_empty() && file.rules.is_empty());
    assert_eq!(file.left, Attachment::Interface(InterfaceSpec { name: "eth1".to_owned(), namespace: None }));
    assert_eq!(file.right.namespace(), Some("/run/x"));
}

/// Each edit of a valid file is refused with a message that begins with the line, the column and the key of the fault.
#[test]
fn a_fault_is_shown_where_it_is() {
    let cases = [
        ("delay = \"24ms\"", "delay = \"24 parsecs\"", "19:9: links.up.delay: unknown unit"),
        ("delay = \"24ms\"", "dlay = \"24ms\"", "19:1: links.up.dlay: unknown key: expected one of delay"),
        ("[links.up]", "[links.pass]", "18:8: links.pass: \"pass\" cannot be the name of a link"),
        ("[links.up]", "[links.\"a b\"]", "18:8: links.a b: \"a b\" cannot be the name"),
        (
            "right-to-left = \"pass\"",
            "right-to-left = \"uo\"",
            "5:51: router.default.right-to-left: there is no link \"uo\": expected one of up, slow-one, pass, drop; did you mean \"up\"?",
        ),
        (", right-to-left = \"pass\"", "", "5:11: router.default.right-to-left: missing key: expected the name of a link"),
        ("seed    = 7", "seed    = -7", "3:11: router.seed: -7 is out of range"),
        ("packets = 1000", "packets = 0", "4:23: router.memory.packets: 0 is out of range"),
        ("\"2MB\"", "\"0MB\"", "4:37: router.memory.bytes: zero is out of range"),
        ("\"left0\"", "\"left/0\"", "8:13: left.tun: \"left/0\" cannot be this name"),
        ("\"left0\"", "\"left%d\"", "8:13: left.tun: \"left%d\" cannot be this name"),
        ("\"left0\"", "\"a-name-that-is-too-long\"", "8:13: left.tun: "),
        ("\"10.1.0.1/24\"", "\"10.1.0.1/33\"", "9:14: left.addresses.0: \"10.1.0.1/33\" is not an address"),
        ("mtu       = 1400", "mtu       = 67", "10:13: left.mtu: 67 is out of range"),
        ("namespace = \"blue\"", "namespace = \"..\"", "11:13: left.namespace: \"..\" is not a namespace"),
        ("existing = true", "existing = true\nmtu = 1500", "16:7: right.mtu: an existing device is left as it is"),
        ("existing = true", "interface = \"eth1\"", "15:13: right.interface: a side is a tun or an interface"),
        ("tun      = \"right0\"\nexisting = true", "interface = \"eth1\"", "13:1: right: one side is a tun"),
        ("tun      = \"right0\"\nexisting = true", "tun = \"left0\"\nnamespace = \"blue\"", "13:1: right: both sides are the same device"),
        ("tun      = \"right0\"\n", "", "13:1: right.tun: missing key: expected tun = \"NAME\""),
        ("from        = \"left\"", "from        = \"top\"", "29:15: rules.0.from: unknown name \"top\": expected one of left, right"),
        ("\"10.1.0.0/24\"", "\"fd00::/24\"", "31:15: rules.0.destination: source and destination are of different families"),
        ("\"10.2.0.7\"", "\"10.2.0.7/\"", "31:15: rules.0.destination: \"10.2.0.7/\" is not an address"),
        ("protocol    = \"tcp\"", "protocol    = \"tpc\"", "32:15: rules.0.protocol: unknown name \"tpc\": expected one of tcp"),
        ("protocol    = \"tcp\"", "protocol    = \"icmp\"", "33:15: rules.0.source-port: only tcp and udp have ports"),
        ("protocol = 89", "protocol = 256", "38:12: rules.1.protocol: 256 is out of range"),
        ("\"1024-65535\"", "\"1024-65536\"", "33:15: rules.0.source-port: \"1024-65536\" is not a range of ports"),
        ("\"1024-65535\"", "\"1024-\"", "33:15: rules.0.source-port: \"1024-\" is not a range of ports"),
        ("\"1024-65535\"", "\"2-1\"", "33:15: rules.0.source-port: \"2-1\" is not a range of ports"),
        ("link        = \"slow-one\"\n", "", "28:1: rules.0.link: missing key: expected the name of a link, \"pass\" or \"drop\""),
        ("by = \"weather\"", "by = \"wether\"", "22:20: links.slow-one.modulated.by: "),
        ("[router]", "[ruoter]", "2:2: ruoter: unknown key: expected one of "),
    ];
    let mut wrong = Vec::new();
    for (written, instead, expected) in cases {
        assert_eq!(EVERY_KEY.matches(written).count(), 1, "{written}");
        let error = parse(&EVERY_KEY.replace(written, instead)).expect_err(instead).to_string();
        if !error.starts_with(&format!("router.toml:{expected}")) || !error.contains("expected") {
            wrong.push(format!("{instead}: expected {expected}, found\n{error}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn icmp_is_of_one_family() {
    let with_rule = |rule: &str| {
        parse(&format!(
            "router = {{ default = \"pass\" }}\nleft = {{ tun = \"a\" }}\nright = {{ tun = \"b\" }}\nrules = [{{ {rule}, link = \"drop\" }}]"
        ))
    };
    assert!(with_rule("protocol = \"icmp\", source = \"10.0.0.0/8\"").is_ok());
    assert!(with_rule("protocol = \"icmpv6\", destination = \"fe80::/10\"").is_ok());
    for rule in ["protocol = \"icmpv6\", source = \"10.0.0.0/8\"", "protocol = \"icmp\", destination = \"::/0\""] {
        assert!(with_rule(rule).unwrap_err().to_string().contains("rules.0.protocol: icmp is of IPv4"), "{rule}");
    }
}

#[test]
fn an_override_reaches_a_link_and_a_rule() {
    let overrides = ["links.up.delay=8ms".to_owned(), "rules.1.link=up".to_owned(), "router.default=drop".to_owned()];
    let file = RouterFile::parse(EVERY_KEY, Path::new("router.toml"), &overrides).unwrap();
    assert_eq!(file.links[0].model.mean_delay(), Duration::from_millis(8));
    assert_eq!((file.rules[1].target, file.default), (Target::Link(0), [Target::Drop; 2]));
    let error = RouterFile::parse(EVERY_KEY, Path::new("router.toml"), &["links.up.delay=8".to_owned()]).unwrap_err();
    assert_eq!(error.diagnostic().unwrap().override_text(), Some("links.up.delay=8"));
}

#[test]
fn a_file_is_read_and_one_that_is_not_there_is_named() {
    let error = RouterFile::read(Path::new("no/such/router.toml"), &[]).unwrap_err();
    assert!(error.is_io() && error.to_string().starts_with("no/such/router.toml: cannot be read: "));
}

properties! {
    /// A file with a piece cut out or put in is a router, or is refused with an error that can be shown.
    #[test]
    fn no_text_causes_a_panic(at in 0..EVERY_KEY.len(), length in 0_usize..60, splice in prop::sample::select(vec![
        "", "nan", "\"\"", "-1", "{}", "[]", "true", "\"all\"", "=", "\n[left]\n", "99999999999999999999999999999999999999999", "\"1-\"", "\"/0\"",
    ])) {
        let end = (at + length).min(EVERY_KEY.len());
        let text = format!("{}{splice}{}", &EVERY_KEY[..at], &EVERY_KEY[end..]);
        if let Err(error) = parse(&text) {
            prop_assert!(!error.to_string().is_empty());
        }
    }
}

/// Every TOML block of the manual's page about routers is a router file.
#[test]
fn the_files_of_the_manual_are_routers() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/router.md")).unwrap();
    let files: Vec<&str> = page.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(files.len() >= 2);
    for text in files {
        parse(text).unwrap_or_else(|error| panic!("{error}"));
    }
}

/// The length is checked before the parser runs, whose tree would take fifty times as much memory as the text. Line breaks alone are valid TOML.
#[test]
fn a_text_of_more_than_16_mebibytes_is_refused() {
    let parse = |bytes: usize| RouterFile::parse(&"\n".repeat(bytes), Path::new("router.toml"), &[]).unwrap_err().to_string();
    assert!(parse((16 << 20) + 1).contains("longer than 16 MiB: expected a file of at most that"));
    assert!(!parse(1 << 20).contains("MiB"));
}
