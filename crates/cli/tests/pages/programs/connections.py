# A server that sends back what it gets, the relay of TCP before it, and twenty clients that each ask ten times; then Ctrl-C.
import os, re, signal, socket, subprocess, sys, threading, time

server = socket.create_server(("127.0.0.1", 0))


def answer(connection):
    try:
        while asked := connection.recv(4096):
            connection.sendall(asked)
    except OSError:
        pass
    connection.close()


def serve():
    while True:
        threading.Thread(target=answer, args=(server.accept()[0],), daemon=True).start()


threading.Thread(target=serve, daemon=True).start()
words = sys.argv[1:]
words[words.index("--listen") + 1] = "127.0.0.1:0"
words[words.index("--to") + 1] = f"127.0.0.1:{server.getsockname()[1]}"
relay = subprocess.Popen([os.environ["COHAPTIC_PAGES_PROGRAM"], "relay", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
said = relay.stderr.readline()
port = int(re.search(r":(\d+) for", said)[1])


def ask():
    try:
        with socket.create_connection(("127.0.0.1", port)) as client:
            for _ in range(10):
                client.sendall(bytes(1000))
                left = 1000
                while left > 0:
                    left -= len(client.recv(left)) or left
    except OSError:
        pass


clients = [threading.Thread(target=ask) for _ in range(20)]
for client in clients:
    client.start()
for client in clients:
    client.join()
# The ends of the last connections are on their way.
time.sleep(0.3)
relay.send_signal(signal.SIGINT)
report, warnings = relay.communicate()
print(said + "^C\n" + warnings + report, end="")
sys.exit(relay.returncode != 130)
