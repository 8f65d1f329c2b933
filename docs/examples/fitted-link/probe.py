"""Measures round trips through a port, one probe every 25 ms, and prints them as the data set LENS does: when the answer came [s], and the round trip [ms].

    python3 probe.py PORT SECONDS > line.csv

An echo server for the other end: python3 probe.py --echo PORT
"""
import select
import socket
import struct
import sys
import time

GAP_S = 0.025
# A probe without an answer counts as lost after this time.
PATIENCE_S = 2.0


def echo(port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", port))
        while True:
            data, client = server.recvfrom(64)
            server.sendto(data, client)


def shown(rtt_s):
    """Writes milliseconds with the digits of ping."""
    millis = rtt_s * 1e3
    digits = 3 if millis < 0.9995 else 2 if millis < 9.995 else 1 if millis < 99.95 else 0
    return f"{millis:.{digits}f}"


def probe(port, seconds):
    count = round(seconds / GAP_S)
    answers = [None] * count
    sent = [0.0] * count
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.connect(("127.0.0.1", port))
        begin = time.monotonic()
        number = 0
        while time.monotonic() < begin + count * GAP_S + PATIENCE_S:
            now = time.monotonic()
            if number < count and now >= begin + number * GAP_S:
                sent[number] = time.monotonic()
                client.send(struct.pack("!I", number))
                number += 1
                continue
            wait = begin + number * GAP_S - now if number < count else 0.1
            if select.select([client], [], [], max(wait, 0.0))[0]:
                (answered,) = struct.unpack("!I", client.recv(64))
                if answers[answered] is None:
                    answers[answered] = time.monotonic()
    print("timestamp,rtt")
    for at, answered in zip(sent, answers):
        rtt = -1 if answered is None else answered - at
        print(f"{(at if answered is None else answered) - begin:.4f},{-1 if answered is None else shown(rtt)}")


if sys.argv[1] == "--echo":
    echo(int(sys.argv[2]))
else:
    probe(int(sys.argv[1]), float(sys.argv[2]))
