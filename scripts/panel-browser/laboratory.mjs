// The laboratory works of a session in headless Chromium: instructions, answers, check, report, and the refusal of an early explain; by
// keyboard, in both languages. node laboratory.mjs STAND CHROMIUM FOLDER [PICTURES] Exit status 0: all claims hold.
import { execFileSync } from "node:child_process";
import { appendFileSync, existsSync, readFileSync } from "node:fs";
import puppeteer from "puppeteer-core";
import { accessible, chromium, claim, focus, folder, panel, pause, picture, press, stand, tab, text, type, untranslated } from "./page.mjs";

const VALUE = "[data-entry='quantities.motor_constant_N_m_A.value']";

async function shownAs(page, name) {
  await pause(200);
  await picture(page, name);
}

async function works(browser, language) {
  const session = `lab-${language}`;
  for (const [lab, out] of [["motor", session], ["hunt", `${session}/hunt`]]) execFileSync(stand, ["lab", "start", lab, "--student", "Olena K.", "--language", language, "--out", out], { cwd: folder });
  const file = `${folder}/${session}/answers.toml`;
  const { child, address } = await panel(session);
  const page = await browser.newPage();
  const problems = [];
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("console", (message) => message.type() === "error" && !/status of 4(09|22)/.test(message.text()) && problems.push(message.text()));
  try {
    await page.setViewport({ width: 1360, height: 900 });
    await page.goto(address);
    await page.waitForSelector("#tab-laboratory:not([hidden])");
    await focus(page, "#language");
    await page.keyboard.press(language === "uk" ? "ArrowDown" : "ArrowUp");
    await page.waitForFunction((l) => document.documentElement.lang === l, {}, language);
    await tab(page, "live", 4);
    await page.waitForSelector(VALUE);
    claim(/^1?\.? ?.*K, R, L/.test(await text(page, "#lab-instructions h2")), "the instructions are shown");
    await shownAs(page, `laboratory-${language}`);
    await type(page, VALUE, language === "uk" ? "0,02340" : "0.02340");
    await press(page, "#lab-save");
    await page.waitForFunction(() => /answers\.toml/.test(document.querySelector("#lab-state").textContent));
    claim(readFileSync(file, "utf8").includes("value = 0.02340\n"), "the value is in answers.toml as it was typed");
    await press(page, "#lab-check");
    await page.waitForSelector("#lab-checked[data-code]");
    const code = await page.$eval("#lab-checked", (node) => node.dataset.code);
    claim((await text(page, "#lab-checked strong")).includes(code.slice(0, 16)) && readFileSync(`${folder}/${session}/lab-journal.jsonl`, "utf8").trim().split("\n").length === 2, `the check is in the journal, its code on the page: ${code.slice(0, 16)}`);
    await page.$eval("#lab-checked", (node) => node.scrollIntoView({ block: "end" }));
    await shownAs(page, `laboratory-check-${language}`);
    if (language === "en") await accessible(page, "laboratory");
    else await untranslated(page, "laboratory");
    const downloads = await browser.target().createCDPSession();
    await downloads.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: `${folder}/${session}` });
    await press(page, "#lab-report");
    for (let k = 0; k < 100 && !existsSync(`${folder}/${session}/motor-report.html`); k++) await pause(100);
    claim(readFileSync(`${folder}/${session}/motor-report.html`, "utf8").includes("Olena K."), "the report is saved");
    appendFileSync(file, "# by hand\n");
    await type(page, VALUE, "0.03");
    await press(page, "#lab-save");
    await page.waitForSelector("#lab-error:not([hidden])");
    claim(/changed/.test(await text(page, "#lab-error")) && readFileSync(file, "utf8").includes("0.02340"), "a file that was changed by hand is not overwritten");
    await press(page, "#lab-reload");
    await page.waitForFunction((value) => document.querySelector(value).value === "0.02340", {}, VALUE);
    await focus(page, "#lab-choice");
    await page.keyboard.press("ArrowDown");
    await focus(page, "[data-class='A']");
    await page.keyboard.type("cog");
    await press(page, "[data-add-class='A']");
    await page.waitForSelector("[data-entry='hunt.A.before.cogging']");
    await type(page, "[data-entry='hunt.A.before.cogging']", "0.7");
    await page.$eval("[data-add-class='A']", (node) => node.scrollIntoView({ block: "center" }));
    await shownAs(page, `laboratory-hunt-${language}`);
    // The Ukrainian instructions of the hunt quote headings of the program, which are English.
    if (language === "en") await accessible(page, "laboratory, hunt");
    await press(page, "[data-log='hunt/logs/A.parquet']");
    await page.waitForFunction(() => document.querySelector("#log-choice").value === "hunt/logs/A.parquet" && document.querySelector("#model-choice").value === "hunt/model.toml" && !document.querySelector("#view-identify").hidden);
    await press(page, "#explain");
    await page.waitForSelector("#identify-error:not([hidden])");
    claim(/work `hunt`/.test(await text(page, "#identify-error")), "a log of a hunt opens in Identify, and its explanation is refused before the own answers");
    await shownAs(page, `laboratory-refused-${language}`);
    claim(problems.length === 0, `no error in the page's console: ${problems}`);
  } finally {
    await page.close();
    child.kill("SIGKILL");
  }
}

const browser = await puppeteer.launch({ executablePath: chromium, headless: true, protocolTimeout: 900_000, args: ["--no-sandbox", "--lang=en"] });
try {
  await works(browser, "en");
  await works(browser, "uk");
} finally {
  await browser.close();
}
process.exit(0);
