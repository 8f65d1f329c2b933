// ---- Rooms: the part of the canvas of each peer. The room of the own hand is the largest.

/** Half width of the shown part of the world [m]. Grows when a copy leaves this part. */
let reach = 0.12;
const LARGEST_REACH = 2;

/** Returns the rooms for a width and a height: the own room beside the others, or above the others if the canvas is upright. */
function layRooms(width, height, number, own) {
  const gap = 8;
  const others = number - 1;
  const upright = height > width;
  const [long, short] = upright ? [height, width] : [width, height];
  const mine = others === 0 ? long : long * (others <= 3 ? 0.62 : others <= 6 ? 0.5 : 0.42);
  // The number of columns makes the other rooms nearly square.
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

/** Returns the own room alone. In a study the other peers are felt, and seen only by their effect on the own copy. */
function aloneIn(width, height, own) {
  const all = [];
  [all[own]] = layRooms(width, height, 1, 0);
  return all;
}

/** Returns the points of the canvas per metre in a room. */
const scaleOf = (room) => Math.min(room.width, room.height) / 2 / reach;
const middleOf = (room) => ({ x: room.left + room.width / 2, y: room.top + room.height / 2 });

/** Shift to the left and down on the canvas per metre along z. The view is from the right and from above. */
const SLANT = [0.35, 0.25];

/** Returns the point of the canvas of a position: x to the right, y up, z towards the viewer, drawn to the left and down. */
function onCanvas(room, place) {
  const [{ x, y }, scale] = [middleOf(room), scaleOf(room)];
  return { x: x + (place[0] - SLANT[0] * place[2]) * scale, y: y - (place[1] - SLANT[1] * place[2]) * scale };
}

/** Returns the displacement in the world for a displacement on the canvas. Scenes have one to three axes. */
function inWorld(room, dx, dy) {
  const scale = scaleOf(room);
  return [dx / scale, facts.axes > 1 ? -dy / scale : 0, 0];
}

/** Fits the shown part of the world to all drawn objects, and changes it rarely. */
function lookAround(passed) {
  const size = facts.edges ? lengthOf(facts.edges) / 2 : 0;
  let most = 0.12;
  for (const { at, device } of facts.alone ? [shown[ownPlace()]] : shown) for (const place of [at, device]) most = Math.max(most, 1.15 * (Math.max(...place.map(Math.abs)) + size));
  // The target is shown before any copy is there.
  if (frame.task) most = Math.max(most, 1.15 * (Math.max(...wide(frame.task.at).map(Math.abs)) + (frame.task.radius || 0)));
  most = Math.min(most, LARGEST_REACH + size);
  const share = still.matches ? 1 : 1 - Math.exp(-passed / (most > reach ? 60 : 1500));
  reach += (most - reach) * share;
}
