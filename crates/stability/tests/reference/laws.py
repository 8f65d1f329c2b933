"""The laws that remember, extrapolate or look back, from their equations: radii, mean squares and admittances of laws.json.

smoothed-average-position: FT(k) = a·FT(k − 1) + (1 − a)·[KT·(x − x̄) + BT·(v − v̄)], a = e^(−Tc/lag), at first 0. One more state for each peer.

extrapolated: FT = KT·(x − mean x̂_j) + BT·(v − mean v_j), x̂_j = x_j + min(age, horizon)·v_j, the age counted from when the sample was sent.

local-lag: FT(k) = KT·(x(k − L) − x̄(k)) + BT·(v(k − L) − v̄(k)), L the lag in ticks, rounded up. Two more states for each peer and tick.
"""

import dataclasses
import sys
import time
from functools import partial

from mpmath import mpf

import admittance
import mean_square
from cases import EVERY_DIFFERENT, NONE, Case, full_radius
from monodromy import Frame, relative, rigid_modes
from plant import Exact, Maps
from radius import digits, spectral_radius
from scene import EXTRAPOLATED, LOCAL_LAG, SMOOTHED, parse
from text import arm, scene


# Ticks of 0.5, 1 and 2 ms, offsets, phases, plants and delays.
EVERYTHING_DIFFERENT = {
    "delay": "12.5ms",
    "bo": 0.3,
    "peers": [
        EVERY_DIFFERENT[0] + '; clock = { offset = "123456ns" }',
        EVERY_DIFFERENT[1].replace("phase = 5", "phase = 3") + '; tick = "2ms"; compute-delay = 1',
        EVERY_DIFFERENT[2] + '; clock = { offset = "3ms" }; tick = "500us"',
    ],
    "links": [(0, 2, 'delay = "31ms"'), (2, 0, 'delay = "1ns"')],
}


def smoothed(n, kt, lag="10ms", **keys):
    return scene(n, kt, strategy=SMOOTHED, own=f'lag = "{lag}"', **keys)


def extrapolated(n, kt, horizon="100ms", **keys):
    return scene(n, kt, strategy=EXTRAPOLATED, own=f'horizon = "{horizon}"', **keys)


def local_lag(n, kt, lag="auto", **keys):
    return scene(n, kt, strategy=LOCAL_LAG, own=f'lag = "{lag}"', **keys)


def radius_by_modes(text):
    """The radius of N equal peers from two blocks, of one peer that hears λ times itself: λ = 1 and −1/(N − 1)."""
    made = parse(text)
    assert made.identical
    count = len(made.peers)
    one = dataclasses.replace(made, peers=made.peers[:1], links={(0, 0): made.links[0, 1]})
    maps = [Maps(Exact, made, made.peers[0], count)]
    together = rigid_modes(one)
    # Copies that are displaced against each other pull; a device that touches nothing stays where it is in either block.
    apart = [mode for mode in together if mode != "scene"]
    radii = []
    for echo, rigid in ((mpf(1), together), (mpf(-1) / (count - 1), apart)):
        frame = Frame(one, maps=maps, echo=echo)
        radii.append(spectral_radius(relative(one, frame.states, frame.matrix, rigid)[0])[0])
    return max(radii), len(together) - len(apart) + count * len(apart)


def radii_of_smoothed():
    strategy = "smoothed"
    yield Case(f"{strategy}-n2-default-lag", scene(2, 1000.0, strategy=SMOOTHED, delay="8ms"), "without a table the lag is 10 ms")
    yield Case(f"{strategy}-n2-80ms", smoothed(2, 300.0, delay="80ms"), "ten samples in flight a link")
    yield Case(f"{strategy}-n3-lag-0", smoothed(3, 1000.0, "0s", delay="8ms"), "average-position itself: 0.8964881385693")
    yield Case(f"{strategy}-n3-lag-1ms-0ms", smoothed(3, 1000.0, "1ms"), "no delay, a lag of one tick")
    yield Case(f"{strategy}-n3-lag-100ms", smoothed(3, 500.0, "100ms", delay="11.3ms"), "a lag of many frames")
    yield Case(f"{strategy}-n3-free", smoothed(3, 200.0, bo=1.0, delay="16ms", contact="none"), "none touches")
    yield Case(f"{strategy}-n3-update-4ms", smoothed(3, 700.0, "2500us", update="4ms", delay="9.5ms", split=False), "another frame, whole masses")
    yield Case(f"{strategy}-compute-delay", smoothed(3, 700.0, kc=1500.0, delay="8ms", compute_delay=1), "forces that are one tick late, of a lag")
    yield Case(
        f"{strategy}-arms",
        smoothed(2, 1000.0, delay="8ms", peers=["hand = " + arm(0.3, 10.0, 100.0), NONE + "; hand = " + arm(0.3, 1.0, 50.0)]),
        "one is tied to ground by its arm, the device of the other for itself",
    )
    yield Case(f"{strategy}-n5-two-touch", smoothed(5, 500.0, delay="8ms", peers=["", NONE, "", NONE, NONE]), "classes of two and three, mixed")
    yield Case(f"{strategy}-n5-inverse-n", smoothed(5, 1000.0, "3ms", delay="8ms", scaling="inverse-n", coupling_scaling="inverse-n"), "both scalings")
    yield Case(
        f"{strategy}-everything-different",
        smoothed(
            3,
            600.0,
            **EVERYTHING_DIFFERENT,
        ),
        "ticks of 0.5, 1 and 2 ms, each with its own a",
    )
    yield Case(f"{strategy}-n20", smoothed(20, 1000.0, delay="11.3ms"), "twenty equal peers: two blocks", "modes")
    yield Case(f"{strategy}-n20-free", smoothed(20, 50.0, "30ms", bo=0.5, bt=3.0, delay="8ms", contact="none"), "twenty and no device", "modes")


def radii_of_extrapolated():
    strategy = "extrapolated"
    yield Case(f"{strategy}-n2-default-horizon", scene(2, 500.0, strategy=EXTRAPOLATED, delay="8ms"), "without a table the horizon is 100 ms")
    yield Case(f"{strategy}-n2-80ms", extrapolated(2, 30.0, "1s", delay="80ms"), "ten samples in flight a link, all extrapolated")
    yield Case(f"{strategy}-n2-80ms-cut", extrapolated(2, 30.0, "83500us", delay="80ms"), "ages from 80 to 87 ms, cut at 83.5 ms")
    yield Case(f"{strategy}-n3-horizon-0", extrapolated(3, 1000.0, "0s", delay="8ms"), "average-position itself: 0.8964881385693")
    yield Case(f"{strategy}-n3-0ms", extrapolated(3, 1000.0, "1s"), "no delay: ages of 0 to 7 ms")
    yield Case(f"{strategy}-n3-free", extrapolated(3, 200.0, bo=1.0, delay="16ms", contact="none"), "none touches")
    yield Case(
        f"{strategy}-n3-free-undamped",
        extrapolated(3, 100.0, delay="3ms", contact="none"),
        "copies without damping that move on alike exert no force: exactly 1 once the position is left out, a Jordan block with it",
    )
    yield Case(f"{strategy}-n3-cut-in-frame", extrapolated(3, 1000.0, "11ms", delay="8ms"), "ages of 8 to 15 ms: four ticks of a frame are beyond the horizon")
    yield Case(f"{strategy}-n3-cut-at-0ms", extrapolated(3, 800.0, "2500us"), "ages of 0 to 7 ms, cut between two ticks")
    yield Case(f"{strategy}-n3-cut-always", extrapolated(3, 700.0, "5ms", delay="16ms"), "every age is beyond the horizon")
    yield Case(f"{strategy}-n3-update-4ms", extrapolated(3, 700.0, "50ms", update="4ms", delay="9.5ms", split=False), "another frame, whole masses")
    yield Case(f"{strategy}-compute-delay", extrapolated(3, 700.0, kc=1500.0, delay="8ms", compute_delay=1), "the age is that at the tick whose forces are late")
    yield Case(
        f"{strategy}-arms",
        extrapolated(2, 1000.0, delay="8ms", peers=["hand = " + arm(0.3, 10.0, 100.0), NONE + "; hand = " + arm(0.3, 1.0, 50.0)]),
        "one is tied to ground by its arm, the device of the other for itself",
    )
    yield Case(f"{strategy}-n5-two-touch", extrapolated(5, 500.0, "12ms", delay="8ms", peers=["", NONE, "", NONE, NONE]), "classes of two and three, mixed")
    links = [(0, 1, 'delay = "3ms"'), (1, 0, 'delay = "24ms"'), (0, 2, 'delay = "11.3ms"'), (2, 1, 'delay = "0s"'), (1, 2, 'delay = "19ms"')]
    # The free device slows down by more than the rest of the scene.
    different = {"delay": "8ms", "peers": [*EVERY_DIFFERENT[:2], "phase = 7; " + NONE], "links": links}
    yield Case(f"{strategy}-every-different", extrapolated(3, 400.0, "1s", **different), "phases, delays and plants: each link has its own ages")
    yield Case(f"{strategy}-every-different-cut", extrapolated(3, 400.0, "14ms", **different), "some links never beyond the horizon, some always, some at times")
    shifted = ['clock = { offset = "300us" }', 'clock = { offset = "300us" }; phase = 3']
    yield Case(f"{strategy}-offset", extrapolated(2, 600.0, "9ms", delay="4ms", peers=shifted), "one offset of all clocks: ages do not see it")
    offsets = [f'clock = {{ offset = "{offset}" }}' for offset in ("0s", "300us", "1700us")]
    yield Case(f"{strategy}-offsets", extrapolated(3, 500.0, "1s", delay="4ms", peers=offsets), "clocks that show other times: ages differ from link to link")
    behind = ["", 'clock = { offset = "6ms" }']
    yield Case(
        f"{strategy}-offsets-of-the-future",
        extrapolated(2, 500.0, "1s", delay="1ms", peers=behind),
        "to the clock of one the samples of the other were sent later than now: age 0, for most ticks",
    )
    ticks = ['tick = "1ms"', 'tick = "2ms"', 'tick = "500us"']
    yield Case(f"{strategy}-ticks", extrapolated(3, 500.0, "14ms", delay="8ms", peers=ticks), "ticks of 0.5, 1 and 2 ms")
    yield Case(
        f"{strategy}-everything-different",
        extrapolated(
            3,
            300.0,
            "17ms",
            **EVERYTHING_DIFFERENT,
        ),
        "ticks, offsets, phases, plants and delays",
    )
    yield Case(f"{strategy}-n20", extrapolated(20, 500.0, delay="11.3ms"), "twenty equal peers: two blocks", "modes")
    yield Case(f"{strategy}-n20-cut", extrapolated(20, 50.0, "12ms", bo=0.5, bt=3.0, delay="8ms", contact="none"), "twenty, no device, cut in the frame", "modes")


def radii_of_local_lag():
    strategy = "local-lag"
    yield Case(f"{strategy}-n3-push", local_lag(3, 200.0, "11ms", delay="8ms"), "the page of the comparators has 0.848044258")
    yield Case(f"{strategy}-n3-auto", scene(3, 1000.0, strategy=LOCAL_LAG, delay="8ms"), "without a table the lag is 11 ticks; the page has 1.0505577")
    yield Case(f"{strategy}-n3-lag-0", local_lag(3, 1000.0, "0s", delay="8ms"), "average-position itself: 0.8964881385693")
    yield Case(f"{strategy}-n3-lag-1ms-0ms", local_lag(3, 500.0, "1ms"), "no delay, one tick")
    yield Case(f"{strategy}-n2-rounded-up", local_lag(2, 300.0, "10200us", delay="8ms"), "eleven ticks")
    yield Case(f"{strategy}-n2-within-a-frame", local_lag(2, 300.0, "3ms", delay="11.3ms"), "shorter than a frame")
    yield Case(f"{strategy}-n2-40ms", local_lag(2, 50.0, delay="40ms"), "43 ticks and five samples in flight a link", "modes")
    yield Case(f"{strategy}-n3-free", local_lag(3, 100.0, bo=1.0, delay="16ms", contact="none"), "none touches")
    yield Case(
        f"{strategy}-n3-free-undamped",
        local_lag(3, 20.0, delay="3ms", contact="none"),
        "each sample is in use around its middle age: copies that move on alike exert no force on average",
    )
    yield Case(f"{strategy}-n3-update-4ms", local_lag(3, 300.0, update="4ms", delay="9.5ms", split=False), "another frame, whole masses")
    yield Case(f"{strategy}-compute-delay", local_lag(3, 300.0, kc=1500.0, delay="8ms", compute_delay=1), "forces that are one tick late")
    yield Case(
        f"{strategy}-arms",
        local_lag(2, 300.0, delay="8ms", peers=["hand = " + arm(0.3, 10.0, 100.0), NONE + "; hand = " + arm(0.3, 1.0, 50.0)]),
        "one is tied to ground by its arm, the device of the other for itself",
    )
    yield Case(f"{strategy}-n5-two-touch", local_lag(5, 300.0, "3ms", delay="8ms", peers=["", NONE, "", NONE, NONE]), "classes of two and three, mixed")
    yield Case(
        f"{strategy}-everything-different",
        local_lag(
            3,
            200.0,
            "7ms",
            **EVERYTHING_DIFFERENT,
        ),
        "14, 7 and 4 ticks of 0.5, 1 and 2 ms",
    )
    yield Case(f"{strategy}-n20", local_lag(20, 300.0, delay="11.3ms"), "twenty equal peers: two blocks", "modes")
    yield Case(f"{strategy}-n20-free", local_lag(20, 50.0, "5ms", bo=0.5, bt=3.0, delay="8ms", contact="none"), "twenty and no device", "modes")


def radii():
    yield from radii_of_smoothed()
    yield from radii_of_extrapolated()
    yield from radii_of_local_lag()


def mean_squares():
    """(name, scene, why). A horizon of 1 s is never reached but with a chance far below the digits given."""
    chain = "{ gilbert-elliott = { p = 0.05, r = 0.4 } }"
    jitter = '{ sd = "1443375ns", distribution = "uniform" }'
    unlike = [(0, 1, "loss = 0.4"), (2, 0, "loss = 0.0"), (1, 2, 'loss = 0.6; delay = "3ms"')]
    for law, short, own in ((smoothed, "smoothed", "10ms"), (extrapolated, "extrapolated", "1s")):
        make = partial(law, **{"lag" if law is smoothed else "horizon": own})
        for loss in (None, 0.1, 0.5):
            yield f"{short}-n2-8ms-p{loss or 0}", make(2, 500.0, delay="8ms", loss=loss), "every link loses each sample with the same probability"
        yield f"{short}-n2-3ms-p0.3-free", make(2, 200.0, bo=1.0, delay="3ms", loss=0.3, contact="none"), "none touches"
        yield f"{short}-n2-0ms-p0.2-compute-delay", make(2, 300.0, loss=0.2, compute_delay=1), "forces one tick late"
        yield f"{short}-n3-0ms-p0.2", make(3, 500.0, loss=0.2), "no delay"
        yield f"{short}-n3-8ms-p0.1-free", make(3, 200.0, bo=1.0, delay="8ms", loss=0.1, contact="none"), "none touches"
        yield (
            f"{short}-n3-different",
            make(3, 400.0, delay="8ms", loss=0.1, peers=["", "phase = 3", NONE], links=unlike),
            "another probability on each link",
        )
        yield f"{short}-n2-gilbert", make(2, 500.0, delay="8ms", loss=chain), "bursts of 2.5 packets"
        yield f"{short}-n2-jitter", make(2, 500.0, delay="2500us", jitter=jitter), "uniform from 0 to 5 ms: 1, 2, 3, 4 or 5 ticks"
    yield (
        "smoothed-held-sample",
        smoothed(3, 400.0, "3ms", loss=0.1, links=[(1, 2, "loss = 0.95")]),
        "a held sample with KT·x + BT·v = 0 acts on nothing and stays with the chance of a loss: exactly 0.95",
    )
    yield (
        "extrapolated-held-sample",
        extrapolated(3, 400.0, "1s", loss=0.1, links=[(1, 2, "loss = 0.84")]),
        "a held sample moves on, so that none acts on nothing for ever",
    )
    yield "local-lag-n2-p0.3", local_lag(2, 300.0, "4ms", delay="3ms", loss=0.3), "every link loses each sample with the same probability"
    yield "local-lag-n2-free", local_lag(2, 100.0, "2ms", bo=1.0, delay="3ms", loss=0.2, contact="none"), "none touches"
    yield "local-lag-n3-p0.1", local_lag(3, 300.0, "3ms", loss=0.1), "no delay"
    yield "local-lag-n2-compute-delay", local_lag(2, 200.0, "2ms", loss=0.2, compute_delay=1), "forces one tick late"
    yield "local-lag-n2-gilbert", local_lag(2, 300.0, "3ms", delay="8ms", loss=chain), "bursts of 2.5 packets"
    yield "local-lag-n2-jitter", local_lag(2, 300.0, "6ms", delay="2500us", jitter=jitter), "uniform from 0 to 5 ms: 1, 2, 3, 4 or 5 ticks"
    yield "local-lag-n3-different", local_lag(3, 200.0, "2ms", delay="8ms", loss=0.1, peers=["", "phase = 3", NONE], links=unlike), "no symmetry"
    yield "smoothed-n2-lag-100ms", smoothed(2, 500.0, "100ms", delay="8ms", loss=0.3), "a lag of many frames"
    yield (
        "extrapolated-n2-free-undamped",
        extrapolated(2, 50.0, "1s", delay="3ms", loss=0.1, contact="none"),
        "copies that move on alike exert no force, whatever is lost: exactly 1",
    )


def one_touches(law, *arguments, **keys):
    return law(2, *arguments, peers=["", NONE], **keys)


def admittances():
    """(name, scene, place of the peer, frequencies, why)."""
    wide = [0.01, 1.0, 7.3, 40.0, 125.0, 300.0]
    yield "smoothed-n2", one_touches(smoothed, 200.0, delay="8ms"), 0, wide, "one touches"
    yield "smoothed-n3-lag-100ms", smoothed(3, 300.0, "100ms", delay="11.3ms", bo=2.0), 1, [0.5, 5.0, 62.5], "all touch"
    yield "smoothed-different", smoothed(3, 800.0, "3ms", delay="8ms", peers=EVERY_DIFFERENT), 1, [0.2, 4.0, 25.0], "no symmetry"
    ticks = ["", 'tick = "2ms"; clock = { offset = "300us" }']
    yield "smoothed-two-ticks", smoothed(2, 200.0, delay="3ms", peers=ticks), 1, [0.3, 6.0], "ticks of the peer's own clock"
    yield "smoothed-compute-delay", smoothed(2, 200.0, kc=1500.0, delay="8ms", compute_delay=1), 0, [0.3, 6.0], "forces one tick late"
    yield "extrapolated-n2", one_touches(extrapolated, 1000.0, delay="8ms"), 0, wide, "one touches"
    yield "extrapolated-n2-cut", one_touches(extrapolated, 1000.0, "11ms", delay="8ms"), 0, wide, "four ticks of a frame are beyond the horizon"
    yield "extrapolated-n3-24ms", extrapolated(3, 300.0, "1s", delay="24ms", bo=2.0), 1, [0.5, 5.0, 62.5], "all touch"
    yield "extrapolated-different", extrapolated(3, 400.0, "14ms", delay="8ms", peers=EVERY_DIFFERENT), 1, [0.2, 4.0, 25.0], "no symmetry, cut on some links"
    yield "extrapolated-compute-delay", extrapolated(2, 500.0, kc=1500.0, delay="8ms", compute_delay=1), 0, [0.3, 6.0], "forces one tick late"
    yield "local-lag-n2", one_touches(local_lag, 200.0, delay="8ms"), 0, wide, "one touches"
    yield "local-lag-n3-24ms", local_lag(3, 100.0, delay="24ms", bo=2.0), 1, [0.5, 5.0, 62.5], "all touch"
    yield "local-lag-different", local_lag(3, 200.0, "9ms", delay="8ms", peers=EVERY_DIFFERENT), 1, [0.2, 4.0, 25.0], "no symmetry"
    yield "local-lag-compute-delay", local_lag(2, 200.0, kc=1500.0, delay="8ms", compute_delay=1), 0, [0.3, 6.0], "forces one tick late"


def check():
    """What must agree before anything is written."""
    near = mpf(10) ** -60
    for law, bound in ((smoothed, "10ms"), (extrapolated, "10ms"), (extrapolated, "1s"), (local_lag, "5ms")):
        for keys in ({"delay": "8ms"}, {"delay": None}, {"delay": "11.3ms", "contact": "none", "bo": 1.0}, {"compute_delay": 1, "update": "4ms"}):
            text = law(5, 300.0, bound, **keys)
            (full, rigid), (blocks, of_blocks) = full_radius(text), radius_by_modes(text)
            assert abs(full - blocks) < near and rigid == of_blocks, "two blocks and the full matrix"
    plain = full_radius(scene(3, 1000.0, delay="8ms"))[0]
    for law in (smoothed, extrapolated, local_lag):
        assert abs(full_radius(law(3, 1000.0, "0s", delay="8ms"))[0] - plain) < near, "without lag and horizon it is average-position"
    for kt, anchor in ((200.0, "0.848044258"), (1000.0, "1.0505577")):
        assert abs(full_radius(local_lag(3, kt, delay="8ms"))[0] - mpf(anchor)) < mpf(6) / 10 ** len(anchor.split(".")[1]) / 10, "of another simulation"
    for keys in ({"peers": EVERY_DIFFERENT}, {"compute_delay": 1}, {"update": "4ms", "links": [(0, 1, 'delay = "19ms"')]}):
        made = parse(extrapolated(3, 400.0, "1s", delay="11.3ms", **keys))
        frame = Frame(made, outcomes={pair: link.delay for pair, link in made.links.items()})
        moving = spectral_radius(relative(made, frame.states, frame.matrix)[0])[0]
        assert abs(moving - full_radius(made.text)[0]) < near, "held as sent, and moved on to the present"
    different = {"delay": "8ms", "peers": EVERY_DIFFERENT}
    admittance.check(
        (
            (one_touches(smoothed, 200.0, delay="8ms"), 0, 5.0, 100_000),
            (smoothed(3, 800.0, "3ms", **different), 1, 25.0, 30_000),
            (one_touches(extrapolated, 1000.0, "11ms", delay="8ms"), 0, 62.5, 100_000),
            (extrapolated(3, 400.0, "1s", **different), 1, 25.0, 30_000),
            (local_lag(3, 200.0, "9ms", **different), 1, 25.0, 30_000),
        )
    )


def radius_entry(place):
    case = list(radii())[place]
    began = time.monotonic()
    radius, rigid = (full_radius if case.method == "full" else radius_by_modes)(case.text)
    print(f"{time.monotonic() - began:6.1f} s  {digits(radius, 14)}  {rigid}  {case.name}", file=sys.stderr, flush=True)
    return {"name": case.name, "scene": case.text, "radius": digits(radius), "rigid_modes": rigid, "why": case.why}


def mean_square_entry(place):
    return mean_square.entry_of(*list(mean_squares())[place])


def admittance_group(place):
    return admittance.group_of(*list(admittances())[place])


def entries(pool):
    check()

    def every(entry, cases):
        return list(pool.imap(entry, range(len(list(cases()))), chunksize=1))

    return {
        "radii": every(radius_entry, radii),
        "mean_square": every(mean_square_entry, mean_squares),
        "admittance": sum(every(admittance_group, admittances), []),
    }
