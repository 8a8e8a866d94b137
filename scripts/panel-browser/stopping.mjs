// Loss of the page or of the program while the drive is on: time until the drive is off and the fault is latched.
//   node stopping.mjs STAND CHROMIUM FOLDER [IMAGE]
// IMAGE: the firmware's image; the loss of page and program is then measured on the emulated chip, too.
import puppeteer from "puppeteer-core";
import { bench, checked, claim, drive, pause, watch } from "./bench.mjs";

const [stand, chromium, folder, image] = process.argv.slice(2);
const launch = () => puppeteer.launch({ executablePath: chromium, headless: true, args: ["--no-sandbox", "--lang=en"] });

/** The processes that draw pages. */
async function renderers(browser) {
  const session = await browser.target().createCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  return processInfo.filter(({ type }) => type === "renderer").map(({ id }) => id);
}

/** Page: harm, then the state of the panel. */
async function page(name, harm, after = async () => {}, words = []) {
  const browser = await launch();
  const { address, relay, end } = await bench(stand, folder, `stopping-${name.replaceAll(/\W+/g, "-")}`, words);
  try {
    const driving = await drive(browser, address);
    const viewer = await watch(address);
    const begun = performance.now();
    await harm(browser, driving);
    await viewer.until(({ drive: { is_on, fault } }) => !is_on && fault !== "");
    const took = performance.now() - begun;
    const stop = relay.sent.find(({ at, bytes }) => at >= begun && bytes.includes(0x18));
    claim(took <= 1500 && stop !== undefined, `${name}: 0x18 after ${(stop.at - begun).toFixed(0)} ms, drive off and fault latched after ${took.toFixed(0)} ms`);
    await after(browser, driving);
    await pause(700);
    const { drive: { is_on, fault }, driver } = viewer.state;
    claim(!is_on && fault !== "" && driver === null, `${name}: nothing resumes by itself`);
    viewer.close();
  } finally {
    end();
    browser.process().kill("SIGKILL");
  }
}

/** Program: harm, then the stand itself is asked over its line. An emulated chip can be slower than real time, so its own clock counts. */
async function program(name, harm, words = []) {
  const browser = await launch();
  const { panel, address, relay, end } = await bench(stand, folder, `stopping-${name.replaceAll(/\W+/g, "-")}`, words);
  try {
    await drive(browser, address);
    relay.keeps = true;
    const begun = performance.now();
    harm(panel);
    let text = "";
    /** Replies: time of arrival, the stand's clock, whether the drive is off with a fault. */
    const replies = [];
    relay.stand.on("data", (bytes) => {
      const lines = (text + bytes.toString("latin1")).split("\n");
      text = lines.pop();
      for (const line of lines) {
        const [, uptime, output, fault] = line.match(/(\d[\dE.+-]*);([01]);(\d+,[^\n]*)/) ?? [];
        if (uptime) replies.push({ at: performance.now(), uptime: 1000 * Number(uptime), isOff: output === "0" && /host silent/.test(fault) });
      }
    });
    const off = () => replies.find(({ isOff }) => isOff);
    // Ends a line that was broken off.
    relay.stand.write(`~\r\n${checked("STReam OFF")}`);
    while (!off() && performance.now() < begun + 10_000) {
      // A query is no sign of life.
      relay.stand.write(checked("SYSTem:UPTime?;:OUTPut?;:FAULt?"));
      await pause(20);
    }
    const wall = (off()?.at ?? Infinity) - begun;
    const took = words.includes("--chip") ? off().uptime - replies[0].uptime : wall;
    claim(took <= 700 && !replies[0].isOff, `${name}: drive off and fault latched by the stand after ${took.toFixed(0)} ms`);
  } finally {
    end();
    browser.process().kill("SIGKILL");
  }
}

/** One press of STOP is one byte on the line, though the page sends it in two ways. */
async function presses() {
  const browser = await launch();
  const { address, relay, end } = await bench(stand, folder, "stopping-presses");
  try {
    const driving = await drive(browser, address);
    const viewer = await watch(address);
    const count = async (name, press) => {
      const begun = performance.now();
      await press();
      await pause(800);
      const bytes = relay.sent.filter(({ at }) => at >= begun).reduce((sum, { bytes }) => sum + bytes.filter((byte) => byte === 0x18).length, 0);
      claim(bytes === 1 && !viewer.state.drive.is_on, `${name}: ${bytes} byte 0x18 on the line`);
    };
    await count("Esc", () => driving.keyboard.press("Escape"));
    await count("click on STOP", () => driving.click("#stop"));
    await driving.focus("#stop");
    await count("Enter on STOP", () => driving.keyboard.press("Enter"));
    await count("space bar on STOP", () => driving.keyboard.press(" "));
    viewer.close();
  } finally {
    end();
    browser.process().kill("SIGKILL");
  }
}

const signal = (name) => async (browser) => (await renderers(browser)).forEach((pid) => process.kill(pid, name));
await presses();
await page("renderer stopped by SIGSTOP", signal("SIGSTOP"), signal("SIGCONT"));
await page("renderer killed by SIGKILL", signal("SIGKILL"));
// What F5 does; in a headless browser the key itself has no effect.
await page("reload", (_, driving) => driving.reload());
await page("hidden tab", async (browser) => (await browser.newPage()).bringToFront());
await program("server killed by SIGKILL", (panel) => panel.kill("SIGKILL"));
if (image) {
  await page("emulated chip, renderer stopped by SIGSTOP", signal("SIGSTOP"), signal("SIGCONT"), ["--chip", image]);
  await program("emulated chip, server killed by SIGKILL", (panel) => panel.kill("SIGKILL"), ["--chip", image]);
}
process.exit(0);
