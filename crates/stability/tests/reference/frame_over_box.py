"""A frame of a scene over a box of numbers: rows of entries over the box, coefficients of the state at the beginning of a frame, go through what happens in the frame: sample, deliver, forces, move.

The averages of the classes of equal peers are one part of the motion; how the members of a class differ is another, one peer that hears its own samples
times −1/(N−1). Only average-position, extrapolated and proportional-derivative coordination between equal clocks and over links without chance are covered.
"""

from dataclasses import dataclass
from fractions import Fraction

from numbers_over_box import Affine, NotCovered, Row, combination, difference, row_of, scalar, times
from timing import Timing


@dataclass
class Frame:
    mean: list
    slopes: list
    radius: list


class Part:
    """A part of the motion, in the states that a certificate names."""

    def __init__(self, box, difference, members, states, heard, time):
        self.box, self.time, self.difference = box, Fraction(time), difference
        self.states = [tuple(state) for state in states]
        self.members = [tuple(of_class) for of_class in members]
        if (len(self.members) != 1 if difference else self.members != box.classes):
            raise NotCovered("classes of peers that are not those of the scene")
        scene = box.scene
        self.first = [of_class[0] for of_class in self.members]
        classes = range(len(self.members))
        self.weights = [[box.weight(i, j, difference) for j in classes] for i in classes]
        tied = any(peer.touches and peer.arm is not None and peer.arm[2] > 0 for peer in scene.peers)
        self.reference = None if difference or tied else ("copy", 0)
        self.combined = heard is not None

    def zeros(self, size):
        return Row.zeros(size, self.box.count)

    def unit(self, size, place):
        return Row.unit(size, place, self.box.count)

    def constant(self, number):
        return scalar(Affine(Fraction(number), (Fraction(0),) * self.box.count))

    def touches(self, c):
        return self.box.scene.peers[self.first[c]].touches

    def link(self, sender, receiver):
        """Two peers between which samples of a class go to another, or to itself."""
        if sender != receiver:
            return self.first[sender], self.first[receiver]
        return self.members[sender][1], self.members[sender][0]

    def hears(self, i, j):
        """Whether samples of a class go to another, or to itself."""
        return i != j or len(self.members[i]) > 1

    def heard(self):
        """Of each number of a sample, what it is of position and velocity; and of each class, by what each number is multiplied in what its law hears, but for what the age of a sample adds."""
        if self.combined and self.box.scene.horizon is not None:
            raise NotCovered("one number of a sample where its age counts")
        kt, bt = ([self.box.gain(peer, name) for peer in self.first] for name in ("kt", "bt"))
        constant = self.constant
        if not self.combined:
            return [row_of(constant(1), constant(0)), row_of(constant(0), constant(1))], [(k, b.scaled(1 / self.time)) for k, b in zip(kt, bt)]
        laws = self.box.laws()
        stiffness, damping = laws[0]
        unit = stiffness + damping / self.time
        if unit == 0:
            raise NotCovered("a law that hears nothing")
        if any(k * damping != b * stiffness for k, b in laws):
            raise NotCovered("one number of a sample where two are heard")
        shares = row_of(constant(stiffness / unit), constant(damping / self.time / unit))
        by = [k.scaled(unit / stiffness) if stiffness else b.scaled(unit / damping) for k, b in zip(kt, bt)]
        return [shares], [(scale,) for scale in by]

    def frame(self) -> Frame:
        size = len(self.states)
        place_of = {state: place for place, state in enumerate(self.states)}
        if len(place_of) != size:
            raise NotCovered("a state that stands there twice")
        taken = set()

        def state(*name):
            taken.add(name)
            if name not in place_of:
                raise NotCovered(f"a state that is missing: {name}")
            return self.unit(size, place_of[name])

        scene, timing = self.box.scene, Timing(self.box.scene)
        classes = range(len(self.members))
        zero = self.zeros(size)
        body = lambda kind, c: [zero if (kind, c) == self.reference else state(kind, c, "position"), state(kind, c, "velocity")]
        bodies = [[*body("copy", c), *(body("device", c) if self.touches(c) else [])] for c in classes]
        shares, heard_by = self.heard()

        # Samples by class and number: 0 the first of this frame, −1 the last of the frame before.
        sent_first = {c: timing.sends(self.first[c], timing.t0, timing.t1)[0] for c in classes}
        number_of = lambda c, sent: (sent - sent_first[c]) // scene.update
        before = sorted({(c, number) for kind, c, number, *_ in self.states if kind == "sample"})
        samples = {(c, number): [state("sample", c, number, channel) for channel in range(len(shares))] for c, number in before}

        def sample(c, number):
            if (c, number) not in samples:
                raise NotCovered(f"a sample that is missing: {number} of class {c}")
            return samples[c, number]

        links = {(i, j): self.link(i, j) for i in classes for j in classes if self.hears(i, j)}
        held = {pair: number_of(pair[0], timing.held(*link)) for pair, link in links.items()}
        due = {pair: timing.in_force(*link) for pair, link in links.items()}
        senders = [[i for i in classes if (i, c) in links] for c in classes]
        ages = [()] * len(self.members)
        ticks = [self.tick(c, senders[c], heard_by[c], ages[c]) for c in classes]
        peer = self.first[0]
        for instant in range(timing.first_tick(peer, timing.t0), timing.t1, scene.peers[peer].tick):
            # Samples of this instant, of where everything is.
            fresh = {}
            for c in classes:
                if instant in timing.sends(self.first[c], timing.t0, timing.t1):
                    x, v, *_ = bodies[c]
                    samples[c, number_of(c, instant)] = [x.times(share.entry(0)) + v.times(share.entry(1)) for share in shares]
                    fresh[c, number_of(c, instant)] = [{(c, 0): share.entry(0), (c, 1): share.entry(1)} for share in shares]
            for pair, arrivals in due.items():
                for tick, sent in arrivals:
                    if tick == instant:
                        held[pair] = number_of(pair[0], sent)
            if scene.horizon is not None:
                older = [[min(instant - sent_first[i] - held[i, c] * scene.update, scene.horizon) for i in senders[c]] for c in classes]
                ticks = [ticks[c] if older[c] == ages[c] else self.tick(c, senders[c], heard_by[c], older[c]) for c in classes]
                ages = older
            # What each number is of where everything is, by name: copies and devices, and the samples held.
            seen = {(c, place): row for c in classes for place, row in enumerate(bodies[c])}
            moved = []
            for c in classes:
                of_samples = [("sample", i, held[i, c], channel) for i in senders[c] for channel in range(len(shares))]
                seen.update({name: sample(*name[1:3])[name[3]] for name in of_samples})
                names = [(c, place) for place in range(len(bodies[c]))] + of_samples
                moved.append([{name: row.entry(place) for place, name in enumerate(names)} for row in ticks[c]])
            shift = moved[0][0] if self.reference else {}
            bodies = [[combination(difference(row, {} if place % 2 else shift), seen) for place, row in enumerate(moved[c])] for c in classes]
            if shift:
                samples = {name: self.shifted(name, rows, fresh.get(name), shift, seen, shares) for name, rows in samples.items()}
        final = []
        for kind, c, *which in self.states:
            if kind == "sample":
                final.append(sample(c, which[0] + 1)[which[1]])
            else:
                final.append(bodies[c][2 * (kind == "device") + (which == ["velocity"])])
        if taken != set(place_of):
            raise NotCovered(f"states that nothing begins with: {sorted(map(str, set(place_of) - taken))}")
        return Frame([row.mean for row in final], [[row.slopes[k] for row in final] for k in range(self.box.count)], [row.radius for row in final])

    def shifted(self, name, rows, fresh, shift, seen, shares):
        """The numbers of a sample, from where the first copy is after the move."""
        shifted = []
        for channel, (row, share) in enumerate(zip(rows, shares)):
            own = ("sample", *name, channel)
            of_shift = {of: times(by, share.entry(0)) for of, by in shift.items()}
            shifted.append(combination(difference(fresh[channel] if fresh else {own: self.constant(1)}, of_shift), {**seen, own: row}))
        return shifted

    def tick(self, c, senders, heard_by, ages):
        """Where a class moves in a tick, copy and device: what each is of where they are and of the samples held, for velocities multiplied by the time of the part.

        Where ages [ns] are given, samples have moved on by their velocity for so long.
        """
        peer = self.first[c]
        kc, bc, kt, bt = (self.box.gain(peer, name) for name in ("kc", "bc", "kt", "bt"))
        of_velocity = lambda gain: scalar(gain.scaled(1 / self.time))
        bodies = 4 if self.touches(c) else 2
        size = bodies + len(senders) * len(heard_by)
        x, v, *device = (self.unit(size, place) for place in range(bodies))
        zero = self.zeros(size)
        force = zero - (x.times(scalar(kt)) + v.times(of_velocity(bt)))
        for place, sender in enumerate(senders):
            for channel, by in enumerate(heard_by):
                if channel == 1 and ages:
                    by = by.plus(kt.scaled(Fraction(ages[place], 10**9) / self.time))
                held = self.unit(size, bodies + place * len(heard_by) + channel)
                force = force + held.times(self.box.weighed(by, self.weights[c][sender]))
        if not device:
            return self.move("copy", peer, (x, v), force)
        grasp = (device[0] - x).times(scalar(kc)) + (device[1] - v).times(of_velocity(bc))
        return self.move("copy", peer, (x, v), force + grasp) + self.move("device", peer, device, zero - grasp)

    def move(self, body, peer, state, force):
        e00, e01, e10, e11, g0, g1 = self.box.step(peer, body)
        t, (x, v) = self.time, state
        by = lambda *coefficients: sum((row.times(scalar(number)) for number, row in zip(coefficients, (x, v, force))), start=self.zeros(len(x.mean)))
        return [x + by(e00, e01.scaled(1 / t), g0), v + by(e10.scaled(t), e11, g1.scaled(t))]
