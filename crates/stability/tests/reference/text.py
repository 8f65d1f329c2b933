"""Writes scenes as text. What a scene does not need is left out, so that each reads like one written by hand."""


def number(value):
    return repr(float(value))


def scene(
    n,
    kt,
    kc=3500.0,
    bt=5.0,
    bc=5.0,
    bh=5.0,
    mh=0.1,
    mo=0.45,
    bo=0.0,
    split=True,
    strategy="average-position",
    scaling=None,
    coupling_scaling=None,
    tick=None,
    update="8ms",
    delay=None,
    compute_delay=0,
    contact=None,
    hand=None,
    loss=None,
    jitter=None,
    own=None,
    peers=(),
    links=(),
):
    """A scene of n peers. `peers` has for each peer (or for none) the lines of its own; `links` has (from, to, lines), peers counted from 0.

    `own` is the line of the table that the strategy alone has."""
    lines = ["[scene]", 'duration = "1s"']
    if not peers:
        lines.append(f"count = {n}")
    lines += ["", "[object]", f"mass = {number(mo)}"]
    if bo:
        lines.append(f"damping = {number(bo)}")
    if not split:
        lines.append("split-mass = false")
    lines += ["", "[coordination]", f'strategy = "{strategy}"', f"stiffness = {number(kt)}", f"damping = {number(bt)}", f'update = "{update}"']
    if scaling:
        lines.append(f'scaling = "{scaling}"')
    if own:
        lines += ["", f"[coordination.{strategy}]", own]
    lines += ["", "[peer]"]
    if tick:
        lines.append(f'tick = "{tick}"')
    if compute_delay:
        lines.append("compute-delay = 1")
    if contact:
        lines.append(f'contact = "{contact}"')
    if hand:
        lines.append(f"hand = {hand}")
    lines.append(f"device = {{ mass = {number(mh)}, damping = {number(bh)} }}")
    extra = f', scaling = "{coupling_scaling}"' if coupling_scaling else ""
    lines.append(f"coupling = {{ stiffness = {number(kc)}, damping = {number(bc)}{extra} }}")
    assert not peers or len(peers) == n
    for place, own in enumerate(peers):
        lines += ["", "[[peers]]", f'name = "{name(place)}"', *[line for line in own.split("; ") if line]]
    if delay or loss or jitter:
        lines += ["", "[link]"]
        lines += [f'delay = "{delay}"'] if delay else []
        lines += [f"loss = {loss}"] if loss else []
        lines += [f"jitter = {jitter}"] if jitter else []
    for begin, end, own in links:
        named = (name(begin), name(end)) if peers else (f"peer{begin + 1}", f"peer{end + 1}")
        lines += ["", "[[links]]", f'from = "{named[0]}"', f'to = "{named[1]}"', *own.split("; ")]
    return "\n".join(lines) + "\n"


def name(place):
    return "abcdefghijklmnop"[place]


def arm(mass, damping, stiffness):
    return f"{{ arm = {{ mass = {number(mass)}, damping = {number(damping)}, stiffness = {number(stiffness)} }} }}"
