"""Follows motions of peers with one-sided contacts and walls, from the equations of docs/model.md.

Prints as JSON the factor by which the fastest of some motions grows in a frame, between the first third of the frames and the end: of velocities, of distances of
copies and of contact forces. It shares no code with the analysis, and needs nothing but the standard library.

    python3 contact_motions.py SCENE.toml [FRAMES]

One axis, average-position or proportional-derivative, equal clocks and one constant delay; another key is refused.
"""

import json
import math
import random
import sys
import tomllib

TICK = 1e-3


def milliseconds(text):
    """A duration in whole milliseconds."""
    if text.endswith("ms"):
        return int(text[:-2])
    if text.endswith("s"):
        return 1000 * int(text[:-1])
    raise SystemExit(f"{text}: expected ms or s")


def step(mass, damping, stiffness):
    """(x, v, F) after a tick in which F does not change: the exponential of the augmented matrix by its series, 2^20 times squared."""
    halvings = 20
    h = TICK / 2**halvings
    a = [[0.0, h, 0.0], [-stiffness / mass * h, -damping / mass * h, h / mass], [0.0, 0.0, 0.0]]

    def times(p, q):
        return [[math.fsum(p[i][k] * q[k][j] for k in range(3)) for j in range(3)] for i in range(3)]

    # E − 1 is carried along, so that nothing cancels.
    square = times(a, a)
    rest = [[a[i][j] + square[i][j] / 2 for j in range(3)] for i in range(3)]
    for _ in range(halvings):
        doubled = times(rest, rest)
        rest = [[2 * rest[i][j] + doubled[i][j] for j in range(3)] for i in range(3)]
    return [[rest[i][j] + (i == j) for j in range(3)] for i in range(2)]


class Scene:
    """A scene, with the keys that are covered."""

    def __init__(self, text):
        data = tomllib.loads(text)
        known = {"scene", "object", "coordination", "peer", "peers", "link", "expect"}
        if set(data) - known:
            raise SystemExit(f"not covered: {sorted(set(data) - known)}")
        common = data.get("peer", {})
        count = data["scene"].get("count", len(data.get("peers", [])))
        peers = [{**common, **own} for own in data.get("peers", [])]
        peers += [dict(common) for _ in range(count - len(peers))]
        self.n = len(peers)
        body, law = data["object"], data["coordination"]
        share = self.n if body.get("split-mass", True) else 1
        self.copy = step(body["mass"] / share, body.get("damping", 0.0), 0.0)
        self.wall = body.get("enclosure")
        factor = {"average-position": 1.0, "proportional-derivative": self.n - 1.0}[law["strategy"]]
        self.kt, self.bt = factor * law["stiffness"], factor * law["damping"]
        self.update, self.delay = milliseconds(law["update"]), milliseconds(data["link"]["delay"])
        self.contacts = [peer.get("contact", "grasp") for peer in peers]
        self.couplings = [peer["coupling"] for peer in peers]
        self.devices = []
        for peer in peers:
            arm = (peer.get("hand") or {}).get("arm", {"mass": 0.0, "damping": 0.0, "stiffness": 0.0})
            device = peer["device"]
            self.devices.append(step(device["mass"] + arm["mass"], device["damping"] + arm["damping"], arm["stiffness"]))
        self.phases = [peer.get("phase", 0) for peer in peers]
        if any(self.phases):
            raise SystemExit("not covered: phase")

    def contact(self, peer, apart, speed):
        """The force of a device on its copy."""
        kind, gains = self.contacts[peer], self.couplings[peer]
        if kind == "none":
            return 0.0
        whole = gains["stiffness"] * apart + gains["damping"] * speed
        if kind == "grasp":
            return whole
        sign = 1.0 if kind["push"] == "+x" else -1.0
        return sign * max(0.0, sign * whole) if sign * apart > 0.0 else 0.0

    def walls(self, x, v):
        """The force of the walls on a copy."""
        if self.wall is None:
            return 0.0
        k, b = self.wall["stiffness"], self.wall["damping"]
        if x > self.wall["max"]:
            return -max(0.0, k * (x - self.wall["max"]) + b * v)
        if x < self.wall["min"]:
            return -min(0.0, k * (x - self.wall["min"]) + b * v)
        return 0.0

    def growth(self, seed, frames):
        """The factor a frame of a motion from a random beginning."""
        draw = random.Random(seed)
        some = lambda size: [draw.uniform(-size, size) for _ in range(self.n)]
        # Small where there are walls, that they are struck and rest remains between them.
        x, v, xh, vh = some(0.01), some(0.3), some(0.01), some(0.3)
        waiting, held = [], (list(x), list(v))
        sizes = []
        for tick in range(frames * self.update):
            if tick % self.update == 0:
                waiting.append((tick + self.delay, list(x), list(v)))
            while waiting and waiting[0][0] <= tick:
                held = waiting.pop(0)[1:]
            sums = sum(held[0]), sum(held[1])
            size = 0.0
            mean = sum(x) / self.n
            for i in range(self.n):
                target = [(sums[k] - held[k][i]) / (self.n - 1) for k in range(2)]
                f = self.contact(i, xh[i] - x[i], vh[i] - v[i])
                force = f - self.kt * (x[i] - target[0]) - self.bt * (v[i] - target[1]) + self.walls(x[i], v[i])
                size = max(size, abs(v[i]), abs(f), 100.0 * abs(x[i] - mean), abs(vh[i]) if self.contacts[i] != "none" else 0.0)
                body, device = self.copy, self.devices[i]
                x[i], v[i] = (math.fsum((row[0] * x[i], row[1] * v[i], row[2] * force)) for row in body)
                xh[i], vh[i] = (math.fsum((row[0] * xh[i], row[1] * vh[i], -row[2] * f)) for row in device)
            if tick % self.update == self.update - 1:
                sizes.append(size)
            # Positions of 0.01 m are rounded to 1e-18 m, which counts as 1e-16: a size below some powers of ten more does not shrink.
            if not 1e-11 < size < 1e280:
                break
        first, last = len(sizes) // 3, len(sizes) - 1
        return (sizes[last] / sizes[first]) ** (1.0 / (last - first))


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        scene = Scene(file.read())
    frames = int(sys.argv[2]) if len(sys.argv) > 2 else 600
    print(json.dumps({"growth": max(scene.growth(seed, frames) for seed in range(3))}))


if __name__ == "__main__":
    main()
