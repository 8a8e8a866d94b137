// A log of another program in headless Chromium: its mapping, the comparison, cursors, exports; by keyboard, in both languages. And the
// time until the plots of a log of 30 s are drawn. node logs.mjs STAND CHROMIUM FOLDER [PICTURES] Exit status 0: all claims hold.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import puppeteer from "puppeteer-core";
import { accessible, chromium, claim, focus, folder, panel, pause, picture, pictures, press, stand, tab, text, type } from "./page.mjs";

/** Rows of the log: 30 s at 1 kHz. */
const ROWS = 30_000;

/** The program's log of a simulated stand as another program writes it: semicolons, decimal commas, rpm, and a name that says nothing. */
function foreign() {
  execFileSync(stand, ["sim", "--seconds", String(ROWS / 1000), "--out", "truth.csv"], { cwd: folder });
  const lines = readFileSync(`${folder}/truth.csv`, "utf8").split("\n").filter((line) => line !== "" && !line.startsWith("#"));
  const names = lines[0].split(",");
  const column = (name) => names.indexOf(name);
  const cells = (line) => {
    const at = line.split(",");
    const number = (name, factor) => String(Number(at[column(name)]) * factor).replace(".", ",");
    return [number("t_s", 1e3), number("u_V", 1), number("i_A", 1e3), number("omega_rad_s", 30 / Math.PI), number("theta_rad", 180 / Math.PI)].join(";");
  };
  const rows = lines.slice(1).map(cells);
  return { text: ["Zeit [ms];Spannung [V];Strom [mA];Kanal 4;Winkel [°]", ...rows, ""].join("\n"), rows: rows.length, at: (k) => lines[k + 1].split(",").map(Number), column };
}

const inspect = (session, name) => JSON.parse(execFileSync(stand, ["log", "inspect", name, "--json", "-"], { cwd: `${folder}/${session}`, encoding: "utf8" }));
const shown = (page, id) => page.$eval(`#${id}-cursors`, (node) => node.textContent);
/** Presses a key several times in the element that has the focus. */
async function keys(page, key, count) {
  for (let k = 0; k < count; k++) await page.keyboard.press(key);
}
async function exported(page, id, format) {
  const before = await text(page, `#${id}-message`);
  await press(page, `#${id}-${format}`);
  // It is empty while the file is written.
  await page.waitForFunction((i, old) => { const { textContent: now } = document.querySelector(`#${i}-message`); return now !== old && /export-/.test(now); }, { timeout: 30_000 }, id, before);
  return (await text(page, `#${id}-message`)).match(/export-\d+\.\w+/)[0];
}

async function main(browser, language, log) {
  const session = `logs-${language}`;
  const { child, address } = await panel(session);
  const page = await browser.newPage();
  const problems = [];
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => message.type() === "error" && !/status of 4(09|22)/.test(message.text()) && problems.push(message.text()));
  page.on("dialog", (dialog) => problems.push(`dialog: ${dialog.message()}`));
  try {
    await page.setViewport({ width: 1360, height: 900 });
    await page.goto(address);
    await page.evaluate((l) => localStorage.setItem("language", l), language);
    await page.reload();
    await page.waitForFunction((l) => document.documentElement.lang === l && document.querySelector("#import-open"), {}, language);
    await live(page, session);
    await tab(page, "live", 1);
    if (language === "en") await drop(page, log);
    else await choose(page, log);
    const name = await mapping(page, session, language, log);
    await compare(page, session, language, name, log);
    if (language === "en") await drawingTime(page);
    const requests = readFileSync(`${folder}/${session}/commands.txt`, "utf8");
    claim(requests.includes(`stand log inspect ${name} --map 'Kanal 4=omega_rad_s' --unit 'Kanal 4=rpm' --accept`), "the mapping is a command for a shell");
    claim(problems.length === 0, `no error in the page's console: ${problems}`);
  } finally {
    await page.close();
    child.kill("SIGKILL");
  }
}

/** Cursors and exports of the running stand. */
async function live(page, session) {
  await page.waitForFunction(() => document.querySelectorAll("#values tbody tr").length >= 8 && Number.parseFloat(document.querySelector("#values tbody td:nth-child(2)").textContent) !== null, { timeout: 20_000 });
  await pause(3000);
  await press(page, "#pause");
  // What was under way when the page was paused is still drawn, and a cursor begins in the middle of what is shown.
  await pause(500);
  await focus(page, "#plots figure");
  await page.keyboard.press("a");
  await page.keyboard.press("b");
  await keys(page, "ArrowRight", 5);
  claim(/Δt = 0[.,]005 s; 1\/Δt = 200 /.test(await shown(page, "live")), `five samples from A to B: ${await shown(page, "live")}`);
  // By mouse: a click sets A, with Shift B.
  const box = await (await page.$("#plots figure .u-over")).boundingBox();
  await page.mouse.click(box.x + 0.25 * box.width, box.y + 40);
  await page.keyboard.down("Shift");
  await page.mouse.click(box.x + 0.75 * box.width, box.y + 40);
  await page.keyboard.up("Shift");
  const range = Number((await shown(page, "live")).match(/Δt = ([\d.,]+) s/)[1].replace(",", "."));
  await press(page, "#live-zoom");
  const parquet = await exported(page, "live", "parquet");
  const found = inspect(session, parquet);
  claim(found.is_own && found.gaps === 0 && Math.abs(found.rows / 1000 / (1.04 * range) - 1) < 0.02, `${parquet} has ${found.rows} rows of ${range} s between the cursors and their margin`);
  await press(page, "#live-whole");
  const csv = inspect(session, await exported(page, "live", "csv"));
  claim(csv.rows > found.rows && csv.columns.length === found.columns.length, `the whole as CSV has ${csv.rows} rows`);
  await picture(page, `cursors-${session}`);
  await press(page, "#live-clear");
  await press(page, "#pause");
}

/** Drops a file whose name is markup. */
async function drop(page, log) {
  const hostile = 'Prüfstand <img src=x onerror=alert(1)> 1.csv';
  await page.evaluate((contents, name) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([contents], name, { type: "text/csv" }));
    for (const kind of ["dragover", "drop"]) document.querySelector("#view-identify").dispatchEvent(new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer }));
  }, log.text, hostile);
}

/** Chooses the file by the button. */
async function choose(page, log) {
  mkdirSync(`${folder}/files`, { recursive: true });
  const path = `${folder}/files/Журнал.csv`;
  writeFileSync(path, log.text);
  await focus(page, "#import-open");
  const waiting = page.waitForFileChooser();
  // Until the browser reports choosers instead of opening them.
  await pause(500);
  await page.keyboard.press("Enter");
  await (await waiting).accept([path]);
}

/** Corrects what is believed about the columns and accepts it; the name of the log. */
async function mapping(page, session, language, log) {
  await page.waitForSelector("#import-accept", { timeout: 30_000 });
  const title = await text(page, "#import-title");
  const name = title.match(/[\w.-]+\.csv/)[0];
  claim(/^[A-Za-z0-9._-]+$/.test(name) && existsSync(`${folder}/${session}/${name}`), `the file is in the session: ${name}`);
  claim((await page.$$("#import img")).length === 0, "a name that is markup is text");
  const before = await page.$$eval("#import-form tbody tr", (rows) => rows.map((row) => [...row.querySelectorAll("input")].map((input) => input.value)));
  claim(JSON.stringify(before.filter((_, k) => k !== 3)) === JSON.stringify([["t_s", "ms"], ["u_V", "V"], ["i_A", "mA"], ["theta_rad", "°"]]), `what is believed: ${JSON.stringify(before)}`);
  await type(page, "#import-is-4", "omega_rad_s");
  await page.keyboard.press("Tab");
  await page.waitForFunction(() => /rad\/s|rpm/.test(document.querySelector("#import-unit-4").value));
  await type(page, "#import-unit-4", "banana");
  await page.keyboard.press("Tab");
  await page.waitForSelector("#import-error:not([hidden])");
  claim(/banana/.test(await text(page, "#import-error")), `a wrong unit is named: ${await text(page, "#import-error")}`);
  await type(page, "#import-unit-4", "rpm");
  await page.keyboard.press("Tab");
  await page.waitForFunction(() => /4=rpm/.test(document.querySelector("#import-form code").textContent));
  await type(page, "#import-note", "u_V=at t");
  await press(page, "#import-note-add");
  await press(page, "[data-remove-note='u_V']");
  await page.waitForFunction(() => document.querySelector("[data-remove-note]") === null && !/--note/.test(document.querySelector("#import-form code").textContent));
  claim(true, "a note on a column is added and removed");
  await picture(page, `mapping-${language}`);
  if (language === "en") await accessible(page, "mapping of columns");
  await press(page, "#import-accept");
  await page.waitForFunction((n) => document.querySelector("#log-choice").value === n, { timeout: 30_000 }, name);
  const found = inspect(session, name);
  claim(found.is_mapped && found.open === null && found.rows === log.rows, "the command line reads the log by the accepted mapping");
  return name;
}

/** Compares, and examines the plots. */
async function compare(page, session, language, name, log) {
  await press(page, "#compare");
  await page.waitForFunction(() => document.querySelector("#answer").dataset.drawn?.startsWith("compare"), { timeout: 120_000 });
  const captions = await page.$$eval("#answer figcaption", (all) => all.map((node) => node.textContent));
  claim(captions.some((caption) => / s, (rms|СКЗ) /.test(caption)) && captions.some((caption) => /± .*rad\/s/.test(caption)), `the worst places are named: ${captions.length} captions`);
  const profiles = await page.$$eval("#answer .pair", (all) => all.map((node) => node.querySelectorAll("figure").length));
  claim(profiles.length >= 2 && profiles.every((count) => count >= 4), `plots over coordinates and orders: ${profiles}`);
  await focus(page, "#answer figure details summary");
  claim(await page.$eval("#answer figure:has(:focus) .tip", (tip) => getComputedStyle(tip).display === "block" && /: /.test(tip.textContent)), "the focus names the worst place over its plot");
  await page.keyboard.press("Enter");
  await page.waitForSelector("#answer figure details[open] tbody tr");
  claim((await page.$$eval("#answer figure details[open] tbody tr", (rows) => rows.length)) >= 14, "the table of a plot opens by keyboard");
  await focus(page, "#answer figure");
  await page.keyboard.press("a");
  await page.keyboard.press("b");
  await keys(page, "ArrowRight", 3);
  await page.keyboard.press("+");
  const caption = await shown(page, "answer");
  const A = Number(caption.match(/A = ([\d.,]+) s/)[1].replace(",", "."));
  const row = await page.$$eval("#answer-table tbody tr", (rows) => rows.map((r) => [...r.children].map((cell) => cell.textContent)));
  const rate = row.find(([channel]) => channel === "omega_rad_s").map((cell) => Number(cell.replace(",", ".")));
  const k = Math.round(A * 1000);
  const [a, b] = [k, k + 3].map((n) => log.at(n)[log.column("omega_rad_s")]);
  claim(Math.abs(rate[2] - a) < 1e-5 * Math.abs(a) + 1e-9 && Math.abs(rate[4] - (b - a)) < 1e-3 * Math.abs(b - a) + 1e-5, `values at A and B are those of the file: ${rate.slice(2)}`);
  await press(page, "#answer-zoom");
  const parquet = inspect(session, await exported(page, "answer", "parquet"));
  claim(parquet.rows === 4 && parquet.columns.some((column) => column.name === "omega_rad_s_residual"), `zoomed to single samples, the export has ${parquet.rows} rows`);
  if (language === "en") await spike(page);
  await png(page);
  await press(page, "#answer-whole");
  await page.$eval("#answer", (node) => node.scrollIntoView());
  await picture(page, `residuals-${language}`);
  await page.$eval("#answer .pair", (node) => node.scrollIntoView());
  await page.waitForFunction(() => document.querySelectorAll("#answer .pair canvas").length >= 4);
  await picture(page, `profiles-${language}`);
  if (language === "en") await accessible(page, "residuals");
}

/** One sample of 30 000 is visible: its column of pixels reaches the top. */
async function spike(page) {
  const heights = await page.evaluate(async (rows) => {
    const { Plot } = await import("/plot.js");
    const place = document.createElement("div");
    document.body.append(place);
    const plot = new Plot(place, { title: "spike", series: [{ label: "x", unit: "V" }] });
    const result = [];
    for (const at of [1, 777, 15_000, rows - 2]) {
      const values = new Float64Array(rows);
      values[at] = 1;
      plot.set([Float64Array.from(values, (_, k) => k / 1000), values]);
      await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
      const { ctx, bbox } = plot.plot;
      const x = Math.round(plot.plot.valToPos(at / 1000, "x", true));
      const { data } = ctx.getImageData(x - 2, bbox.top, 5, bbox.height);
      let coloured = 0;
      for (let y = 0; y < bbox.height; y++) for (let column = 0; column < 5; column++) {
        const [red, green, blue] = data.slice(4 * (5 * y + column));
        if (red < 120 && green < 180 && blue > 120) { coloured++; break; }
      }
      result.push(coloured / bbox.height);
    }
    plot.destroy();
    place.remove();
    return result;
  }, ROWS);
  claim(heights.every((height) => height > 0.75), `a spike of one sample of ${ROWS} is drawn over ${heights.map((h) => h.toFixed(2))} of the height`);
}

/** The plots as a picture. */
async function png(page) {
  const client = await page.createCDPSession();
  const downloads = pictures ?? folder;
  await client.send("Page.setDownloadBehavior", { behavior: "allow", downloadPath: downloads });
  const before = readdirSync(downloads).filter((file) => file.endsWith(".png")).length;
  await press(page, "#answer-png");
  for (let k = 0; k < 100 && readdirSync(downloads).filter((file) => file.endsWith(".png")).length === before; k++) await pause(50);
  const file = readdirSync(downloads).find((f) => /^plots.*\.png$/.test(f));
  claim(file && readFileSync(`${downloads}/${file}`).subarray(1, 4).toString() === "PNG", "the plots are exported as PNG");
}

/** From the click on an answer of 30 s until its plots are drawn and the page has reacted to a key, the median of five. */
async function drawingTime(page) {
  const times = [];
  for (let k = 0; k < 5; k++) {
    times.push(await page.evaluate(async () => {
      const answer = document.querySelector("#answer");
      answer.dataset.drawn = "";
      const begun = performance.now();
      document.querySelector("[data-answer]").click();
      const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
      do await frame(); while (answer.dataset.drawn !== answer.dataset.series || answer.dataset.drawn === "");
      const plot = document.querySelector("#answer figure");
      plot.dispatchEvent(new KeyboardEvent("keydown", { code: "KeyA", key: "a" }));
      await frame();
      await frame();
      if (document.querySelector("#answer-A").value === "") throw new Error("the plot does not react");
      return performance.now() - begun;
    }));
  }
  times.sort((a, b) => a - b);
  // Those that are out of sight are drawn when they are scrolled to.
  const plots = await page.$$eval("#answer canvas", (all) => all.length);
  // A time of this machine is printed, not judged.
  claim(plots >= 6, `a log of ${ROWS / 1000} s with its residuals is drawn and reacts after ${times.map((t) => t.toFixed(0))} ms`);
}

const log = foreign();
const browser = await puppeteer.launch({ executablePath: chromium, headless: true, protocolTimeout: 900_000, args: ["--no-sandbox", "--lang=en"] });
try {
  for (const language of ["en", "uk"]) await main(browser, language, log);
} finally {
  await browser.close();
}
process.exit(0);
