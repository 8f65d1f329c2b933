// ---- Where each peer is on the canvas: a room each, that of the own hand the largest.

/** Half of what a room shows [m]; grows when something goes beyond. */
let reach = 0.12;
const LARGEST_REACH = 2;

/** The rooms in a width and a height: the own one beside the others, or above them where the canvas is upright. */
function layRooms(width, height, number, own) {
  const gap = 8;
  const others = number - 1;
  const upright = height > width;
  const [long, short] = upright ? [height, width] : [width, height];
  const mine = others === 0 ? long : long * (others <= 3 ? 0.62 : others <= 6 ? 0.5 : 0.42);
  // As many columns as make the others nearly square.
  const rest = long - mine - gap;
  let across = 1;
  while (across < others && (rest / across) * Math.ceil(others / across) > short) across += 1;
  const along = Math.max(1, Math.ceil(others / across));
  const room = (at, from, size, wideness) => (upright ? { left: from, top: at, width: wideness, height: size } : { left: at, top: from, width: size, height: wideness });
  let k = 0;
  return Array.from({ length: number }, (_, i) => {
    if (i === own) return room(0, 0, mine, short);
    const [column, row] = [k % across, Math.floor(k / across)];
    k += 1;
    const [size, wideness] = [(rest - gap * (across - 1)) / across, (short - gap * (along - 1)) / along];
    return room(mine + gap + column * (size + gap), row * (wideness + gap), size, wideness);
  });
}

/** The own room alone: in a study others are felt, and seen only as far as the network shows them in the own copy. */
function aloneIn(width, height, own) {
  const all = [];
  [all[own]] = layRooms(width, height, 1, 0);
  return all;
}

/** Points of a room per metre. */
const scaleOf = (room) => Math.min(room.width, room.height) / 2 / reach;
const middleOf = (room) => ({ x: room.left + room.width / 2, y: room.top + room.height / 2 });

/** How far one goes to the left and down on the canvas along z: one looks from the right and from above. */
const SLANT = [0.35, 0.25];

/** Where a place of the world is on the canvas: x to the right, y up, z towards the viewer, aslant to the left and down. */
function onCanvas(room, place) {
  const [{ x, y }, scale] = [middleOf(room), scaleOf(room)];
  return { x: x + (place[0] - SLANT[0] * place[2]) * scale, y: y - (place[1] - SLANT[1] * place[2]) * scale };
}

/** A way on the canvas as a way in the world; scenes have one axis or more. */
function inWorld(room, dx, dy) {
  const scale = scaleOf(room);
  return [dx / scale, facts.axes > 1 ? -dy / scale : 0, 0];
}

/** Wide enough for all that is shown, and steady. */
function lookAround(passed) {
  const size = facts.edges ? lengthOf(facts.edges) / 2 : 0;
  let most = 0.12;
  for (const { at, device } of facts.alone ? [shown[ownPlace()]] : shown) for (const place of [at, device]) most = Math.max(most, 1.15 * (Math.max(...place.map(Math.abs)) + size));
  // The target is seen before anybody is there.
  if (frame.task) most = Math.max(most, 1.15 * (Math.max(...wide(frame.task.at).map(Math.abs)) + (frame.task.radius || 0)));
  most = Math.min(most, LARGEST_REACH + size);
  const share = still.matches ? 1 : 1 - Math.exp(-passed / (most > reach ? 60 : 1500));
  reach += (most - reach) * share;
}
