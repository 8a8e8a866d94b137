// Ten channels at 1 kHz for some minutes in an unattended recording, with the page frozen for 30 s midway: no row is lost, the drive is off
// at the end, memory is flat. node endurance.mjs STAND CHROMIUM FOLDER MINUTES
import { readFile } from "node:fs/promises";
import puppeteer from "puppeteer-core";
import { bench, claim, click, pause, request, watch } from "./bench.mjs";

const [stand, chromium, folder, minutes] = process.argv.slice(2);
const seconds = 60 * Number(minutes);
const FREEZE_S = 30;
const browser = await puppeteer.launch({ executablePath: chromium, headless: true, protocolTimeout: 120_000, args: ["--no-sandbox", "--lang=en", "--js-flags=--expose-gc"] });
const { panel, address, end } = await bench(stand, folder, "endurance");
/** Resident memory of the program, MB. */
const resident = async () => Number((await readFile(`/proc/${panel.pid}/status`, "utf8")).match(/VmRSS:\s+(\d+)/)[1]) / 1024;
try {
  const page = await browser.newPage();
  const debug = await page.createCDPSession();
  /** JavaScript heap of the page after a collection, MB. */
  const heap = async () => {
    await debug.send("HeapProfiler.collectGarbage");
    return (await page.metrics()).JSHeapUsedSize / 2 ** 20;
  };
  await page.goto(address.href);
  await page.waitForFunction(() => document.querySelector("#take") && !document.querySelector("#take").disabled);
  const viewer = await watch(address);
  // Page and program hold 30 s of rows: their memory is that of the running instrument from then on. In a run of one minute the margin
  // covers these rows.
  await pause(seconds > 60 ? 35_000 : 5000);
  await click(page, "#take");
  await page.waitForSelector("#record:not([disabled])");
  await page.$eval("#seconds", (node, value) => { node.value = value; }, String(seconds));
  await page.$eval("#find-index", (node) => { node.checked = false; });
  await click(page, "#unattended");
  await click(page, "#record");
  await viewer.until(({ job, drive }) => job.is_running && drive.is_on, 60_000);
  const begun = performance.now();
  const until = (s) => pause(Math.max(0, begun + 1000 * s - performance.now()));
  await pause(2000);
  const [rss, used] = [await resident(), await heap()];
  await until(seconds / 2 - FREEZE_S / 2);
  const froze = performance.now();
  const thaw = page.evaluate((ms) => { for (const end = Date.now() + ms; Date.now() < end;); }, 1000 * FREEZE_S);
  await pause(1000 * FREEZE_S - 2000);
  claim(viewer.state.job.is_running && viewer.state.drive.is_on, `the page is frozen for ${((performance.now() - froze) / 1000).toFixed(0)} s, and the unattended recording goes on`);
  await thaw;
  await until(seconds - 4);
  const [rssEnd, usedEnd] = [await resident(), await heap()];
  await viewer.until(({ job }) => !job.is_running, 120_000);
  const { job, lost_rows: lost, damaged_frames: damaged } = viewer.state;
  claim(job.error === "" && job.answer !== "", `the recording is complete: ${job.answer} ${job.error}`);
  const bytes = new DataView(await (await request(address, `log?name=${job.answer}`)).arrayBuffer());
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes.buffer, 4, bytes.getUint32(0, true))));
  claim(head.rows === 1000 * seconds && lost === 0 && damaged === 0, `${head.rows} rows of ${head.columns.length} columns, ${lost} lost, ${damaged} frames damaged`);
  await viewer.until(({ drive }) => !drive.is_on);
  claim(true, "the drive is off after it");
  console.log(`memory of the program ${rss.toFixed(0)} → ${rssEnd.toFixed(0)} MB, heap of the page ${used.toFixed(1)} → ${usedEnd.toFixed(1)} MB`);
  claim(rssEnd < 1.25 * rss + 10 && usedEnd < 1.25 * used + 10, "memory is flat");
} finally {
  end();
  browser.process().kill("SIGKILL");
}
process.exit(0);
