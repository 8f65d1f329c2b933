// ---- The copies of the object, and the peers that hold them.

/** Drawn positions. They follow the measured positions, so that ten states a second look like continuous motion. */
let bodies = [];
let view = null;
let trails = [];
/** Edges of the object, if it turns. */
let shape = null;

/** Length of a trail [ms], and time constant with which the picture follows [ms]. */
const TRAIL = 2500;
const FOLLOW = 60;
/** With reduced motion, measured positions are drawn ten times a second, without trails. */
const still = matchMedia('(prefers-reduced-motion: reduce)');
const share = (passed) => (still.matches ? 1 : 1 - Math.exp(-passed / FOLLOW));

function takePeers(peers, body) {
  shape = body || null;
  $('people').hidden = peers.length === 0;
  const moving = peers.some((peer) => peer.position.length > 0);
  $('stage').hidden = !moving;
  $('eye').hidden = shape === null;
  $('apart').parentElement.hidden = peers.length < 2;
  $('turned').hidden = shape === null;
  if (bodies.length !== peers.length) {
    bodies = [];
    trails = [];
    view = null;
  }
  bodies = peers.map((peer, index) => ({
    at: [...peer.position],
    turned: isAll(peer.orientation, 4) ? peer.orientation : [1, 0, 0, 0],
    ...(bodies[index] && bodies[index].at.length === peer.position.length ? bodies[index] : {}),
    peer,
    index,
  }));
  showPeers(peers);
  showJoined(peers);
}

/** Returns whether `values` is a list of `many` finite numbers. */
const isAll = (values, many) => Array.isArray(values) && values.length === many && values.every(Number.isFinite);

/** Moves the drawn positions a part of the way to the measured positions. */
function follow(body, passed) {
  const { peer } = body;
  const part = share(passed);
  const between = (from, to) => from.map((value, axis) => value + (to[axis] - value) * part);
  body.at = between(body.at, peer.position);
  if (!body.at.every(Number.isFinite)) body.at = [...peer.position];
  if (!shape) return;
  if (isAll(peer.orientation, 4)) body.turned = towards(body.turned, peer.orientation, part);
  const device = peer.device || {};
  body.device = isAll(device.position, 3) ? between(body.device || device.position, device.position) : null;
  body.deviceTurned = isAll(device.orientation, 4) ? towards(body.deviceTurned || device.orientation, device.orientation, part) : null;
}

const PRESENCE = { here: 'here', present: 'present', stale: 'stale', absent: 'absent' };

function showPeers(peers) {
  const body = $('peers');
  while (body.rows.length > peers.length) body.deleteRow(-1);
  peers.forEach((peer, i) => {
    let tr = body.rows[i];
    if (!tr) {
      tr = body.insertRow();
      const name = make('th', 'name');
      name.scope = 'row';
      name.append(make('span', 'swatch'), make('span'));
      const status = make('td');
      status.append(make('span', 'pill'));
      tr.append(name, status, make('td', 'n'), make('td', 'n'), make('td', 'n'));
    }
    const [name, status, position, turn, force] = tr.cells;
    name.firstChild.style.background = colour(i);
    put(name.lastChild, peer.name);
    name.title = peer.kind;
    const pill = status.firstChild;
    const age = peer.age_s === null ? '' : ' · heard ' + span(peer.age_s, 2) + ' ago';
    put(pill, PRESENCE[peer.status] + (peer.status === 'stale' ? age : ''));
    pill.title = peer.kind + age;
    pill.className = 'pill ' + peer.status;
    tr.classList.toggle('old', peer.status === 'stale' || peer.status === 'absent');
    put(position, peer.position.length ? place(peer.position) : '–');
    turn.hidden = shape === null;
    put(turn, isAll(peer.orientation, 4) ? turnOf(peer.orientation).map((angle) => signed(angle.toFixed(1))).join(', ') + '°' : '–');
    put(force, peer.force.length ? peer.force.map((f) => (f === null ? '–' : signed(f.toFixed(2)))).join(', ') + ' N' : '–');
  });
}

/** Shows for each program that has joined: its device, its address, the time since its last sample, and the number of lost samples. */
function showJoined(peers) {
  const lines = peers
    .filter((peer) => peer.joined)
    .map((peer) => {
      const { device, address, lost, sent } = peer.joined;
      const age = peer.age_s === null ? 'no sample yet' : 'last sample ' + span(peer.age_s, 2) + ' ago';
      return `${peer.name}: ${device} at ${address}, ${PRESENCE[peer.status]}, ${age}, ${lost} of ${sent} lost`;
    });
  const list = $('joined');
  list.hidden = lines.length === 0;
  while (list.children.length > lines.length) list.lastChild.remove();
  lines.forEach((line, i) => put(list.children[i] || list.appendChild(make('li')), line));
}

/** Draws the copies. Called for each frame of the screen while there are copies. */
function drawCopies(passed) {
  const canvas = $('copies');
  if ($('stage').hidden || $('people').hidden) return;
  canvas.classList.toggle('depth', shape !== null);
  canvas.classList.toggle('plane', bodies.some((body) => body.peer.position.length > 1));
  const { context, width, height } = prepare(canvas);
  const known = bodies.filter((body) => body.peer.position.length > 0 && body.peer.position.every(Number.isFinite));
  if (known.length === 0 || width === 0) return;
  const flat = known.every((body) => body.peer.position.length === 1);
  for (const body of known) follow(body, passed);
  const now = performance.now();
  trails.push({ now, at: bodies.map((body) => body.at) });
  while (trails.length > 0 && trails[0].now < now - (still.matches ? 0 : TRAIL)) trails.shift();
  if (shape) {
    drawDepth(context, known, width, height, passed);
    return;
  }
  const area = { left: 16, right: width - 16, top: 14, bottom: height - 26 };
  look(known, flat, area);
  const x = (m) => (area.left + area.right) / 2 + (m - view.x) * view.scale;
  const lane = (area.bottom - area.top) / bodies.length;
  const y = (at, i) => (flat ? area.top + lane * (i + 0.5) : (area.top + area.bottom) / 2 - (at[1] - view.y) * view.scale);
  axes(context, area, x, flat, height);
  const size = Math.max(9, Math.min(30, (flat ? lane : height) * (flat ? 0.6 : 0.09)));
  bodies.forEach((body, i) => {
    if (known.includes(body)) drawTrail(context, i, (at) => ({ x: x(at[0]), y: y(at, i) }));
  });
  bodies.forEach((body, i) => {
    if (known.includes(body)) cube(context, x(body.at[0]), y(body.at, i), size, colour(i), body.peer, flat && lane >= 13);
  });
}

/** Draws the trail of a copy, fainter for older positions; in few strokes, because there are many copies. */
function drawTrail(context, i, where) {
  const STROKES = 12;
  const now = performance.now();
  const alike = (at) => at && at.length === bodies[i].at.length && at.every(Number.isFinite);
  context.strokeStyle = colour(i);
  context.lineWidth = 2;
  let stroke = -1;
  for (let k = 1; k < trails.length; k += 1) {
    const [from, to] = [trails[k - 1].at[i], trails[k].at[i]];
    if (!alike(from) || !alike(to)) continue;
    const next = Math.floor(STROKES * Math.max(0, 1 - (now - trails[k].now) / TRAIL));
    const [begin, end] = [where(from), where(to)];
    if (next !== stroke) {
      if (stroke >= 0) context.stroke();
      context.globalAlpha = (0.5 * (next + 0.5)) / STROKES;
      context.beginPath();
      stroke = next;
    }
    context.moveTo(begin.x, begin.y);
    context.lineTo(end.x, end.y);
  }
  if (stroke >= 0) context.stroke();
}

/** Fits the shown part of the world to all trails, and changes it rarely. */
function look(known, flat, area) {
  const low = [Infinity, Infinity];
  const high = [-Infinity, -Infinity];
  for (const at of [...trails.flatMap((trail) => trail.at), ...known.map((body) => body.peer.position)]) {
    at.slice(0, 2).forEach((value, axis) => {
      if (!Number.isFinite(value)) return;
      low[axis] = Math.min(low[axis], value);
      high[axis] = Math.max(high[axis], value);
    });
  }
  const inside = view && [0, 1].every((axis) => !Number.isFinite(low[axis]) || (low[axis] >= view.low[axis] && high[axis] <= view.high[axis]));
  const wide = view && !flat ? Math.max(high[0] - low[0], high[1] - low[1]) : high[0] - low[0];
  if (inside && wide > view.wide / 6 - 1e-12) {
    fit(flat, area);
    return;
  }
  const spread = Math.max(wide, high[0] - low[0], flat ? 0 : high[1] - low[1], 0.01);
  const middle = low.map((value, axis) => (Number.isFinite(value) ? (value + high[axis]) / 2 : 0));
  view = { x: middle[0], y: middle[1], low: middle.map((m) => m - spread), high: middle.map((m) => m + spread), wide: 2 * spread, scale: 1 };
  fit(flat, area);
}

function fit(flat, area) {
  const across = (area.right - area.left) / view.wide;
  view.scale = flat ? across : Math.min(across, (area.bottom - area.top) / view.wide);
}

function axes(context, area, x, flat, height) {
  const metresOfPoint = 1 / view.scale;
  const step = round125(90 * metresOfPoint);
  context.globalAlpha = 1;
  context.strokeStyle = ink.line;
  context.fillStyle = ink.soft;
  context.textAlign = 'center';
  context.lineWidth = 1;
  const from = view.x - ((area.right - area.left) / 2) * metresOfPoint;
  for (let k = Math.ceil(from / step); x(k * step) <= area.right; k += 1) {
    const at = Math.round(x(k * step)) + 0.5;
    context.beginPath();
    context.moveTo(at, area.top - 8);
    context.lineTo(at, area.bottom + 6);
    context.stroke();
    const value = Number((k * step).toPrecision(6));
    context.fillText(signed(step >= 0.5 ? value + ' m' : Number((value * 1e3).toPrecision(6)) + ' mm'), at, height - 6);
  }
  if (flat) return;
  const middle = (area.top + area.bottom) / 2;
  context.textAlign = 'left';
  const half = ((area.bottom - area.top) / 2) * metresOfPoint;
  for (let k = Math.ceil((view.y - half) / step); k * step <= view.y + half; k += 1) {
    const at = Math.round(middle - (k * step - view.y) * view.scale) + 0.5;
    context.beginPath();
    context.moveTo(area.left, at);
    context.lineTo(area.right, at);
    context.stroke();
  }
}

/** Draws a copy; a stale copy is an outline. In a plane copies overlap, so only stale copies have a name there. The table has the colours. */
function cube(context, x, y, size, style, peer, named) {
  const old = peer.status === 'stale' || peer.status === 'absent';
  context.globalAlpha = 1;
  context.beginPath();
  context.roundRect(x - size / 2, y - size / 2, size, size, size / 5);
  context.lineWidth = 2;
  context.strokeStyle = style;
  context.setLineDash(old ? [4, 3] : []);
  context.globalAlpha = old ? 0.15 : 0.85;
  context.fillStyle = style;
  context.fill();
  context.globalAlpha = 1;
  context.stroke();
  context.setLineDash([]);
  context.fillStyle = ink.text;
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  if (named || old) context.fillText(peer.name + (old ? ' (' + peer.status + ')' : ''), x + size / 2 + 6, named ? y - 9 : y);
  context.textBaseline = 'alphabetic';
}
