// A panel, and its page by keyboard alone, for the browser tests: node TEST.mjs STAND CHROMIUM FOLDER [PICTURES].
// STAND: the program; CHROMIUM: the browser; FOLDER: an empty folder for sessions; PICTURES: folder for screenshots.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { claim, pause, started } from "./bench.mjs";

export { claim, pause };

export const [stand, chromium, folder, pictures] = process.argv.slice(2);
const axe = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

export async function panel(name) {
  const { child, line } = await started(stand, ["panel", "--hidden", "cogging", "--folder", name], folder);
  return { child, address: line };
}

/** Moves the focus with Tab until the element has it. */
export async function focus(page, selector) {
  await page.waitForSelector(`${selector}:not([disabled])`, { timeout: 600_000 });
  for (let k = 0; k < 400; k++) {
    if (await page.evaluate((s) => document.activeElement?.matches(s), selector)) return;
    await page.keyboard.press("Tab");
  }
  throw new Error(`Tab does not reach ${selector}`);
}
export async function press(page, selector, key = "Enter") {
  await focus(page, selector);
  await page.keyboard.press(key);
}
export async function type(page, selector, value) {
  await focus(page, selector);
  await page.keyboard.down("Control");
  await page.keyboard.press("a");
  await page.keyboard.up("Control");
  await page.keyboard.type(value);
}
export async function tab(page, from, steps) {
  await focus(page, `#tab-${from}`);
  for (let k = 0; k < steps; k++) await page.keyboard.press("ArrowRight");
}
/** Waits until the condition holds; an error that the view of identification shows meanwhile ends the test in its words. */
export async function shown(page, condition, ...values) {
  const ends = new AbortController();
  const options = { timeout: 600_000, signal: ends.signal };
  const error = page.waitForSelector("#identify-error:not([hidden])", options).then(async () => { throw new Error(`the page says: ${await text(page, "#identify-error")}`); });
  try {
    await Promise.race([page.waitForFunction(condition, options, ...values), error]);
  } finally {
    ends.abort();
  }
}
export const text = (page, selector) => page.$eval(selector, (node) => node.textContent);
export async function picture(page, name) {
  if (pictures) await page.screenshot({ path: `${pictures}/${name}.png` });
}
/** Text of the page in the language of the page: what is marked as English, what a person has typed, code and names are left out. Three words in Latin letters in a row are English. */
export async function untranslated(page, view) {
  const found = await page.evaluate(() => {
    const all = [];
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = walker.nextNode(); node; node = walker.nextNode()) {
      const parent = node.parentElement;
      if (parent.closest("[lang=en], code, pre, option, script, [hidden]")) continue;
      if (/(?:^|[\s("«])[A-Za-z]{2,}(?:[ ,]+[A-Za-z]{2,}){2,}/.test(node.textContent)) all.push(node.textContent.slice(0, 120));
    }
    return all;
  });
  claim(found.length === 0, `no English sentence in the view ${view} ${found.join(" | ")}`);
}
export async function accessible(page, view) {
  // The policy of the page admits no script of others; the test's own comes through the debugger.
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "wcag21aa", "wcag22aa"] }));
  const serious = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
  for (const found of serious) console.log(found.id, found.help, found.nodes.map((node) => node.html.slice(0, 160)));
  claim(serious.length === 0, `axe-core has no serious finding in the view ${view}`);
}

