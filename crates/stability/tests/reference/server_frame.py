"""A frame of a server, which alone has the object, and its clients, over a box of keys.

Clients send it the states of their devices, and it adds up the forces FC of their couplings, equation (9) of docs/model.md. With the force returned a sample to a client carries its FC, of the states that the server held before this instant; with the object a client computes FC from the state that it hears.

As for other laws the averages of classes of equal peers are one part of the motion, with the server a class of its own, and the differences within a class of clients another: of those the server's object feels nothing. Forces that wait are counted as lengths, multiplied by the compliance [m/N] that the certificate names.
"""

from fractions import Fraction

from boxes import KeyBox
from frame_over_box import Frame, Part
from numbers_over_box import NotCovered, Scalar, combination, difference, row_of, scalar, times
from timing import Timing

POSITION, VELOCITY = STATE = ("position", "velocity")


def without_server(root):
    """The tables of a scene without its coordination, the name of its server, and whether clients hear forces; the name is `None` if there is no server."""
    coordination = dict(root["coordination"])
    if coordination["strategy"] != "client-server":
        return root, None, False
    own = coordination.pop("client-server", {})
    returns, server = own.get("returns", "force"), own.get("server", first_name(root))
    if returns not in ("force", "object") or set(own) - {"returns", "server"}:
        raise NotCovered(f"a coordination by a server that is not covered: {own}")
    # The server has all of the object, whose copies elsewhere are what it said last: gains of other laws do not count.
    nothing = {"strategy": "average-position", "stiffness": 0.0, "damping": 0.0}
    return {**root, "coordination": {**coordination, **nothing}, "object": {**root["object"], "split-mass": False}}, server, returns == "force"


def first_name(root):
    return "peer1" if root["scene"].get("count", 0) else root["peers"][0]["name"]


class ServerBox(KeyBox):
    """The scenes at the corners of a box of keys, with a server."""

    def __init__(self, corners, classes, server, returns_force):
        super().__init__(corners, classes)
        self.server = next(members for members in classes if corners[0].peers[members[0]].name == server)
        self.returns_force = returns_force

    def has_differences(self, members):
        """Devices that touch nothing feel nothing."""
        return len(members) > 1 and self.scene.peers[members[0]].touches

    def part(self, part):
        return ServerPart(self, part)


class Rows(dict):
    """Rows by the names of what they are of."""

    def __missing__(self, name):
        raise NotCovered(f"a sample that is missing: {name}")


class ServerPart(Part):
    """A part of the motion of a server and its clients."""

    def __init__(self, box, part):
        super().__init__(box, part["difference"], part["members"], part["states"], None, part["time"])
        self.states = [(*name[:3], STATE[name[3]]) if name[0] == "sample" else name for name in self.states]
        self.compliance = Fraction(part["compliance"])
        if part["heard"] is not None or not self.compliance > 0:
            raise NotCovered("expected whole samples, and a compliance above zero")
        # The place of the server among the classes, and that of everything else that a device holds on to.
        self.server = None if self.difference else self.members.index(box.server)
        self.clients = [c for c, first in enumerate(self.first) if c != self.server and box.scene.peers[first].touches]
        if self.reference:
            self.reference = ("copy", self.server, POSITION)

    def frame(self) -> Frame:
        size, box, timing = len(self.states), self.box, Timing(self.box.scene)
        rows = Rows({state: self.unit(size, place) for place, state in enumerate(self.states)})
        bodies = [("device", c, of) for c in range(len(self.first)) if self.touches(c) for of in STATE]
        bodies += [("copy", self.server, of) for of in STATE] if self.server is not None else []
        if self.reference:
            rows[self.reference] = self.zeros(size)
        kinds = {"sample", "returned"}
        if len(rows) != size + bool(self.reference) or {name for name in rows if name[0] not in kinds} != set(bodies):
            raise NotCovered("states of bodies that are not those of the scene, or stand there twice")
        server = box.server[0]
        # All clocks are equal: everybody sends at the same instant, once in a frame, and this is sample 0.
        (sends,) = {instant for instant in timing.sends(server, timing.t0, timing.t1)}
        number = lambda sent: (sent - sends) // box.scene.update
        ways = {(c, way): (self.first[c], server)[::way] for c in self.clients for way in (1, -1)}
        held = {way: number(timing.held(*link)) for way, link in ways.items()}
        due = {way: timing.in_force(*link) for way, link in ways.items()}
        ticks = {}
        for instant in range(timing.first_tick(server, timing.t0), timing.t1, box.scene.peers[server].tick):
            if instant == sends:
                rows.update({name: combination(of, rows) for name, of in self.sampled(held).items()})
            for way, arrivals in due.items():
                held[way] = next((number(sent) for tick, sent in reversed(arrivals) if tick == instant), held[way])
            # Ticks between the same samples are alike.
            of_held = tuple(held.values())
            if of_held not in ticks:
                ticks[of_held] = {name: self.only(name) for name in rows} | self.tick(held)
            moved = ticks[of_held]
            shift = moved[self.reference] if self.reference else {}
            relative = lambda name, of: difference(of, shift) if shift and POSITION in name else of
            rows = Rows({name: self.zeros(size) if name == self.reference else combination(relative(name, of), rows) for name, of in moved.items()})
        older = lambda name: (*name[:2], name[2] + 1, *name[3:]) if name[0] in kinds else name
        if not all(older(name) in rows for name in self.states):
            raise NotCovered("samples that are states without those after them")
        final = [rows[older(name)] for name in self.states]
        return Frame([row.mean for row in final], [[row.slopes[k] for row in final] for k in range(box.count)], [row.radius for row in final])

    def only(self, name):
        return {name: self.constant(1)}

    def device(self, c):
        return [("device", c, of) for of in STATE]

    def object(self):
        """The names of the object's state, which has no part in a difference."""
        return [("copy", self.server, of) for of in STATE] if self.server is not None else []

    def sample(self, c, number):
        return [("sample", c, number, of) for of in STATE]

    def coupling(self, c, device, thing):
        """FC of a class, for a device and an object of those names."""
        gains = [self.box.gain(self.first[c], name) for name in ("kc", "bc")]
        gains = [scalar(gains[0]), scalar(gains[1].scaled(1 / self.time))]
        less = [negated(gain) for gain in gains]
        return dict(zip([*device, *thing], [*gains, *less]))

    def sampled(self, held):
        """What everybody sends."""
        sent = {}
        for c in self.clients:
            sent.update(zip(self.sample(c, 0), map(self.only, self.device(c))))
            if self.box.returns_force:
                force = self.coupling(c, self.sample(c, held[c, 1]), self.object())
                sent["returned", c, 0] = scaled(force, self.constant(self.compliance))
        if not self.box.returns_force and self.server is not None:
            sent.update(zip(self.sample(self.server, 0), map(self.only, self.object())))
        return sent

    def tick(self, held):
        """Where all bodies are after a tick, of where everything is before it."""
        moved = {}
        on_object = {}
        for c in self.clients:
            if self.box.returns_force:
                grasp = {("returned", c, held[c, -1]): self.constant(1 / self.compliance)}
            else:
                heard = self.sample(self.server, held[c, -1]) if self.server is not None else []
                grasp = self.coupling(c, self.device(c), heard)
            moved |= self.moved("device", c, self.device(c), scaled(grasp, self.constant(-1)))
            if self.server is not None:
                of_one = self.coupling(c, self.sample(c, held[c, 1]), self.object())
                on_object = added(on_object, scaled(of_one, self.constant(len(self.members[c]))))
        if self.server is not None:
            if self.touches(self.server):
                grasp = self.coupling(self.server, self.device(self.server), self.object())
                moved |= self.moved("device", self.server, self.device(self.server), scaled(grasp, self.constant(-1)))
                on_object = added(on_object, grasp)
            moved |= self.moved("copy", self.server, self.object(), on_object)
        return moved

    def moved(self, body, c, state, force):
        e00, e01, e10, e11, g0, g1 = self.box.step(self.first[c], body)
        t, (x, v) = self.time, state
        along = lambda own, by_x, by_v, by_force: added(self.only(own), {x: scalar(by_x), v: scalar(by_v)}, scaled(force, scalar(by_force)))
        return {x: along(x, e00, e01.scaled(1 / t), g0), v: along(v, e10.scaled(t), e11, g1.scaled(t))}


def negated(number: Scalar) -> Scalar:
    return Scalar(-number.mean, [-slope for slope in number.slopes], number.radius)


def scaled(coefficients, by: Scalar):
    return {name: times(number, by) for name, number in coefficients.items()}


def added(*all_of):
    """Sums of coefficients, by name."""
    total = {}
    for coefficients in all_of:
        for name, number in coefficients.items():
            total[name] = (row_of(total[name]) + row_of(number)).entry(0) if name in total else number
    return total
