"""The spectral radius of the second-moment operator, in double, by listing every mode and forming the whole Kronecker operator.

In one frame every directed link brings exactly one sample: it is lost, or comes with some delay. An outcome of all links together is a mode; z⁺ = A z
with the A of the mode, in relative coordinates. Independent modes: E[z zᵀ] is mapped by X ↦ Σ P(mode)·A·X·Aᵀ, a matrix Σ P·(A ⊗ A) of n² rows. With
links that have a state (Gilbert–Elliott) there is one such X for each joint state, and the sample of a packet is lost according to the state before the
transition that belongs to that packet.

Whether a sample is lost is decided here when it would come into force, not when it is sent: delays are the same for all packets where losses have a
memory, so only the origin of time of each link's chain moves. A random delay must bring every sample into force within the same frame.
"""

import itertools
import sys
import time

import mpmath
import numpy as np
import scipy.linalg
from mpmath import mpf

from cases import NONE, PD, full_radius
from monodromy import Frame, make_maps, relative
from plant import Double
from radius import digits
from scene import parse
from text import scene


def uniform_outcomes(link, timing, pair):
    """Delays and their probabilities: one for each tick of the receiver at which the sample may come into force.

    The law is uniform with mean and standard deviation as given, its half-width √3·sd, rounded to the nearest nanosecond: a sample is in force by a tick
    if its unrounded delay is at most that tick and half a nanosecond.
    """
    mean, half = mpf(link.delay), mpmath.sqrt(3) * link.uniform_sd
    (send,) = timing.sends(pair[0], timing.t0, timing.t1)
    tick = timing.scene.peers[pair[1]].tick
    outcomes, below = [], mpf(0)
    instant = timing.first_tick(pair[1], send + int(mpmath.floor(mean - half)))
    while below < 1:
        upto = min(mpf(1), max(mpf(0), (instant - send + mpf("0.5") - (mean - half)) / (2 * half)))
        if upto > below:
            outcomes.append((instant - send, upto - below))
        below = upto
        instant += tick
    return [(delay, float(chance)) for delay, chance in outcomes]


def outcomes_of(scene_, timing, pair):
    """What may become of the sample that a link brings: (delay, or None where it is lost; probability)."""
    link = scene_.links[pair]
    if link.uniform_sd:
        assert link.loss == 0
        return uniform_outcomes(link, timing, pair)
    return [(link.delay, 1 - link.loss), (None, link.loss)] if link.loss else [(link.delay, 1.0)]


def frames(scene_, choices):
    """The relative matrix of every mode: `choices` has for each link the outcomes to combine."""
    maps = make_maps(scene_, Double)
    pairs = list(choices)
    for combination in itertools.product(*choices.values()):
        frame = Frame(scene_, Double, outcomes=dict(zip(pairs, combination)), maps=maps)
        yield relative(scene_, frame.states, frame.matrix)[0]


def kronecker(matrices, weights):
    """Σ weight·(A ⊗ A), by one product of all vectorised matrices."""
    n = len(matrices[0])
    stacked = np.array([m.ravel() for m in matrices])
    moments = (stacked.T * np.array(weights)) @ stacked  # E[A_ij·A_kl]
    return moments.reshape(n, n, n, n).transpose(0, 2, 1, 3).reshape(n * n, n * n)


def symmetric(operator, n, blocks=1):
    """The operator on symmetric X only (its largest eigenvalue has a positive semidefinite X): pairs i ≤ j, with √2 off the diagonal."""
    rows, columns = np.triu_indices(n)
    embed = np.zeros((n * n, len(rows)))
    for place, (i, j) in enumerate(zip(rows, columns)):
        embed[i * n + j, place] = embed[j * n + i, place] = 1 if i == j else np.sqrt(0.5)
    whole = np.kron(np.eye(blocks), embed)
    return whole.T @ operator @ whole


def largest(operator):
    return max(abs(scipy.linalg.eigvals(operator)))


def independent(scene_):
    timing = Frame(scene_, Double).timing
    choices = {pair: outcomes_of(scene_, timing, pair) for pair in scene_.links}
    matrices = list(frames(scene_, {pair: [o for o, _ in c] for pair, c in choices.items()}))
    weights = [np.prod(c) for c in itertools.product(*[[p for _, p in c] for c in choices.values()])]
    operator = kronecker(matrices, weights)
    return largest(symmetric(operator, len(matrices[0])))


def gilbert_elliott(scene_):
    pairs = list(scene_.links)
    count = len(pairs)
    laws = [scene_.links[pair].loss for pair in pairs]
    matrices = list(frames(scene_, {pair: [scene_.links[pair].delay, None] for pair in pairs}))
    n = len(matrices[0])
    states = list(itertools.product((0, 1), repeat=count))  # 0 good, 1 bad, of each link
    operator = np.zeros((len(states) * n * n,) * 2)
    for a, before in enumerate(states):
        through = [law["h"] if bad else law["k"] for law, bad in zip(laws, before)]
        weights = [np.prod([1 - t if lost else t for t, lost in zip(through, fate)]) for fate in itertools.product((0, 1), repeat=count)]
        moved = kronecker(matrices, weights)
        for b, after in enumerate(states):
            chance = 1.0
            for law, old, new in zip(laws, before, after):
                change = law["r"] if old else law["p"]
                chance *= change if old != new else 1 - change
            operator[b * n * n : (b + 1) * n * n, a * n * n : (a + 1) * n * n] = chance * moved
    return largest(symmetric(operator, n, len(states)))


def cases():
    for n in (2, 3):
        for strategy, short in (("average-position", "ap"), (PD, "pd")):
            if n == 2 and short == "pd":
                continue  # the same as AP
            for delay in ("8ms", "3ms", None):
                for loss in (0.0, 0.01, 0.1, 0.3, 0.7):
                    yield (
                        f"loss-n{n}-{short}-{delay or '0ms'}-p{loss}",
                        scene(n, 1000.0, strategy=strategy, delay=delay, loss=loss or None),
                        "every link loses each sample with the same probability",
                    )
    yield "loss-n2-pd-8ms-p0.1", scene(2, 1000.0, strategy=PD, delay="8ms", loss=0.1), "the same as AP"
    yield "loss-none-touches", scene(3, 1000.0, delay="8ms", loss=0.2, contact="none"), "four rigid modes"
    yield (
        "loss-different",
        scene(3, 800.0, delay="8ms", loss=0.1, peers=["", "phase = 3", NONE], links=[(0, 1, "loss = 0.4"), (2, 0, "loss = 0.0"), (1, 2, "loss = 0.6")]),
        "another probability on each link",
    )
    yield (
        "loss-held-sample",
        scene(3, 800.0, delay="8ms", loss=0.1, links=[(1, 2, "loss = 0.95")]),
        "a held sample with KT·x + BT·v = 0 acts on nothing and stays with the chance of a loss: exactly 0.95, not seen where only KT·x + BT·v is kept",
    )
    yield "loss-certain", scene(2, 1000.0, delay="8ms", loss=1.0), "nothing ever arrives: what is held stays as it is, exactly 1"
    yield (
        "loss-makes-unstable",
        scene(2, 300.0, kc=800.0, bt=1.0, bc=2.0, bh=1.0, delay="8ms", loss=0.6),
        "the mean of the frames, and the square of the nominal radius, say nothing about it",
    )
    chain = "{ gilbert-elliott = { p = 0.05, r = 0.4, h = 0.0, k = 1.0 } }"
    yield "gilbert-n2-8ms", scene(2, 1000.0, delay="8ms", loss=chain), "bursts of 2.5 packets"
    yield "gilbert-n2-3ms", scene(2, 1000.0, delay="3ms", loss=chain), "bursts of 2.5 packets"
    chain = "{ gilbert-elliott = { p = 0.02, r = 0.1, h = 0.2, k = 0.99 } }"
    yield "gilbert-n2-long-bursts", scene(2, 1000.0, delay="8ms", loss=chain), "bursts of ten packets, some of which get through"
    chain = "{ gilbert-elliott = { p = 0.3, r = 0.7, h = 0.4, k = 0.9 } }"
    yield "gilbert-n2-without-memory", scene(2, 1000.0, delay="8ms", loss=chain), "p + r = 1: as independent losses of probability 0.25"
    yield "loss-n2-8ms-p0.25", scene(2, 1000.0, delay="8ms", loss=0.25), "the same radius as gilbert-n2-without-memory"
    yield (
        "gilbert-n2-different",
        scene(2, 700.0, delay="3ms", loss=chain, peers=["phase = 2", NONE], links=[(1, 0, "loss = { gilbert-elliott = { p = 0.1, r = 0.2 } }")]),
        "another chain on each link, defaults h = 0 and k = 1",
    )
    jitter = '{ sd = "1443375ns", distribution = "uniform" }'
    yield "jitter-n2", scene(2, 1000.0, delay="2500us", jitter=jitter), "uniform from 0 to 5 ms: 1, 2, 3, 4 or 5 ticks"
    yield "jitter-n3-ap", scene(3, 1000.0, delay="2500us", jitter=jitter), "the same, 15,625 modes"
    narrow = '{ sd = "800us", distribution = "uniform" }'
    yield "jitter-n3-pd", scene(3, 700.0, delay="2500us", jitter=narrow, strategy=PD), "2, 3 or 4 ticks, 729 modes"
    yield "jitter-n2-next-frame", scene(2, 1000.0, delay="11500us", jitter='{ sd = "1500us", distribution = "uniform" }'), "ticks 9 to 15, unequal chances"
    yield (
        "jitter-n2-different",
        scene(
            2,
            1000.0,
            delay="2500us",
            jitter=jitter,
            peers=['clock = { offset = "300us" }', NONE],
            links=[(0, 1, 'delay = "4ms"; jitter = { sd = "800us", distribution = "uniform" }')],
        ),
        "another law on each link, clocks apart",
    )


def entry(place):
    return entry_of(*list(cases())[place])


def entry_of(name, text, why):
    began = time.monotonic()
    made = parse(text)
    if any(isinstance(link.loss, dict) for link in made.links.values()):
        radius = gilbert_elliott(made)
    else:
        radius = independent(made)
    nominal, rigid = full_radius(text)
    print(f"{time.monotonic() - began:6.1f} s  {radius:.12f}  {mpmath.nstr(nominal**2, 12)}  {name}", file=sys.stderr, flush=True)
    random = any(link.loss or link.uniform_sd for link in made.links.values())
    if not random:
        assert abs(radius - nominal**2) < 1e-12 * radius, "without chance the two must agree"
    return {
        "name": name,
        "scene": text,
        "mean_square_radius": f"{radius:.12g}",
        "nominal_radius_squared": digits(nominal**2),
        "rigid_modes": rigid,
        "why": why,
    }


def entries(pool):
    return list(pool.imap(entry, range(len(list(cases()))), chunksize=1))
