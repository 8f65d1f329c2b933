// ---- Motion: the pictures of the server, and the interpolation between two of them.

/** Time constant with which the drawing follows the pictures [ms], so that 50 pictures a second look like 60. */
const FOLLOWS = 18;
/** With reduced motion, measured positions are drawn without interpolation, and no dots fly. */
const still = matchMedia('(prefers-reduced-motion: reduce)');

let facts = { part: 0, peers: [], axes: 1, edges: null, host: false };
let frame = null;
/** Drawn state of each peer: copy, device, force, turn. In a study the server tells the own peer alone, and all other peers are null. */
let shown = [];

/** Returns three numbers, with zeros for axes that the scene does not have. */
const wide = (values) => [0, 1, 2].map((axis) => (values && Number.isFinite(values[axis]) ? values[axis] : 0));

function takeFrame(next) {
  const another = frame === null || next.part !== frame.part;
  frame = next;
  if (shown.length !== next.peers.length) shown = next.peers.map((peer) => peer && { at: wide(peer.at), device: wide(peer.device || peer.at), force: wide(peer.force), turned: [1, 0, 0, 0] });
  takePackets(next.packets);
  return another;
}

/** Moves the drawn positions towards the measured positions. */
function follow(passed) {
  if (frame === null) return;
  const share = still.matches ? 1 : 1 - Math.exp(-passed / FOLLOWS);
  const between = (from, to) => from.map((value, axis) => value + (to[axis] - value) * share);
  frame.peers.forEach((peer, i) => {
    const body = shown[i];
    if (!peer) return;
    body.at = between(body.at, wide(peer.at));
    body.device = between(body.device, wide(peer.device || peer.at));
    body.force = between(body.force, wide(peer.force));
    if (peer.turned && peer.turned.every(Number.isFinite)) body.turned = towards(body.turned, peer.turned, share);
    body.hand = peer.hand;
  });
}

const lengthOf = (v) => Math.hypot(...v);
/** Returns the largest distance of a copy from the origin [m]. */
const farthestOut = () => Math.max(0, ...shown.map((body) => lengthOf(body.at)));

/** Returns the largest distance between two copies [m]; null if a copy has no finite position. Measured positions count, because drawn positions follow
 * and show less of a fast swing. */
function farthest() {
  const places = frame.peers.map((peer) => peer.at);
  if (!places.flat().every(Number.isFinite)) return null;
  let most = 0;
  places.forEach((one, i) => places.slice(i + 1).forEach((other) => { most = Math.max(most, lengthOf(one.map((value, axis) => value - other[axis]))); }));
  return most;
}
