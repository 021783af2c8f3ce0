/**
 * The WebSocket to the server: requests, subscriptions, and reconnecting.
 *
 * A subscription outlives its socket: it is made again on the next one.
 */
const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 8000;
const REQUEST_LIMIT_MS = 60_000;

/** The server refused a request, or did not respond. `code` is that of the contract, or "". */
export class RequestError extends Error {
  constructor({ message, hint = "", code = "" }) {
    super(message);
    this.hint = hint ?? "";
    this.code = code;
  }
}

/** `onstate` is called with {state: "open" | "waiting" | "refused", retryInMs}. */
export function createConnection(key, { onhello, onstate }) {
  const query = `?key=${encodeURIComponent(key)}`;
  const requests = new Map();
  const subscriptions = new Set();
  const bySub = new Map();
  let socket = null;
  let lastId = 0;
  let waitMs = FIRST_WAIT_MS;
  let suspended = false;
  let wasOpen = false;
  const early = [];

  function open() {
    socket = new WebSocket(`ws://${location.host}/ws${query}`);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("message", ({ data }) => {
      if (typeof data === "string") receive(JSON.parse(data));
      else receiveBinary(data);
    });
    socket.addEventListener("close", closed);
  }

  function receive(message) {
    if (message.hello) {
      wasOpen = true;
      for (const text of early.splice(0)) socket.send(text);
      waitMs = FIRST_WAIT_MS;
      onstate({ state: "open" });
      onhello(message.hello);
      for (const subscription of subscriptions) {
        if (subscription.once || !suspended) start(subscription);
      }
    } else if (message.sub !== undefined) {
      bySub.get(message.sub)?.receive(message);
    } else {
      const pending = requests.get(message.id);
      requests.delete(message.id);
      if (message.ok) pending?.resolve(message.ok);
      else pending?.reject(new RequestError(message.error));
    }
  }

  /** A binary message: the length of a JSON header, the header, the payload. */
  function receiveBinary(buffer) {
    const length = new DataView(buffer).getUint32(0);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    bySub.get(header.sub)?.receive({ ...header, data: new Uint8Array(buffer, 4 + length) });
  }

  async function closed() {
    socket = null;
    bySub.clear();
    const lost = new RequestError({ message: "the connection was lost" });
    for (const pending of requests.values()) pending.reject(lost);
    requests.clear();
    for (const subscription of subscriptions) {
      subscription.sub = null;
      if (subscription.once) subscription.onerror(lost);
    }
    if (await isRefused()) {
      onstate({ state: "refused" });
      return;
    }
    onstate({ state: "waiting", retryInMs: waitMs });
    setTimeout(open, waitMs);
    waitMs = Math.min(waitMs * 2, LONGEST_WAIT_MS);
  }

  /** A socket does not say why it was refused; a plain request does. */
  async function isRefused() {
    try {
      const response = await fetch(`/page/icon.svg${query}`, { cache: "no-store" });
      return response.status === 401;
    } catch {
      return false;
    }
  }

  /** The server speaks first. */
  function isOpen() {
    return wasOpen && socket?.readyState === WebSocket.OPEN;
  }

  /** Send a request; before the first connection it waits for that. */
  function request(op, args = {}) {
    if (!isOpen() && wasOpen) {
      return Promise.reject(new RequestError({ message: "not connected to the server" }));
    }
    lastId += 1;
    const id = lastId;
    const text = JSON.stringify({ id, op, ...args });
    return new Promise((resolve, reject) => {
      requests.set(id, { resolve, reject });
      if (isOpen()) socket.send(text);
      else early.push(text);
      setTimeout(() => {
        if (requests.delete(id)) reject(new RequestError({ message: "the server did not respond" }));
      }, REQUEST_LIMIT_MS);
    });
  }

  function start(subscription) {
    const { channel, params } = subscription;
    request("subscribe", { channel, params }).then(
      ({ sub }) => {
        if (!subscriptions.has(subscription) || (suspended && !subscription.once)) {
          stop(sub);
          return;
        }
        subscription.sub = sub;
        bySub.set(sub, subscription);
        if (subscription.params !== params) update(subscription);
      },
      (error) => subscription.onerror(error),
    );
  }

  function stop(sub) {
    bySub.delete(sub);
    request("unsubscribe", { sub }).catch(() => {});
  }

  function update({ sub, params, onerror }) {
    request("update", { sub, params }).catch(onerror);
  }

  /** Receive nothing while the page is hidden. What runs once, such as a goal, goes on. */
  function suspend(isHidden) {
    if (isHidden === suspended) return;
    suspended = isHidden;
    for (const subscription of subscriptions) {
      if (subscription.once || !isOpen()) continue;
      if (!isHidden) start(subscription);
      else if (subscription.sub !== null) {
        stop(subscription.sub);
        subscription.sub = null;
      }
    }
  }

  /**
   * Subscribe to a channel. `onmessage(data, message)` is called for each message, `onerror(error)` for
   * each error. With `once`, it is not made again when the connection was lost.
   *
   * Return {end, update, sub}: update replaces the parameters.
   */
  function subscribe(channel, params, onmessage, { onerror = () => {}, once = false } = {}) {
    const subscription = {
      channel,
      params,
      once,
      sub: null,
      onerror(error) {
        if (once) subscriptions.delete(subscription);
        onerror(error);
      },
      receive(message) {
        if (message.error) onerror(new RequestError(message.error));
        else onmessage(message.data, message);
        if (!message.ended) return;
        bySub.delete(subscription.sub);
        subscriptions.delete(subscription);
      },
    };
    subscriptions.add(subscription);
    if (isOpen() && (once || !suspended)) start(subscription);
    return {
      sub: () => subscription.sub,
      end() {
        if (!subscriptions.delete(subscription)) return;
        if (subscription.sub !== null && isOpen()) stop(subscription.sub);
      },
      update(replaced) {
        subscription.params = replaced;
        if (subscription.sub !== null && isOpen()) update(subscription);
      },
    };
  }

  open();
  return { request, subscribe, suspend };
}
