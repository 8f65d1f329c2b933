"""A frame of copies that are tied by waves, over a box of keys or a span of numbers of peers.

Of the law `wave` of docs/model.md with wave s_ij that copy i gets from j, S_i = ρ·Σ_j s_ij, P_i = ρ·Σ_j s_ji, d_i what copy i has moved by since its last sample, and ⟨ ⟩ the mean over the ticks since then: FT = −S_i, and since ρ² = 2·b/(N−1) the samples say

    S_i ← 2·b/(M·Tc)·(mean of d_j over all j ≠ i) − ⟨P_i⟩        P_i ← 2·b/(M·Tc)·d_i − ⟨S_i⟩

for links and clocks that are equal. Nothing else of the waves moves a body. Σ S_i = Σ P_i are the same waves, so that of the averages of classes the P of one is known by all else; of two peers each P is the S of the other. The damping b of a copy belongs to its body.

Without loss and with one delay for all a wave is in force until the next.
"""

from fractions import Fraction

from boxes import KeyBox, NumberBox
from named_rows import POSITION, NamedPart, added, negated, scaled
from numbers_over_box import Affine, NotCovered, between, scalar
from timing import Timing

RECEIVED, SENT = "received", "sent"


def without_waves(root):
    """The tables of a scene with no law in the place of waves, and their impedance b, or `None`."""
    coordination = dict(root["coordination"])
    if coordination["strategy"] != "wave":
        return root, None
    own = coordination.pop("wave", {})
    if own.get("on-loss", "zero") not in ("zero", "hold") or set(own) - {"impedance", "on-loss"}:
        raise NotCovered(f"waves that are not covered: {own}")
    coordination.pop("scaling", None)
    nothing = {"strategy": "average-position", "stiffness": 0.0, "damping": 0.0}
    return {**root, "coordination": {**coordination, **nothing}}, Fraction(float(own.get("impedance", 20.0)))


def refuse_unequal(scene):
    if len(set(map(repr, scene.links.values()))) > 1:
        raise NotCovered("links that differ, for waves")


class WaveBox(KeyBox):
    """The scenes at the corners of a box of keys."""

    def __init__(self, corners, classes, impedance):
        super().__init__(corners, classes)
        refuse_unequal(self.scene)
        self.impedance, self.is_pair = impedance, len(self.scene.peers) == 2

    def part(self, part):
        return WavePart(self, part)

    def share(self, c, of):
        """The size of a class in units of that of another."""
        return Affine(Fraction(len(self.classes[c]), len(self.classes[of])), (Fraction(0),) * self.count)


class WaveNumberBox(NumberBox):
    """A scene with from `low` to `high` peers."""

    def __init__(self, scene, classes, growing, low, high, impedance):
        super().__init__(scene, classes, growing, low, high)
        refuse_unequal(scene)
        self.impedance, self.is_pair = impedance, (low, high) == (2, 2)
        if low == 2 and not self.is_pair:
            raise NotCovered("two peers together with more, of waves")
        self.sizes = [1 / (low - self.others), 1 / (high - self.others) if high else Fraction(0)]

    def part(self, part):
        return WavePart(self, part)

    def share(self, c, of):
        """The size of a class in units of that of the one that grows. With one other peer that is ν, and else goes along the factor of a law's gains, of which there are none."""
        if of != self.growing:
            raise NotCovered("waves of the averages but for those that the class that grows sends")
        low, high = (len(self.classes[c]) * size for size in self.sizes)
        return between(low, high, int(self.others == 1), self.count)


class WavePart(NamedPart):
    """A part of the motion of copies that are tied by waves."""

    def __init__(self, box, part):
        super().__init__(box, part)
        tied = lambda peer: peer.touches and peer.arm is not None and peer.arm[2] > 0
        self.references = {c: ("copy", c, POSITION) for c, first in enumerate(self.first) if not tied(box.scene.peers[first])}
        # The class of which no P is a state.
        self.rest = None
        if not self.difference and not box.is_pair:
            sent = {name[1] for name in self.states if name[0] == "waves" and name[3] == SENT}
            rest = [c for c in range(len(self.first)) if c not in sent]
            if len(rest) != 1:
                raise NotCovered("expected what all classes but one send as states")
            (self.rest,) = rest

    def bodies(self):
        classes = range(len(self.first))
        return [("copy", c) for c in classes] + [("device", c) for c in classes if self.touches(c)]

    def instants(self):
        """What is sent at each instant, and where everything is after its tick."""
        scene, timing = self.box.scene, Timing(self.box.scene)
        (sends,) = timing.sends(0, timing.t0, timing.t1)
        number = lambda sent: (sent - sends) // scene.update
        instants = range(timing.first_tick(0, timing.t0), timing.t1, scene.peers[0].tick)
        arrivals = {tick: number(sent) for tick, sent in timing.in_force(0, 1)}
        held, in_force = number(timing.held(0, 1)), []
        for instant in instants:
            held = arrivals.get(instant, held)
            in_force.append(held)
        # Ticks before the frame are those of the frame before.
        at = lambda tick: in_force[tick % len(in_force)] + tick // len(in_force)
        ticks = {held: self.tick(held) for held in set(in_force)}
        for tick, instant in enumerate(instants):
            since = [at(tick - ago) for ago in range(1, len(in_force) + 1)]
            yield self.sampled(since) if instant == sends else {}, ticks[at(tick)]

    def received(self, c, number):
        return {("waves", c, number, RECEIVED): self.constant(1)}

    def sent(self, c, number):
        """P of a class."""
        classes = range(len(self.first))
        if self.box.is_pair:
            one = Affine(Fraction(1), (Fraction(0),) * self.box.count)
            return added(*(scaled(self.received(other, number), self.box.weighed(one, self.weights[c][other])) for other in classes))
        own = lambda c: {("waves", c, number, SENT): self.constant(1)}
        if c != self.rest:
            return own(c)
        others = [(other, scalar(self.box.share(other, c))) for other in classes if other != c]
        of_others = [scaled(added(self.received(other, number), scaled(own(other), self.constant(-1))), share) for other, share in others]
        return added(self.received(c, number), *of_others)

    def sampled(self, since):
        """What everybody sends, where waves of those numbers were in force at the ticks since the last sample."""
        classes = range(len(self.first))
        answer = 2 * self.box.impedance * self.compliance / Fraction(self.box.scene.update, 10**9)
        answer = Affine(answer, (Fraction(0),) * self.box.count)
        less = self.constant(Fraction(-1, len(since)))
        way = lambda c, by: {("copy", c, POSITION): by, ("sample", c, -1, POSITION): negated(by)}
        sent = {}
        for c in classes:
            of_others = added(*(way(other, self.box.weighed(answer, self.weights[c][other])) for other in classes))
            sent["waves", c, 0, RECEIVED] = added(of_others, *(scaled(self.sent(c, number), less) for number in since))
            if not self.box.is_pair and c != self.rest:
                back = [scaled(self.received(c, number), less) for number in since]
                sent["waves", c, 0, SENT] = added(way(c, scalar(answer)), *back)
            sent["sample", c, 0, POSITION] = {("copy", c, POSITION): self.constant(1)}
        return sent

    def tick(self, number):
        """Where all bodies are after a tick, of where everything is before it."""
        moved = {}
        for c in range(len(self.first)):
            copy, device = self.body("copy", c), self.body("device", c)
            on_copy = scaled(self.received(c, number), self.constant(1 / self.compliance))
            if self.touches(c):
                grasp = self.coupling(c, device, copy)
                on_copy = added(on_copy, grasp)
                moved |= self.moved("device", c, device, scaled(grasp, self.constant(-1)))
            moved |= self.moved("copy", c, copy, on_copy)
        return moved
