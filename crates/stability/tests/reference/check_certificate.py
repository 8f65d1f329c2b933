#!/usr/bin/env python3
"""Checks a certificate of `cohaptic stability` with no part of the program that wrote it: of `map --prove`, `boundary --prove` or `point --every-number`.

    python3 check_certificate.py certificate.json

A certificate has a scene, boxes of one or two of its keys or spans of numbers of peers, and for each a verdict with the numbers by which it can be checked. This
program writes down the frame of the scene over each from the equations of docs/model.md, with a bound of every rounding error, and checks that

1. the boxes cover the whole range, once, or spans leave no number out;
2. on a circle all matrices A(z) = W·(z·1 − M)·V of the box are strictly diagonally dominant with the weights of the certificate, where W is the
   inverse of its coordinates V, nearly. Then no M of the box has an eigenvalue on the circle (Gershgorin 1931), and as many inside as A has
   diagonal entries that vanish there;
3. with the circle |z| = 1 that is all of them, in every part of the scene: it is stable; or there is one outside of |z| = 1 in some part: unstable.

It needs Python 3.11 or later and nothing else. A scene that is not covered is refused, by name.
"""

import json
import math
import struct
import sys
import tomllib
from fractions import Fraction
from itertools import product as tuples
from operator import mul

import scene as scenes
from frame_over_box import KeyBox, NumberBox, Part, classes_of
from scene import Scene

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
    root = tomllib.loads(text)
    for key, value in overrides:
        *path, last = key.split(".")
        table = root
        for name in path:
            table = table.setdefault(name, {})
            if not isinstance(table, dict):
                raise Refused(f"a key that is not covered: {key}")
        table[last] = value
    return scenes.read(root, text)


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


def check_box(document, box) -> str:
    """The verdict of a box of keys."""
    corners = []
    for place in range(2 ** len(document["keys"])):
        values = [(key, box["ranges"][number][place >> number & 1]) for number, key in enumerate(document["keys"])]
        corners.append(scene_of(document, values))
    return check_verdict(lambda: KeyBox(corners, classes_of(corners)), box, corners)


def check_span(document, span) -> str:
    """The verdict of a span of numbers of peers."""
    scene = scene_of(document)
    return check_verdict(lambda: NumberBox(scene, classes_of([scene]), document["growing"], span["from"], span["to"]), span, [scene])


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
        for peer in (peer for scene in scenes for peer in scene.peers):
            damping = peer.device_damping + (peer.arm[1] if peer.arm else 0.0)
            if not peer.touches and not damping > 0:
                raise Refused(f"the device of {peer.name} touches nothing and has no damping")
    if verdict not in ("stable", "unstable"):
        raise Refused(f"a verdict that is none: {verdict}")
    return verdict


def check_cover(document):
    """Refuses boxes that do not cover the range once: each is the range, or a part of a box that is no box, with all sides halved."""
    left = {tuple(map(tuple, box["ranges"])) for box in document["boxes"]}
    if len(left) != len(document["boxes"]):
        raise Refused("a box stands there twice")
    waiting = [tuple(map(tuple, document["ranges"]))]
    while waiting:
        box = waiting.pop()
        if box in left:
            left.remove(box)
            continue
        halves = [((low, (low + high) / 2), ((low + high) / 2, high)) for low, high in box]
        if not left or not all(low < middle < high for (low, middle), (_, high) in halves):
            raise Refused(f"nothing covers {box}")
        waiting += tuples(*halves)
    if left:
        raise Refused(f"beyond the range, or twice: {left.pop()}")


def check(document) -> str:
    """What a certificate shows, in words; refuses what does not hold."""
    kind = document["schema"].split("/")
    if kind == ["cohaptic", "stability-certificate"]:
        return check_boxes(document)
    if kind == ["cohaptic", "stability-number-certificate"]:
        return check_spans(document)
    raise Refused("not a certificate of a region or of numbers of peers")


def checked(one, all_of, place, words) -> str:
    """The verdict on a piece, or a refusal that says which."""
    try:
        return one(all_of, place)
    except (Refused, ValueError, KeyError) as refused:
        raise Refused(f"{words}, {place['verdict']}: {refused}") from None


def check_boxes(document) -> str:
    for key in document["keys"]:
        if key not in KEYS:
            raise Refused(f"a key that is not covered: {key}; expected gains, masses and dampings")
    check_cover(document)
    area = lambda box: math.prod(Fraction(high) - Fraction(low) for low, high in box["ranges"])
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
