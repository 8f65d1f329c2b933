// ---- The task: the target in each room, a ring that fills while the copies stay at the target, and the request in words.

const TASK_OUTCOMES = { done: 'Done', 'timed-out': 'The time is over', failed: 'Failed', diverged: 'The copies came apart', unfinished: 'The task ended before its time' };

/** Returns the present request of the task as a sentence. */
function taskWords(task) {
  if (task.outcome) return TASK_OUTCOMES[task.outcome] + (task.targets > 1 ? ', ' + task.reached + ' of ' + task.targets + ' targets reached' : '');
  const what = {
    reach: task.targets > 1 ? 'Move the cube to target ' + Math.min(task.reached + 1, task.targets) + ' of ' + task.targets : 'Move the cube to the target',
    carry: task.targets > 1 ? 'Carry the cube to target ' + Math.min(task.reached + 1, task.targets) + ' of ' + task.targets : 'Carry the cube to the target',
    path: 'Move the cube along the line',
    track: 'Follow the target with the cube',
    hold: 'Keep the cube at the target',
  }[facts.task] || '';
  return task.until > 0 ? 'Soon: ' + what : what;
}

/** Shows the request and the time left, four times a second. Only the request is announced: a screen reader would read a clock all the time. */
function showTask() {
  const task = frame && frame.task;
  $('task').hidden = !task;
  if (!task) return;
  put($('task-what'), taskWords(task));
  $('task-what').className = task.outcome === 'done' ? 'good' : task.outcome ? 'bad' : '';
  const left = (seconds) => seconds.toFixed(1) + ' s';
  put($('task-left'), task.outcome ? '' : task.until > 0 ? 'begins in ' + left(task.until) : left(task.left) + ' left');
}

/** Returns the radius of the target on the canvas. A target without a radius is a point. */
const radiusOf = (room) => Math.max(5, (frame.task.radius || 0) * scaleOf(room));

/** Draws the target: a disc of its radius, and a cross in the middle. For a path also the line and its lane, whose half width is the radius. */
function drawTarget(context, room) {
  const { task } = frame;
  if (!task) return;
  const { x, y } = onCanvas(room, wide(task.at));
  context.strokeStyle = context.fillStyle = ink.accent;
  if (facts.path) {
    context.lineJoin = context.lineCap = 'round';
    context.beginPath();
    facts.path.map((point) => onCanvas(room, point)).forEach((at, k) => (k ? context.lineTo(at.x, at.y) : context.moveTo(at.x, at.y)));
    for (const [alpha, width] of [[0.16, 2 * task.radius * scaleOf(room)], [0.5, 1]]) {
      context.globalAlpha = alpha;
      context.lineWidth = width;
      context.stroke();
    }
    context.lineJoin = 'miter';
    context.lineCap = 'butt';
  }
  context.globalAlpha = 0.16;
  context.beginPath();
  context.arc(x, y, radiusOf(room), 0, 2 * Math.PI);
  context.fill();
  context.globalAlpha = task.outcome || task.until > 0 ? 0.4 : 1;
  context.lineWidth = 1.5;
  context.stroke();
  context.beginPath();
  context.moveTo(x - 5, y);
  context.lineTo(x + 5, y);
  context.moveTo(x, y - 5);
  context.lineTo(x, y + 5);
  context.stroke();
  if (task.turned && facts.edges) {
    context.setLineDash([6, 4]);
    outlineBox(context, room, { at: wide(task.at), turned: task.turned });
    context.stroke();
    context.setLineDash([]);
  }
  context.globalAlpha = 1;
}

/** Draws the ring, in front of the cube. */
function drawDwell(context, room) {
  const { task } = frame;
  if (!task || task.outcome || !(task.dwelt > 0)) return;
  const { x, y } = onCanvas(room, wide(task.at));
  context.beginPath();
  context.arc(x, y, radiusOf(room) + 6, -Math.PI / 2, -Math.PI / 2 + 2 * Math.PI * task.dwelt);
  for (const [style, width] of [[ink.ground, 7], [ink.text, 4]]) {
    context.strokeStyle = style;
    context.lineWidth = width;
    context.stroke();
  }
}
