/**
 * The key that opens the WebSocket: the server adds it to the address in exchange for the token.
 *
 * It is kept where only pages of this server can read it. Cookies are sent to all ports of a computer.
 */
const KEY = "key";

/** Return the key, and remove it from the address; "" if this browser has not got one. */
export function takeKey() {
  const given = new URLSearchParams(location.hash.slice(1)).get(KEY);
  if (given) history.replaceState(null, "", location.pathname + location.search);
  try {
    if (given) localStorage.setItem(KEY, given);
    return given ?? localStorage.getItem(KEY) ?? "";
  } catch {
    // Storage may be forbidden: the key then ends with the page.
    return given ?? "";
  }
}
