// ---- Packets in flight: dots from room to room, slower than real packets.

const SLOWER = 20;
const FALL = 500;
const MOST_DOTS = 500;
let dots = [];

function takePackets(packets) {
  if (still.matches) return;
  const now = performance.now();
  for (const [from, to, ms, lost] of packets) {
    if (dots.length >= MOST_DOTS) return;
    // The packets of a picture are spread over the time until the next picture, because pictures come fifty times a second.
    dots.push({ from, to, begin: now + Math.random() * 20, over: Math.max(150, ms * SLOWER), lost: lost === 1 });
  }
}

function drawPackets(context, rooms, now) {
  dots = dots.filter((dot) => now < dot.begin + dot.over + (dot.lost ? FALL : 0));
  for (const dot of dots) {
    const [from, to] = [rooms[dot.from], rooms[dot.to]];
    if (!from || !to || now < dot.begin) continue;
    const [a, b] = [middleOf(from), middleOf(to)];
    const length = Math.hypot(b.x - a.x, b.y - a.y) || 1;
    // Packets of the two directions have separate lanes.
    const side = { x: (-(b.y - a.y) / length) * 9, y: ((b.x - a.x) / length) * 9 };
    const gone = (now - dot.begin) / dot.over;
    const share = dot.lost ? Math.min(gone, 0.5) : Math.min(gone, 1);
    const fallen = dot.lost && gone > 0.5 ? ((now - dot.begin - dot.over / 2) / FALL) : 0;
    const x = a.x + (b.x - a.x) * share + side.x;
    const y = a.y + (b.y - a.y) * share + side.y + 60 * fallen * fallen;
    context.globalAlpha = Math.max(0, 1 - 0.6 * fallen);
    context.fillStyle = dot.lost && fallen > 0 ? ink.bad : colour(dot.from);
    if (dot.lost && fallen > 0) {
      context.fillRect(x - 4, y - 1, 8, 2);
      context.fillRect(x - 1, y - 4, 2, 8);
    } else {
      context.beginPath();
      context.arc(x, y, 3, 0, 7);
      context.fill();
    }
  }
  context.globalAlpha = 1;
}
