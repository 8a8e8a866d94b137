// Time from STOP on a page's WebSocket to the byte 0x18 on the line, under a stream of all default channels at 1 kHz and a running `explain`.
//   node stop-latency.mjs STAND FOLDER [REPETITIONS]
// A TCP relay between the panel and a served stand sees the byte; page and relay share one clock.
import { spawn } from "node:child_process";
import { createInterface } from "node:readline";
import { connect, createServer } from "node:net";
import { WebSocket } from "ws";

const [stand, folder, repetitions = "100"] = process.argv.slice(2);
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const children = [];

async function firstLine(words) {
  const child = spawn(stand, words, { cwd: folder, stdio: ["ignore", "pipe", "inherit"] });
  children.push(child);
  for await (const line of createInterface({ input: child.stdout })) return line;
}

let seen = () => {};
const port = Number((await firstLine(["sim", "--serve", "tcp:0"])).split(":").at(-1));
const relay = createServer({ noDelay: true }, (client) => {
  const line = connect({ port, host: "127.0.0.1", noDelay: true });
  client.on("data", (bytes) => {
    if (bytes.includes(0x18)) seen(performance.now());
    line.write(bytes);
  });
  line.on("data", (bytes) => client.write(bytes));
  for (const [one, other] of [[client, line], [line, client]]) one.on("close", () => other.destroy()).on("error", () => other.destroy());
});
await new Promise((resolve) => relay.listen(0, "127.0.0.1", resolve));
const address = new URL(await firstLine(["panel", "--port", `tcp:${relay.address().port}`, "--folder", "session"]));
const request = (path, body) => fetch(`${address.origin}/api/${path}`, { method: "POST", body: JSON.stringify(body), headers: { Origin: address.origin, Authorization: `Bearer ${address.hash.slice(1)}` } });

const socket = new WebSocket(`ws://${address.host}/socket`, { origin: address.origin });
let state = null;
socket.on("message", (data) => {
  if (data[0] === 3) state = JSON.parse(data.subarray(1).toString());
});
await new Promise((resolve) => socket.on("open", resolve));
socket.send(Buffer.from(address.hash.slice(1)));
const until = async (condition) => {
  while (!(state && condition(state))) await pause(20);
};
const say = (word) => socket.send(Buffer.from([word]));
setInterval(() => say(1), 100);
await until(() => true);
say(2);
await until((s) => s.driver === s.client);
await request("record", { client: state.client, profile: "multi-step", mode: "rate", seconds: 20 });
await until((s) => s.job.number === 1 && !s.job.is_running);
const log = state.job.answer;

const times = [];
for (let k = 0; k < Number(repetitions); k++) {
  if (!state.job.is_running) await request("explain", { log, model: "model.toml" });
  await pause(50 + 100 * Math.random());
  const arrived = new Promise((resolve) => (seen = resolve));
  const begun = performance.now();
  say(0x18);
  times.push((await arrived) - begun);
}
times.sort((a, b) => a - b);
const at = (part) => times[Math.min(times.length - 1, Math.floor(part * times.length))].toFixed(1);
console.log(`STOP to 0x18 on the line, ${times.length} times: median ${at(0.5)} ms, p99 ${at(0.99)} ms, largest ${at(1)} ms`);
children.forEach((child) => child.kill("SIGKILL"));
process.exit(Number(at(0.99)) <= 50 ? 0 : 1);
