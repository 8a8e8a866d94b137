// The connection to `stand panel`: one WebSocket for rows, state, beats and STOP; requests for the rest.
import { programError } from "./dom.js";
import { text } from "./text.js";

// The key stays in the fragment, which no request contains; sessionStorage keeps it for a reload of this tab.
const KEY = "rotary-stand-key";
const token = location.hash.slice(1) || sessionStorage.getItem(KEY) || "";
sessionStorage.setItem(KEY, token);

const KIND = { rows: 1, columns: 2, state: 3, command: 4 };
const WORD = { beat: 1, take: 2, leave: 3, stop: 0x18 };

/** @type {WebSocket|null} */
let socket = null;
/** @type {any} */
export let state = null;
/** @type {string[]} */
export let columns = [];
export const listeners = { rows: [], columns: [], state: [], command: [], lost: [] };
/** @param {keyof typeof listeners} kind @param {any} [value] */
const emit = (kind, value) => listeners[kind].forEach((/** @type {any} */ listener) => listener(value));
/** @param {keyof typeof listeners} kind @param {(value: any) => void} listener */
export const on = (kind, listener) => /** @type {any[]} */ (listeners[kind]).push(listener);

export const hasToken = () => /^[0-9a-f]{64}$/.test(token);
export const drives = () => state != null && state.driver === state.client;

export function connect() {
  socket = new WebSocket(`ws://${location.host}/socket`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => socket?.send(new TextEncoder().encode(token));
  socket.onmessage = ({ data }) => take(data);
  socket.onclose = () => {
    state = null;
    emit("lost");
    setTimeout(connect, 1000);
  };
}

/** @param {ArrayBuffer} data */
function take(data) {
  const kind = new Uint8Array(data, 0, 1)[0];
  if (kind === KIND.rows) {
    const width = new Uint8Array(data, 1, 1)[0] + 1;
    emit("rows", { width, values: new Float64Array(data, 8) });
    return;
  }
  const value = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 1)));
  if (kind === KIND.columns) {
    columns = value;
    emit("columns", value);
  } else if (kind === KIND.state) {
    state = value;
    emit("state", value);
  } else if (kind === KIND.command) emit("command", value);
}

/** @param {number} word @param {Uint8Array<ArrayBuffer>} [more] */
function say(word, more = new Uint8Array()) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(new Uint8Array([word, ...more]));
}
export const takeControl = () => say(WORD.take);
export const leaveControl = () => say(WORD.leave);

/** STOP, on both ways to the program: the WebSocket is the fast one, the request is for a socket that is just being reopened. Both have the number of the press, so that the program sends
 * the stand one 0x18 for it. */
export function stop() {
  const [low, high] = crypto.getRandomValues(new Uint32Array(2));
  const press = low + (high >>> 11) * 2 ** 32; // 53 bits, exact in JSON
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setBigUint64(0, BigInt(press), true);
  say(WORD.stop, bytes);
  request("stop", { press }).catch(() => {});
}

// The lease: beats come from the animation frames of this thread, so that a page that no longer draws no longer drives.
let beatAt = 0;
/** @param {number} now */
function beat(now) {
  if (now - beatAt > 90) {
    beatAt = now;
    if (drives()) say(WORD.beat);
  }
  requestAnimationFrame(beat);
}
requestAnimationFrame(beat);
document.addEventListener("visibilitychange", () => document.hidden && leaveControl());
addEventListener("pagehide", leaveControl);

/** A request; the error of the program as an exception. @param {string} path @param {any} [body] JSON, or bytes as a Blob */
export async function request(path, body) {
  const isBytes = body instanceof Blob;
  const headers = { Authorization: `Bearer ${token}`, "Content-Type": isBytes ? "application/octet-stream" : "application/json" };
  const options = body === undefined ? { headers } : { method: "POST", headers, body: isBytes ? body : JSON.stringify(body) };
  let response;
  try {
    response = await fetch(`/api/${path}`, options);
  } catch {
    throw new Error(text("server_gone"));
  }
  if (response.headers.get("Content-Type") === "application/octet-stream") return response.arrayBuffer();
  const answer = await response.json().catch(() => ({ error: `HTTP ${response.status}` }));
  if (!response.ok) throw programError(answer.error ?? `HTTP ${response.status}`, { status: response.status });
  return answer;
}

/** The columns of a log of the session. @param {string} name @returns {Promise<Record<string, Float64Array>>} */
export async function readLog(name) {
  const bytes = await request(`log?name=${encodeURIComponent(name)}`);
  const length = new DataView(bytes).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const begin = 4 + length;
  return Object.fromEntries(head.columns.map((/** @type {string} */ column, /** @type {number} */ k) => [column, new Float64Array(bytes, begin + 8 * k * head.rows, head.rows)]));
}

/** Columns into a new file of the session, in the layout that `readLog` reads. @param {{format: string, of: string, columns: string[], rows: number}} head @param {Float64Array[]} columns */
export function exportColumns(head, columns) {
  const bytes = new TextEncoder().encode(JSON.stringify(head));
  const length = Math.ceil((bytes.length + 4) / 8) * 8 - 4;
  const first = new Uint8Array(4 + length).fill(" ".charCodeAt(0));
  new DataView(first.buffer).setUint32(0, length, true);
  first.set(bytes, 4);
  return request("export", new Blob([first, .../** @type {any[]} */ (columns)]));
}
