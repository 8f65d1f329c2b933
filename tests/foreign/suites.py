"""The suites, the loopbacks, and the tests that cannot run on a test bed."""

from dataclasses import dataclass, field

IDEAL = "delay 0ms"
# Tests that pass without any packet do not need the network.
CUT = "loss 100%"
LOOPBACKS = [IDEAL, "delay 20ms loss 1%", "delay 50ms 10ms loss 3%", "rate 10mbit delay 30ms loss 5%"]


@dataclass
class Suite:
    name: str
    version: str
    licence: str
    # Features for the tests, as the project itself chooses them.
    features: list[str] = field(default_factory=list)
    # Lines of a manifest: dependencies that the project's own workspace brings, and the archive does not name.
    beside: list[str] = field(default_factory=list)
    # Environment of the tests with `cohaptic test`.
    variables: dict[str, str] = field(default_factory=dict)
    # Programs of tests that are left out.
    skipped: tuple[str, ...] = ()
    # Runs on the real loopback, and seeds at most: slow suites have fewer.
    reals: int = 3
    seeds: int = 20
    # Runs under load that go at the same time. More than one only for suites that mostly sleep, so that the runs hardly disturb each other.
    at_once: int = 1
    # Tests that fail on an ideal loopback, and why.
    limits: dict[str, str] = field(default_factory=dict)


BEFORE = "makes its socket before `block_on`, where a test bed does not run yet"
OF_QUINN = ["echo_dualstack", "echo_v4", "echo_v6", "export_keying_material", "handshake_timeout", "local_addr", "read_after_close"]

SUITES = [
    Suite("mini-redis", "0.4.1", "MIT"),
    # A lock keeps the tests apart. A test bed cannot wait for another thread, so that its tests run one after the other on one thread.
    Suite("bore-cli", "0.6.0", "MIT", variables={"RUST_TEST_THREADS": "1"}, at_once=10),
    # The program left out measures a hundred nodes in memory, for minutes and without a socket.
    Suite("chitchat", "0.10.1", "MIT", variables={"COHAPTIC_TEST_LIMIT": "30h"}, skipped=("test perf_test",), reals=1, seeds=3, at_once=10),
    # The macro of the tests is a private feature, which the archive of axum takes from a path.
    Suite(
        "axum",
        "0.8.9",
        "MIT",
        features=["http2", "macros", "multipart", "ws"],
        beside=['axum-macros = { version = "0.5", features = ["__private"] }'],
    ),
    Suite("quinn", "0.11.12", "MIT OR Apache-2.0", limits={f"lib quinn tests::{test}": BEFORE for test in OF_QUINN}),
]
