# A session with a key at a free port, and `join` with the words of the command line: SCENE WORD... Words of --set are for both. Prints what `join` prints.
import os, subprocess, sys

PROGRAM = os.environ["COHAPTIC_PAGES_PROGRAM"]
scene, *words = sys.argv[1:]
sets = [word for place, word in enumerate(words) if "--set" in (word, words[place - 1])]
subprocess.run([PROGRAM, "live", "--new-key", "session.key"], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
key = ["--key-file", "session.key", "--no-priority"]
live = [PROGRAM, "live", scene, *sets, "--listen", "127.0.0.1:0", *key]
session = subprocess.Popen(live, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
# The session may say before that it homes simulated devices.
address = next(line for line in session.stderr if line.startswith("listening on ")).split()[2]
joined = subprocess.run([PROGRAM, "join", address, scene, *words, *key])
session.terminate()
session.communicate()
sys.exit(joined.returncode)
