// Hostile pages and hostile data in a real browser: another site, DNS rebinding, file names, columns, effects and answers that are markup.
//   node hostile.mjs STAND CHROMIUM FOLDER
import { createServer } from "node:http";
import { mkdir, writeFile } from "node:fs/promises";
import puppeteer from "puppeteer-core";
import { bench, claim, drive, linesSince, pause, request, watch } from "./bench.mjs";

const [stand, chromium, folder] = process.argv.slice(2);
const MARK = "SOURce:RATE 9.125";
const MARKUP = '<img src=x onerror="window.hacked=1">';
const SCRIPT = "</script><script>window.hacked=1</script>";

// Hostile data lie in the folder before the panel starts.
const session = `${folder}/hostile`;
await mkdir(session, { recursive: true });
const rows = Array.from({ length: 300 }, (_, k) => `${k / 100},${Math.sin(k / 20).toFixed(4)},${Math.cos(k / 9).toFixed(4)}`).join("\n");
await writeFile(`${session}/<img src=x onerror=alert(1)>.csv`, `t_s,omega_rad_s,u_V\n${rows}\n`);
await writeFile(`${session}/hostile.csv`, `# operator: ${MARKUP}${SCRIPT}\n# theta_zero: ${MARKUP}\nt_s,omega_rad_s,"${MARKUP.replaceAll('"', '""')}"\n${rows}\n`);
await writeFile(`${session}/compare-1.json`, JSON.stringify({ log: MARKUP, model: SCRIPT, model_effects: [MARKUP], outputs: { [MARKUP]: { rms: 1, noise: 1, ratio: 2 } }, failures: [{ output: MARKUP, coordinate: "theta", share: 1, orders: [MARKUP], form: { kind: "sensor", channel: SCRIPT } }, { output: SCRIPT, coordinate: MARKUP, share: 0.5, orders: [], form: { kind: MARKUP } }, { says: MARKUP }] }));
await writeFile(`${session}/compensate-1.json`, JSON.stringify({ port: MARKUP, source: SCRIPT, in_force: [MARKUP], left_out: [SCRIPT], left_out_reasons: [{ kind: "effect", effect: MARKUP }], withdrawn: true, saved: false, ripple: null, spectrum: null }));
await writeFile(`${session}/evil.toml`, `input = "voltage"\n[parameters]\n"${MARKUP.replaceAll('"', '\\"')}" = 1.0\n`);

// Host names of the hostile sites lead to this computer, as after DNS rebinding. Chromium's own guard of local addresses is off, so that
// the program's is tested.
const browser = await puppeteer.launch({
  executablePath: chromium, headless: true,
  args: ["--no-sandbox", "--lang=en", "--host-resolver-rules=MAP evil.test 127.0.0.1", "--disable-features=LocalNetworkAccessChecks,BlockInsecurePrivateNetworkRequests,PrivateNetworkAccessSendPreflights"],
});
const { address, relay, end } = await bench(stand, folder, "hostile");
const viewer = await watch(address);
const token = address.hash.slice(1);
const dialogs = [];
/** Lines that the panel itself sends while the drive is on. */
const quiet = new Set();

/** Everything that a page of another origin can try, with the right token; what it gets. */
const attack = async ({ target, token, mark, command }) => {
  const got = {};
  const attempt = async (name, work) => {
    got[name] = await Promise.race([work().catch((error) => `refused: ${error.name}`), new Promise((resolve) => setTimeout(() => resolve("refused: no answer"), 4000))]);
  };
  const status = async (promise) => {
    const response = await promise;
    return response.type === "opaque" ? "opaque" : response.status >= 400 ? `refused: ${response.status}` : `answered: ${response.status}`;
  };
  const body = JSON.stringify({ client: command, line: mark });
  const key = { Authorization: `Bearer ${token}` };
  await attempt("get", () => status(fetch(`${target}/api/session`, { headers: key })));
  await attempt("get without a key", () => status(fetch(`${target}/api/session`)));
  await attempt("post", () => status(fetch(`${target}/api/command`, { method: "POST", headers: key, body })));
  await attempt("simple post", () => status(fetch(`${target}/api/command`, { method: "POST", mode: "no-cors", headers: { "Content-Type": "text/plain" }, body })));
  await attempt("stop", () => status(fetch(`${target}/api/stop`, { method: "POST", mode: "no-cors", body: "{}" })));
  await attempt("put", () => status(fetch(`${target}/api/command`, { method: "PUT", headers: key, body })));
  await attempt("socket", () => new Promise((resolve) => {
    const socket = new WebSocket(`${target.replace("http", "ws")}/socket`);
    socket.onopen = () => {
      socket.send(new TextEncoder().encode(token));
      socket.send(new Uint8Array([2]));
      socket.send(new Uint8Array([0x18]));
      resolve("answered: open");
    };
    socket.onerror = () => resolve("refused: error");
  }));
  await attempt("script", () => new Promise((resolve) => {
    const script = document.createElement("script");
    Object.assign(script, { src: `${target}/connection.js`, type: "module", onload: () => resolve("answered: loaded"), onerror: () => resolve("refused: error") });
    document.head.append(script);
  }));
  await attempt("frame", () => new Promise((resolve) => {
    const frame = document.createElement("iframe");
    Object.assign(frame, { src: `${target}/#${token}`, onload: () => { let inner = "refused: opaque"; try { inner = frame.contentDocument?.querySelector("#stop") ? "answered: readable" : "refused: empty"; } catch { /* another origin */ } resolve(inner); } });
    document.body.append(frame);
    setTimeout(() => resolve("refused: no load"), 2000);
  }));
  await attempt("form", async () => {
    const frame = Object.assign(document.createElement("iframe"), { name: "sink" });
    const form = Object.assign(document.createElement("form"), { action: `${target}/api/stop`, method: "POST", target: "sink", enctype: "text/plain" });
    document.body.append(frame, form);
    form.submit();
    await new Promise((resolve) => setTimeout(resolve, 500));
    return "opaque";
  });
  return got;
};

/** Runs the attack on a page of `origin`, whose first answer is the attacker's; nothing may reach the line. */
async function from(origin, target, name) {
  const page = await browser.newPage();
  page.on("dialog", (dialog) => { dialogs.push(dialog.message()); dialog.dismiss(); });
  await page.setRequestInterception(true);
  page.on("request", (asked) => (asked.url() === `${origin}/attack` ? asked.respond({ contentType: "text/html", body: "<!doctype html><title>attack</title><body>" }) : asked.continue()));
  const statuses = [];
  page.on("response", (response) => response.url().startsWith(target) && !response.url().endsWith("/attack") && statuses.push(`${new URL(response.url()).pathname} ${response.status()}`));
  await page.goto(`${origin}/attack`);
  const begun = performance.now();
  const got = await page.evaluate(attack, { target, token, mark: MARK, command: viewer.state.client });
  await pause(300);
  const reached = linesSince(relay, begun);
  const bytes = relay.sent.filter(({ at }) => at >= begun);
  claim(Object.values(got).every((outcome) => outcome === "opaque" || outcome.startsWith("refused")), `${name}: every attempt is refused: ${JSON.stringify(got)}`);
  // The bare page may be opened by a link from elsewhere; in a frame the browser does not show it.
  const answered = statuses.filter((status) => !/ 4\d\d$/.test(status) && status !== "/ 200");
  claim(statuses.some((status) => status.startsWith("/api/stop 4")) && answered.length === 0, `${name}: the program refuses: ${[...new Set(statuses)].join(", ")}`);
  const foreign = reached.filter((line) => !quiet.has(line));
  claim(!bytes.some((sent) => sent.bytes.includes(0x18)) && foreign.length === 0, `${name}: no byte of it on the line ${foreign}`);
  await page.close();
  return viewer.state.drive.is_on && viewer.state.drive.fault === "";
}

/** The user's drive on, as the page's buttons do it. */
async function switchOn() {
  for (const line of ["FAULt:CLEar", "SOURce:RATE 5", "SOURce:MODE RATE", "OUTPut ON"]) await request(address, "command", { client: viewer.state.client, line });
  await viewer.until((s) => s.drive.is_on);
}

/** The fault of a stand whose host was late. */
const LATE = "host silent";

/** Attacks; the user's drive goes on. A computer that is late stops it too, by one fault only and not three times: then the attack is repeated. */
async function leavesTheDrive(origin, target, name) {
  for (let attempt = 1; attempt <= 3; attempt++) {
    if (await from(origin, target, name)) return claim(true, `${name}: the drive of the user goes on undisturbed`);
    const { fault } = viewer.state.drive;
    claim(fault.includes(LATE) && attempt < 3, `${name}: attempt ${attempt}: only a late computer stopped the drive: ${fault}`);
    await switchOn();
  }
}

try {
  // The user's own page drives in a window of its own and stays in front.
  const driver = setInterval(() => viewer.say(1), 100);
  viewer.say(2);
  await viewer.until((s) => s.driver === s.client);
  await switchOn();
  const before = performance.now();
  await pause(3000);
  linesSince(relay, before).forEach((line) => quiet.add(line));
  const other = createServer((_, response) => response.end("hostile"));
  await new Promise((resolve) => other.listen(0, "127.0.0.1", resolve));
  const port = other.address().port;
  await leavesTheDrive(`http://127.0.0.1:${port}`, address.origin, "page of another port of this computer");
  await leavesTheDrive(`http://evil.test:${port}`, address.origin, "page of another site");
  await leavesTheDrive(`http://evil.test:${address.port}`, `http://evil.test:${address.port}`, "DNS rebinding");
  clearInterval(driver);
  viewer.say(0x18);
  await viewer.until((s) => !s.drive.is_on);
  other.close();

  // Hostile data on the page of the user.
  const page = await browser.newPage();
  const problems = [];
  page.on("dialog", (dialog) => { dialogs.push(dialog.message()); dialog.dismiss(); });
  page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
  await page.goto(address.href);
  await page.waitForSelector("#take");
  await page.waitForFunction(() => document.querySelector("#log-choice")?.options.length > 0);
  for (const line of [MARKUP, `*IDN?;${SCRIPT}`]) await request(address, "command", { client: 1, line });
  for (const [path, body] of [
    ["model", { name: "model.toml", add_expression: { name: MARKUP, torque_N_m: MARKUP, parameters: { [MARKUP]: 1 } } }], ["model", { name: MARKUP, add: SCRIPT }],
    ["record", { client: viewer.state.client, profile: MARKUP, mode: SCRIPT, seconds: 1 }], ["compare", { log: MARKUP, model: SCRIPT }], ["compare", { log: "hostile.csv", model: "model.toml" }],
  ]) {
    await request(address, path, body);
    await viewer.until((s) => !s.job.is_running);
  }
  for (const view of ["identify", "compensate", "measure", "commands", "live"]) {
    if (await page.$(`#tab-${view}`)) await page.click(`#tab-${view}`);
    await pause(300);
  }
  await page.reload();
  await page.waitForFunction(() => document.querySelector("#log-choice")?.options.length > 0);
  await page.click("#tab-identify");
  await page.select("#model-choice", "evil.toml");
  await pause(1500);
  const found = await page.evaluate(() => ({ hacked: "hacked" in window, images: document.querySelectorAll("img[src='x']").length, scripts: document.scripts.length, text: document.body.innerText.includes("onerror") || document.body.textContent.includes("onerror") }));
  claim(!found.hacked && found.images === 0 && found.scripts === 1 && dialogs.length === 0, `names, notes, columns, effects and answers that are markup are inert (${JSON.stringify(found)})`);
  claim(found.text, "and the page shows them as text");
  claim(!problems.some((text) => /Content Security Policy|Refused/.test(text)), `and nothing tried to run: ${problems}`);
} finally {
  end();
  browser.process().kill("SIGKILL");
}
process.exit(0);
