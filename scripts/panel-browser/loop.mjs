// The main loop of `stand panel` in headless Chromium, by keyboard alone, in both languages. node loop.mjs STAND CHROMIUM FOLDER [PICTURES]
// STAND: the program; CHROMIUM: the browser; FOLDER: an empty folder for sessions; PICTURES: folder for screenshots. Exit status 0: all
// claims hold.
import puppeteer from "puppeteer-core";
import { accessible, chromium, claim, focus, panel, pause, picture, press, shown, tab, text, type, untranslated } from "./page.mjs";

/** Explains, and waits for the answer on the page. */
async function explain(page) {
  const before = await page.$eval("#answer", (node) => node.dataset.series);
  await press(page, "#explain");
  await shown(page, (old) => { const { series = "" } = document.querySelector("#answer").dataset; return series !== old && series.startsWith("explain"); }, before);
  await idle(page);
}
const idle = (page) => page.waitForFunction(() => document.querySelector("#job-identify").hidden && !document.querySelector("#compare").disabled, { timeout: 600_000 });

const isUkrainian = (words) => /[а-яіїєґ]/i.test(words);

/** Collects what the page says about the stage of its jobs. */
const collectStages = (page) => page.evaluate(() => {
  globalThis.stages = new Set();
  new MutationObserver(() => document.querySelectorAll(".job-stage").forEach((node) => node.textContent !== "" && globalThis.stages.add(node.textContent))).observe(document.body, { childList: true, characterData: true, subtree: true });
});

/** The verdict and the misfits in the language of the page. */
async function inOwnWords(page, language) {
  const sentences = await page.$$eval("#answer-text :is(ol li, ul li, p.good, p.warn):not([lang=en])", (all) => all.map((node) => node.textContent));
  claim(sentences.length > 0 && sentences.every((sentence) => isUkrainian(sentence) === (language === "uk")), `the findings are in the language of the page: ${sentences.join(" | ").slice(0, 200)}`);
  if (language === "uk") await untranslated(page, "identify");
}

/** The page of the first candidate, and its signature in the log. */
async function signature(page, language) {
  await press(page, "[data-page]");
  await press(page, "#signature-start");
  await shown(page, () => document.querySelectorAll("#signature canvas").length >= 2);
  await idle(page);
  const captions = await page.$$eval("#signature figcaption", (all) => all.map((node) => node.textContent));
  const numbers = captions.find((caption) => caption.startsWith("omega_rad_s:")).match(/\d[\d.,e-]*/g).map((number) => Number(number.replace(",", ".")));
  claim(numbers[0] > 1.5 * numbers[1], `the signature of the candidate in the log: ${captions[0]}`);
  await page.$eval("#signature", (node) => node.scrollIntoView());
  await pause(300);
  await picture(page, `signature-${language}`);
  if (language === "uk") await untranslated(page, "effect");
  if (language === "en") await accessible(page, "effect");
  await page.$eval("#effect", (node) => node.replaceChildren());
}

/** A calibration session that is cancelled, and continued on the page. */
async function interruptedSession(page, language) {
  await press(page, "#calibrate-start");
  await page.waitForFunction(() => /^(done|виконано)$/.test(document.querySelector("#calibrate-steps tbody tr td:last-child").textContent), { timeout: 120_000 });
  await press(page, "#measure-cancel");
  await page.waitForSelector("[data-resume='calibrate-2']", { timeout: 30_000 });
  await page.waitForFunction(() => document.querySelector("#measure-error").textContent !== "", { timeout: 30_000 });
  const error = await text(page, "#measure-error");
  claim(language === "en" ? /Cancelled/.test(error) : /Скасовано/.test(error), `the session is cancelled: ${error}`);
  await picture(page, `interrupted-${language}`);
  if (language === "uk") await untranslated(page, "measure");
  await press(page, "[data-resume='calibrate-2']");
  await page.waitForFunction(() => document.querySelector("#measure-answer").dataset.answer === "calibrate-2.json", { timeout: 120_000 });
  await page.waitForFunction(() => document.querySelector("[data-resume]") === null);
  claim(true, "and continued to its end with one button");
}

/** Each of the other measurements, with its result on the page. */
async function measurements(page, language) {
  for (const kind of ["allan", "drift", "calibrate"]) {
    await press(page, `#${kind}-start`);
    await page.waitForFunction((k) => (document.querySelector("#measure-answer").dataset.answer ?? "").startsWith(`${k}-`) || !document.querySelector("#measure-error").hidden, { timeout: 300_000 }, kind);
    const { rows, pictures, error } = await page.evaluate(() => ({ rows: document.querySelectorAll("#measure-answer tbody tr").length, pictures: [...document.querySelectorAll("#measure-answer img")].filter((image) => image.complete && image.naturalWidth > 0).length, error: document.querySelector("#measure-error").textContent }));
    claim(rows > 0 && pictures > 0, `${kind}: ${rows} quantities with U, ${pictures} pictures ${error}`);
    await picture(page, `measure-${kind}-${language}`);
    if (language === "en") await accessible(page, `measure, ${kind}`);
    else await untranslated(page, `measure, ${kind}`);
  }
  await interruptedSession(page, language);
}

async function loop(browser, language) {
  const { child, address } = await panel(`session-${language}`);
  const page = await browser.newPage();
  const problems = [];
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
  try {
    await page.setViewport({ width: 1360, height: 900 });
    await page.goto(address);
    await page.waitForSelector("#driver");
    await focus(page, "#language");
    await page.keyboard.press(language === "uk" ? "ArrowDown" : "ArrowUp");
    await page.waitForFunction((l) => document.documentElement.lang === l, {}, language);
    claim(true, `language ${language}`);
    await press(page, "#take");
    await press(page, "#drive-start");
    await page.waitForFunction(() => /RATE/.test(document.querySelector("#drive-state").textContent));
    await pause(4000);
    await picture(page, `live-${language}`);
    if (language === "en") await accessible(page, "live");
    await page.keyboard.press("Escape");
    await page.waitForFunction(() => !document.querySelector("#alert").hidden);
    await page.waitForFunction(() => !/RATE/.test(document.querySelector("#drive-state").textContent));
    claim(true, "Esc stops the drive and the fault is shown");
    if (language === "uk") await untranslated(page, "live");
    await collectStages(page);
    await press(page, "#take");
    await press(page, "#clear");
    await page.waitForFunction(() => document.querySelector("#alert").hidden);
    await type(page, "#seconds", language === "uk" ? "10,0" : "10.0");
    await press(page, "#record");
    await page.waitForSelector("#job-drive:not([hidden])");
    await page.waitForSelector("#job-drive[hidden]", { timeout: 600_000 });
    await tab(page, "live", 1);
    await page.waitForFunction(() => document.querySelector("#log-choice").value === "run-1.parquet");
    await press(page, "#fit");
    await shown(page, () => document.querySelectorAll(".steps > div").length === 1);
    await picture(page, `compare-${language}`);
    await inOwnWords(page, language);
    const uncertain = await page.$$eval("#model tbody tr", (rows) => rows.map((row) => row.children[2].textContent));
    claim(uncertain.length === 5 && uncertain.filter((cell) => /^± [\d.,e-]+$/.test(cell)).length >= 3 && uncertain.every((cell) => cell !== "–") && /fit-1\.json/.test(await text(page, "#model")), `each parameter has the uncertainty of the last fit, or why it has none: ${uncertain}`);
    await page.$eval("#answer .pair figure:last-child", (node) => node.scrollIntoView());
    await page.waitForSelector("#answer .pair figure:last-child canvas");
    await picture(page, `profiles-${language}`);
    await explain(page);
    await page.$eval("#answer", (node) => node.scrollIntoView());
    await picture(page, `explain-${language}`);
    await inOwnWords(page, language);
    if (language === "en") await accessible(page, "explain");
    await signature(page, language);
    const best = await page.$eval("[data-add]", (node) => node.dataset.add);
    for (let k = 0; k < 4; k++) {
      const next = await page.evaluate(() => document.querySelector("[data-add]")?.dataset.add);
      if (!next) break;
      const before = await page.$$eval(".steps > div", (all) => all.length);
      await press(page, "[data-add]");
      await shown(page, (n) => document.querySelectorAll(".steps > div").length > n, before);
      await idle(page);
      await explain(page);
      if ((await page.$eval("#answer", (node) => node.dataset.verdict)) === "adequate") break;
    }
    await inOwnWords(page, language);
    const ratios = await page.$$eval(".steps strong", (all) => all.map((node) => Number(node.textContent.replace(",", "."))));
    claim(ratios.at(-1) < ratios[0] / 3, `the error falls: ${ratios.join(" → ")} (first candidate ${best})`);
    claim(/cogging/.test(await text(page, "#model")), "the hidden effect is in the model");
    await picture(page, `staircase-${language}`);
    if (language === "en") await accessible(page, "identify");
    await tab(page, "identify", 1);
    if (await page.$("#compensate-take:not([disabled])")) await press(page, "#compensate-take");
    await press(page, "#compensate-start");
    await page.waitForSelector("#job-compensate:not([hidden])");
    await page.waitForSelector("#ripple-fall, #compensate-error:not([hidden])", { timeout: 120_000 });
    claim((await page.$("#ripple-fall")) !== null, `compensation: ${await text(page, "#compensate-error")}`);
    const factor = await page.$eval("#ripple-fall", (node) => Number(node.dataset.factor));
    claim(factor > 3, `the compensation on the stand divides the ripple by ${factor.toFixed(1)}`);
    await picture(page, `compensate-${language}`);
    if (language === "en") await accessible(page, "compensate");
    await tab(page, "compensate", 1);
    if (language === "uk") await untranslated(page, "compensate");
    await measurements(page, language);
    const stages = await page.evaluate(() => [...globalThis.stages]);
    claim(stages.length > 8 && stages.every((stage) => isUkrainian(stage) === (language === "uk")), `the stages of the jobs are in the language of the page: ${stages.length}, e.g. ${stages.slice(0, 3).join(" | ")}`);
    await picture(page, `measure-${language}`);
    await tab(page, "measure", 1);
    await type(page, "#console-line", "*IDN?");
    await page.keyboard.press("Enter");
    await page.waitForFunction(() => /Rotary Stand,/.test(document.querySelector("#log").textContent));
    await picture(page, `commands-${language}`);
    if (language === "en") await accessible(page, "commands");
    const sent = await text(page, "#log");
    await page.reload();
    await page.waitForFunction(() => document.querySelector("#log")?.textContent.includes("OUTPut ON"), { timeout: 20_000 });
    claim((await text(page, "#log")).length >= sent.length, "a reload loses no command");
    claim(problems.length === 0, `no error in the page's console: ${problems}`);
  } finally {
    await page.close();
    child.kill("SIGKILL");
  }
}

/** A page that stops drawing or is hidden loses the drive; measured by a second page. */
async function dead(browser, name, harm) {
  const { child, address } = await panel(`dead-${name}`);
  const page = await browser.newPage();
  try {
    await page.goto(address);
    await press(page, "#take");
    await press(page, "#drive-start");
    await page.waitForFunction(() => /RATE/.test(document.querySelector("#drive-state").textContent));
    await pause(500);
    const base = new URL(address);
    const state = await watch(base);
    const begun = Date.now();
    await harm(page);
    await state.until((s) => !s.drive.is_on && s.drive.fault !== "");
    const took = Date.now() - begun;
    state.close();
    claim(took <= 1500, `${name}: drive off and fault latched after ${took} ms`);
  } finally {
    child.kill("SIGKILL");
  }
}

/** A viewer without a browser: the state of the panel. */
async function watch(base) {
  const { WebSocket } = await import("ws");
  const socket = new WebSocket(`ws://${base.host}/socket`, { origin: base.origin });
  let state = null;
  socket.on("open", () => socket.send(Buffer.from(base.hash.slice(1))));
  socket.on("message", (data) => {
    if (data[0] === 3) state = JSON.parse(data.subarray(1).toString());
  });
  const until = async (condition) => {
    for (let k = 0; k < 2000; k++) {
      if (state && condition(state)) return;
      await pause(5);
    }
    throw new Error("the state did not come");
  };
  return { until, close: () => socket.close() };
}

const browser = await puppeteer.launch({ executablePath: chromium, headless: true, protocolTimeout: 900_000, args: ["--no-sandbox", "--lang=en"] });
try {
  await loop(browser, "en");
  await loop(browser, "uk");
  await dead(browser, "frozen main thread", (page) => void page.evaluate(() => { for (const until = Date.now() + 4000; Date.now() < until;); }).catch(() => {}));
  await dead(browser, "page closed", (page) => page.close());
  await dead(browser, "reload", (page) => page.reload());
  await dead(browser, "other tab in front", async () => { await (await browser.newPage()).bringToFront(); });
} finally {
  await browser.close();
}
process.exit(0);
