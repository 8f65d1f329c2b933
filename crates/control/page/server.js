// ---- The server: the token, and requests.

/** Token from the address. It is removed from the address at once, stays in this tab, and is sent in headers. */
const token = (() => {
  const query = new URLSearchParams(location.search);
  const given = query.get('token');
  if (given) {
    sessionStorage.setItem('token', given);
    query.delete('token');
    history.replaceState(null, '', location.pathname + (query.size > 0 ? '?' + query : ''));
  }
  return given || sessionStorage.getItem('token') || '';
})();

/** Sends a request and returns the JSON of the answer. Throws an Error with a message for the user. */
async function ask(path, options = {}) {
  let response;
  try {
    response = await fetch(path, { ...options, cache: 'no-store', headers: { Authorization: 'Bearer ' + token } });
  } catch {
    throw new Error('the server does not answer');
  }
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(body.error || 'the server says ' + response.status);
  return body;
}
