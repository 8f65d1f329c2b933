// ---- Events of the server.

/** Silence of the server after which the connection counts as lost [ms]. The server sends something every second. */
const SILENCE = 4000;
const RETRY = 1000;

/**
 * Listens for ever. `onState` gets each state, `onTrouble` a text when the connection is lost, and null when it is back.
 * EventSource would do, but for the token: it sends no headers of ours.
 */
async function listen(onState, onTrouble) {
  for (;;) {
    const abort = new AbortController();
    let timer;
    const alive = () => {
      clearTimeout(timer);
      timer = setTimeout(() => abort.abort(), SILENCE);
    };
    let trouble = 'The server does not answer';
    try {
      alive();
      const response = await fetch('/api/events', { cache: 'no-store', signal: abort.signal, headers: { Authorization: 'Bearer ' + token } });
      if (response.status === 401) {
        trouble = 'The server has another token now: open the address that it printed';
      } else if (response.ok) {
        onTrouble(null);
        await readEvents(response.body, alive, onState);
      }
    } catch {
      // The server is gone or silent for too long. The page says so below.
    }
    clearTimeout(timer);
    abort.abort();
    onTrouble(trouble);
    await new Promise((resolve) => setTimeout(resolve, RETRY));
  }
}

/** Reads server-sent events until the stream ends. */
async function readEvents(body, alive, onState) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = '';
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    alive();
    rest += value;
    const events = rest.split('\n\n');
    rest = events.pop();
    // If several states have arrived, only the last state is drawn. Counters lose nothing by this.
    const states = events.filter((event) => event.includes('event: state'));
    if (states.length === 0) continue;
    const data = states[states.length - 1].split('\n').filter((line) => line.startsWith('data:')).map((line) => line.slice(5)).join('\n');
    onState(JSON.parse(data));
  }
}
