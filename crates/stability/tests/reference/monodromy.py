"""The full monodromy matrix of a scene, by letting one frame happen with rows in place of numbers.

Every quantity (a velocity, a held sample, a force) is kept as the row of its coefficients in the state at the beginning of the frame. What happens at
each instant is done to the rows in the order that the model prescribes: sample, deliver, forces, move. The rows at the end are the matrix. Nothing
is assumed about symmetry, delays, phases or clocks: every directed link has its own held sample and its own samples in flight.

The state, at the beginning of a frame (an instant that is a multiple of Tn, before anything happens at it):
    for each peer, its device and copy as they will be at its first tick of the frame; with a compute delay also the forces computed at its last tick, and
    with a lag of the force the coordination force of that tick, and with a lag of the own state the copy at the latest ticks, the newest first;
    for each directed link, the sample held and the samples in flight, oldest first.

A law that extrapolates knows the age of what it holds. Without chance that age is known at every tick: samples are held as they were sent. With outcomes
the age depends on chance, so the position held is kept extrapolated to the present: it moves on from instant to instant, by the time that passes times
the velocity held, and a sample arrives moved on by its age. This is the same below the horizon, and beyond it is not covered.
"""

from plant import Exact, Maps
from timing import Timing


class Frame:
    """One frame. `states` names the entries of the state; `matrix` maps it over the frame.

    `forced` is the place of a peer whose hand acts with a force of its own at each tick: `inputs` further columns, one a tick, and `outputs`, the
    rows of its device's velocity at its ticks.

    `outcomes` says for a directed link what becomes of the sample that would come into force in this frame: None if it is lost, or the delay in ns
    with which it comes, which must bring it into force within the same frame.

    With `echo` the scene is one peer with a link to itself, which hears its own samples times that factor: one of many equal peers, see modes.py.
    """

    def __init__(self, scene, arithmetic=Exact, forced=None, outcomes=None, maps=None, echo=None):
        self.scene, self.timing = scene, Timing(scene)
        count = len(scene.peers)
        peers, pairs = range(count), list(scene.links)
        timing = self.timing
        flights = {pair: timing.in_flight(*pair, timing.t0) for pair in pairs}
        self.states = []
        for i in peers:
            self.states += [("xH", i), ("vH", i), ("xO", i), ("vO", i)]
            if scene.peers[i].compute_delay:
                self.states += [("fH", i), ("fO", i)]
            if scene.lag is not None:
                self.states.append(("fT", i))
            for age in range(1, scene.looks_back(i) + 1):
                self.states += [("past x", i, age), ("past v", i, age)]
        for pair in pairs:
            self.states += [("held x", pair), ("held v", pair)]
            for place in range(len(flights[pair])):
                self.states += [("flight x", pair, place), ("flight v", pair, place)]
        place_of = {state: place for place, state in enumerate(self.states)}
        inputs = 0 if forced is None else scene.update // scene.peers[forced].tick
        width = len(self.states) + inputs

        def unit(*state):
            return unit_at(place_of[state])

        def unit_at(place):
            row = arithmetic.zeros(width)
            row[place] = arithmetic.number(1)
            return row

        maps = maps or make_maps(scene, arithmetic)
        zero = arithmetic.zeros(width)
        device = [[unit("xH", i), unit("vH", i)] for i in peers]
        copy = [[unit("xO", i), unit("vO", i)] for i in peers]
        pending = [[unit("fH", i), unit("fO", i)] if scene.peers[i].compute_delay else None for i in peers]
        lagging = [unit("fT", i) if scene.lag is not None else None for i in peers]
        past = [[(unit("past x", i, age), unit("past v", i, age)) for age in range(1, scene.looks_back(i) + 1)] for i in peers]
        held = {pair: (unit("held x", pair), unit("held v", pair)) for pair in pairs}
        moving = scene.horizon is not None and outcomes is not None
        ageing = scene.horizon is not None and outcomes is None
        assert not moving or len({p.offset for p in scene.peers}) == 1, "a sample that moves on does so by time that passes, not by what clocks show"
        since = {pair: timing.held(*pair) for pair in pairs} if ageing else {}
        present = timing.t0

        def moved_on(state, span):
            """A sample extrapolated by a span in ns."""
            return state[0] + arithmetic.number(span) / 10**9 * state[1], state[1]

        def pass_time(instant):
            """What is held moves on to an instant."""
            if moving:
                held.update({pair: moved_on(state, instant - present) for pair, state in held.items()})
            return instant

        def seen(pair):
            """The state that a peer extrapolates to now: the age is what its own clock shows less what the sender's showed, at least zero."""
            if not ageing:
                return held[pair]
            sent_at, now = (at - scene.peers[peer].offset for peer, at in zip(pair, (since[pair], instant)))
            return moved_on(held[pair], min(max(now - sent_at, 0), scene.horizon))

        sample = {}
        for pair in pairs:
            for place, sent in enumerate(flights[pair]):
                sample[pair[0], sent, pair] = (unit("flight x", pair, place), unit("flight v", pair, place))
        due = {pair: timing.in_force(*pair) for pair in pairs}
        for pair, outcome in (outcomes or {}).items():
            ((_, sent),) = due[pair]
            if outcome is None:
                due[pair] = []
            else:
                tick = timing.first_tick(pair[1], sent + outcome)
                assert timing.t0 <= tick < timing.t1, "an outcome must stay within the frame"
                due[pair] = [(tick, sent)]

        def newest(pair, sent):
            """What a link carries: a sample of before the frame, which is part of its state, or one of this frame."""
            return sample.get((pair[0], sent, pair)) or sample[pair[0], sent]

        ticks = sorted(
            (t, i) for i in peers for t in range(timing.first_tick(i, timing.t0), timing.t1, scene.peers[i].tick)
        )
        sending = {(t, i) for i in peers for t in timing.sends(i, timing.t0, timing.t1)}
        self.outputs = []
        for instant in sorted({t for t, _ in ticks}):
            ticking = [i for t, i in ticks if t == instant]
            present = pass_time(instant)
            for i in ticking:  # sample and send
                if (instant, i) in sending:
                    sample[i, instant] = tuple(copy[i])
            for i in ticking:
                for j in peers:  # deliver
                    for tick, sent in due.get((j, i), ()):
                        if tick == instant:
                            held[j, i] = newest((j, i), sent)
                            if moving:
                                held[j, i] = moved_on(held[j, i], instant - sent)
                            since[j, i] = sent
                # Forces.
                m = maps[i]
                if echo is None:
                    known = {j: seen((j, i)) for j in peers if j != i}
                    mean = [sum((known[j][q] for j in known), start=zero) / (count - 1) for q in (0, 1)]
                else:
                    mean = [echo * number for number in seen((i, i))]
                if scene.peers[i].touches:
                    fc = m.kc * (device[i][0] - copy[i][0]) + m.bc * (device[i][1] - copy[i][1])
                else:
                    fc = zero
                past[i].insert(0, tuple(copy[i]))
                own = past[i].pop()
                ft = m.kt * (own[0] - mean[0]) + m.bt * (own[1] - mean[1])
                if scene.lag is not None:
                    ft = lagging[i] = m.kept * lagging[i] + (1 - m.kept) * ft
                applied = [fc, fc - ft]
                if pending[i] is not None:
                    applied, pending[i] = pending[i], applied
                hand = zero
                if i == forced:
                    hand = unit_at(len(self.states) + len(self.outputs))
                    self.outputs.append(device[i][1])
                # Move.
                device[i] = move(m.device, device[i], hand - applied[0])
                copy[i] = move(m.copy, copy[i], applied[1])
        present = pass_time(timing.t1)
        assert not ageing or all(since[pair] == timing.held(*pair) + scene.update for pair in pairs), "ages repeat from frame to frame"
        final = {}
        for i in peers:
            final.update({("xH", i): device[i][0], ("vH", i): device[i][1], ("xO", i): copy[i][0], ("vO", i): copy[i][1]})
            if pending[i] is not None:
                final.update({("fH", i): pending[i][0], ("fO", i): pending[i][1]})
            if scene.lag is not None:
                final["fT", i] = lagging[i]
            for age, (x, v) in enumerate(past[i], start=1):
                final["past x", i, age], final["past v", i, age] = x, v
        for pair in pairs:
            final["held x", pair], final["held v", pair] = held[pair]
            flying = timing.in_flight(*pair, timing.t1)
            assert len(flying) == len(flights[pair])
            for place, sent in enumerate(flying):
                final["flight x", pair, place], final["flight v", pair, place] = newest(pair, sent)
        whole = arithmetic.zeros(len(self.states), width)
        for place, state in enumerate(self.states):
            whole[place] = final[state]
        self.matrix = whole[:, : len(self.states)]
        self.inputs = whole[:, len(self.states) :]


def make_maps(scene, arithmetic=Exact):
    """The step maps of every peer; equal peers share theirs."""
    made = {}
    result = []
    for p in scene.peers:
        key = (p.tick, p.device_mass, p.device_damping, p.arm, p.coupling, p.coupling_scaling)
        if key not in made:
            made[key] = Maps(arithmetic, scene, p, len(scene.peers))
        result.append(made[key])
    return result


def move(maps, state, force):
    phi, gamma = maps
    x, v = state
    return [phi[0, 0] * x + phi[0, 1] * v + gamma[0] * force, phi[1, 0] * x + phi[1, 1] * v + gamma[1] * force]


def rigid_modes(scene):
    """What may be displaced without anything noticing: ("device", i) for a device that touches nothing and is tied to nothing, and "scene" for
    everything else together, unless an arm with a stiffness holds a device that touches the object."""
    tied = [p.arm is not None and p.arm[2] > 0 for p in scene.peers]
    modes = [("device", i) for i, p in enumerate(scene.peers) if not p.touches and not tied[i]]
    if not any(p.touches and tie for p, tie in zip(scene.peers, tied)):
        modes.append("scene")
    return modes


def relative(scene, states, matrix, rigid=None):
    """The matrix of the relative motion: positions are counted from the first peer's copy, which is left out, and so are free devices.

    With e the displacement of everything together (M·e = e) and z = z' + x·e, x the reference: z'⁺ = (M − e·(row of x)) z'. `rigid` are the modes to leave
    out, where they are not those of the scene.
    """
    rigid = rigid_modes(scene) if rigid is None else rigid
    left_out = set()
    for mode in rigid:
        if mode != "scene":
            place = states.index(("xH", mode[1]))
            column = matrix[:, place]
            assert abs(column[place] - 1) < 1e-12 and all(value == 0 for row, value in enumerate(column) if row != place)
            left_out.add(place)
    if "scene" in rigid:
        reference = states.index(("xO", 0))
        e = [1 if "x" in state[0] and (state[0] != "xH" or scene.peers[state[1]].touches) else 0 for state in states]
        moved = matrix @ e
        assert all(abs(a - b) < 1e-9 for a, b in zip(moved, e)), "displacing everything must change nothing"
        matrix = matrix - [[c * value for value in matrix[reference]] for c in e]
        left_out.add(reference)
    keep = [place for place in range(len(states)) if place not in left_out]
    return matrix[keep][:, keep], len(rigid)
