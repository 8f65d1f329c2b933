# A server that sends back what it gets, the relay before it, and a client that sends a thousand datagrams; then Ctrl-C.
import os, re, signal, socket, subprocess, sys, threading, time

server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
server.bind(("127.0.0.1", 0))


def answer():
    while True:
        server.sendto(*server.recvfrom(2048))


threading.Thread(target=answer, daemon=True).start()
words = sys.argv[1:]
words[words.index("--listen") + 1] = "127.0.0.1:0"
words[words.index("--to") + 1] = f"127.0.0.1:{server.getsockname()[1]}"
relay = subprocess.Popen([os.environ["COHAPTIC_PAGES_PROGRAM"], "relay", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
said = relay.stderr.readline()
port = int(re.search(r":(\d+) for", said)[1])
client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
for _ in range(1000):
    client.sendto(bytes(64), ("127.0.0.1", port))
    time.sleep(0.0003)
time.sleep(0.5)
relay.send_signal(signal.SIGINT)
report, warnings = relay.communicate()
print(said + "^C\n" + warnings + report, end="")
sys.exit(relay.returncode != 130)
