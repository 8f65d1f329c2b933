# An evening on a line, as irtt, ping and iperf3 write it: line.json, line.txt and rate.json. The line is made here, so what fit should find is known.
import json
import math

MASK = 2**64 - 1


# Sebastiano Vigna's splitmix64, so that the numbers are the same everywhere.
class Random:
    def __init__(self, seed):
        self.state = seed

    def unit(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) & MASK
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        return ((z ^ (z >> 31)) >> 11) * 2.0**-53


class Way:
    """A gamma law of shape 2 above a floor, and losses in bursts of 3 packets."""

    def __init__(self, seed, floor_ms, scale_ms, loss):
        self.random, self.floor, self.scale, self.begins, self.lost = Random(seed), floor_ms, scale_ms, loss / 3, False

    def delay_ns(self):
        self.lost = self.random.unit() < (2 / 3 if self.lost else self.begins)
        delay = self.floor - self.scale * math.log((1 - self.random.unit()) * (1 - self.random.unit()))
        return None if self.lost else round(delay * 1e6)


AHEAD = 3_200_000_000
up, down = Way(1, 14, 2, 0.01), Way(2, 9, 1, 0.005)
trips = []
for number in range(6000):
    sent = 1_760_000_000_000_000_000 + 10_000_000 * number
    there, back = up.delay_ns(), down.delay_ns()
    lost = "true_up" if there is None else "true_down" if back is None else "false"
    delay = {} if lost != "false" else {"send": there + AHEAD, "receive": back - AHEAD, "rtt": there + back}
    trips.append({"seqno": number, "lost": lost, "timestamps": {"client": {"send": {"wall": sent, "monotonic": sent % 10**15}}}, "delay": delay, "ipdv": {}})
with open("line.json", "w") as file:
    json.dump({"version": {"irtt": "0.9.1", "protocol": 1, "json_format": 1}, "round_trips": trips}, file)

up, down = Way(3, 14, 2, 0.01), Way(4, 9, 1, 0.005)
with open("line.txt", "w") as file:
    print("PING home.example (192.0.2.1) 56(84) bytes of data.", file=file)
    for number in range(1, 6001):
        there, back = up.delay_ns(), down.delay_ns()
        if there is None or back is None:
            continue
        rtt = (there + back) / 1e6
        shown = f"{rtt:.2f}" if rtt < 9.995 else f"{rtt:.1f}" if rtt < 99.95 else f"{rtt:.0f}"
        at = 1_760_000_000 + number * 0.01 + rtt / 1e3
        print(f"[{at:.6f}] 64 bytes from 192.0.2.1: icmp_seq={number} ttl=57 time={shown} ms", file=file)

random = Random(5)
intervals = []
for second in range(60):
    rate = 40e6 + 4e6 * random.unit()
    intervals.append({"streams": [], "sum": {"start": second, "end": second + 1, "bits_per_second": rate, "omitted": False, "sender": True}})
with open("rate.json", "w") as file:
    json.dump({"start": {"test_start": {"protocol": "TCP"}}, "intervals": intervals, "end": {}}, file)
