// ---- Copies that turn, in depth: boxes, the devices that hold them, and the springs between.

/** Direction of view: angle about the vertical, and angle above the horizon [°]. 0, 0 is the view from the front: x to the right, z up. */
const eye = { around: -30, above: 25 };
/** Shown part of the world: middle and radius [m], and number of parts of the picture side by side. */
let stage = null;
/** Largest force so far [N]. The colour of a spring is the share of this force. */
let mostForce = 1;

/** Returns the rotation vector in world axes [°]. */
function turnOf(orientation) {
  const [w, ...u] = orientation[0] < 0 ? orientation.map((value) => -value) : orientation;
  const sine = Math.hypot(...u);
  const factor = ((sine > 0 ? (2 * Math.atan2(sine, w)) / sine : 2) * 180) / Math.PI;
  return u.map((value) => value * factor);
}

/** Returns the projection of points of the world to a part of the canvas, with their depth. */
function lens({ left, right, top, bottom }) {
  const [a, e] = [eye.around, eye.above].map((degrees) => (degrees * Math.PI) / 180);
  const across = [Math.cos(a), Math.sin(a), 0];
  const into = [-Math.sin(a) * Math.cos(e), Math.cos(a) * Math.cos(e), -Math.sin(e)];
  const up = [-Math.sin(a) * Math.sin(e), Math.cos(a) * Math.sin(e), Math.cos(e)];
  const [x, y, unit, away] = [(left + right) / 2, (top + bottom) / 2, Math.min(right - left, bottom - top) / 2 / stage.radius, 5 * stage.radius];
  const place = (point) => {
    const from = add3(point, stage.middle, -1);
    const depth = dot3(from, into);
    const scale = (unit * away) / Math.max(away + depth, away / 5);
    return { x: x + dot3(from, across) * scale, y: y - dot3(from, up) * scale, depth };
  };
  return { place, unit, from: add3(stage.middle, into, -away) };
}

/** Draws the known copies, together or each in a part of its own. */
function drawDepth(context, known, width, height, passed) {
  // A plate has no thickness, but two sides.
  const least = 0.03 * Math.max(...shape.edges);
  const half = shape.edges.map((edge) => Math.max(edge, least) / 2);
  for (const body of known) place3(body);
  setStage(known, Math.hypot(...half), passed);
  const parts = $('apart').checked ? known.map((body) => [body]) : [known];
  const columns = Math.min(parts.length, Math.max(1, Math.round(Math.sqrt((parts.length * width) / height))));
  const rows = Math.ceil(parts.length / columns);
  parts.forEach((part, k) => {
    const [left, top] = [((k % columns) * width) / columns, (Math.floor(k / columns) * height) / rows];
    const area = { left, right: left + width / columns, top: top + 4, bottom: top + height / rows - 4 };
    drawPart(context, part, area, half, parts.length === 1 && known.length <= 6);
    if (parts.length > 1) drawName(context, part[0].peer, area.left + 8, area.top + 12);
  });
}

/** Returns the positions of a copy, of its grasp point and of the device in the picture. */
function place3(body) {
  body.matrix = matrixOf(body.turned);
  body.held = body.peer.grasp ? add3(body.at, turned(body.matrix, body.peer.grasp), 1) : null;
}

/** Fits the shown part of the world to all copies, and moves it only if a copy leaves it. */
function setStage(known, reach, passed) {
  const points = [...known.map((body) => body.at), ...trails.flatMap((trail) => trail.at)].filter((at) => at && at.length === 3 && at.every(Number.isFinite));
  const low = [0, 1, 2].map((axis) => Math.min(...points.map((at) => at[axis])));
  const high = [0, 1, 2].map((axis) => Math.max(...points.map((at) => at[axis])));
  const middle = low.map((value, axis) => (value + high[axis]) / 2);
  let radius = Math.hypot(...low.map((value, axis) => high[axis] - value)) / 2 + reach;
  for (const body of known) if (body.device) radius = Math.max(radius, Math.hypot(...add3(body.device, middle, -1)));
  const inside = wanted3 && Math.hypot(...add3(middle, wanted3.middle, -1)) + radius <= wanted3.radius;
  if (!inside || radius < wanted3.radius / 3) wanted3 = { middle, radius: 1.15 * radius };
  if (stage === null) stage = { ...wanted3 };
  const share = still.matches ? 1 : 1 - Math.exp(-passed / 250);
  stage = { middle: add3(stage.middle, add3(wanted3.middle, stage.middle, -1), share), radius: stage.radius + (wanted3.radius - stage.radius) * share };
}
let wanted3 = null;

function drawPart(context, part, area, half, named) {
  const view = lens(area);
  context.save();
  context.beginPath();
  context.rect(area.left, area.top, area.right - area.left, area.bottom - area.top);
  context.clip();
  drawFloor(context, view, area);
  for (const body of part) drawTrail(context, body.index, view.place);
  const faces = part.flatMap((body) => facesOf(body, half, view));
  faces.sort((one, other) => other.depth - one.depth);
  // Many faces on top of each other would be almost opaque.
  for (const face of faces) drawFace(context, face, 2 / (part.length + 1));
  for (const body of part) if (body.device && body.held) drawSpring(context, body, view, named || (part.length > 1 && isOld(body.peer)));
  context.restore();
}

const isOld = (peer) => peer.status === 'stale' || peer.status === 'absent';

/** Draws a grid below the copies; in the first part of the picture with the length of its squares. */
function drawFloor(context, view, area) {
  const { middle, radius } = stage;
  const step = round125(radius / 4);
  const low = middle[2] - radius * 0.5;
  const from = [0, 1].map((axis) => Math.ceil((middle[axis] - 0.9 * radius) / step));
  const to = [0, 1].map((axis) => Math.floor((middle[axis] + 0.9 * radius) / step));
  context.globalAlpha = 1;
  context.lineWidth = 1;
  context.strokeStyle = ink.line;
  context.beginPath();
  for (const axis of [0, 1]) {
    for (let k = from[axis]; k <= to[axis]; k += 1) {
      for (const end of [from, to]) {
        const point = [0, 0, low];
        point[axis] = k * step;
        point[1 - axis] = end[1 - axis] * step;
        const { x, y } = view.place(point);
        if (end === from) context.moveTo(x, y);
        else context.lineTo(x, y);
      }
    }
  }
  context.stroke();
  if (area.left > 0 || area.top > 4) return;
  context.fillStyle = ink.soft;
  context.textBaseline = 'middle';
  context.textAlign = 'right';
  context.fillText('squares of ' + (step >= 0.5 ? step + ' m' : Number((step * 100).toPrecision(3)) + ' cm'), area.right - 10, area.bottom - 10);
  if (area.right - area.left > 200) drawAxes(context, view, [area.left + 34, area.bottom - 30]);
  context.textBaseline = 'alphabetic';
}

/** Draws the directions of x, y and z. */
function drawAxes(context, view, corner) {
  const { middle } = stage;
  const origin = view.place(middle);
  context.strokeStyle = ink.soft;
  context.textAlign = 'center';
  ['x', 'y', 'z'].forEach((name, axis) => {
    const end = view.place(middle.map((value, k) => value + (k === axis ? 20 / view.unit : 0)));
    const [dx, dy] = [end.x - origin.x, end.y - origin.y];
    context.beginPath();
    context.moveTo(...corner);
    context.lineTo(corner[0] + dx, corner[1] + dy);
    context.stroke();
    if (Math.hypot(dx, dy) > 5) context.fillText(name, corner[0] + 1.4 * dx, corner[1] + 1.4 * dy);
  });
}

/** Returns the visible faces of a copy. */
function facesOf(body, half, view) {
  const corner = (unit) => add3(body.at, turned(body.matrix, unit.map((value, k) => value * half[k])), 1);
  return FACES.flatMap(({ axis, side, corners }) => {
    const normal = body.matrix.map((row) => side * row[axis]);
    const middle = add3(body.at, normal, half[axis]);
    if (dot3(normal, add3(view.from, middle, -1)) <= 0) return [];
    const sign = side > 0 && SIGNS[axis] ? SIGNS[axis].map(([a, b]) => view.place(corner(spread3(axis, 1, a, b)))) : null;
    return [{ body, normal, depth: view.place(middle).depth, points: corners.map((unit) => view.place(corner(unit))), sign }];
  });
}

function outline(context, points) {
  context.beginPath();
  points.forEach(({ x, y }) => context.lineTo(x, y));
  context.closePath();
}

/** Draws a face. Copies overlap, so faces are transparent. */
function drawFace(context, { body, normal, points, sign }, weight) {
  const old = isOld(body.peer);
  context.strokeStyle = context.fillStyle = colour(body.index);
  context.lineJoin = 'round';
  context.setLineDash(old ? [4, 3] : []);
  outline(context, points);
  context.globalAlpha = weight * (old ? 0.05 : 0.14 + 0.2 * Math.max(0, dot3(normal, [-0.3, -0.5, 0.81])));
  context.fill();
  context.globalAlpha = old ? 0.6 : 1;
  context.lineWidth = 1.8;
  context.stroke();
  if (sign) {
    outline(context, sign);
    context.globalAlpha = 0.7 * weight;
    context.fill();
  }
  context.setLineDash([]);
}

/** Draws the spring from the grasp point of a copy to the device, redder for a larger force, and the force on the copy as an arrow. */
function drawSpring(context, body, view, named) {
  const [held, device] = [view.place(body.held), view.place(body.device)];
  const force = Math.hypot(...body.peer.force.map(Number));
  if (force > mostForce) mostForce = force;
  const [dx, dy] = [device.x - held.x, device.y - held.y];
  const length = Math.hypot(dx, dy);
  context.globalAlpha = 1;
  context.lineJoin = 'round';
  if (length > 4) {
    const side = [(-dy / length) * 4, (dx / length) * 4];
    context.beginPath();
    context.moveTo(held.x, held.y);
    for (let k = 1; k < 12; k += 1) {
      const swing = k === 1 || k === 11 ? 0 : k % 2 ? 1 : -1;
      context.lineTo(held.x + (dx * k) / 12 + side[0] * swing, held.y + (dy * k) / 12 + side[1] * swing);
    }
    context.lineTo(device.x, device.y);
    for (const [style, alpha] of [[ink.soft, 1], [ink.bad, force / mostForce]]) {
      context.strokeStyle = style;
      context.globalAlpha = alpha;
      context.lineWidth = 1.5;
      context.stroke();
    }
    context.globalAlpha = 1;
  }
  if (force > 0.02 * mostForce) drawArrow(context, body, view, device);
  if (body.deviceTurned) drawHandle(context, body, view, device);
  context.fillStyle = colour(body.index);
  context.strokeStyle = ink.text;
  context.lineWidth = 1.2;
  context.beginPath();
  context.arc(held.x, held.y, 2.5, 0, 7);
  context.fill();
  context.beginPath();
  context.arc(device.x, device.y, 5, 0, 7);
  context.fill();
  context.stroke();
  if (named) drawName(context, body.peer, device.x + 9, device.y - 6);
}

function drawName(context, peer, x, y) {
  context.globalAlpha = 1;
  context.fillStyle = ink.text;
  context.textAlign = 'left';
  context.fillText(peer.name + (isOld(peer) ? ' (' + peer.status + ')' : ''), x, y);
}

/** Draws the force on a copy as an arrow from the device. Its length is proportional to the force. */
function drawArrow(context, body, view, device) {
  const end = view.place(add3(body.device, body.peer.force, 48 / view.unit / mostForce));
  const [dx, dy] = [end.x - device.x, end.y - device.y];
  const length = Math.hypot(dx, dy);
  if (length < 7) return;
  const head = [(5 * dx) / length, (5 * dy) / length];
  context.strokeStyle = ink.bad;
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(device.x, device.y);
  context.lineTo(end.x, end.y);
  for (const side of [-0.6, 0.6]) {
    context.moveTo(end.x, end.y);
    context.lineTo(end.x - head[0] + side * head[1], end.y - head[1] - side * head[0]);
  }
  context.stroke();
}

/** Draws the axes of a device that turns. */
function drawHandle(context, body, view, device) {
  const matrix = matrixOf(body.deviceTurned);
  context.strokeStyle = ink.text;
  context.lineWidth = 1.5;
  context.beginPath();
  for (const axis of [0, 1, 2]) {
    const end = view.place(body.device.map((value, k) => value + (matrix[k][axis] * (18 - 5 * axis)) / view.unit));
    context.moveTo(device.x, device.y);
    context.lineTo(end.x, end.y);
  }
  context.stroke();
}

/** Sets the direction of view by sliders, or by dragging the picture. */
function makeEye() {
  const sliders = ['around', 'above'].map((name) => $(name));
  const tell = (slider) => slider.setAttribute('aria-valuetext', signed(Math.round(eye[slider.id]) + '°'));
  sliders.forEach((slider) => slider.addEventListener('input', () => {
    eye[slider.id] = Number(slider.value);
    tell(slider);
  }));
  const canvas = $('copies');
  let last = null;
  canvas.addEventListener('pointerdown', (event) => {
    if (!shape) return;
    last = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!last) return;
    const by = [event.clientX - last[0], event.clientY - last[1]];
    last = [event.clientX, event.clientY];
    eye.around = ((eye.around - by[0] / 2 + 540) % 360) - 180;
    eye.above = Math.max(-90, Math.min(90, eye.above + by[1] / 2));
    for (const slider of sliders) {
      slider.value = eye[slider.id];
      tell(slider);
    }
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { last = null; });
}
