"""A frame of a scene in which the forces of contacts that only push are inputs, and the quadratic form that shows that whatever they do dies out.

With the depth δ of a contact (of its device relative to the copy, in the direction of the push), p = max(0, δ), f its force divided by KC, τ = BC/KC and b = p − δ, these are not below zero at any tick k and its next:

    f·(f − p − τ·δ') = 0    p·(f − p − τ·δ')    f·(b⁺ − b)    p·(b⁺ − b)    −p⁺·(b⁺ − b)

and where an arm holds the device and another the object at rest, with no contact pressed there, p·(δ − p) and f·(δ − p). So V(after) < V(before) for a form V > 0 of states and p, if V(after) − V(before) plus
these products with multipliers (of the first of any sign, of the others not below zero) is below zero for all states, forces and depths p whatever.

Along another axis than that in which it pushes a device touches nothing. Walls, objects that turn and clocks that differ are not covered.
"""

from frame_over_box import EPS, KeyBox, NotCovered, Part, Row, classes_of, scalar
from moments_over_box import Span, is_everywhere_positive
from timing import Timing

# Of each tick of a contact; the first may be below zero.
PRODUCTS = 7


# The directions of pushes, by axes.
DIRECTIONS = {f"{sign}{axis}": (place, 1 if sign == "+" else -1) for place, axis in enumerate("xyz") for sign in "+-"}


def contacts_of(root):
    """The contact of each peer, by name."""
    if "enclosure" in root["object"] or "inertia" in root["object"]:
        raise NotCovered("walls, or an object that turns: a certificate of contacts that push alone can be checked")
    contact = root.get("peer", {}).get("contact", "grasp")
    names = [f"peer{number + 1}" for number in range(root["scene"].get("count", 0))]
    own = {entry["name"]: entry.get("contact", contact) for entry in root.get("peers", [])}
    return {**dict.fromkeys(names, contact), **own}


def direction(contact):
    """Along which axis a contact pushes, and to which side; `None` if it does not push."""
    if not isinstance(contact, dict):
        return None
    if contact.keys() != {"push"} or contact["push"] not in DIRECTIONS:
        raise NotCovered(f"a contact that is not covered: {contact}")
    return DIRECTIONS[contact["push"]]


def axes_of(root):
    """The axes along which contacts push."""
    return sorted({of[0] for of in map(direction, contacts_of(root).values()) if of})


def without_pushes(root, axis):
    """The tables of a scene along an axis, with contacts that grasp in the place of those that push along it and none in that of others, and to which side each peer pushes."""
    root = {name: table for name, table in root.items() if name not in ("timeline", "measure")}
    root["scene"] = {key: value for key, value in root["scene"].items() if key != "axes"}
    sides = {name: direction(contact) for name, contact in contacts_of(root).items()}
    pushes = {name: of[1] for name, of in sides.items() if of and of[0] == axis}
    along = lambda contact: contact if not isinstance(contact, dict) else "grasp" if direction(contact)[0] == axis else "none"
    common = dict(root.get("peer", {}))
    entries = [dict(entry) for entry in root.get("peers", [])]
    for table in (common, *entries):
        if "contact" in table:
            table["contact"] = along(table["contact"])
    return {**root, "peer": common, "peers": entries} if entries else {**root, "peer": common}, pushes


class PushBox(KeyBox):
    """One scene, as a box without numbers."""

    def __init__(self, scene, pushes):
        if scene.horizon is not None:
            raise NotCovered("contacts and samples that are extrapolated")
        super().__init__([scene], classes_of([scene], pushes.get))


class PushFrame:
    """A frame of a part: rows over its states and then its forces, one input for each tick of each contact."""

    def __init__(self, box, difference, members, states, heard, time, pushes):
        self.part = part = Part(box, difference, members, [], heard, time)
        scene, timing = box.scene, Timing(box.scene)
        peers = [scene.peers[first] for first in part.first]
        armed = [peer.arm is not None and peer.arm[2] > 0 for peer in peers]
        self.signs = [pushes.get(peer.name) for peer in peers]
        classes = range(len(peers))
        holders = [peer for peer in scene.peers if peer.touches and peer.name not in pushes and peer.arm is not None and peer.arm[2] > 0]
        self.has_rest = [bool(holders) and held for held in armed]
        reference = not difference and not holders
        ticks = list(range(timing.first_tick(part.first[0], timing.t0), timing.t1, peers[0].tick))
        self.contacts = [c for c in classes if self.signs[c] is not None]
        self.states = [tuple(state) for state in states]
        self.inputs = {(c, tick): len(self.states) + place * len(ticks) + number for place, c in enumerate(self.contacts) for number, tick in enumerate(ticks)}
        self.ticks = len(ticks)
        self.size = len(self.states) + len(self.inputs)
        zero = part.zeros(self.size)
        left = set(self.states)

        def state(*name):
            left.discard(name)
            if name not in self.states:
                raise NotCovered(f"a state that is missing: {name}")
            return part.unit(self.size, self.states.index(name))

        # A device that nothing holds stands where it begins: its place counts nowhere but in the depth of its own contact, of which only changes do.
        loose = [self.signs[c] is not None and not armed[c] for c in classes]
        bodies = []
        for c, peer in enumerate(peers):
            copy = [zero if reference and c == 0 else state("copy", c, "position"), state("copy", c, "velocity")]
            device = [zero if loose[c] else state("device", c, "position"), state("device", c, "velocity")] if peer.touches else []
            bodies.append(copy + device)
        shares, heard_by = part.heard()
        first = {c: timing.sends(part.first[c], timing.t0, timing.t1)[0] for c in classes}
        number_of = lambda c, sent: (sent - first[c]) // scene.update
        samples = {}
        for kind, c, number, *_ in self.states:
            if kind == "sample":
                samples[c, number] = [state("sample", c, number, channel) for channel in range(len(shares))]
        if left:
            raise NotCovered(f"states that nothing begins with: {sorted(map(str, left))}")
        links = {(i, j): part.link(i, j) for i in classes for j in classes if part.hears(i, j)}
        held = {pair: number_of(pair[0], timing.held(*link)) for pair, link in links.items()}
        due = {pair: timing.in_force(*link) for pair, link in links.items()}
        self.depths, self.rates = ({c: [] for c in self.contacts} for _ in range(2))
        for instant in ticks:
            for c in classes:
                if instant in timing.sends(part.first[c], timing.t0, timing.t1):
                    x, v, *_ = bodies[c]
                    samples[c, number_of(c, instant)] = [x.times(share.entry(0)) + v.times(share.entry(1)) for share in shares]
            for pair, arrivals in due.items():
                held[pair] = next((number_of(pair[0], sent) for tick, sent in reversed(arrivals) if tick == instant), held[pair])
            for c in classes:
                bodies[c] = self.tick(c, bodies[c], instant, [(i, samples[i, held[i, c]]) for i in classes if (i, c) in links], heard_by[c])
        for c in self.contacts:
            self.depths[c].append(self.depth(c, bodies[c], 0))
        moved = bodies[0][0] if reference else zero
        self.final = []
        for kind, c, *which in self.states:
            if kind == "sample":
                row = samples[c, which[0] + 1][which[1]] - moved.times(shares[which[1]].entry(0))
            else:
                row = bodies[c][2 * (kind == "device") + (which == ["velocity"])]
                # A device that an arm holds, and that only pushes, stands relative to that.
                if which == ["position"] and not (kind == "device" and self.signs[c] is not None):
                    row = row - moved
            self.final.append(row)

    def depth(self, c, body, of):
        difference = body[2 + of] - body[of]
        return difference.times(self.part.constant(self.signs[c]))

    def tick(self, c, body, instant, heard, heard_by):
        part, box = self.part, self.part.box
        peer = part.first[c]
        kc, bc, kt, bt = (box.gain(peer, name) for name in ("kc", "bc", "kt", "bt"))
        of_velocity = lambda gain: scalar(gain.scaled(1 / part.time))
        x, v, *device = body
        zero = part.zeros(self.size)
        force = zero - (x.times(scalar(kt)) + v.times(of_velocity(bt)))
        for sender, sample in heard:
            for by, row in zip(heard_by, sample):
                force = force + row.times(box.weighed(by, part.weights[c][sender]))
        if not device:
            return part.move("copy", peer, (x, v), force)
        if self.signs[c] is None:
            grasp = (device[0] - x).times(scalar(kc)) + (device[1] - v).times(of_velocity(bc))
        else:
            if not kc.mean > 0:
                raise NotCovered("a contact without a stiffness")
            self.depths[c].append(self.depth(c, body, 0))
            self.rates[c].append(self.depth(c, body, 1).times(part.constant(bc.mean / kc.mean / part.time)))
            grasp = part.unit(self.size, self.inputs[c, instant]).times(scalar(kc.scaled(self.signs[c])))
        return part.move("copy", peer, (x, v), force + grasp) + part.move("device", peer, device, zero - grasp)

    def falls(self, shape, multipliers, weights, factor) -> bool:
        """Whether V shrinks by that factor at least: `multipliers` by contact, tick and product."""
        states, contacts, steps = len(self.states), self.contacts, self.ticks
        whole = self.size + len(contacts) * (steps + 1)
        wide = lambda row: Row(row.mean + [0.0] * (whole - self.size), [], row.radius + [0.0] * (whole - self.size))
        unit = lambda place: Row.unit(whole, place, 0)
        pressed = lambda number, tick: unit(self.size + number * (steps + 1) + tick)
        before = [unit(place) for place in range(states)] + [pressed(number, 0) for number in range(len(contacts))]
        after = [wide(row) for row in self.final] + [pressed(number, steps) for number in range(len(contacts))]
        factors = []
        for number, c in enumerate(contacts):
            for tick in range(steps):
                f, p, later = unit(states + number * steps + tick), pressed(number, tick), pressed(number, tick + 1)
                depth, deeper = wide(self.depths[c][tick]), wide(self.depths[c][tick + 1])
                rest, opening, inside = f - p - wide(self.rates[c][tick]), depth - deeper - p + later, depth - p
                zero = Row.zeros(whole, 0)
                own = [(f, rest), (p, rest), (f, opening), (p, opening), (zero - later, opening)]
                own += [(p, inside), (f, inside)] if self.has_rest[c] else []
                factors += [(one, other, multipliers[number][tick][kind] * weights[number]) for kind, (one, other) in enumerate(own)]
        matrix = lambda rows: Span([row.mean for row in rows], [], [row.radius for row in rows])
        exact = lambda rows: Span(rows, [], [[0.0] * len(rows[0]) for _ in rows])
        v, first, last = exact(shape), matrix(before), matrix(after)
        by = lambda rows, form: rows.transposed().times(form).times(rows)
        left = by(first, exact([[factor**2 * entry for entry in row] for row in shape])).plus(by(last, v).negated())
        for row in left.radius:
            row[:] = [entry + 1e-300 for entry in row]
        ones, others, signs = matrix([one for one, _, _ in factors]), matrix([other for _, other, _ in factors]), [by for _, _, by in factors]
        scaled = Span(
            [[by * entry for entry in row] for by, row in zip(signs, others.mean)],
            [],
            [[abs(by) * (off + 4 * EPS * abs(entry)) for entry, off in zip(*rows)] for by, rows in zip(signs, zip(others.mean, others.radius))],
        )
        products = ones.transposed().times(scaled)
        half = exact([[0.5 * (i == j) for j in range(whole)] for i in range(whole)])
        return is_everywhere_positive(left.plus(products.plus(products.transposed()).times(half).negated()))


def is_shape(shape) -> bool:
    return shape == [list(column) for column in zip(*shape)] and is_everywhere_positive(Span(shape, [], [[0.0] * len(shape) for _ in shape]))

