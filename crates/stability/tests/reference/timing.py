"""When peers send, and from which tick on a sample is in force."""


class Timing:
    """When samples are sent and from which tick on they are in force, in the steady state, for one frame that begins at t0."""

    def __init__(self, scene):
        self.scene = scene
        latest = max([p.offset + p.tick * (p.phase + 1) for p in scene.peers] + [link.delay for link in scene.links.values()])
        self.t0 = (2 * latest // scene.update + 4) * scene.update
        self.t1 = self.t0 + scene.update

    def first_tick(self, peer, instant):
        """The first tick of a peer at or after an instant."""
        p = self.scene.peers[peer]
        return p.offset - (-(instant - p.offset) // p.tick) * p.tick

    def sends(self, peer, begin, end):
        """The instants in begin ≤ t < end at which a peer sends."""
        p, update = self.scene.peers[peer], self.scene.update
        first = p.offset + p.phase * p.tick
        t = first - (-(begin - first) // update) * update
        return list(range(t, end, update))

    def in_flight(self, sender, receiver, t):
        """The sending instants of what is in flight at t: sent before t, in force at a tick at or after t."""
        delay = self.scene.links[sender, receiver].delay
        sent = self.sends(sender, t - delay - 2 * self.scene.update, t)
        return [s for s in sent if self.first_tick(receiver, s + delay) >= t]

    def in_force(self, sender, receiver):
        """What begins to be in force in the frame: pairs of the tick and the sending instant."""
        delay = self.scene.links[sender, receiver].delay
        sent = self.sends(sender, self.t0 - delay - 2 * self.scene.update, self.t1)
        starts = [(self.first_tick(receiver, s + delay), s) for s in sent]
        return [(tick, s) for tick, s in starts if self.t0 <= tick < self.t1]

    def held(self, sender, receiver):
        """When what is held at the beginning of the frame was sent."""
        delay = self.scene.links[sender, receiver].delay
        sent = self.sends(sender, self.t0 - delay - 3 * self.scene.update, self.t0)
        return max(s for s in sent if self.first_tick(receiver, s + delay) < self.t0)
