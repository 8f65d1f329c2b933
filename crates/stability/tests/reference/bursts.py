"""The spectral radius of the second-moment operator where losses come in bursts and samples overtake, in double, from what was drawn for each sample.

When a sample is sent, its fate is drawn: the state of the chain of losses moves, the sample is lost or not, and if not, the tick is drawn at which it comes
into force. A mode of a link is the state of its chain with the fates of the last samples, as many as may still be on the way. What a receiver holds is the
newest sample of the mode that has arrived, or what it held before if none of them has. So V_m = E[z zᵀ 1(m)] is carried from frame to frame for all modes
of all links. No hazard, no place and no conditional probability: this is another way than that of the program, with many more modes.

Two peers with one device each, average-position coordination, no arms: the equations of docs/model.md, with step maps in closed form.
"""

import itertools
import sys
import time

import mpmath
import numpy as np
from mpmath import mpf
from scipy.sparse.linalg import LinearOperator, eigs
from text import scene

TAIL = mpf("1e-9")
"""Delays outside the central 1 − 2·10⁻⁹ of a law count as at its ends, as docs/stability.md says."""

BASE = dict(kt=600.0, kc=800.0, bt=3.0, bc=5.0, bh=5.0, mh=0.3, mo=0.9)


class Chain:
    """States of samples, one after the other: `moves` from row to column, `lost` in each state."""

    def __init__(self, text, moves, lost):
        self.text, self.moves, self.lost = text, moves, lost


def independent(p):
    return Chain(repr(p), [[1.0]], [p])


def gilbert(p, r, h=0.0, k=1.0):
    """The state before a sample's move decides whether it is lost."""
    text = f"{{ gilbert-elliott = {{ p = {p}, r = {r}, h = {h}, k = {k} }} }}"
    return Chain(text, [[1 - p, p], [r, 1 - r]], [1 - k, 1 - h])


def bursts(loss, length):
    """Samples of a burst are lost, and no others: p of a burst follows from the mean loss."""
    r = 1 / length
    p = loss * r / (1 - loss)
    return Chain(f"{{ bursts = {{ loss = {loss}, length = {length} }} }}", [[1 - p, p], [r, 1 - r]], [0.0, 1.0])


def four(p13, p31, p32, p23, p14):
    """Received between bursts, received within, lost within, lost between: 1, 2, 3, 4."""
    text = f"{{ states = {{ p13 = {p13}, p31 = {p31}, p32 = {p32}, p23 = {p23}, p14 = {p14} }} }}"
    moves = [[1 - p13 - p14, 0, p13, p14], [0, 1 - p23, p23, 0], [p31, p32, 1 - p31 - p32, 0], [1, 0, 0, 0]]
    return Chain(text, moves, [0.0, 0.0, 1.0, 1.0])


def law(kind, mean_ms, sd_ns, tick_ms):
    """The probability that a sample comes into force at each tick after it was sent. Delays are whole nanoseconds: an unrounded one at most half a nanosecond beyond a tick is in force there."""
    if kind is None:
        return {int(np.ceil(mean_ms / tick_ms)): 1.0}
    mean, sd = mpf(mean_ms) * 10**6, mpf(sd_ns)
    if kind == "uniform":
        half = mpmath.sqrt(3) * sd
        below = lambda x: min(mpf(1), max(mpf(0), (x - mean + half) / (2 * half)))
    else:
        shape, scale = (mean / sd) ** 2, sd**2 / mean
        below = lambda x: mpmath.gammainc(shape, 0, x / scale, regularized=True)
    def reached(tick):
        part = below(mpf(tick) * mpf(tick_ms) * 10**6 + mpf("0.5"))
        return mpf(0) if part < TAIL else mpf(1) if 1 - part < TAIL else part
    chances, before, tick = {}, mpf(0), 0
    while before < 1:
        now = reached(tick)
        if now > before:
            chances[tick] = float(now - before)
        before, tick = now, tick + 1
    return chances


def step(mass, damping, h):
    """x, v after h under a force that is held: rows of (x, v, force)."""
    decay = np.exp(-damping / mass * h)
    reach = mass / damping * -np.expm1(-damping / mass * h)
    return np.array([[1, reach, (h - reach) / damping], [0, decay, -np.expm1(-damping / mass * h) / damping]])


def free(mass, h):
    return np.array([[1, h, h * h / (2 * mass)], [0, 1, h / mass]])


class Frame:
    """The states: device and copy of each peer (x, v), `depth` samples of each, newest first, and what each holds of the other."""

    def __init__(self, tick_ms, ticks, depth):
        self.h, self.ticks, self.depth = tick_ms * 1e-3, ticks, depth
        self.size = 8 + 4 * depth + 4

    def sample(self, peer, age):
        return 8 + 2 * (peer * self.depth + age)

    def held(self, peer):
        return 8 + 4 * self.depth + 2 * peer

    def matrix(self, fates):
        """`fates` has for each receiver those of the last samples of the other, newest first: the tick at which it comes into force, or None."""
        b = BASE
        device, copy = step(b["mh"], b["bh"], self.h), free(b["mo"] / 2, self.h)
        z = np.eye(self.size)
        for peer in (0, 1):
            for age in reversed(range(1, self.depth)):
                z[self.sample(peer, age) :][:2] = z[self.sample(peer, age - 1) :][:2]
            z[self.sample(peer, 0) :][:2] = z[4 * peer + 2 :][:2]
        for tick in range(self.ticks):
            for peer in (0, 1):
                arrived = [age for age, fate in enumerate(fates[peer]) if fate is not None and fate <= age * self.ticks + tick]
                if arrived:
                    z[self.held(peer) :][:2] = z[self.sample(1 - peer, arrived[0]) :][:2]
            for peer in (0, 1):
                xh, vh, x, v = z[4 * peer : 4 * peer + 4].copy()
                hx, hv = z[self.held(peer) : self.held(peer) + 2]
                coupling = b["kc"] * (xh - x) + b["bc"] * (vh - v)
                pull = b["kt"] * (x - hx) + b["bt"] * (v - hv)
                z[4 * peer : 4 * peer + 2] = device @ np.array([xh, vh, -coupling])
                z[4 * peer + 2 : 4 * peer + 4] = copy @ np.array([x, v, coupling - pull])
        positions = np.arange(self.size) % 2 == 0
        z -= np.outer(positions, z[2])
        # A common unit, so that the entries are of one size; and without the position that all others are relative to.
        unit = np.where(positions, 1.0, 0.1)
        z = z * np.outer(1 / unit, unit)
        return np.delete(np.delete(z, 2, 0), 2, 1)


class Link:
    """Modes of a link, and how they follow each other. Fates with which a sample has come into force by the first tick of a frame are one."""

    def __init__(self, chain, chances, depth, ticks):
        first = min(chances)
        fates = [None, *chances] if any(chain.lost) else [*chances]
        states = range(len(chain.lost))

        def seen(past):
            return tuple(first if fate is not None and fate <= age * ticks else fate for age, fate in enumerate(past))

        pasts = sorted({seen(past) for past in itertools.product(fates, repeat=depth)}, key=str)
        self.modes = [(state, *past) for state in states for past in pasts]
        place = {mode: number for number, mode in enumerate(self.modes)}
        self.matrix = np.zeros((len(self.modes),) * 2)
        for old, (state, *past) in enumerate(self.modes):
            for new in states:
                for fate in fates:
                    through = chain.lost[new] if fate is None else (1 - chain.lost[new]) * chances[fate]
                    self.matrix[place[(new, *seen((fate, *past[:-1])))], old] += chain.moves[state][new] * through


def radius(tick_ms, ticks, links):
    """`links` has, for each receiver, its chain and the chances of ticks."""
    latest = max(max(chances) for _, chances in links)
    # At the last tick of a period the oldest sample of a mode has been on the way for depth·ticks − 1 ticks.
    depth = (latest + ticks) // ticks
    frame = Frame(tick_ms, ticks, depth)
    made = [Link(chain, chances, depth, ticks) for chain, chances in links]
    n = frame.size - 1
    pasts = {}
    which = np.empty((len(made[0].modes), len(made[1].modes)), dtype=int)
    for i, one in enumerate(made[0].modes):
        for j, other in enumerate(made[1].modes):
            which[i, j] = pasts.setdefault((one[1:], other[1:]), len(pasts))
    matrices = np.array([frame.matrix(past) for past in pasts])
    each = matrices[which]
    shape = (*which.shape, n, n)

    def apply(vector):
        moments = vector.reshape(shape)
        moments = np.tensordot(made[0].matrix, moments, (1, 0))
        moments = np.tensordot(made[1].matrix, moments, (1, 1)).transpose(1, 0, 2, 3)
        return (each @ moments @ each.transpose(0, 1, 3, 2)).ravel()

    start = np.broadcast_to(np.eye(n), shape).ravel().copy()
    size = start.size
    found = eigs(LinearOperator((size, size), matvec=apply), k=3, which="LM", v0=start, tol=0, ncv=40, return_eigenvectors=False)
    # The radius of an operator that keeps matrices positive is an eigenvalue (Krein & Rutman 1948); a pair beside it may be as large.
    assert abs(max(found.real) - max(abs(found))) < 1e-11
    return max(found.real), size


def cases():
    """Names, ticks [ms], ticks a period, links by their receiver (chain; law, mean [ms], standard deviation [ns]), and why."""
    certain = (independent(0.0), (None, 8.0, 0))
    wide, two, narrow = ("uniform", 10.0, 5773502), ("uniform", 8.0, 4618802), ("gamma", 12.0, 1500000)
    yield "independent-overtaking", 4.0, 2, [(independent(0.1), wide), certain], "1 to 5 ticks of half a period, and losses without memory"
    yield "bursts-overtaking", 4.0, 2, [(bursts(0.2, 4.0), wide), certain], "the same delays, and losses in bursts of four"
    yield "gilbert-without-memory", 4.0, 2, [(gilbert(0.1, 0.9), wide), certain], "p + r = 1: the radius of independent-overtaking"
    yield "gilbert-partial", 4.0, 2, [(gilbert(0.05, 0.2, 0.3, 0.98), wide), certain], "some samples of a burst get through, and some are lost outside"
    yield "states-isolated", 8.0, 1, [(four(0.05, 0.2, 0.2, 0.3, 0.1), two), certain], "four states, with losses between bursts"
    yield "gamma-bursts", 8.0, 1, [(bursts(0.1, 3.0), narrow), certain], "a gamma law over three ticks"
    yield "both-links", 8.0, 1, [(bursts(0.2, 4.0), two), (gilbert(0.1, 0.3, 0.2, 0.95), two)], "both links random, each with another chain"


def words(chain, law_of):
    kind, mean, sd = law_of
    lines = [f'delay = "{mean:g}ms"', f"loss = {chain.text}"]
    if kind:
        lines.append(f'jitter = {{ sd = "{sd}ns", distribution = "{kind}" }}')
    return "; ".join(lines)


def entry(name, tick, ticks, links, why):
    began = time.monotonic()
    found, size = radius(tick, ticks, [(chain, law(*law_of, tick)) for chain, law_of in links])
    text = scene(2, tick=f"{tick:g}ms", update=f"{tick * ticks:g}ms", delay="8ms", links=[(1 - to, to, words(*link)) for to, link in enumerate(links)], **BASE)
    print(f"{time.monotonic() - began:6.1f} s  {size:8}  {found:.12f}  {name}", file=sys.stderr, flush=True)
    return {"name": name, "scene": text, "mean_square_radius": f"{found:.12g}", "why": why}


def entry_at(place):
    return entry(*list(cases())[place])


def entries(pool):
    return list(pool.imap(entry_at, range(len(list(cases()))), chunksize=1))


if __name__ == "__main__":
    [entry(*case) for case in cases()]
