// ---- The WebSocket: positions of the hand go out, pictures of the motion come in.

/** Silence after which the connection counts as lost [ms]. */
const DEAD = 4000;
const AGAIN = 1000;

/** Number of the hand of this page; null if the page only looks on. */
let ownHand = null;
let socket = null;

/** Ends the connection for good. */
let disconnect = () => {};

/** Connects, and connects again after each loss. `onFrame` gets each picture, `onNews` each message of a study, and `onTrouble` a text after a loss and null
 * after a return. */
function connect(onFrame, onTrouble, onNews) {
  let ended = false;
  disconnect = () => {
    ended = true;
    socket.close();
  };
  let wanted = new URLSearchParams(location.search).get('hand');
  const open = () => {
    const query = new URLSearchParams({ token });
    if (wanted !== null) query.set('hand', wanted);
    const own = (socket = new WebSocket('ws://' + location.host + '/api/hand?' + query));
    let timer;
    const alive = () => {
      clearTimeout(timer);
      timer = setTimeout(() => own.close(), DEAD);
    };
    alive();
    own.onmessage = ({ data }) => {
      alive();
      const said = JSON.parse(data);
      if ('hand' in said) {
        ownHand = said.hand;
        // The server may not know yet that the connection was lost. Then any hand is taken.
        wanted = said.hand === null ? null : String(said.hand);
        onTrouble(said.refused ? 'You look on: ' + said.refused : null, said.hand === null);
      } else if (said.page) onNews(said);
      else if (said.peers) onFrame(said);
    };
    own.onclose = () => {
      clearTimeout(timer);
      if (ended) return;
      letGo();
      onTrouble('The server does not answer. What is shown is old. Trying again …', false);
      setTimeout(open, AGAIN);
    };
  };
  open();
}

/** Sends the position of the hand; null lets go. */
function tellHand(place) {
  if (socket && socket.readyState === WebSocket.OPEN && ownHand !== null) socket.send(JSON.stringify(place));
}
