"""A frame of a scene in which the forces of contacts that only push, and of walls, are inputs, and the quadratic form that shows that whatever they do dies out.

With the depth δ of a contact (of its device relative to the copy, in the direction of the push), p = max(0, δ), f its force divided by KC, τ = BC/KC and b = p − δ, these are not below zero at any tick k and its next:

    f·(f − p − τ·δ') = 0    p·(f − p − τ·δ')    f·(b⁺ − b)    p·(b⁺ − b)    −p⁺·(b⁺ − b)

and where an arm holds the device and another the object at rest, with no contact pressed there, p·(δ − p) and f·(δ − p). So V(after) < V(before) for a form V > 0 of states and p, if V(after) − V(before) plus
these products with multipliers (of the first of any sign, of the others not below zero) is below zero for all states, forces and depths p whatever.

At walls δ is the position of a copy, p is what of it lies beyond the upper or the lower end, and f has the sign of p: −b is the position, cut off at both ends, and all this holds too. Copies i and j have the same walls, so that

    p_i·(b_j − b_i)    f_i·(b_j − b_i)

are not below zero either. Over all members of two classes these are the product of their averages, and those of the differences within the first.

Along another axis than that in which it pushes a device touches nothing. Objects that turn and clocks that differ are not covered.
"""

from fractions import Fraction

from boxes import KeyBox, classes_of
from circles import doubles
from frame_over_box import Part
from moments_over_box import Span, is_everywhere_positive
from numbers_over_box import EPS, NotCovered, Row, scalar
from timing import Timing

# Of each tick of a contact; the first may be below zero.
PRODUCTS = 7
# And of each tick of the walls of two classes.
SHARED = 2
PUSH, WALL = "push", "wall"


# The directions of pushes, by axes.
DIRECTIONS = {f"{sign}{axis}": (place, 1 if sign == "+" else -1) for place, axis in enumerate("xyz") for sign in "+-"}


def contacts_of(root):
    """The contact of each peer, by name."""
    if "inertia" in root["object"]:
        raise NotCovered("an object that turns")
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
    """The axes along which contacts push, or all, if there are walls; equal ones count as the first."""
    pushed = sorted({of[0] for of in map(direction, contacts_of(root).values()) if of})
    if "enclosure" not in root["object"]:
        return pushed
    return list(range(root["scene"].get("axes", 1))) if pushed else [0]


def walls_of(root):
    """Stiffness and damping of walls; `None` if there are none."""
    wall = root["object"].get("enclosure")
    if wall is None:
        return None
    if set(wall) - {"min", "max", "stiffness", "damping"} or not wall["stiffness"] > 0:
        raise NotCovered(f"walls that are not covered: {wall}")
    return Fraction(wall["stiffness"]), Fraction(wall.get("damping", 0.0))


def without_pushes(root, axis):
    """The tables of a scene along an axis, with contacts that grasp in the place of those that push along it and none in that of others, and to which side each peer pushes."""
    root = {name: table for name, table in root.items() if name not in ("timeline", "measure")}
    root["object"] = {key: value for key, value in root["object"].items() if key != "enclosure"}
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

    def __init__(self, box, difference, members, states, heard, time, pushes, walls):
        self.walls = walls
        self.part = part = Part(box, difference, members, [], heard, time)
        scene, timing = box.scene, Timing(box.scene)
        peers = [scene.peers[first] for first in part.first]
        armed = [peer.arm is not None and peer.arm[2] > 0 for peer in peers]
        self.signs = [pushes.get(peer.name) for peer in peers]
        classes = range(len(peers))
        holders = [peer for peer in scene.peers if peer.touches and peer.name not in pushes and peer.arm is not None and peer.arm[2] > 0]
        reference = not difference and not holders
        ticks = list(range(timing.first_tick(part.first[0], timing.t0), timing.t1, peers[0].tick))
        # The walls of each copy, too.
        kinds = lambda c: [PUSH] * (self.signs[c] is not None) + [WALL] * (walls is not None)
        self.contacts = [(c, kind) for c in classes for kind in kinds(c)]
        self.has_rest = {(c, kind): bool(holders) and (kind == WALL or armed[c]) for c, kind in self.contacts}
        self.states = [tuple(state) for state in states]
        self.inputs = {(*contact, tick): len(self.states) + place * len(ticks) + number for place, contact in enumerate(self.contacts) for number, tick in enumerate(ticks)}
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
        self.depths, self.rates = ({contact: [] for contact in self.contacts} for _ in range(2))
        for instant in ticks:
            for c in classes:
                if instant in timing.sends(part.first[c], timing.t0, timing.t1):
                    x, v, *_ = bodies[c]
                    samples[c, number_of(c, instant)] = [x.times(share.entry(0)) + v.times(share.entry(1)) for share in shares]
            for pair, arrivals in due.items():
                held[pair] = next((number_of(pair[0], sent) for tick, sent in reversed(arrivals) if tick == instant), held[pair])
            for c in classes:
                bodies[c] = self.tick(c, bodies[c], instant, [(i, self.sample(samples, i, held[i, c])) for i in classes if (i, c) in links], heard_by[c])
        for contact in self.contacts:
            self.depths[contact].append(self.depth(contact, bodies[contact[0]], 0))
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

    def sample(self, samples, c, number):
        if (c, number) not in samples:
            raise NotCovered(f"a sample that is missing: {number} of class {c}")
        return samples[c, number]

    def depth(self, contact, body, of):
        """How deep a contact is, or its velocity."""
        c, kind = contact
        if kind == WALL:
            return body[of]
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
        if self.walls is not None:
            force = force - self.touch((c, WALL), body, instant, self.walls)
        if not device:
            return part.move("copy", peer, (x, v), force)
        if self.signs[c] is None:
            grasp = (device[0] - x).times(scalar(kc)) + (device[1] - v).times(of_velocity(bc))
        else:
            grasp = self.touch((c, PUSH), body, instant, (kc.mean, bc.mean)).times(part.constant(self.signs[c]))
        return part.move("copy", peer, (x, v), force + grasp) + part.move("device", peer, device, zero - grasp)

    def touch(self, contact, body, instant, gains):
        """Notes how deep a contact is, and gives its force in the direction of its depth, which is an input."""
        stiffness, damping = gains
        if not stiffness > 0:
            raise NotCovered("a contact without a stiffness")
        constant = self.part.constant
        self.depths[contact].append(self.depth(contact, body, 0))
        self.rates[contact].append(self.depth(contact, body, 1).times(constant(damping / stiffness / self.part.time)))
        return self.part.unit(self.size, self.inputs[(*contact, instant)]).times(constant(stiffness))

    def falls(self, shape, multipliers, shared, members, factor) -> bool:
        """Whether V shrinks by that factor at least. `multipliers` by contact, tick and product; `shared` by two classes, by their first members, of each tick those of the walls of both."""
        difference = self.part.difference
        weight = lambda c: 1.0 if difference else float(members[c])
        states, contacts, steps = len(self.states), self.contacts, self.ticks
        whole = self.size + len(contacts) * (steps + 1)
        wide = lambda row: Row(row.mean + [0.0] * (whole - self.size), [], row.radius + [0.0] * (whole - self.size))
        unit = lambda place: Row.unit(whole, place, 0)
        pressed = lambda number, tick: unit(self.size + number * (steps + 1) + tick)
        before = [unit(place) for place in range(states)] + [pressed(number, 0) for number in range(len(contacts))]
        after = [wide(row) for row in self.final] + [pressed(number, steps) for number in range(len(contacts))]
        factors = []
        zero = Row.zeros(whole, 0)
        inside = {(contact, tick): wide(self.depths[contact][tick]) - pressed(number, tick) for number, contact in enumerate(contacts) for tick in range(steps)}
        force = lambda number, tick: unit(states + number * steps + tick)
        for number, contact in enumerate(contacts):
            for tick in range(steps):
                f, p, later = force(number, tick), pressed(number, tick), pressed(number, tick + 1)
                depth, deeper = wide(self.depths[contact][tick]), wide(self.depths[contact][tick + 1])
                rest, opening = f - p - wide(self.rates[contact][tick]), depth - deeper - p + later
                own = [(f, rest), (p, rest), (f, opening), (p, opening), (zero - later, opening)]
                own += [(p, inside[contact, tick]), (f, inside[contact, tick])] if self.has_rest[contact] else []
                factors += [(one, other, multipliers[number][tick][kind] * weight(contact[0])) for kind, (one, other) in enumerate(own)]
        first = self.part.first
        for number, contact in enumerate(contacts):
            c, kind = contact
            for (one, other), of_ticks in shared.items():
                if kind != WALL or one != first[c] or not difference and one == other:
                    continue
                beside = [] if difference else [(first.index(other), WALL)]
                for tick in range(steps):
                    opening = inside[contact, tick]
                    for at in beside:
                        opening = opening - inside[at, tick]
                    factors += [(row, opening, by * weight(c)) for row, by in zip((pressed(number, tick), force(number, tick)), of_ticks[tick])]
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


class Multipliers:
    """The multipliers of a motion: of each contact by tick and product, and of the walls of two classes."""

    def __init__(self, box, motion, pushes, walls):
        flat = doubles(motion["multipliers"])
        peers = box.scene.peers
        firsts = [members[0] for members in box.classes]
        kinds = lambda first: [PUSH] * (peers[first].name in pushes) + [WALL] * (walls is not None)
        names = [(first, kind) for first in firsts for kind in kinds(first)]
        ticks = box.scene.update // peers[0].tick
        is_held = any(peer.touches and peer.name not in pushes and peer.arm is not None and peer.arm[2] > 0 for peer in peers)
        at_walls = [members for members in box.classes if walls is not None and not is_held]
        pairs = [(one[0], other[0]) for one in at_walls for other in at_walls if one != other or len(one) > 1]
        if len(flat) != ticks * (PRODUCTS * len(names) + SHARED * len(pairs)):
            raise NotCovered("multipliers of another size")
        taken = iter(flat)
        take = lambda count: [[next(taken) for _ in range(count)] for _ in range(ticks)]
        self.of = {name: take(PRODUCTS) for name in names}
        self.shared = {pair: take(SHARED) for pair in pairs}
        if any(by < 0 for ticks in self.of.values() for tick in ticks for by in tick[1:]) or any(by < 0 for ticks in self.shared.values() for tick in ticks for by in tick):
            raise NotCovered("a multiplier below zero")


def is_shape(shape) -> bool:
    return shape == [list(column) for column in zip(*shape)] and is_everywhere_positive(Span(shape, [], [[0.0] * len(shape) for _ in shape]))

