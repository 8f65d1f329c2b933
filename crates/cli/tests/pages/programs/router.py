# In namespaces of its own: the router, a server on its right that sends back what it gets, and a client on its left that sends 500 datagrams.
import os, subprocess, sys, time

if sys.argv[1] != "inside":
    os.execvp("unshare", ["unshare", "--map-root-user", "--net", "--mount", sys.executable, sys.argv[0], "inside", *sys.argv[1:]])

SOCKET = "import socket, time; s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM); "
SERVER = SOCKET + "s.bind(('10.1.0.2', 9)); print('here', flush=True)\nwhile True: s.sendto(*s.recvfrom(2048))"
CLIENT = SOCKET + "\nfor _ in range(500): s.sendto(bytes(64), ('10.1.0.2', 9)); time.sleep(0.001)"


def inside(side, code):
    return subprocess.Popen(["ip", "netns", "exec", side, sys.executable, "-c", code], stdout=subprocess.PIPE)


for command in ["mount -t tmpfs tmpfs /run", "ip netns add left", "ip netns add right"]:
    subprocess.run(command.split(), check=True)
router = subprocess.Popen([os.environ["COHAPTIC_PAGES_PROGRAM"], "router", *sys.argv[2:]], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
said = router.stderr.readline()
server = inside("right", SERVER)
server.stdout.readline()
inside("left", CLIENT).wait()
report, warnings = router.communicate()
server.kill()
print(said + warnings + report, end="")
sys.exit(router.returncode)
