// Time from STOP on a page's WebSocket to the byte 0x18 on the line, under a stream of all default channels at 1 kHz and a running
// `explain`. node stop-latency.mjs STAND FOLDER [REPETITIONS] The relay between panel and stand sees the byte; page and relay share one
// clock.
import { bench, pause, request, watch } from "./bench.mjs";

const BEAT = 1;
const TAKE = 2;
const STOP = 0x18;

const [stand, folder, repetitions = "100"] = process.argv.slice(2);
const { address, relay, end } = await bench(stand, folder, "session");
const page = await watch(address);
setInterval(() => page.say(BEAT), 100);
page.say(TAKE);
await page.until((state) => state.driver === state.client);
await request(address, "record", { client: page.state.client, profile: "multi-step", mode: "rate", seconds: 20 });
await page.until(({ job }) => job.number === 1 && !job.is_running, 120_000);
const log = page.state.job.answer;

const times = [];
for (let k = 0; k < Number(repetitions); k++) {
  if (!page.state.job.is_running) await request(address, "explain", { log, model: "model.toml" });
  await pause(50 + 100 * Math.random());
  const begun = performance.now();
  page.say(STOP);
  let seen;
  while (!(seen = relay.sent.find(({ at, bytes }) => at >= begun && bytes.includes(STOP)))) await pause(1);
  times.push(seen.at - begun);
  relay.sent.length = 0;
}
times.sort((a, b) => a - b);
const at = (part) => times[Math.min(times.length - 1, Math.floor(part * times.length))].toFixed(1);
console.log(`STOP to 0x18 on the line, ${times.length} times: median ${at(0.5)} ms, p99 ${at(0.99)} ms, largest ${at(1)} ms`);
end();
process.exit(Number(at(0.99)) <= 50 ? 0 : 1);
