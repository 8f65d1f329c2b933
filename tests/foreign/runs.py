"""Runs of a suite, each kept in a file as soon as it is over."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import combinations
from pathlib import Path

from suites import CUT, IDEAL, LOOPBACKS

# Programs that only compute beside the runs with load.
BURNERS = 4
# Longest time of a program of tests [s].
PATIENCE = 300
# Runs a program where no other program has a port: in a network namespace whose only interface is the loopback.
ALONE = ["unshare", "--map-root-user", "--net", "sh", "-c", 'ip link set lo up && exec "$@"', "sh"]


def called(command, folder, patience=None, **variables):
    """Calls a program. A program that takes longer than `patience` [s] is ended, and has no status."""
    streams = {"stdin": subprocess.DEVNULL, "capture_output": True, "text": True, "errors": "replace"}
    with contextlib.suppress(subprocess.TimeoutExpired):
        return subprocess.run(command, cwd=folder, env={**os.environ, **variables}, timeout=patience, check=False, **streams)
    return subprocess.CompletedProcess(command, None, "", "")


def kill_children():
    for children in Path("/proc/self/task").glob("*/children"):
        for child in children.read_text().split():
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(child), signal.SIGKILL)


@cache
def alone():
    """Returns whether this system allows network namespaces."""
    try:
        return called([*ALONE, "true"], ".").returncode == 0
    except FileNotFoundError:
        return False


class Runs:
    """`programs` are the programs of a suite for both builds, by the names of the targets."""

    def __init__(self, suite, folder, programs, work):
        self.suite, self.folder, self.programs = suite, folder, programs
        self.file, self.log = (work / f"{suite.name}-{suite.version}{end}" for end in (".json", ".log"))
        self.kept = json.loads(self.file.read_text()) if self.file.exists() else {"runs": {}, "smallest": {}}
        tests = {target: self.names(program) - self.names(program, "--ignored") for target, program in programs["real"].items() if target not in suite.skipped}
        self.tests = {target: names for target, names in tests.items() if names}

    def names(self, program, *arguments):
        return set(re.findall(r"^(\S+): test$", called([program, "--list", *arguments], self.folder).stdout, re.M))

    def keep(self, kind, key, value):
        self.kept[kind][key] = value
        partial = self.file.with_suffix(".partial")
        partial.write_text(json.dumps(self.kept, indent=1, sort_keys=True))
        partial.rename(self.file)
        return value

    def results(self, runs, at_once=1):
        """Returns the failed tests of each run, and its time [s]. Makes the runs that are not kept, `at_once` at the same time."""
        missing = [run for run in runs if run[0] not in self.kept["runs"]]
        with ThreadPoolExecutor(at_once) as pool:
            try:
                for (key, *_), result in zip(missing, pool.map(self.made, missing)):
                    self.keep("runs", key, result)
            except BaseException:
                # The threads would else wait for the programs that run, and start others. No run that ends now is kept.
                pool.shutdown(wait=False, cancel_futures=True)
                kill_children()
                raise
        return [self.kept["runs"][key] for key, *_ in runs]

    def made(self, run):
        """Makes a run. Returns the failed tests, and its time [s]."""
        key, build, before, variables = run
        wrong, begin = [], time.monotonic()
        for target, tests in self.tests.items():
            # Programs of tests that log would print between the names of tests and their results.
            done = called([*before, self.programs[build][target]], self.folder, PATIENCE, RUST_LOG="off", **variables)
            names = sorted(failed(done, tests))
            wrong += [f"{target} {test}" for test in names]
            if names:
                with self.log.open("a") as log:
                    log.write(f"##### {key}: {target}\n{done.stdout}{done.stderr}\n")
        return [wrong, time.monotonic() - begin]

    def real(self, number, prefix=""):
        return f"{prefix}real {number}", "real", ALONE if self.at_once() > 1 else [], {}

    def bed(self, words, seed, prefix=""):
        return f"{prefix}{words} seed {seed}", "bed", [], self.variables(words, seed)

    def at_once(self):
        """Returns how many runs under load go at once. On the real loopback each of them needs a network of its own."""
        return self.suite.at_once if alone() else 1

    def variables(self, words, seed):
        asked = {"COHAPTIC_TEST_LOOPBACK": words, "COHAPTIC_TEST_SEED": str(seed), "COHAPTIC_TEST_STD": "clocks random"}
        return {**asked, **self.suite.variables}

    def fails(self, test, words, seed):
        target, name = test.rsplit(" ", 1)
        return called([self.programs["bed"][target], "--exact", name], self.folder, PATIENCE, **self.variables(words, seed)).returncode != 0

    def smallest(self, test, words, seed):
        """Returns the words that are left if each part is left out without which the test still fails. Of a delay alone, the least whole number of
        milliseconds is sought."""
        key = f"{test}: {words} seed {seed}"
        if key in self.kept["smallest"]:
            return self.kept["smallest"][key]
        parts = re.findall(r"(?:delay|loss|rate)(?: [0-9]\S*)+", words)
        # A part may become superfluous when another part has gone.
        while fewer := next((rest for rest in combinations(parts, len(parts) - 1) if rest and self.fails(test, " ".join(rest), seed)), None):
            parts = fewer
        delay = re.match(r"delay (\d+)ms", parts[0]) if len(parts) == 1 else None
        if delay and self.fails(test, delay[0], seed):
            low, high = 0, int(delay[1])
            while high - low > 1:
                middle = (low + high) // 2
                low, high = (low, middle) if self.fails(test, f"delay {middle}ms", seed) else (middle, high)
            parts = (f"delay {high}ms",)
        return self.keep("smallest", key, " ".join(parts))

    def figures(self, seeds, loads):
        """Makes all runs that are not kept, and returns what the page shows."""
        seeds = min(seeds, self.suite.seeds)
        real = self.results([self.real(number) for number in range(self.suite.reals)])
        beds = {words: self.results([self.bed(words, seed) for seed in range(seeds)]) for words in LOOPBACKS}
        # Loopbacks take turns, and then seeds.
        turns = [(LOOPBACKS[number % len(LOOPBACKS)], number // len(LOOPBACKS) % seeds) for number in range(loads)]
        with load():
            real_under = self.results([self.real(number, "load: ") for number in range(loads)], self.at_once())
            bed_under = self.results([self.bed(*turn, f"load {number}: ") for number, turn in enumerate(turns)], self.at_once())
        failures = {}
        for words, runs in beds.items():
            for seed, (wrong, _) in enumerate(runs):
                for test in wrong:
                    failures.setdefault((test, words), []).append(seed)
        # A test that fails in some of the runs without load counts in each run under load in which the test fails.
        always = set.intersection(*(set(wrong) for wrong, _ in real))
        limits = {test for test, words in failures if words == IDEAL}
        own = sorted(item for item in failures.items() if item[0][0] not in limits)
        return {
            "tests": sum(map(len, self.tests.values())),
            "networked": len(set(self.results([self.bed(CUT, 0)])[0][0]) - limits),
            "seeds": seeds,
            "failed": [len({test for wrong, _ in real for test in wrong}), *(len({test for test, where in failures if where == words}) for words in LOOPBACKS)],
            "seconds": [sum(taken for _, taken in runs) / len(runs) for runs in [real, *beds.values()]],
            "limits": limits,
            "failures": [(test, words, found, self.smallest(test, words, found[0])) for (test, words), found in own],
            "loads": loads,
            "at once": self.at_once(),
            # Runs in which other tests fail than in each run without load.
            "real under load": sum(set(wrong) != always for wrong, _ in real_under),
            "bed under load": sum(wrong != beds[words][seed][0] for (wrong, _), (words, seed) in zip(bed_under, turns)),
        }


def failed(done, tests):
    """Returns those of the tests that have failed, or have not ended."""
    # The list at the end is whole, also if output of a test has come between the name of a test and the result.
    if re.search(r"^test result: ", done.stdout, re.M):
        return tests & set(re.findall(r"^    (\S+)$", done.stdout.rpartition("\nfailures:\n")[2], re.M)) if done.returncode else set()
    return tests - set(re.findall(r"^test (\S+)(?: - should panic)? \.\.\. ok$", done.stdout, re.M))


@contextlib.contextmanager
def load():
    """Other programs that compute meanwhile."""
    burners = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(BURNERS)]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()
