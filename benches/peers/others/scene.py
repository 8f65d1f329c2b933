"""The scene that `others-table` writes for programs in other languages, and the line of JSON that they answer with."""

import json
import sys
from array import array

SKIPPED = 77


def skip(why):
    """Ends with the status that says: not installed here."""
    print(why, file=sys.stderr)
    sys.exit(SKIPPED)


class Scene:
    """Lines of a key and numbers; the delays of all packets, if they differ, in a file of 64-bit words beside it: frame by frame, from by to, −1 is lost."""

    def __init__(self, path):
        self.delays = None
        with open(path, encoding="utf-8") as lines:
            for line in lines:
                key, *values = line.split()
                if key == "delays":
                    self.delays = array("q")
                    with open(values[0], "rb") as words:
                        self.delays.frombytes(words.read())
                    if sys.byteorder == "big":
                        self.delays.byteswap()
                else:
                    numbers = [float(value) if "." in value or "e" in value else int(value) for value in values]
                    setattr(self, key, numbers[0] if len(numbers) == 1 else numbers)


def answer(**fields):
    """One line of JSON: floats come back as the same bits."""
    print(json.dumps(fields))
