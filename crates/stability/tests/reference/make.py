"""Makes radii.json, mean_square.json, bursts.json, admittance.json, random.json, laws.json, absurd.json and verdicts.json, or those named on the command line. See README.md."""

import json
import sys
import time
from multiprocessing import Pool
from pathlib import Path

import absurd
import admittance
import bursts
import cases
import laws
import mean_square
import random_scenes
import verdicts
from mpmath import mpf
from modes import One
from radius import digits
from scene import parse
from text import scene

HERE = Path(__file__).parent


def radius_entry(place):
    case = list(cases.all_cases())[place]
    began = time.monotonic()
    text = case.text() if callable(case.text) else case.text
    if case.method == "full":
        radius, rigid = cases.full_radius(text)
    else:
        made = parse(text)
        one = One(made, case.count or len(made.peers))
        radius = one.radius() if case.method == "modes" else one.radius_by_roots()
        rigid = one.rigid_modes()
    entry = {"name": case.name, "scene": text, "radius": digits(radius), "rigid_modes": rigid, "why": case.why}
    if case.count:
        entry["count"] = case.count
    print(f"{time.monotonic() - began:6.1f} s  {digits(radius, 14)}  {rigid}  {case.name}", file=sys.stderr, flush=True)
    return entry


def radii(pool):
    """Every case, after the three ways to a radius have been compared where all of them apply."""
    for contact, delay in (("grasp", "8ms"), ("none", "16ms"), ("grasp", None)):
        text = scene(5, 1000.0, delay=delay, contact=contact)
        one = One(parse(text), 5)
        full = cases.full_radius(text)[0]
        assert max(abs(full - one.radius()), abs(full - one.radius_by_roots())) < mpf(10) ** -60
    return list(pool.imap(radius_entry, range(len(list(cases.all_cases()))), chunksize=1))


def write(name, entries):
    (HERE / name).write_text(json.dumps(entries, indent=2, ensure_ascii=False) + "\n")


def main():
    wanted = sys.argv[1:] or ["radii", "mean_square", "bursts", "admittance", "random", "laws", "absurd", "verdicts"]
    with Pool() as pool:
        if "radii" in wanted:
            write("radii.json", radii(pool))
        if "mean_square" in wanted:
            write("mean_square.json", mean_square.entries(pool))
        if "bursts" in wanted:
            write("bursts.json", bursts.entries(pool))
        if "admittance" in wanted:
            write("admittance.json", admittance.entries(pool))
        if "random" in wanted:
            write("random.json", random_scenes.entries(pool))
        if "laws" in wanted:
            write("laws.json", laws.entries(pool))
        if "absurd" in wanted:
            write("absurd.json", absurd.entries(pool))
        if "verdicts" in wanted:
            (HERE / "verdicts.json").write_text(json.dumps(verdicts.entries(pool)) + "\n")


if __name__ == "__main__":
    main()
