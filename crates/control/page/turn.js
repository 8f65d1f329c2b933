// ---- Boxes and orientations in space.

/** Corners of the faces of a box, in halves of its edges: indexed by axis and side, in order around the face. */
const FACES = [0, 1, 2].flatMap((axis) => [-1, 1].map((side) => ({
  axis,
  side,
  corners: [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => spread3(axis, side, a, b)),
})));
/** Marks of two faces: a triangle at the end of x and a square at the end of z. So a box that has turned by a quarter looks different. */
const SIGNS = { 0: [[-0.4, -0.4], [0.5, 0], [-0.4, 0.4]], 2: [[-0.4, -0.4], [0.4, -0.4], [0.4, 0.4], [-0.4, 0.4]] };

function spread3(axis, side, a, b) {
  const corner = [0, 0, 0];
  corner[axis] = side;
  corner[(axis + 1) % 3] = a;
  corner[(axis + 2) % 3] = b;
  return corner;
}

const dot3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const add3 = (a, b, factor) => a.map((value, axis) => value + factor * b[axis]);
/** Returns R·v, with R given by its rows. */
const turned = (matrix, v) => matrix.map((row) => dot3(row, v));

/** Returns the rotation from body to world axes, from a quaternion of any length. */
function matrixOf([w, x, y, z]) {
  const f = 2 / (w * w + x * x + y * y + z * z);
  return [
    [1 - f * (y * y + z * z), f * (x * y - w * z), f * (x * z + w * y)],
    [f * (x * y + w * z), 1 - f * (x * x + z * z), f * (y * z - w * x)],
    [f * (x * z - w * y), f * (y * z + w * x), 1 - f * (x * x + y * y)],
  ];
}

/** Returns an orientation between two orientations, on the shorter way. */
function towards(from, to, share) {
  const near = from.reduce((sum, value, k) => sum + value * to[k], 0) < 0 ? -1 : 1;
  const mixed = from.map((value, k) => value + (near * to[k] - value) * share);
  const length = Math.hypot(...mixed);
  return length > 1e-6 ? mixed.map((value) => value / length) : [...to];
}
