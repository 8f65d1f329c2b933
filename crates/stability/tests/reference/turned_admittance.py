"""The admittance of peers who hold a rigid body off its centre, by the equations alone: every peer by itself, all numbers of 40 digits.

A tick of 1 ms, samples every 8 ms, links of whole samples. States a peer: copy (δp, δθ) and device (δx, and δθH if it turns), positions and velocities; then
the samples on their way. Nothing is taken out, scaled or reduced. Prints rows for tests/integration/turned_admittance.rs.
"""

import mpmath
from mpmath import matrix, mp, mpc, mpf

mp.dps = 40
TICK, EVERY = mpf(1) / 1000, 8


def step(mass, damping):
    """(x, v) and f to (x, v) after a tick of m·a = f − b·v, f held."""
    a = matrix([[0, TICK, 0], [0, -damping / mass * TICK, TICK / mass], [0, 0, 0]])
    e = mpmath.expm(a, method="taylor")
    return e[0, 1], e[1, 1], e[0, 2], e[1, 2]


def point(scene, hz, peer, push, seen):
    n, delay = scene["peers"], scene["frames"]
    share = mpf(1) / n
    m, inertia = scene["mass"] * share, [j * share for j in scene["inertia"]]
    kt, bt, kr, br = scene["kt"], scene["bt"], scene["kr"], scene["br"]
    bodies = [(m, scene["bo"])] * 3 + list(zip(inertia, scene["rot"]))
    device = [(mpf("0.1"), mpf(5))] * 3
    kc, bc = [mpf(3500)] * 3, [mpf(5)] * 3
    if scene.get("handle"):
        handle, damping, kcr, bcr = scene["handle"]
        device = device + [(j, damping) for j in handle]
        kc, bc = kc + [kcr] * 3, bc + [bcr] * 3
    d = len(device)
    # A peer: 6 + d positions, as many velocities; then delay + 1 samples of 12.
    size = 2 * (6 + d)
    held = n * size
    total = held + n * 12 * delay

    def grip(r):
        g = matrix(d, 6)
        for a in range(3):
            g[a, a] = 1
        for a, b, s, c in [(0, 4, 1, 2), (0, 5, -1, 1), (1, 3, -1, 2), (1, 5, 1, 0), (2, 3, 1, 1), (2, 4, -1, 0)]:
            g[a, b] = s * r[c]
        for a in range(3, d):
            g[a, a] = 1
        return g

    stiff, rate = [kt] * 3 + list(kr), [bt] * 3 + list(br)
    steps = [step(*body) for body in bodies] + [step(*body) for body in device]
    # One linear map per tick: own state, what is held, and the push.
    z = matrix(total, total + 1)
    for i in range(total):
        z[i, i] = 1
    looked = matrix(1, total + 1)
    omega = 2 * mpmath.pi * hz
    frame = [z[i, :] for i in range(total)]
    newest = [[frame[i * size + a] for a in list(range(6)) + [6 + d + a for a in range(6)]] for i in range(n)]
    # Held in this frame: sampled `delay` frames ago.
    first = held + 12 * n * (delay - 1)
    arrived = newest if delay == 0 else [[frame[first + 12 * i + a] for a in range(12)] for i in range(n)]
    for k in range(EVERY):
        force = mpmath.exp(mpc(0, 1) * omega * k * TICK)
        looked += frame[peer * size + 6 + d + 6 + seen] / force
        after = list(frame)
        for i in range(n):
            own = [frame[i * size + a] for a in range(6)]
            speed = [frame[i * size + 6 + d + a] for a in range(6)]
            x = [frame[i * size + 6 + a] for a in range(d)]
            v = [frame[i * size + 6 + d + 6 + a] for a in range(d)]
            g = grip(scene["grasp"][i])
            c = []
            for a in range(d):
                at = sum((g[a, b] * own[b] for b in range(6) if g[a, b]), 0 * own[0])
                moves = sum((g[a, b] * speed[b] for b in range(6) if g[a, b]), 0 * own[0])
                c.append(kc[a] * (x[a] - at) + bc[a] * (v[a] - moves))
            for b in range(6):
                others = [arrived[j] for j in range(n) if j != i]
                mean = sum((o[b] for o in others), 0 * own[0]) / (n - 1)
                drift = sum((o[6 + b] for o in others), 0 * own[0]) / (n - 1)
                f = sum((g[a, b] * c[a] for a in range(d) if g[a, b]), 0 * own[0])
                f -= stiff[b] * (own[b] - mean) + rate[b] * (speed[b] - drift)
                xv, vv, xf, vf = steps[b]
                after[i * size + b] = own[b] + xv * speed[b] + xf * f
                after[i * size + 6 + d + b] = vv * speed[b] + vf * f
            for a in range(d):
                f = -c[a]
                if i == peer and a == push:
                    f = f.copy()
                    f[0, total] += force
                xv, vv, xf, vf = steps[6 + a]
                after[i * size + 6 + a] = x[a] + xv * v[a] + xf * f
                after[i * size + 6 + d + 6 + a] = vv * v[a] + vf * f
        frame = after
    for age in range(delay):
        for i in range(n):
            for a in range(12):
                before = newest[i][a] if age == 0 else z[held + 12 * n * (age - 1) + 12 * i + a, :]
                frame[held + 12 * n * age + 12 * i + a] = before
    ahead = mpmath.exp(mpc(0, 1) * omega * EVERY * TICK)
    left, right = matrix(total, total), matrix(total, 1)
    for row in range(total):
        for column in range(total):
            left[row, column] = (ahead if row == column else 0) - frame[row][0, column]
        right[row] = frame[row][0, total]
    solution = mpmath.lu_solve(left, right)
    return (sum(looked[0, i] * solution[i] for i in range(total)) + looked[0, total]) / EVERY


def numbers(*texts):
    return [mpf(text) for text in texts]


THREE = {
    "peers": 3, "frames": 1, "mass": mpf("0.45"), "inertia": numbers("1.2e-4", "2e-4", "2.6e-4"), "bo": mpf("1.5"), "rot": numbers("1e-3", "2e-3", "5e-4"),
    "kt": mpf(1000), "bt": mpf(5), "kr": numbers("0.9", "0.7", "0.8"), "br": numbers("3e-3", "1e-3", "2e-3"),
    "grasp": [numbers("0.03", "0.01", "-0.02"), numbers("-0.015", "0.025", "0"), numbers("0.01", "0", "0.02")],
}
SIX = {**THREE, "peers": 2, "frames": 2, "handle": (numbers("2e-5", "2e-5", "1e-5"), mpf("2e-3"), mpf(3), mpf("2e-3"))}

if __name__ == "__main__":
    for name, scene, cases in [
        ("THREE", THREE, [("0.1", 0, 0, 0), ("3", 0, 1, 1), ("3", 0, 1, 2), ("70", 0, 2, 0), ("120", 0, 0, 1), ("400", 1, 0, 1)]),
        ("SIX", SIX, [("0.1", 0, 3, 3), ("3", 0, 4, 0), ("3", 0, 0, 4), ("40", 0, 5, 3), ("300", 1, 5, 5)]),
    ]:
        for hz, peer, push, seen in cases:
            found = point(scene, mpf(hz), peer, push, seen)
            print(f'({name}, {hz}, {peer}, {push}, {seen}, ({mpmath.nstr(found.real, 17)}, {mpmath.nstr(found.imag, 17)})),', flush=True)
