"""A frame of a server, which alone has the object, and its clients, over a box of keys.

Clients send it the states of their devices, and it adds up the forces FC of their couplings, equation (9) of docs/model.md. With the force returned a sample to a client carries its FC, of the states that the server held before this instant; with the object a client computes FC from the state that it hears.

As for other laws the averages of classes of equal peers are one part of the motion, with the server a class of its own, and the differences within a class of clients another: of those the server's object feels nothing.
"""

from boxes import KeyBox
from named_rows import POSITION, STATE, NamedPart, added, scaled
from numbers_over_box import NotCovered
from timing import Timing


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


class ServerPart(NamedPart):
    """A part of the motion of a server and its clients."""

    def __init__(self, box, part):
        super().__init__(box, part)
        # The place of the server among the classes, and that of everything else that a device holds on to.
        self.server = None if self.difference else self.members.index(box.server)
        self.clients = [c for c, first in enumerate(self.first) if c != self.server and box.scene.peers[first].touches]
        if self.reference:
            self.references = dict.fromkeys(range(len(self.first)), ("copy", self.server, POSITION))

    def bodies(self):
        devices = [("device", c) for c in range(len(self.first)) if self.touches(c)]
        return devices + ([("copy", self.server)] if self.server is not None else [])

    def instants(self):
        """What is sent at each instant, and where everything is after its tick."""
        box, timing, server = self.box, Timing(self.box.scene), self.box.server[0]
        (sends,) = timing.sends(server, timing.t0, timing.t1)
        number = lambda sent: (sent - sends) // box.scene.update
        ways = {(c, way): (self.first[c], server)[::way] for c in self.clients for way in (1, -1)}
        held = {way: number(timing.held(*link)) for way, link in ways.items()}
        due = {way: timing.in_force(*link) for way, link in ways.items()}
        ticks = {}
        for instant in range(timing.first_tick(server, timing.t0), timing.t1, box.scene.peers[server].tick):
            sent = self.sampled(held) if instant == sends else {}
            for way, arrivals in due.items():
                held[way] = next((number(sent) for tick, sent in reversed(arrivals) if tick == instant), held[way])
            # Ticks between the same samples are alike.
            of_held = tuple(held.values())
            if of_held not in ticks:
                ticks[of_held] = self.tick(held)
            yield sent, ticks[of_held]

    def device(self, c):
        return self.body("device", c)

    def object(self):
        """The names of the object's state, which has no part in a difference."""
        return self.body("copy", self.server) if self.server is not None else []

    def sample(self, c, number):
        return [("sample", c, number, of) for of in STATE]

    def sampled(self, held):
        """What everybody sends."""
        sent = {}
        only = lambda name: {name: self.constant(1)}
        for c in self.clients:
            sent.update(zip(self.sample(c, 0), map(only, self.device(c))))
            if self.box.returns_force:
                force = self.coupling(c, self.sample(c, held[c, 1]), self.object())
                sent["returned", c, 0] = scaled(force, self.constant(self.compliance))
        if not self.box.returns_force and self.server is not None:
            sent.update(zip(self.sample(self.server, 0), map(only, self.object())))
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
