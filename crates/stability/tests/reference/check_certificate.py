#!/usr/bin/env python3
"""Checks a certificate of `cohaptic stability` with no part of the program that wrote it: of `map --prove`, `boundary --prove`, `point --every-number` or `point --switching`.

    python3 check_certificate.py certificate.json

A certificate has a scene, boxes of one or two of its keys (and of 1/(N − 1), if they hold for every number N of peers) or spans of numbers of peers, and for each a verdict with the numbers by which it can be checked. This
program writes down the frame of the scene over each from the equations of docs/model.md, with a bound of every rounding error, and checks that

1. the boxes cover the whole range, once, or spans leave no number out;
2. on a circle all matrices A(z) = W·(z·1 − M)·V of the box are strictly diagonally dominant with the weights of the certificate, where W is the
   inverse of its coordinates V, nearly. Then no M of the box has an eigenvalue on the circle (Gershgorin 1931), and as many inside as A has
   diagonal entries that vanish there;
3. with the circle |z| = 1 that is all of them, in every part of the scene: it is stable; or there is one outside of |z| = 1 in some part: unstable.

In the mean square, and of contacts that open and close, it checks quadratic forms instead: `moments_over_box.py` and `pushes.py` say which.

It needs Python 3.11 or later and nothing else. A scene that is not covered is refused, by name.
"""

import json
import math
import struct
import sys
import tomllib
from decimal import Decimal
from fractions import Fraction
from itertools import product as tuples
from operator import mul

import scene as scenes
from frame_over_box import KeyBox, NumberBox, Part, TooLight, classes_of
from moments_over_box import Moments, Span, is_everywhere_positive
from pushes import PRODUCTS, PushBox, PushFrame, axes_of, is_shape, without_pushes
from scene import Scene
from timing import Timing

# The relative error of one operation, and of some in a row.
EPS = 2.0**-52
UP = 1 + 2.0**-40

KEYS = {
    *("coordination.stiffness", "coordination.damping", "peer.coupling.stiffness", "peer.coupling.damping"),
    *("object.mass", "object.damping", "peer.device.mass", "peer.device.damping"),
}


class Refused(Exception):
    """The certificate does not show what it says, or cannot be checked."""


def scene_with(text: str, overrides: list) -> Scene:
    """The scene with keys set to values, as the program's --set does."""
    return scenes.read(tables_with(text, overrides), text)


def tables_with(text: str, overrides) -> dict:
    """The tables of a scene with keys set to values."""
    root = tomllib.loads(text)
    for key, value in overrides:
        *path, last = key.split(".")
        table = root
        for name in path:
            table = table.setdefault(name, {})
            if not isinstance(table, dict):
                raise Refused(f"a key that is not covered: {key}")
        table[last] = value
    return root


def override(text: str) -> tuple:
    key, value = text.split("=", 1)
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value


def doubles(digits: str) -> list:
    return [number for (number,) in struct.iter_unpack(">d", bytes.fromhex(digits))]


def product(one, other):
    columns = list(zip(*other))
    return [[sum(map(mul, row, column)) for column in columns] for row in one]


def sizes(matrix):
    return [[abs(entry) * UP for entry in row] for row in matrix]


def inverse(matrix):
    """The inverse, nearly, by Gauss and Jordan."""
    size = len(matrix)
    rows = [list(row) + [1.0 if i == j else 0.0 for j in range(size)] for i, row in enumerate(matrix)]
    for place in range(size):
        pivot = max(range(place, size), key=lambda row: abs(rows[row][place]))
        rows[place], rows[pivot] = rows[pivot], rows[place]
        if rows[place][place] == 0:
            raise Refused("coordinates that are none: V has no inverse")
        by = 1 / rows[place][place]
        head = rows[place] = [entry * by for entry in rows[place]]
        for row in range(size):
            if row != place and rows[row][place] != 0:
                factor = rows[row][place]
                rows[row] = [entry - factor * of_head for entry, of_head in zip(rows[row], head)]
    return [row[size:] for row in rows]


def check_part(frame, certificate) -> tuple:
    """How many eigenvalues of every matrix of the box lie within the circle of the certificate, of how many; and a bound from below of how far the others
    are from zero."""
    size, numbers = len(frame.mean), len(frame.slopes)
    flat = doubles(certificate["coordinates"])
    weights = doubles(certificate["weights"])
    if len(flat) != 2 * size * size or len(weights) != size or not all(weight > 0 for weight in weights):
        raise Refused(f"expected {size} coordinates and as many weights above zero")
    column = lambda j: [complex(*flat[2 * (j * size + i) : 2 * (j * size + i) + 2]) for i in range(size)]
    v = [list(row) for row in zip(*[column(j) for j in range(size)])]
    w = inverse(v)
    through = lambda matrix: product(w, product(matrix, v))
    unit, mean, slopes = product(w, v), through(frame.mean), [through(slope) for slope in frame.slopes]
    w_sizes, v_sizes = sizes(w), sizes(v)
    rounding = (8 * size + 32) * (2 + numbers) * EPS
    largest = [
        [(abs(m) + sum(abs(s[i][j]) for s in frame.slopes) + frame.radius[i][j]) * UP for j, m in enumerate(row)] for i, row in enumerate(frame.mean)
    ]
    by_radius, by_largest = (product(w_sizes, product(matrix, v_sizes)) for matrix in (frame.radius, largest))
    unit_sizes = product(w_sizes, v_sizes)
    wide = [[(one + rounding * other) * UP for one, other in zip(*rows)] for rows in zip(by_radius, by_largest)]
    off_unit = [[(abs(u - (i == j)) + rounding * unit_sizes[i][j]) * UP for j, u in enumerate(row)] for i, row in enumerate(unit)]

    def reach(centre, moves, radius):
        """Between which sizes centre + Σ sᵢ·movesᵢ ± radius stays."""
        length = abs(centre)
        turn = centre.conjugate() / length if length > 0 else 1.0
        along = sum(abs((move * turn).real) for move in moves)
        across = sum(abs((move * turn).imag) for move in moves)
        radius = radius + 16 * EPS * (length + along + across)
        return length - along - radius, (math.hypot(length + along, across) + radius) * UP

    moves = lambda i, j: [slope[i][j] for slope in slopes]
    reaches = [reach(mean[i][i], moves(i, i), wide[i][i]) for i in range(size)]
    kind, *of_circle = certificate["circle"]
    if kind == "around-zero":
        (radius,) = of_circle
        inside = [high < radius for _, high in reaches]
        apart = [radius - high if within else low - radius for (low, high), within in zip(reaches, inside)]
        farthest = radius
        least = radius
    elif kind == "around-entry":
        place, radius = of_circle
        inside = [i == place for i in range(size)]
        far = lambda i: reach(mean[i][i] - mean[place][place], [a - b for a, b in zip(moves(i, i), moves(place, place))], wide[i][i])[0]
        apart = [radius - wide[i][i] if i == place else far(i) - radius for i in range(size)]
        low, high = reach(mean[place][place], moves(place, place), 0.0)
        farthest = (high + radius) * UP
        least = low - radius
    else:
        raise Refused(f"a circle that is not covered: {kind}")
    if not radius > 0:
        raise Refused("a circle without a radius")
    for i in range(size):
        own = (apart[i] - off_unit[i][i] * farthest * UP) * weights[i]
        beside = [(abs(mean[i][j]) + sum(map(abs, moves(i, j))) + wide[i][j] + off_unit[i][j] * farthest) * weights[j] for j in range(size) if j != i]
        if not own > sum(beside) * (1 + 4 * size * EPS) * UP:
            raise Refused(f"row {i + 1} of {size} is not dominant on the circle")
    return sum(inside), size, kind, least


DELAY = "link.delay"


def check_box(document, box) -> str:
    """The verdict of a box of keys."""
    keys, ranges = document["keys"], box["ranges"]
    free = [place for place, key in enumerate(keys) if key != DELAY]
    text = lambda place, value: (keys[place], f"{Decimal(repr(value)):f}{document['units'][place]}" if keys[place] == DELAY else value)
    with_keys = lambda bits: scene_of(document, [text(place, of_key[place in free and bits >> free.index(place) & 1]) for place, of_key in enumerate(ranges[: len(keys)])])
    corners = [with_keys(bits) for bits in range(2 ** len(free))]
    if DELAY in keys:
        place = keys.index(DELAY)
        last = scene_of(document, [text(key, ranges[key][key == place]) for key in range(len(keys))])
        if events(corners[0]) != events(last):
            raise Refused("samples come into force at other ticks with the longest delay than with the shortest")
    numbers = numbers_of_box(document, ranges[len(keys) :])
    return check_verdict(lambda: KeyBox(corners, classes_of(corners), numbers), box, corners)


def events(scene):
    """When the samples of each peer come into force at each other, which is later for none if a delay is shorter."""
    timing = Timing(scene)
    of = lambda *link: (timing.held(*link) - timing.t0, [(tick - timing.t0, sent - timing.t0) for tick, sent in timing.in_force(*link)])
    return [of(*link) for link in scene.links]


def ends_of_numbers(document):
    """Between which ends 1/(N − 1) is."""
    every = document["every_number"]
    if every["from"] < 2 or every["to"] is not None and every["to"] < every["from"]:
        raise Refused("numbers of peers that are none")
    return Fraction(0) if every["to"] is None else Fraction(1, every["to"] - 1), Fraction(1, every["from"] - 1)


def numbers_of_box(document, ranges):
    """The ends of 1/(N − 1) of a box, exact where they are those of all of them."""
    if document["every_number"] is None:
        return None
    (ends,) = ranges
    whole = ends_of_numbers(document)
    return [next((exact for exact in whole if float(exact) == end), Fraction(end)) for end in ends]


def check_moments(scene, growing, span):
    """Whether γ·Y − L(Y) is positive definite for every number of a span, Y being so too if it is stable, and not so if it is not: in the mean square (Krein & Rutman 1948)."""
    box = NumberBox(scene, classes_of([scene]), growing, span["from"], span["to"], may_lose=True)
    if len(span["moments"]) != 1:
        raise Refused("expected one second moment")
    (moment,) = span["moments"]
    gamma = moment["factor"]
    frame = Moments(box, span["from"], span["to"], moment["heard"], moment["time"], moment["depth"])
    size = frame.bodies + frame.depth
    blocks = []
    for digits, rows in zip(moment["blocks"], (size + 1 - (frame.part.reference is not None), size + 2, 1)):
        flat = doubles(digits)
        if len(flat) != rows * rows:
            raise Refused(f"expected a moment of {rows} rows")
        block = [flat[row * rows : (row + 1) * rows] for row in range(rows)]
        if block != [list(column) for column in zip(*block)]:
            raise Refused("a moment that is not symmetric")
        blocks.append(block)
    whole = [frame.constant(block) for block in blocks]
    if span["verdict"] == "stable":
        holds = gamma <= 1 and all(map(is_everywhere_positive, whole))
    else:
        holds = gamma > 1 and any(block[place][place] < 0 for block in blocks for place in range(len(block)))
    if not holds:
        raise Refused("a moment, or a factor, that shows something else")
    images = frame.image(*whole)
    for block, image in zip(whole, images):
        left = [[gamma * entry for entry in row] for row in block.mean]
        rounded = [[EPS * abs(entry) for entry in row] for row in left]
        if not is_everywhere_positive(Span(left, frame.constant(left).slopes, rounded).plus(image.negated())):
            raise Refused("a frame leaves more of the second moment than its factor")


def check_span(document, span) -> str:
    """The verdict of a span of numbers of peers."""
    scene = scene_of(document)
    if span["moments"]:
        check_moments(scene, document["growing"], span)
        check_devices([scene])
        return span["verdict"]
    try:
        return check_verdict(lambda: NumberBox(scene, classes_of([scene]), document["growing"], span["from"], span["to"]), span, [scene])
    except TooLight:
        # The numbers before are checked all the same.
        return "undecided"


def scene_of(document, values=()) -> Scene:
    return scene_with(document["scene"], [*map(override, document["overrides"]), *values])


def check_verdict(make, certified, scenes) -> str:
    verdict = certified["verdict"]
    if verdict == "undecided":
        return verdict
    over = make()
    found = set()
    for part in certified["parts"]:
        name = (part["difference"], tuple(map(tuple, part["members"])))
        frame = Part(over, *name, part["states"], part["heard"], part["time"]).frame()
        within, size, kind, least = check_part(frame, part)
        if verdict == "unstable" and (least < 1 or kind == "around-zero" and within == size):
            raise Refused("no eigenvalue is shown to be outside of the unit circle")
        if verdict == "stable" and (kind != "around-zero" or part["circle"][1] > 1 or within < size):
            raise Refused("not all eigenvalues are shown to be within the unit circle")
        found.add(name)
    known = {(True, (members,)) for members in over.classes if over.has_differences(members)} | {(False, tuple(over.classes))}
    if not found <= known:
        raise Refused("a part of the certificate is none of the scene")
    if verdict == "unstable" and not found:
        raise Refused("there is no part that grows")
    if verdict == "stable":
        if found != known:
            raise Refused("a part of the scene is missing")
        check_devices(scenes)
    if verdict not in ("stable", "unstable"):
        raise Refused(f"a verdict that is none: {verdict}")
    return verdict


def check_devices(scenes):
    """Refuses devices that touch nothing and do not come to rest."""
    for peer in (peer for scene in scenes for peer in scene.peers):
        damping = peer.device_damping + (peer.arm[1] if peer.arm else 0.0)
        if not peer.touches and not damping > 0:
            raise Refused(f"the device of {peer.name} touches nothing and has no damping")


def check_motion(document, motion) -> str:
    """The verdict on contacts along an axis that open and close."""
    if motion["verdict"] == "undecided":
        return "undecided"
    if motion["verdict"] != "stable" or not 0 < motion["factor"] <= 1:
        raise Refused("a verdict that is not covered")
    root, pushes = without_pushes(tables_of(document), motion["axis"])
    scene = scenes.read(root, document["scene"])
    box = PushBox(scene, pushes)
    multipliers = doubles(motion["multipliers"])
    numbers = {members[0]: place for place, members in enumerate(m for m in box.classes if scene.peers[m[0]].name in pushes)}
    found = set()
    for part in motion["parts"]:
        members = list(map(tuple, part["members"]))
        frame = PushFrame(box, part["difference"], members, part["states"], motion["heard"], motion["time"], pushes)
        firsts = [members[c][0] for c in frame.contacts]
        rows = len(frame.states) + len(frame.contacts)
        flat = doubles(part["shape"])
        if len(flat) != rows * rows or len(multipliers) != len(numbers) * frame.ticks * PRODUCTS:
            raise Refused("a form, or multipliers, of another size")
        shape = [flat[row * rows : (row + 1) * rows] for row in range(rows)]
        at = lambda contact, tick: PRODUCTS * (numbers[contact] * frame.ticks + tick)
        of_contacts = [[multipliers[at(first, tick) : at(first, tick) + PRODUCTS] for tick in range(frame.ticks)] for first in firsts]
        if any(by < 0 for ticks in of_contacts for tick in ticks for by in tick[1:]):
            raise Refused("a multiplier below zero")
        weights = [1.0 if part["difference"] else float(len(members[c])) for c in frame.contacts]
        if not is_shape(shape) or not frame.falls(shape, of_contacts, weights, motion["factor"]):
            raise Refused("a form that is not shown to fall")
        found.add((part["difference"], tuple(members)))
    for part in motion["rest"]:
        members = tuple(map(tuple, part["members"]))
        within, size, kind, _ = check_part(Part(box, part["difference"], members, part["states"], part["heard"], part["time"]).frame(), part)
        if kind != "around-zero" or part["circle"][1] > 1 or within < size or any(scene.peers[first].name in pushes for first, *_ in members):
            raise Refused("not all eigenvalues are shown to be within the unit circle")
        found.add((part["difference"], members))
    if found != {(True, (members,)) for members in box.classes if len(members) > 1} | {(False, tuple(box.classes))}:
        raise Refused("a part of the scene is missing")
    check_devices([scene])
    return "stable"


def tables_of(document) -> dict:
    return tables_with(document["scene"], map(override, document["overrides"]))


def check_switching(document) -> str:
    if not document["motions"]:
        raise Refused("no motion")
    words = [checked(check_motion, document, motion, motion["motion"] or "the motion") for motion in document["motions"]]
    proven = [motion["axis"] for motion in document["motions"] if motion["verdict"] == "stable"]
    if len(proven) == len(words) and proven != axes_of(tables_of(document)):
        raise Refused("an axis along which contacts push is missing, or stands there twice")
    return "contacts that open and close: " + ", ".join(words)


def check_cover(document):
    """Refuses boxes that do not cover the range once: each is the range, or a part of a box that is no box, with all sides halved. A delay is divided into stretches
    between which there is no nanosecond, and 1/(N − 1) into pieces of its own for each box of keys."""
    keys, ranges = document["keys"], document["ranges"]
    pieces = {}
    for box in document["boxes"]:
        pieces.setdefault(tuple(map(tuple, box["ranges"][: len(keys)])), []).append(box["ranges"][len(keys) :])
    for of_keys, of_numbers in pieces.items():
        if document["every_number"] is None:
            chained = of_numbers == [[]]
        else:
            of_numbers = sorted(ends for (ends,) in of_numbers)
            low, high = map(float, ends_of_numbers(document))
            chained = (of_numbers[0][0], of_numbers[-1][1]) == (low, high) and all(one[1] == other[0] for one, other in zip(of_numbers, of_numbers[1:]))
        if not chained:
            raise Refused(f"numbers of peers are left out, or a box stands there twice: {of_keys}")
    left = set(pieces)
    for whole in beginnings(document, left):
        waiting = [whole]
        while waiting:
            box = waiting.pop()
            if box in left:
                left.remove(box)
                continue
            halves = [[side] if key == DELAY else [(side[0], sum(side) / 2), (sum(side) / 2, side[1])] for key, side in zip(keys, box)]
            if not left or not all(low < high for sides in halves if len(sides) > 1 for low, high in sides):
                raise Refused(f"nothing covers {box}")
            waiting += tuples(*halves)
    if left:
        raise Refused(f"beyond the range, or twice: {left.pop()}")


def beginnings(document, boxes):
    """The range, for each stretch of delays if one of the keys is a delay."""
    whole = tuple(map(tuple, document["ranges"]))
    if DELAY not in document["keys"]:
        return [whole]
    place = document["keys"].index(DELAY)
    stretches = sorted({box[place] for box in boxes})
    nanoseconds = lambda value: scenes.nanoseconds(f"{Decimal(repr(value)):f}{document['units'][place]}")
    ends = [(nanoseconds(low), nanoseconds(high)) for low, high in stretches]
    if (stretches[0][0], stretches[-1][1]) != whole[place] or any(one[1] + 1 != other[0] for one, other in zip(ends, ends[1:])):
        raise Refused("delays are left out, or stand there twice")
    return [(*whole[:place], stretch, *whole[place + 1 :]) for stretch in stretches]


def check(document) -> str:
    """What a certificate shows, in words; refuses what does not hold."""
    kind = document["schema"].split("/")
    if kind == ["cohaptic", "stability-certificate"]:
        return check_boxes(document)
    if kind == ["cohaptic", "stability-number-certificate"]:
        return check_spans(document)
    if kind == ["cohaptic", "stability-switching-certificate"]:
        return check_switching(document)
    raise Refused("not a certificate of a region, of numbers of peers or of contacts")


def checked(one, all_of, place, words) -> str:
    """The verdict on a piece, or a refusal that says which."""
    try:
        return one(all_of, place)
    except (Refused, ValueError, KeyError) as refused:
        raise Refused(f"{words}, {place['verdict']}: {refused}") from None


def check_boxes(document) -> str:
    for key in document["keys"]:
        if key not in KEYS | {DELAY}:
            raise Refused(f"a key that is not covered: {key}; expected gains, masses, dampings and link.delay")
    document.setdefault("every_number", None)
    check_cover(document)
    # A side without a length counts as one: a single delay, a single number of peers.
    area = lambda box: math.prod(Fraction(high) - Fraction(low) or 1 for low, high in box["ranges"])
    shares = {"stable": Fraction(0), "unstable": Fraction(0), "undecided": Fraction(0)}
    for number, box in enumerate(document["boxes"], start=1):
        shares[checked(check_box, document, box, f"box {number} of {len(document['boxes'])}, {box['ranges']}")] += area(box)
    whole = sum(shares.values())
    return f"{len(document['boxes'])} boxes hold: " + ", ".join(f"{name} {float(100 * share / whole):.3f} %" for name, share in shares.items())


def check_spans(document) -> str:
    found = []
    for span in document["spans"]:
        low, high = span["from"], span["to"]
        if found and found[-1][1] != low - 1 or high is not None and high < low:
            raise Refused(f"numbers of peers are left out before {low}, or stand there twice")
        verdict = checked(check_span, document, span, f"from {low} to {high} peers")
        if found and found[-1][2] == verdict:
            low = found.pop()[0]
        found.append((low, high, verdict))
    words = [f"{verdict} from {low} on" if high is None else f"{verdict} from {low} to {high}" for low, high, verdict in found]
    return f"{len(document['spans'])} spans of numbers hold: " + ", ".join(words)


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: python3 check_certificate.py CERTIFICATE.json")
    with open(sys.argv[1], encoding="utf-8") as file:
        document = json.load(file)
    try:
        print(check(document))
    except Refused as refused:
        sys.exit(f"refused: {refused}")


if __name__ == "__main__":
    main()
