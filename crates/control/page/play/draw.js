// ---- Drawing: rooms, cubes, devices, and the springs between.

/** Edge of a cube that does not turn [m]. */
const EDGE = 0.05;
/** Force at which a spring has its full colour [N]. */
const STRONG = 6;

/** Sets the resolution of a canvas to its size on the screen. Returns the context and the size. */
function sized(canvas) {
  const ratio = Math.min(devicePixelRatio || 1, 2);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

let rooms = [];
const ownPlace = () => (ownHand !== null && ownHand < shown.length ? ownHand : 0);

function drawAll(passed, now) {
  const canvas = $('rooms');
  if (document.hidden || frame === null || canvas.clientWidth === 0) return;
  follow(passed);
  // After a lost connection to a study, a picture may come before the number of the own peer.
  if (!shown[ownPlace()]) return;
  lookAround(passed);
  const { context, width, height } = sized(canvas);
  rooms = facts.alone ? aloneIn(width, height, ownPlace()) : layRooms(width, height, shown.length, ownPlace());
  rooms.forEach((room, i) => drawRoom(context, room, i));
  drawPackets(context, rooms, now);
}

function drawRoom(context, room, i) {
  const own = i === ownPlace();
  context.save();
  context.beginPath();
  context.roundRect(room.left + 0.5, room.top + 0.5, room.width - 1, room.height - 1, 8);
  context.strokeStyle = own ? ink.accent : ink.faint;
  context.lineWidth = own ? 2 : 1;
  context.stroke();
  context.clip();
  if (facts.walls) drawWalls(context, room);
  drawTarget(context, room);
  if (!facts.alone) shown.forEach((other, k) => { if (k !== i) drawGhost(context, room, other, k); });
  const body = shown[i];
  drawCube(context, room, body, i);
  drawDwell(context, room);
  drawPull(context, room, body, i);
  if (own && hand.holding) drawHand(context, room);
  context.fillStyle = ink.text;
  context.font = '13px system-ui, sans-serif';
  context.textAlign = 'left';
  context.textBaseline = 'top';
  const name = facts.peers[i] ? facts.peers[i].name : '';
  context.fillText(name + (own && ownHand !== null ? ' (your hand)' : ''), room.left + 9, room.top + 8);
  context.fillStyle = ink.soft;
  if (room.height > 60) context.fillText(newtons(lengthOf(body.force), 1), room.left + 9, room.top + 25);
  context.restore();
}

/** Draws the copy of another peer as an outline. */
function drawGhost(context, room, body, k) {
  context.strokeStyle = colour(k);
  context.lineWidth = 1;
  context.setLineDash([3, 3]);
  if (facts.edges) outlineBox(context, room, body);
  else squareAt(context, onCanvas(room, body.at), (EDGE * scaleOf(room)) / 2);
  context.stroke();
  context.setLineDash([]);
}

/** Draws the walls along x and y, if the scene has walls. */
function drawWalls(context, room) {
  const far = (value, other) => (Number.isFinite(value) ? value : other);
  const [min, max] = [facts.walls[0].map((value) => far(value, -LARGEST_REACH)), facts.walls[1].map((value) => far(value, LARGEST_REACH))];
  const [from, to] = [onCanvas(room, [min[0], max[1], 0]), onCanvas(room, [max[0], min[1], 0])];
  context.strokeStyle = ink.faint;
  context.lineWidth = 1;
  context.setLineDash([1, 5]);
  context.strokeRect(from.x, from.y, to.x - from.x, to.y - from.y);
  context.setLineDash([]);
}

function squareAt(context, { x, y }, half) {
  context.beginPath();
  context.roundRect(x - half, y - half, 2 * half, 2 * half, half / 5);
}

function drawCube(context, room, body, i) {
  if (facts.edges) {
    drawBox(context, room, body, i);
    return;
  }
  squareAt(context, onCanvas(room, body.at), (EDGE * scaleOf(room)) / 2);
  context.fillStyle = context.strokeStyle = colour(i);
  context.globalAlpha = 0.75;
  context.fill();
  context.globalAlpha = 1;
  context.lineWidth = 2;
  context.stroke();
}

/** Returns the visible faces of a box: the corners and the brightness of each. */
function facesSeen(room, body) {
  const matrix = matrixOf(body.turned);
  const half = facts.edges.map((edge) => Math.max(edge, 0.03 * Math.max(...facts.edges)) / 2);
  // All points along this direction are at one point of the canvas: see onCanvas.
  const view = [...SLANT, 1];
  return FACES.flatMap(({ axis, side, corners }) => {
    const normal = matrix.map((row) => side * row[axis]);
    if (dot3(normal, view) <= 0) return [];
    const points = corners.map((unit) => onCanvas(room, add3(body.at, turned(matrix, unit.map((value, k) => value * half[k])), 1)));
    return [{ points, light: Math.max(0, dot3(normal, [-0.3, 0.6, 0.7])) }];
  });
}

function drawBox(context, room, body, i) {
  context.fillStyle = context.strokeStyle = colour(i);
  for (const { points, light } of facesSeen(room, body)) {
    context.beginPath();
    points.forEach(({ x, y }) => context.lineTo(x, y));
    context.closePath();
    context.globalAlpha = 0.35 + 0.45 * light;
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 1.5;
    context.stroke();
  }
}

function outlineBox(context, room, body) {
  context.beginPath();
  for (const { points } of facesSeen(room, body)) {
    points.forEach(({ x, y }, k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.closePath();
  }
}

/** Returns the point at which a peer holds the object. An object that turns has a grasp point per peer. */
function graspOf(body, i) {
  const grasp = facts.peers[i] && facts.peers[i].grasp;
  return grasp ? add3(body.at, turned(matrixOf(body.turned), grasp), 1) : body.at;
}

/** Draws the device, and the spring from the device to the copy, redder for a larger force. */
function drawPull(context, room, body, i) {
  const [from, to] = [onCanvas(room, graspOf(body, i)), onCanvas(room, body.device)];
  // 5 N stretch a stiff spring by millimetres only. The spring is drawn longer than it is, but within the room.
  const stretch = Math.min(6, (0.45 * Math.min(room.width, room.height)) / (Math.hypot(to.x - from.x, to.y - from.y) || 1));
  const end = { x: from.x + (to.x - from.x) * stretch, y: from.y + (to.y - from.y) * stretch };
  const [dx, dy] = [end.x - from.x, end.y - from.y];
  const length = Math.hypot(dx, dy);
  const share = Math.min(1, lengthOf(body.force) / STRONG);
  if (length > 3) {
    const wide = Math.min(6, length / 8);
    const side = { x: (-dy / length) * wide, y: (dx / length) * wide };
    context.beginPath();
    context.moveTo(from.x, from.y);
    for (let k = 1; k < 14; k += 1) {
      const swing = k === 1 || k === 13 ? 0 : k % 2 ? 1 : -1;
      context.lineTo(from.x + (dx * k) / 14 + side.x * swing, from.y + (dy * k) / 14 + side.y * swing);
    }
    context.lineTo(end.x, end.y);
    for (const [style, alpha] of [[ink.text, 1], [ink.bad, share]]) {
      context.strokeStyle = style;
      context.globalAlpha = alpha;
      context.lineWidth = 2 + 1.5 * share;
      context.stroke();
    }
    context.globalAlpha = 1;
  }
  context.beginPath();
  context.arc(end.x, end.y, 8, 0, 7);
  context.fillStyle = ink.ground;
  context.fill();
  context.strokeStyle = body.hand === 'present' || body.hand === 'here' ? ink.text : ink.soft;
  context.lineWidth = body.hand === 'present' ? 3 : 1.5;
  context.stroke();
}

/** Draws the position at which the own hand wants the device. */
function drawHand(context, room) {
  const { x, y } = onCanvas(room, hand.at);
  context.strokeStyle = ink.accent;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(x, y, 14, 0, 7);
  context.moveTo(x - 19, y);
  context.lineTo(x + 19, y);
  context.moveTo(x, y - 19);
  context.lineTo(x, y + 19);
  context.stroke();
}
