"""Random scenes, with what is printed of them with a bound: the radius, and the spring, damper and mass that a slow hand feels.

The spring, damper and mass are the first coefficients of the impedance Z = F/v of `admittance.Lifted` around ω = 0, Re Z = b + O(ω²) and ω·Im Z = −k + m·ω² +
O(ω⁴), read at ω = 2π·10⁻¹² rad/s and twice that in arithmetic of 60 digits: what is left out is some 10⁻²⁴ of a coefficient.

Scenes are drawn until there are as many as wanted; `Random` of one seed draws the same ones wherever it runs.
"""

import random
import sys

import mpmath
from mpmath import mpf

import admittance
import cases
from radius import digits
from scene import parse
from text import arm, number, scene

SEED = 20_260
ORDINARY, EXTREME = 150, 50
# The frequencies at which the coefficients are read [Hz].
SLOW = 2.0**-40


def spread(chance, low, high):
    """Some number between two, each order of magnitude as likely as another."""
    return low * (high / low) ** chance.random()


def drawn(chance, gains):
    """A scene; `gains` are the least and the largest stiffness of the coordination."""
    count = chance.choice((2, 2, 3))
    update = chance.choice((2, 4, 8))
    alike = chance.random() < 0.4
    stiffness = spread(chance, *gains)
    coupling = spread(chance, 200.0, 6000.0)
    keys = {
        "kc": coupling,
        "bt": chance.choice((0.0, spread(chance, 0.1, 30.0))),
        "bc": chance.choice((0.0, spread(chance, 0.1, 10.0))),
        "bh": chance.choice((0.0, spread(chance, 0.1, 20.0))),
        "mh": spread(chance, 0.05, 1.0),
        "mo": spread(chance, 0.05, 5.0),
        "bo": chance.choice((0.0, spread(chance, 0.01, 5.0))),
        "split": chance.random() < 0.7,
        "strategy": chance.choice(("average-position", cases.PD)),
        "update": f"{update}ms",
        "delay": chance.choice((None, f"{chance.randrange(1, 3 * update * 1000)}us", f"{update * chance.randrange(1, 4)}ms")),
        "compute_delay": int(chance.random() < 0.2),
    }
    if chance.random() < 0.3:
        keys["hand"] = arm(spread(chance, 0.05, 1.0), spread(chance, 0.5, 20.0), chance.choice((0.0, spread(chance, 10.0, 1000.0))))
    peers = [] if alike else [own(chance, place, update) for place in range(count)]
    return scene(count, stiffness, peers=peers, **keys)


def own(chance, place, update):
    """What a peer has of its own."""
    lines = []
    if chance.random() < 0.5:
        lines.append(f"device = {{ mass = {number(spread(chance, 0.05, 1.0))}, damping = {number(spread(chance, 0.1, 20.0))} }}")
    if chance.random() < 0.4:
        lines.append(f"phase = {chance.randrange(0, update)}")
    if chance.random() < 0.2:
        lines.append(f'clock = {{ offset = "{chance.randrange(1, 1000)}us" }}')
    if place > 0 and chance.random() < 0.3:
        lines.append(cases.NONE)
    return "; ".join(lines)


def slow(made, peer):
    """k, b and m."""
    lifted = admittance.Lifted(made, peer)
    with mpmath.workdps(60):
        def impedance(hz):
            omega = 2 * mpmath.pi * mpf(hz)
            value = 1 / lifted.at(hz)[0]
            return omega**2, value.real, omega * value.imag

        (one, viscosity, near), (other, _, far) = impedance(SLOW), impedance(2 * SLOW)
        inertia = (far - near) / (other - one)
        return inertia * one - near, viscosity, inertia


def entry(place):
    """A scene with its truth; None where the method finds no eigenvalues to fifty digits."""
    chance = random.Random(SEED + place)
    extreme = place % 4 == 3
    gains = chance.choice(((1e-9, 1e-2), (1e6, 1e14))) if extreme else (5.0, 5000.0)
    text = drawn(chance, gains)
    made = parse(text)
    try:
        radius, rigid = cases.full_radius(text)
    except (ArithmeticError, AssertionError):
        return None
    found = {"name": f"random-{place}", "scene": text, "radius": digits(radius), "rigid_modes": rigid}
    if not extreme:
        peer = chance.randrange(len(made.peers))
        stiffness, viscosity, inertia = slow(made, peer)
        found |= {"peer": made.peers[peer].name, "stiffness": digits(stiffness, 25), "viscosity": digits(viscosity, 25), "inertia": digits(inertia, 25)}
    print(f"{digits(radius, 14)}  {found['name']}", file=sys.stderr, flush=True)
    return found


def entries(pool):
    """As many as wanted, by their places."""
    return [found for found in pool.imap(entry, range(ORDINARY + EXTREME), chunksize=1) if found]
