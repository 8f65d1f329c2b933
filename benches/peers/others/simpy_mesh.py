"""The mesh on SimPy (https://simpy.readthedocs.io, MIT): `simpy_mesh.py SCENE`, a file that `others-table` writes.

A process for each peer, which waits for its next tick; a timeout for each packet, whose callback takes it in, since a process for each costs more. Times
are whole nanoseconds. Packets have been scheduled before the ticks of the same instant, and SimPy keeps that order.
"""

import sys
from time import process_time

from scene import Scene, answer, skip

try:
    import simpy
except ImportError:
    skip("SimPy is not installed: python3 -m pip install simpy")


class Peer:
    """One participant: the arithmetic of src/mesh/body.rs, in the same order, so that it ends at the same bits."""

    def __init__(self, scene, me):
        self.me = me
        self.hand = scene.hand if me == 0 else 0.0
        self.xh = self.vh = self.xo = self.vo = 0.0
        others = scene.peers - 1
        self.others = float(others)
        self.held_x, self.held_v, self.next = [0.0] * others, [0.0] * others, [0] * others
        self.mean_x = self.mean_v = 0.0
        self.stale = False
        self.delivered = 0
        self.device, self.copy, self.coupling, self.gains = scene.device, scene.copy, scene.coupling, scene.gains

    def receive(self, event):
        sender, sequence, x, v = event._value
        self.delivered += 1
        place = sender if sender < self.me else sender - 1
        if sequence >= self.next[place]:
            self.next[place] = sequence + 1
            self.held_x[place] = x
            self.held_v[place] = v
            self.stale = True

    def mean(self, held):
        sums = []
        for first in range(4):
            total = 0.0
            for value in held[first::4]:
                total += value
            sums.append(total)
        a, b, c, d = sums
        return ((a + b) + (c + d)) / self.others

    def tick(self):
        if self.stale:
            self.stale = False
            self.mean_x, self.mean_v = self.mean(self.held_x), self.mean(self.held_v)
        xh, vh, xo, vo = self.xh, self.vh, self.xo, self.vo
        coupling = self.coupling[0] * (xh - xo) + self.coupling[1] * (vh - vo)
        coordination = self.gains[0] * (xo - self.mean_x) + self.gains[1] * (vo - self.mean_v)
        x_by_v, x_by_f, v_by_v, v_by_f = self.device
        force = self.hand - coupling
        self.xh = xh + (x_by_v * vh + x_by_f * force)
        self.vh = vh + (v_by_v * vh + v_by_f * force)
        x_by_v, x_by_f, v_by_v, v_by_f = self.copy
        force = coupling - coordination
        self.xo = xo + (x_by_v * vo + x_by_f * force)
        self.vo = vo + (v_by_v * vo + v_by_f * force)


def run(scene):
    env = simpy.Environment()
    peers = [Peer(scene, me) for me in range(scene.peers)]
    timeout, n, delays = env.timeout, scene.peers, scene.delays

    def live(peer):
        row = peer.me * n
        for tick in range(scene.ticks):
            if tick % scene.ticks_a_frame == 0:
                sequence = tick // scene.ticks_a_frame
                packet = (peer.me, sequence, peer.xo, peer.vo)
                for to in range(n):
                    if to != peer.me:
                        delay = scene.delay if delays is None else delays[sequence * n * n + row + to]
                        if delay >= 0:
                            timeout(delay, packet).callbacks.append(peers[to].receive)
            peer.tick()
            yield timeout(scene.tick_nanos)

    for peer in peers:
        env.process(live(peer))
    # Those that arrive after the last tick do not count.
    env.run(until=(scene.ticks - 1) * scene.tick_nanos + 1)
    return peers


def main():
    scene = Scene(sys.argv[1])
    begin = process_time()
    peers = run(scene)
    seconds = process_time() - begin
    answer(
        program=f"SimPy {simpy.__version__}, Python {sys.version_info.major}.{sys.version_info.minor}",
        seconds=seconds,
        delivered=sum(peer.delivered for peer in peers),
        positions=[peer.xo for peer in peers],
        lacks="links: no delay, loss, jitter, rate, queue or counter but those written here (draws are read from a file); bytes",
    )


main()
