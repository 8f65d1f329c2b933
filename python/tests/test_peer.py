"""Devices in Python: the gate, the peer, the protocol, the loop with its ends, and a device beside `cohaptic live`."""

import contextlib
import json
import math
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import ROOT, program

from cohaptic import Reading, join, peer
from cohaptic.peer import Body, Cause, Gate, Joining, Limits, Mechanics, Moment, Peer, Sample, Session

MS = 1_000_000


def well(now: int) -> Moment:
    return Moment(now, True, True, now, now)


def test_a_force_comes_up_as_fast_as_it_may_and_no_faster() -> None:
    gate = Gate(Limits(force=3.0))
    assert [gate.admit([0.0, 0.0, 8.0], well(k * MS)) for k in range(5)] == [
        ([0.0, 0.0, height], Cause.FORCE) for height in (0.0, 1.0, 2.0, 3.0, 3.0)
    ]


STRONG = [0.0, 2.0, 0.0]
CAUSES = [
    (replace(well(2 * MS), ready=False), STRONG, Cause.NOT_READY),
    (replace(well(2 * MS), armed=False), STRONG, Cause.NOT_ARMED),
    (replace(well(2 * MS), reading_at=None), STRONG, Cause.STALE_READING),
    (replace(well(13 * MS), reading_at=3 * MS - 1), STRONG, Cause.STALE_READING),
    (replace(well(2 * MS), reading_at=3 * MS), STRONG, Cause.STALE_READING),
    (replace(well(2 * MS), setpoint_at=None), STRONG, Cause.STALE_SETPOINT),
    (replace(well(20 * MS), setpoint_at=-30 * MS - 1), STRONG, Cause.STALE_SETPOINT),
    (well(21 * MS + 1), STRONG, Cause.LOOP_LATE),
    *(
        (well(2 * MS), odd, Cause.NOT_FINITE)
        for odd in ([math.nan, 2.0, 0.0], [0.0, math.inf, 0.0], [0.0, 2.0, -math.inf])
    ),
]


def strong_gate() -> Gate:
    gate = Gate(Limits(force=4.0, slew=1e6))
    gate.admit(STRONG, well(0))
    assert gate.admit(STRONG, well(1 * MS)) == (STRONG, Cause.FORCE)
    return gate


@pytest.mark.parametrize(("moment", "wanted", "cause"), CAUSES)
def test_each_cause_alone_makes_zero_at_once(moment: Moment, wanted: list[float], cause: Cause) -> None:
    gate = strong_gate()
    assert gate.admit(wanted, moment) == ([0.0] * 3, cause)
    assert gate.counts[cause] == 1
    # After zero, the force grows from zero.
    assert gate.admit(STRONG, well(moment.now)) == ([0.0] * 3, Cause.FORCE)
    assert gate.admit(STRONG, well(moment.now + MS)) == (STRONG, Cause.FORCE)


def test_a_stop_is_for_good() -> None:
    gate = strong_gate()
    gate.stop()
    gate.stop()
    assert all(gate.admit(STRONG, well(k * MS)) == ([0.0] * 3, Cause.STOPPED) for k in range(2, 100))


def test_limits_that_make_no_sense_are_refused() -> None:
    for limits in ({"force": math.nan}, {"force": 20.1}, {"force": -1.0}, {"slew": 0.0}, {"slew": math.nan}):
        with pytest.raises(ValueError, match="the limit of"):
            Limits(**limits)
    gate = Gate(Limits(slew=1e6))
    gate.admit([0.0] * 3, well(0))
    force, _ = gate.admit([-1e308, 1e308, 1e308], well(MS))
    assert force == pytest.approx([-math.sqrt(3), math.sqrt(3), math.sqrt(3)])


FIGURES = [
    (
        Mechanics(coordination=(500.0, 5.0)),
        (0.00418909868044695, -0.0126283653899512, 0.003717446243695, -0.0121602475770235),
    ),
    (
        Mechanics(coupling=(1000.0, 2.0), coordination=(500.0, 5.0), exchange_every=2, exchange_age=1),
        (0.00524952463767579, -0.0111540648355197, 0.00377446409899885, -0.00545479030280096),
    ),
]


@pytest.mark.parametrize(("mechanics", "expected"), FIGURES)
def test_the_peer_moves_to_the_figures_of_the_program(mechanics: Mechanics, expected: tuple[float, ...]) -> None:
    """100 ticks of a device of 0.1 kg and 5 N·s/m under 1.5 N, with the copy of the other peer at rest."""
    me = Peer(Session(1, 0), mechanics, None, 0)
    device = Body(0.1, 5.0, 0.001, me.reading)
    for k in range(100):
        me.tick(k, device.states)
        device.move([1.5 + me.on_hand[0]])
    found = (*device.states[0], *me.copy.states[0])
    assert all(abs(one - other) < 1e-12 for one, other in zip(found, expected, strict=True))


def test_pd_is_ap_with_the_gains_of_all_others() -> None:
    session = Session(1, 0, peers=4)
    ap = Peer(session, Mechanics(coordination=(900.0, 15.0)), None, 0)
    pd = Peer(session, Mechanics(coordination=(300.0, 5.0), law="PD"), None, 0)
    for k in range(50):
        ap.tick(k, [(0.01, 0.0)])
        pd.tick(k, [(0.01, 0.0)])
    assert ap.copy.states == pd.copy.states
    assert ap.copy.states[0][0] > 1e-3


def test_a_peer_begins_anew_after_silence() -> None:
    """After a second one hello in 250 ms, with one new nonce; then numbers begin anew. Another scene ends the loop."""
    s, key = 10**9, bytes(range(32))
    for update in (8_000_000, 16_000_000):
        session = Session(7, 0)
        me = Peer(session, Mechanics(), Joining(key, session), 5 * s)
        me.others[1].newest = 900
        assert me.begin_anew(6 * s - 1) is None
        hello = me.begin_anew(6 * s)
        assert hello is not None
        assert me.begin_anew(6 * s + 249 * MS) is None
        assert me.begin_anew(6 * s + 250 * MS) == hello
        body = peer.datagrams.WELCOME.pack(b"CHPW", 1, 1, 0, 7, 0, 2, hello[24:40], bytes(16), 1_000_000, update)
        welcome = body + peer.datagrams.tag(key, body)
        if update == session.update_ns:
            assert me.take(welcome, 7 * s)
            assert (me.joinings, me.others[1].newest, me.is_in_silence(7 * s)) == (2, None, False)
            assert not me.take(welcome, 7 * s)
        else:
            with pytest.raises(ConnectionError, match="another scene"):
                me.take(welcome, 7 * s)


def blocks() -> dict[str, bytes]:
    """The blocks of bytes of the worked examples, by title."""
    found: dict[str, bytes] = {}
    for block in (ROOT / "docs/examples/live-protocol.txt").read_text(encoding="utf-8").split("[")[1:]:
        title, lines = block.split("]\n", 1)
        rows = [line[6 : 6 + 48] for line in lines.split("\n\n")[0].splitlines()]
        found[title] = bytes.fromhex("".join(rows))
    return found


@pytest.fixture
def joining(monkeypatch: pytest.MonkeyPatch) -> Joining:
    monkeypatch.setattr(os, "urandom", lambda count: bytes(range(0x40, 0x40 + count)))
    return Joining(bytes(range(32)), Session(0x0123456789ABCDEF, 1))


def test_the_bytes_are_those_of_the_page(joining: Joining) -> None:
    expected = blocks()
    assert joining.hello() == expected["hello"]
    told = joining.handle_welcome(expected["welcome"])
    assert told == Session(0x0123456789ABCDEF, 1, 3, 1, False, 1_000_000, 8_000_000)
    assert (joining.to_door, joining.to_peer) == (expected["key to the session"], expected["key to the peer"])
    sealed = joining.seal(peer.encode(told, Sample(1, 5, 40 * MS, [(0.025, -1.5)])))
    assert sealed == expected["to the session"]
    assert joining.open(sealed) is None
    plain = joining.open(expected["to the peer"])
    assert plain is not None
    assert peer.decode(told, plain) == Sample(0, 7, 56 * MS, [(-0.5, 0.125)])


def test_a_notice_of_a_taken_place_is_counted_and_no_other_one(joining: Joining) -> None:
    sealed, plain = blocks()["taken"], blocks()["taken without a key"]
    for keyed, notice in ((joining, sealed), (None, plain)):
        me = Peer(joining.session, Mechanics(), keyed, 0)
        assert me.take(notice, 1)
        assert (me.taken, me.ignored, me.heard_at) == (1, 0, 0)
        # Another session, place, nonce or tag, a byte more, and the notice of the other kind of session.
        changed = [bytes(byte ^ (k == at) for k, byte in enumerate(notice)) for at in range(len(notice))]
        for other in (*changed, notice + b"\0", notice[:-1], plain if keyed else sealed):
            assert not me.take(other, 1)
        assert (me.taken, me.ignored) == (1, len(notice) + 3)


def test_a_device_learns_that_another_program_has_its_place() -> None:
    """A session on the loopback interface that refuses every sample. It answers in the thread of the peer, so that no notice comes too late."""
    notice = peer.datagrams.NOTICE.pack(b"CHPS", 1, 0, 7, 1, 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as door:
        door.bind(("127.0.0.1", 0))
        door.setblocking(False)
        grip = Grip()

        def answer() -> Reading:
            with contextlib.suppress(BlockingIOError):
                door.sendto(notice, door.recvfrom(peer.client.BUFFER_LEN)[1])
            return Reading((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

        grip.read = answer
        joined = join(grip, f"127.0.0.1:{door.getsockname()[1]}", session=7, place=1, duration=0.1)
    assert (joined.sent, joined.taken, joined.ignored, joined.received) == (13, 13, 0, {0: 0})


def test_a_hello_may_tell_scene_and_label(joining: Joining) -> None:
    told = Joining(joining.key, joining.session, 0x1122334455667788, "inverse3")
    assert told.hello()[:40] == joining.hello()[:40]
    assert told.hello()[40:72] == bytes.fromhex("8877665544332211") + b"inverse3" + bytes(16)
    assert told.hello()[72:] != joining.hello()[72:]
    for label in ("much too long", "a b", "é", "a\n"):
        with pytest.raises(ValueError, match="8 printable"):
            Joining(joining.key, joining.session, 0, label)


def test_no_datagram_breaks_the_peer() -> None:
    """Noise and mutations of samples, with and without a key: what is refused changes nothing."""
    dice = random.Random(1)
    taken = 0
    for _ in range(3000):
        turns = dice.random() < 0.3
        session = Session(7, 1, peers=dice.randint(2, 4), axes=3 if turns else dice.randint(1, 3), turns=turns)
        joining = Joining(dice.randbytes(32), session) if dice.random() < 0.5 else None
        if joining:
            joining.to_peer = dice.randbytes(32)
        me = Peer(session, Mechanics(inertia=(1e-3, 1e-3, 1e-3) if turns else None), joining, 0)
        sample = Sample(
            dice.randint(0, 4),
            dice.getrandbits(40),
            0,
            [(0.01, 0.2)] * session.axes,
            peer.Attitude() if turns else None,
        )
        datagram = bytearray(peer.encode(session, sample))
        if joining:
            datagram += joining.nonce
            datagram += peer.datagrams.tag(joining.to_peer, bytes(datagram))
        kind = dice.randint(0, 3)
        if kind == 0:
            datagram = bytearray(dice.randbytes(dice.randint(0, 250)))
        elif kind == 1:
            datagram[dice.randrange(len(datagram))] ^= 1 << dice.randint(0, 7)
        elif kind == 2:
            del datagram[dice.randrange(len(datagram)) :]
        held = {place: list(other.states) for place, other in me.others.items()}
        if me.take(bytes(datagram), 1):
            taken += 1
            assert kind == 3 or (kind == 1 and not joining)
        else:
            assert {place: other.states for place, other in me.others.items()} == held
            assert me.ignored == 1
            assert kind != 3 or sample.sender not in me.others
        assert all(math.isfinite(x) and math.isfinite(v) for other in me.others.values() for x, v in other.states)
        me.tick(0, None)
    assert taken > 300


class Grip:
    """A grip that stands 50 mm away from the copy, so that KC asks for 175 N."""

    def __init__(
        self, at: float = 0.05, armed: bool = True, on_push: Callable[["Grip"], None] = lambda grip: None
    ) -> None:
        self.at, self.armed, self.on_push = at, armed, on_push
        self.forces: list[list[float]] = []
        self.stops = 0

    def read(self) -> Reading:
        return Reading((self.at, 0.0, 0.0), (0.0, 0.0, 0.0), armed=self.armed)

    def push(self, force: list[float]) -> None:
        self.forces.append(list(force))
        if not self.stops and len(self.forces) == 60:
            self.on_push(self)

    def stop(self) -> None:
        self.stops += 1

    @property
    def largest(self) -> float:
        return max(abs(force[0]) for force in self.forces)


SILENT = "127.0.0.1:9"


def test_the_time_ends_a_loop_and_its_forces() -> None:
    grip = Grip()
    joined = join(grip, SILENT, session=7, place=1, duration=0.2)
    assert (joined.ended, joined.ticks, joined.sent, grip.stops) == ("time", 200, 25, 1)
    assert 0 < grip.largest <= 3
    assert all(abs(to[0] - last[0]) <= 20.0 for last, to in zip(grip.forces, grip.forces[1:], strict=False))
    assert grip.forces[-1] == [0.0] * 3
    # The device pulls the copy towards its place.
    assert 0 < joined.position[0] < 0.1
    assert sum(joined.pushes.values()) == 200


def test_a_device_that_is_not_armed_feels_nothing() -> None:
    grip = Grip(armed=False)
    joined = join(grip, SILENT, session=7, place=1, duration=0.1)
    assert joined.pushes == {"not armed": 100}
    assert grip.largest == 0
    assert joined.position == [0.0]


def test_a_device_that_is_not_ready_moves_nothing() -> None:
    grip = Grip()
    grip.read = lambda: Reading((0.05, 0.0, 0.0), (0.0, 0.0, 0.0), ready=False)
    assert join(grip, SILENT, session=7, place=1, duration=0.05).position == [0.0]
    grip.read = lambda: None
    joined = join(grip, SILENT, session=7, place=1, duration=0.05)
    assert (joined.position, joined.pushes, grip.largest) == ([0.0], {"not ready": 50}, 0)


def test_readings_that_are_not_finite_or_stop_coming_make_zero() -> None:
    grip = Grip()

    def fail(grip: Grip) -> None:
        grip.at = math.nan

    grip.on_push = fail
    joined = join(grip, SILENT, session=7, place=1, duration=0.15)
    assert joined.pushes["stale reading"] > 50
    assert grip.forces[-2:] == [[0.0] * 3] * 2
    assert math.isfinite(joined.position[0])


def test_silence_of_the_session_makes_zero() -> None:
    grip = Grip()
    joined = join(grip, SILENT, session=7, place=1, duration=1.3)
    # After a second without anybody no force is asked for, and the last request is valid for 50 ms.
    assert joined.pushes["stale setpoint"] > 100
    # A scene of one peer has nobody to hear.
    alone = join(Grip(), SILENT, session=7, place=0, peers=1, duration=1.2)
    assert "stale setpoint" not in alone.pushes


def test_an_event_ends_a_loop_from_any_thread_and_twice() -> None:
    until = threading.Event()
    grip = Grip()
    joined: list[object] = []
    thread = threading.Thread(target=lambda: joined.append(join(grip, SILENT, session=7, place=1, until=until)))
    thread.start()
    while len(grip.forces) < 30:
        time.sleep(0.001)
    until.set()
    until.set()
    thread.join(10)
    assert not thread.is_alive()
    assert grip.stops == 1
    assert grip.forces[-1] == [0.0] * 3
    assert [one.ended for one in joined] == ["stop"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_a_loop_and_are_given_back(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    grip = Grip(on_push=lambda grip: os.kill(os.getpid(), number))
    joined = join(grip, SILENT, session=7, place=1)
    assert (joined.ended, grip.stops, grip.forces[-1]) == (number.name, 1, [0.0] * 3)
    assert signal.getsignal(number) is before


def test_a_second_signal_leaves_a_device_that_hangs() -> None:
    def hang(grip: Grip) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60)

    grip = Grip(on_push=hang)
    with pytest.raises(KeyboardInterrupt):
        join(grip, SILENT, session=7, place=1)
    assert (grip.stops, grip.forces[-1]) == (1, [0.0] * 3)


def test_exceptions_of_the_device_end_a_loop() -> None:
    def fail(grip: Grip) -> None:
        raise RuntimeError("the cable is out")

    grip = Grip(on_push=fail)
    with pytest.raises(RuntimeError, match="cable"):
        join(grip, SILENT, session=7, place=1)
    assert grip.stops == 1

    class Broken(Grip):
        def read(self) -> Reading:
            raise OSError("no device")

        def push(self, force: list[float]) -> None:
            raise OSError("no device")

    broken = Broken()
    with pytest.raises(OSError, match="no device"):
        join(broken, SILENT, session=7, place=1)
    assert broken.stops == 1


def test_the_end_of_the_interpreter_stops_a_device_in_a_daemon_thread(tmp_path: Path) -> None:
    script = tmp_path / "daemon.py"
    script.write_text(
        f"""
import threading, time
from cohaptic import Reading, join
class Grip:
    pushed = threading.Event()
    def read(self):
        return Reading((0.05, 0.0, 0.0), (0.0, 0.0, 0.0))
    def push(self, force):
        if force[0]:
            self.pushed.set()
    def stop(self):
        print("off", flush=True)
grip = Grip()
threading.Thread(target=join, args=(grip, {SILENT!r}), kwargs=dict(session=7, place=1), daemon=True).start()
grip.pushed.wait()
"""
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.splitlines()[0] == "off", done


def test_what_does_not_fit_is_refused_and_the_device_stopped(tmp_path: Path) -> None:
    key = tmp_path / "session.key"
    key.write_text("00" * 32)
    key.chmod(0o644)
    refusals = [
        ({"place": 2}, ValueError, "do not fit together"),
        ({"axes": 4}, ValueError, "do not fit together"),
        ({"inertia": (1.0, 1.0, 1.0)}, ValueError, "three axes"),
        ({"exchange_every": 21}, ValueError, "20 ms"),
        ({"force_limit": 21.0}, ValueError, "20 N"),
        ({"object_mass": 0.0}, ValueError, "mass"),
        ({"key_file": key}, PermissionError, "chmod 600"),
        ({"key_file": tmp_path / "none.key"}, FileNotFoundError, "none.key"),
    ]
    for options, error, text in refusals:
        grip = Grip()
        with pytest.raises(error, match=text):
            join(grip, SILENT, **{"session": 7, "place": 1, "duration": 0.1, **options})
        assert grip.stops == 1
        assert not any(any(force) for force in grip.forces)
    key.chmod(0o600)
    grip = Grip()
    with pytest.raises(TimeoutError, match="is the key the same"):
        join(grip, SILENT, session=7, place=1, key_file=key, patience=0.3)
    assert grip.stops == 1
    with pytest.raises(ValueError, match="HOST:PORT"):
        join(Grip(), "nowhere", session=7, place=1)


SCENE = """
scene        = { duration = "60s", seed = 7 }
object       = { mass = 0.45 }
coordination = { strategy = "average-position", stiffness = 300.0, damping = 5.0, update = "8ms" }
peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
peers        = [{ name = "left", hand = { force = 0.5 } }, { name = "right", kind = "udp" }]
link         = { delay = "8ms" }
"""


@pytest.fixture
def session(tmp_path: Path) -> Iterator[tuple[str, Path, subprocess.Popen[str]]]:
    """A session with a key: its address, its key file and its process."""
    (tmp_path / "scene.toml").write_text(SCENE)
    subprocess.run([program(), "live", "--new-key", "session.key"], cwd=tmp_path, check=True, capture_output=True)
    command = [
        program(),
        "live",
        "scene.toml",
        "--listen",
        "127.0.0.1:0",
        "--key-file",
        "session.key",
        "--json",
        "--no-priority",
    ]
    running = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert running.stderr is not None
        line = running.stderr.readline()
        assert line.startswith("listening on "), line
        yield line.split()[2], tmp_path / "session.key", running
    finally:
        running.kill()
        running.communicate()


def test_a_device_takes_part_beside_a_session(session: tuple[str, Path, subprocess.Popen[str]]) -> None:
    door, key, running = session
    grip = Grip(at=0.0)
    # The longer the device takes part, the surer the session has heard it and been heard, on any machine.
    for duration in (1.0, 4.0, 16.0):
        joined = join(grip, door, session=7, place=1, key_file=key, duration=duration, label="python")
        if joined.received[0] > 0 and grip.largest > 0:
            break
    assert joined.joinings >= 1
    assert joined.received[0] > 0
    assert joined.position[0] > 0
    # The person on the left pushes to the right, and the grip feels that: a force to the right on a hand at rest.
    assert max(force[0] for force in grip.forces) > 0
    running.send_signal(signal.SIGINT)
    out, _ = running.communicate(timeout=60)
    document = json.loads(out)
    assert document["door"]["admitted"] > 0
    assert document["door"]["refused"] == {} or not any(document["door"]["refused"].values())
