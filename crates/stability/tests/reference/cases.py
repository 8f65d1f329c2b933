"""The scenes of radii.json: (name, text, why, and for two peers in a hundred thousand another count)."""

import math
from dataclasses import dataclass

import mpmath
from mpmath import mpf

from monodromy import Frame, relative
from radius import spectral_radius
from scene import parse
from text import arm, number, scene

PD = "proportional-derivative"
NONE = 'contact = "none"'


@dataclass
class Case:
    name: str
    text: object  # the scene, or a function that finds it
    why: str
    method: str = "full"  # or "modes", "roots"
    count: int = 0  # in place of that of the scene, where no scene may have so many


def full_radius(text):
    made = parse(text)
    frame = Frame(made)
    matrix, rigid = relative(made, frame.states, frame.matrix)
    return spectral_radius(matrix)[0], rigid


def tuned(make, low, high, target):
    """The scene make(x) with the double x in low..high at which the radius is nearest to a target (Illinois' false position)."""
    target = mpf(target)
    f_low, f_high = (full_radius(make(x))[0] - target for x in (low, high))
    low, high = mpf(low), mpf(high)
    assert f_low * f_high < 0
    side = 0
    x = low
    for _ in range(80):
        x = (low * f_high - high * f_low) / (f_high - f_low)
        f = full_radius(make(x))[0] - target
        if abs(f) < mpf(10) ** -17 or abs(high - low) < mpf(10) ** -16 * abs(x):
            break
        if f * f_high > 0:
            high, f_high = x, f
            f_low /= 2 if side == 1 else 1
            side = 1
        else:
            low, f_low = x, f
            f_high /= 2 if side == -1 else 1
            side = -1
    return make(x)


def paper(strategy, kt, touching, arms, delay="24ms"):
    """Section 5 of the paper: three peers, the first `touching` of which touch."""
    hand = "hand = " + arm(0.3, 10.0, 100.0) if arms else ""
    return scene(3, kt, strategy=strategy, delay=delay, peers=[hand] * touching + [NONE] * (3 - touching))


def anchors():
    yield Case("anchor-n3-ap-8ms", scene(3, 1000.0, delay="8ms"), "control.md: 0.8964881385693")
    for strategy, short in (("average-position", "ap"), (PD, "pd")):
        for kt in (1000.0, 2100.0):
            for arms in (True, False):
                yield Case(
                    f"paper-5-1-{short}-{kt:.0f}" + ("" if arms else "-no-arm"),
                    paper(strategy, kt, 2, arms),
                    "Section 5.1 of the paper: two of three touch, 24 ms; published to four digits in docs/results.md",
                )
        yield Case(f"paper-5-2-{short}", paper(strategy, 1000.0, 1, False), "Section 5.2 of the paper: one of three touches; docs/results.md")
        yield Case(f"paper-5-1-{short}-48ms", paper(strategy, 2100.0, 2, True, "48ms"), "Section 5.1 read as 48 ms one way: six samples in flight a link")


def grid():
    """Equal peers: N, strategy, damping, gains, mass policy and delay, each value with several others."""
    table = [
        # n, strategy, B, KT, KC, split, delay
        (2, "ap", 0, 100.0, 500.0, True, None),
        (2, "ap", 5, 1000.0, 3500.0, False, "16ms"),
        (2, "pd", 5, 1000.0, 3500.0, True, "24ms"),
        (3, "ap", 0, 300.0, 1500.0, False, "8ms"),
        (3, "pd", 5, 500.0, 3500.0, True, None),
        (3, "pd", 0, 100.0, 3500.0, True, "16ms"),
        (4, "ap", 5, 2000.0, 1000.0, True, "8ms"),
        (4, "pd", 5, 100.0, 3500.0, False, "24ms"),
        (4, "ap", 0, 50.0, 200.0, True, "11.3ms"),
        (5, "ap", 5, 1000.0, 3500.0, True, "8ms"),
        (5, "pd", 0, 200.0, 2000.0, False, None),
        (5, "ap", 5, 700.0, 3500.0, False, "12.5ms"),
        (8, "ap", 5, 1000.0, 3500.0, True, "8ms"),
        (8, "pd", 5, 30.0, 3500.0, False, "3ms"),
        (8, "ap", 0, 400.0, 800.0, False, None),
        (2, "ap", 5, 1000.0, 3500.0, True, "3ms"),
        (3, "ap", 5, 1000.0, 3500.0, True, "11.3ms"),
        (3, "pd", 5, 300.0, 3500.0, True, "12.5ms"),
        (2, "ap", 5, 300.0, 3500.0, True, "80ms"),
    ]
    for n, short, b, kt, kc, split, delay in table:
        strategy = PD if short == "pd" else "average-position"
        yield Case(
            f"grid-n{n}-{short}-b{b}-kt{kt:.0f}-kc{kc:.0f}-{'split' if split else 'whole'}-{delay or '0ms'}",
            scene(n, kt, kc=kc, bt=b, bc=b, split=split, strategy=strategy, delay=delay),
            "equal peers, all touching",
        )


EVERY_DIFFERENT = [
    "device = { mass = 0.08, damping = 3.0 }; coupling = { stiffness = 2500.0, damping = 4.0 }; phase = 2",
    "device = { mass = 0.15, damping = 6.0 }; coupling = { stiffness = 3500.0, damping = 7.0 }; phase = 5; hand = " + arm(0.4, 3.0, 200.0),
    "device = { mass = 0.3, damping = 1.0 }; phase = 7; " + NONE,
]


def unequal():
    yield Case("phases", scene(3, 1000.0, delay="8ms", peers=["", "phase = 3", "phase = 6"]), "samples sent at different ticks of the frame")
    yield Case(
        "clock-offsets",
        scene(3, 1000.0, delay="5ms", peers=["", 'clock = { offset = "350us" }', 'clock = { offset = "2700us" }']),
        "no two peers tick at one instant: delays are rounded up to the receiver's own tick",
    )
    yield Case("ticks-1-and-2ms", scene(2, 800.0, delay="3ms", peers=["", 'tick = "2ms"']), "3 ms are 4 ms for the slower receiver")
    yield Case(
        "ticks-four-rates",
        scene(4, 600.0, delay="4.3ms", peers=['tick = "500us"', "", 'tick = "2ms"', 'tick = "4ms"; ' + NONE]),
        "four rates",
    )
    yield Case("compute-delay", scene(3, 700.0, kc=1500.0, delay="8ms", compute_delay=1), "forces act one tick late: two states a peer")
    yield Case(
        "compute-delay-of-one",
        scene(3, 700.0, kc=1500.0, delay="3ms", peers=["compute-delay = 1", "", NONE]),
        "one peer only",
    )
    yield Case("one-of-four-touches", scene(4, 1000.0, delay="16ms", peers=["", NONE, NONE, NONE]), "classes of one and three")
    yield Case("two-of-five-touch", scene(5, 500.0, delay="8ms", peers=["", NONE, "", NONE, NONE]), "classes of two and three, mixed")
    yield Case("none-of-three-touches", scene(3, 300.0, delay="8ms", contact="none"), "four rigid modes")
    yield Case("every-peer-different", scene(3, 800.0, delay="8ms", peers=EVERY_DIFFERENT), "no symmetry at all")
    yield Case(
        "every-link-different",
        scene(
            3,
            800.0,
            delay="8ms",
            links=[(0, 1, 'delay = "3ms"'), (1, 0, 'delay = "24ms"'), (0, 2, 'delay = "11.3ms"'), (2, 1, 'delay = "0s"'), (1, 2, 'delay = "40ms"')],
        ),
        "each direction has its own delay",
    )
    yield Case(
        "everything-different",
        scene(
            3,
            600.0,
            delay="12.5ms",
            bo=0.3,
            strategy=PD,
            peers=[
                EVERY_DIFFERENT[0] + '; clock = { offset = "123456ns" }',
                EVERY_DIFFERENT[1].replace("phase = 5", "phase = 3") + '; tick = "2ms"; compute-delay = 1',
                EVERY_DIFFERENT[2] + '; clock = { offset = "3ms" }',
            ],
            links=[(0, 2, 'delay = "31ms"'), (2, 0, 'delay = "1ns"')],
        ),
        "all of it together",
    )
    yield Case("inverse-n", scene(5, 1000.0, delay="8ms", scaling="inverse-n", coupling_scaling="inverse-n"), "both scalings")
    yield Case("object-damping", scene(3, 1000.0, delay="16ms", bo=2.0), "a damped copy")
    yield Case("arms-without-stiffness", scene(2, 1000.0, delay="8ms", hand=arm(0.3, 10.0, 0.0)), "dampers do not tie to ground: one rigid mode")
    yield Case("arms-with-stiffness", scene(2, 1000.0, delay="8ms", hand=arm(0.3, 10.0, 100.0)), "tied to ground: no rigid mode")
    yield Case(
        "arm-of-one-who-does-not-touch",
        scene(2, 1000.0, delay="8ms", peers=[NONE + "; hand = " + arm(0.3, 1.0, 50.0), ""]),
        "the arm ties its device, not the scene: one rigid mode, and the device's own motion counts",
    )
    yield Case("update-20ms", scene(2, 400.0, update="20ms", delay="33ms"), "another frame: 20 ticks")


def critical(damping):
    """Peers apart from one device that touches nothing: 1 kg on a spring of 1/64 N/m, critical at 1/4 N·s/m."""
    hand = f"hand = {{ arm = {{ mass = 0.5, damping = {number(damping)}, stiffness = 0.015625 }} }}"
    return scene(2, 1000.0, delay="8ms", peers=[f"{NONE}; device = {{ mass = 0.5, damping = 0.0 }}; {hand}", ""])


def equal_moduli(factor):
    """A free device that slows down by the same factor a frame as the rest of the scene, times a given factor."""

    def make(damping):
        return scene(3, 1000.0, delay="8ms", peers=["", "", f"{NONE}; device = {{ mass = 0.1, damping = {number(damping)} }}"])

    rest = full_radius(make(5.0))[0]
    return make(-mpmath.log(rest * mpf(factor)) * mpf("0.1") / mpf("0.008"))


def hard():
    yield Case("stiff-coupling-diverges", scene(2, 1e6, kc=1e6, delay="8ms"), "KC·Tc²/m far above 4: the radius is enormous")
    yield Case("stiff-coupling-fine-tick", scene(2, 1e6, kc=1e6, bt=200.0, bc=200.0, tick="50us", update="1ms", delay="1ms"), "KC = KT = 10⁶ N/m, sampled finely")
    yield Case("stiff-arm", scene(2, 1000.0, delay="8ms", hand=arm(0.3, 10.0, 1e6)), "stiff part of the plant, solved exactly whatever its size")
    yield Case("light", scene(3, 0.02, kc=0.1, bt=1e-4, bc=1e-4, mh=1e-6, bh=1e-5, mo=1e-6, split=False, delay="8ms"), "masses of 10⁻⁶ kg")
    yield Case("light-in-honey", scene(2, 0.02, kc=0.1, bt=1e-4, bc=1e-4, mh=1e-6, bh=5.0, mo=1e-6, bo=5.0, split=False, delay="8ms"), "b·Tc/m = 5000")
    yield Case("heavy", scene(3, 1e5, kc=1e6, bt=3e3, bc=1e4, mh=1e3, bh=50.0, mo=1e3, split=False, delay="8ms"), "masses of 1000 kg")
    yield Case("heavy-device-light-object", scene(2, 0.02, kc=0.05, bt=1e-4, bc=1e-4, mh=1e3, mo=1e-6, delay="8ms"), "masses nine orders apart")
    yield Case("no-device-damping", scene(2, 500.0, bh=0.0, delay="8ms"), "BH = 0: only the coupling's and the network's damping")
    yield Case(
        "free-device-without-damping",
        scene(2, 500.0, delay="8ms", peers=["", NONE + "; device = { mass = 0.1, damping = 0.0 }"]),
        "a device that nobody holds keeps its velocity: exactly 1, marginal",
    )
    yield Case("no-damping-at-all", scene(2, 200.0, kc=500.0, bt=0.0, bc=0.0, bh=0.0, delay="8ms"), "undamped and delayed: unstable")
    yield Case("one-tick-a-frame", scene(3, 1000.0, update="1ms", delay="4ms"), "M = 1")
    yield Case("thousand-ticks-a-frame", scene(2, 1000.0, tick="8us", delay="8ms"), "M = 1000")
    yield Case(
        "free-object",
        scene(3, 100.0, update="1ms", contact="none"),
        "an undamped object that nobody touches, over an ideal network with M = 1, drifts: exactly 1 once the position is left out, a Jordan block with it",
    )
    yield Case("kt-0", scene(3, 0.0, delay="8ms"), "copies held by damping only stay apart: exactly 1 (N − 1 relative displacements)")
    yield Case("kt-0-bt-0-free", scene(2, 0.0, bt=0.0, contact="none"), "nothing acts on undamped copies: relative drift, a Jordan block at exactly 1")
    yield Case("defective", critical(0.25), "critically damped device: a double eigenvalue e^(−0.001) with one eigenvector dominates")
    yield Case("nearly-defective", critical(0.25 * (1 + 1e-12)), "two dominant eigenvalues some 10⁻⁹ apart, with nearly one eigenvector")
    yield Case("equal-moduli", lambda: equal_moduli(1), "a real eigenvalue and a complex pair whose moduli agree to the last digits of a double")
    yield Case("nearly-equal-moduli", lambda: equal_moduli("1.000000001"), "a real eigenvalue a billionth above a complex pair")

    def by_kt(kt):
        return scene(3, kt, delay="24ms")

    def by_kt_of_pd(kt):
        return scene(2, kt, strategy=PD, delay="11.3ms", bo=1.0)

    yield Case("just-unstable", lambda: tuned(by_kt, 1000.0, 3000.0, "1.0000000001"), "KT tuned to 1 + 10⁻¹⁰")
    yield Case("just-stable", lambda: tuned(by_kt, 1000.0, 3000.0, "0.9999999999"), "KT tuned to 1 − 10⁻¹⁰")
    yield Case("on-the-edge", lambda: tuned(by_kt, 1000.0, 3000.0, "1"), "KT is the double nearest to the edge")
    yield Case("just-unstable-pd", lambda: tuned(by_kt_of_pd, 100.0, 6000.0, "1.0000000001"), "KT tuned to 1 + 10⁻¹⁰")
    yield Case("just-stable-pd", lambda: tuned(by_kt_of_pd, 100.0, 6000.0, "0.9999999999"), "KT tuned to 1 − 10⁻¹⁰")


def many():
    """Too large for the full matrix."""
    equal = scene(4096, 1000.0, split=False, delay="8ms")
    yield Case("peers-4096-ap", equal, "4096 equal peers, AP: the two modes λ = 1, −1/(N − 1)", "modes")
    yield Case("peers-4096-pd", scene(4096, 0.05, bt=0.001, split=False, delay="3ms", strategy=PD), "4096 equal peers, PD", "modes")
    yield Case("peers-4096-free", scene(4096, 300.0, split=False, delay="11.3ms", contact="none"), "4097 rigid modes", "modes")
    yield Case(
        "peers-4096-scaled",
        scene(4096, 500.0, bt=0.3, kc=2000.0, bc=1.0, scaling="inverse-n", coupling_scaling="inverse-n", delay="8ms"),
        "a copy of 0.1 g, both scalings",
        "modes",
    )
    yield Case("peers-100000-ap", equal, "100,000 peers: `count` of the entry in place of the scene's", "modes", 100_000)
    yield Case("thousand-frames", scene(3, 1000.0, delay="8s"), "1000 samples in flight a link, unstable: all roots of z^D·p(z) = λ·q(z)", "roots")
    yield Case("thousand-frames-stable", scene(2, 20.0, bt=1.0, bh=20.0, delay="8s"), "the same, many eigenvalues near the unit circle", "roots")
    yield Case("thousand-frames-free", scene(2, 0.01, bt=0.5, bo=1.0, contact="none", delay="8s"), "the same with nobody touching", "roots")


def all_cases():
    for family in (anchors, grid, unequal, hard, many):
        yield from family()
