"""Writes the rows of a suite into the tables of docs/tested-with.md. Rows of other suites stay."""

import re

from suites import LOOPBACKS, SUITES

LINKS = " | ".join(f"`{words}`" for words in LOOPBACKS)
PASSING = f"| crate | tests | over the network | real loopback | {LINKS} | lines changed |\n| --- | ---: | ---: | ---: |{' ---: |' * len(LOOPBACKS)} ---: |"
TIMES = f"| crate | real loopback | {LINKS} | times as fast |\n| --- | ---: |{' ---: |' * len(LOOPBACKS)} ---: |"
UNDER_LOAD = "| crate | runs each | at once | real loopback | test bed |\n| --- | ---: | ---: | ---: | ---: |"
FAILURES = "| crate | test | loopback | seeds that fail | smallest loopback, with the seed |\n| --- | --- | --- | ---: | --- |"
LIMITS = "| crate | test | why |\n| --- | --- | --- |"


def tables(suite, figures):
    """Returns the head of each table, and the rows of the suite."""
    name, tests, seconds = suite.name, figures["tests"], figures["seconds"]
    passing = [tests - failed for failed in figures["failed"]]
    return {
        PASSING: [row(f"{name} {suite.version} ({suite.licence})", tests, figures["networked"], *passing, figures["changed"])],
        TIMES: [row(name, *(f"{taken:.2f}" for taken in [*seconds, seconds[0] / seconds[1]]))],
        UNDER_LOAD: [row(name, figures["loads"], figures["at once"], figures["real under load"], figures["bed under load"])] if figures["loads"] else [],
        FAILURES: [
            row(name, f"`{test}`", f"`{words}`", f"{len(seeds)} of {figures['seeds']}", f"`{smallest}`, seed {seeds[0]}")
            for test, words, seeds, smallest in figures["failures"]
        ],
        LIMITS: [row(name, f"`{test}`", suite.limits.get(test, "")) for test in sorted(figures["limits"])],
    }


def row(*cells):
    return f"| {' | '.join(map(str, cells))} |"


def place(line):
    """Returns the place of a row in the order of the suites."""
    return [suite.name for suite in SUITES].index(re.match(r"\| ([\w-]+)", line)[1])


def write(path, suite, figures):
    text = path.read_text()
    for head, rows in tables(suite, figures).items():
        before, after = text.split(f"{head}\n", 1)
        table = re.match(r"(?:\|.*\n)*", after)[0]
        others = [line for line in table.splitlines() if place(line) != SUITES.index(suite)]
        text = "\n".join([before + head, *sorted(others + rows, key=place), after[len(table) :]])
    path.write_text(text)
