// What the browser scripts share: a served stand, a relay that sees every byte between panel and stand, the panel, a viewer without a
// browser.
import { spawn } from "node:child_process";
import { createInterface } from "node:readline";
import { connect, createServer } from "node:net";
import { crc32 } from "node:zlib";
import { WebSocket } from "ws";

export const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const children = new Set();
process.on("exit", () => children.forEach((child) => child.kill("SIGKILL")));

export function claim(holds, words) {
  if (!holds) throw new Error(`not so: ${words}`);
  console.log(`ok: ${words}`);
}

/** Starts a program and returns it with its first line. */
export async function started(program, words, folder) {
  const child = spawn(program, words, { cwd: folder, stdio: ["ignore", "pipe", "inherit"] });
  children.add(child);
  child.on("exit", () => children.delete(child));
  for await (const line of createInterface({ input: child.stdout })) return { child, line };
  throw new Error(`${words.join(" ")}: no output`);
}

/** A served stand, a relay before it, and a panel on the relay's port. `words`: further options of the served stand. */
export async function bench(program, folder, name, words = []) {
  const stand = await started(program, ["sim", "--serve", "tcp:0", ...words], folder);
  const port = Number(stand.line.split(":").at(-1));
  // With `keeps` the stand's line outlives the panel, so that the stand can be asked after the panel's death.
  const relay = { sent: [], keeps: false, stand: null };
  const server = createServer({ noDelay: true }, (client) => {
    const line = connect({ port, host: "127.0.0.1", noDelay: true });
    relay.stand = line;
    client.on("data", (bytes) => {
      relay.sent.push({ at: performance.now(), bytes });
      line.write(bytes);
    });
    line.on("data", (bytes) => client.destroyed || client.write(bytes));
    client.on("error", () => {}).on("close", () => relay.keeps || line.destroy());
    line.on("error", () => {}).on("close", () => client.destroy());
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const panel = await started(program, ["panel", "--port", `tcp:${server.address().port}`, "--folder", name], folder);
  return { stand: stand.child, panel: panel.child, address: new URL(panel.line), relay, end: () => { panel.child.kill("SIGKILL"); stand.child.kill("SIGKILL"); server.close(); } };
}

/** A line with its checksum, as the stand expects it while it sends a stream. @param {string} line */
export const checked = (line) => `${line}~${crc32(line).toString(16).toUpperCase().padStart(8, "0")}\n`;

/** Lines to the stand since `from`, without checksums. */
export const linesSince = (relay, from) => relay.sent.filter(({ at }) => at >= from).map(({ bytes }) => bytes.toString("latin1")).join("").split("\n").map((line) => line.split("~")[0]).filter((line) => line !== "");

/** A viewer: the state of the panel, and its bytes. */
export async function watch(address) {
  const socket = new WebSocket(`ws://${address.host}/socket`, { origin: address.origin });
  const viewer = { state: null, say: (word) => socket.send(Buffer.from([word])), close: () => socket.close() };
  socket.on("message", (data) => {
    if (data[0] === 3) viewer.state = JSON.parse(data.subarray(1).toString());
  });
  socket.on("error", () => {});
  await new Promise((resolve, reject) => socket.on("open", resolve).on("error", reject));
  socket.send(Buffer.from(address.hash.slice(1)));
  viewer.until = async (condition, ms = 20_000) => {
    for (const end = performance.now() + ms; performance.now() < end; await pause(5)) if (viewer.state && condition(viewer.state)) return;
    throw new Error(`the state did not come: ${JSON.stringify(viewer.state)}`);
  };
  await viewer.until(() => true);
  return viewer;
}

/** A request as the page sends it. */
export const request = (address, path, body) => fetch(`${address.origin}/api/${path}`, { method: body ? "POST" : "GET", body: body && JSON.stringify(body), headers: { ...(body ? { Origin: address.origin } : {}), Authorization: `Bearer ${address.hash.slice(1)}` } });

/** Clicks an element as soon as it can be clicked, in one step: a view that is being built again replaces its elements. */
export const click = (page, selector) =>
  page.waitForFunction((of) => {
    const node = document.querySelector(of);
    const ready = node !== null && !node.disabled && node.offsetParent !== null;
    if (ready) node.click();
    return ready;
  }, {}, selector);

/** Opens the page and switches the drive on with it. */
export async function drive(browser, address) {
  const page = await browser.newPage();
  await page.goto(address.href);
  await click(page, "#take");
  await click(page, "#drive-start");
  await page.waitForFunction(() => /RATE/.test(document.querySelector("#drive-state").textContent));
  await pause(500);
  return page;
}
