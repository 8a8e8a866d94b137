// The laboratory works of the session: instructions, logs, the answers as a form, check and report. The page has neither true values nor a
// judgement.
import { request } from "./connection.js";
import { attemptIn, byId, download, element, english, table } from "./dom.js";
import { openLog } from "./identify.js";
import { fill, text } from "./text.js";

/** @type {any} the work that is shown */
let work = null;
/** @type {any} its answers as texts, with what was typed, and the SHA-256 of the file that they are from */
let loaded = null;
let isEdited = false;

const attempt = attemptIn("lab-error");
const button = (/** @type {string} */ key, /** @type {() => Promise<any>} */ action, /** @type {any} */ more = {}) => element("button", { type: "button", onclick: () => attempt(action), ...more }, text(key));
const named = (/** @type {string} */ path) => `${path}?name=${encodeURIComponent(work.name)}`;

export async function buildLaboratory() {
  const { works } = await request("works");
  byId("tab-laboratory").hidden = works.length === 0;
  if (works.length === 0) return;
  const choose = async (/** @type {string} */ name) => {
    byId("lab-choice").value = work.name;
    await saveEdited();
    byId("lab-choice").value = name;
    await open(name);
  };
  byId("view-laboratory").replaceChildren(
    element("p", { id: "lab-error", class: "error", role: "alert", hidden: true }),
    element("div", { class: "row", hidden: works.length === 1 }, element("label", {}, text("lab_work"),
      element("select", { id: "lab-choice", onchange: (/** @type {any} */ event) => attempt(() => choose(event.target.value)) }, ...works.map((/** @type {string} */ name) => element("option", { value: name }, name === "." ? text("session_folder") : name))))),
    element("div", { class: "halves" }, element("article", { id: "lab-instructions" }), element("div", {}, element("section", { id: "lab-head" }), element("section", { id: "lab-answers" }))));
  const name = works.includes(work?.name) ? work.name : works[0];
  byId("lab-choice").value = name;
  await attempt(async () => (isEdited && name === work.name ? show() : open(name)));
}

/** @param {string} name of a work */
async function open(name) {
  work = await request(`work?name=${encodeURIComponent(name)}`);
  loaded = null;
  show();
  await load();
}

/** The answers of the file; what was typed is dropped. */
async function load() {
  loaded = await request(named("lab-answers"));
  edited(false);
  showAnswers();
}

function show() {
  const instructions = byId("lab-instructions");
  instructions.lang = work.language;
  // HTML of texts that are part of the program, made without raw HTML.
  instructions.innerHTML = work.instructions;
  for (const wide of instructions.querySelectorAll("pre, table")) wide.tabIndex = 0;
  const log = (/** @type {string} */ name) => element("button", { type: "button", "data-log": name, onclick: () => attempt(() => openLog(name, work.model)) }, name);
  byId("lab-head").replaceChildren(
    element("p", {}, element("strong", {}, work.student), fill("lab_attempt", { attempt: work.attempt })),
    ...(work.sealed ? [] : [element("p", { class: "warn" }, text("lab_practice"))]),
    element("h2", {}, text("lab_logs")), element("div", { class: "row" }, ...work.logs.map(log)));
  byId("lab-answers").replaceChildren();
  if (loaded) showAnswers();
}

/** @param {boolean} now */
function edited(now) {
  isEdited = now;
  if (byId("lab-state")) byId("lab-state").textContent = now ? text("lab_unsaved") : "";
}

/** A field of an entry of the answers. @param {"input"|"textarea"} tag @param {string} name of the entry @param {any} holder @param {string} key @param {any} [more] */
function answerField(tag, name, holder, key, more = {}) {
  const change = () => {
    holder[key] = node.value;
    edited(true);
  };
  const node = element(tag, { "data-entry": name, autocomplete: "off", ...(tag === "textarea" ? { rows: 3 } : { size: 11, inputmode: "decimal" }), ...more, oninput: change });
  node.value = holder[key] ?? "";
  return node;
}

/** A label above a text of several lines. @param {any} label @param {any} area */
const above = (label, area) => element("label", { class: "above" }, label, area);
const inWork = (/** @type {string} */ words) => element("span", { lang: work.language }, words);

function showAnswers() {
  const { answers } = loaded;
  const questions = (/** @type {string} */ when) => work.questions.filter((/** @type {any} */ asked) => asked.when === when).map((/** @type {any} */ asked) => above(inWork(asked.text), answerField("textarea", `questions.${asked.id}`, answers.questions, asked.id)));
  const values = work.hunt ? [element("p", { class: "faint" }, text("lab_probabilities")), ...work.hunt.logs.map(hunt)] : [element("p", { class: "faint" }, text("lab_values_note")), ...work.quantities.map(quantity)];
  byId("lab-answers").replaceChildren(
    element("h2", {}, text("lab_answers")),
    element("fieldset", {}, element("legend", {}, text("lab_before")), ...questions("before")),
    element("fieldset", {}, element("legend", {}, text(work.hunt ? "lab_hunt" : "lab_values")), ...values),
    element("fieldset", {}, element("legend", {}, text("lab_after")), ...questions("after"), above(text("lab_conclusion"), answerField("textarea", "conclusion", answers, "conclusion"))),
    element("div", { class: "row" }, button("lab_save", save, { id: "lab-save" }), button("lab_check", check, { id: "lab-check", class: "main" }), button("lab_report", report, { id: "lab-report" }), button("lab_reload", load, { id: "lab-reload", hidden: true }), element("span", { id: "lab-state", role: "status" })),
    element("p", { class: "faint" }, text("lab_check_note")),
    element("div", { id: "lab-checked", "aria-live": "polite" }));
  edited(isEdited);
}

/** The fields of a measured value. @param {any} asked */
function quantity(asked) {
  const given = loaded.answers.quantities[asked.name];
  const name = `quantities.${asked.name}`;
  // Another unit than the asked one was written by hand; it can be corrected here.
  const unit = given.unit === asked.unit ? element("span", {}, asked.unit === "1" ? "" : asked.unit) : answerField("input", `${name}.unit`, given, "unit", { inputmode: "text", "aria-label": `${asked.name}: ${text("unit")}` });
  return element("div", { class: "quantity" }, element("p", {}, inWork(asked.text), " ", element("code", {}, asked.name)),
    element("div", { class: "row" }, answerField("input", `${name}.value`, given, "value", { "aria-label": `${asked.name}: ${text("value")}` }), element("label", {}, "± U", answerField("input", `${name}.U`, given, "U", { "aria-label": `${asked.name}: U` })), unit),
    above(text("lab_budget"), answerField("textarea", `${name}.budget`, given, "budget")));
}

/** The fields of a log of a hunt. @param {string} log */
function hunt(log) {
  const given = loaded.answers.hunt[log];
  const place = element("div", {});
  const showClasses = () => {
    const words = [...new Set([...Object.keys(given.before), ...Object.keys(given.after)])];
    const cell = (/** @type {string} */ word, /** @type {"before"|"after"} */ time) => answerField("input", `hunt.${log}.${time}.${word}`, given[time], word, { "aria-label": `${log}: ${word}, ${text(time)}` });
    const more = work.hunt.classes.filter((/** @type {any} */ each) => !words.includes(each.class));
    const choice = element("select", { "data-class": log }, ...more.map((/** @type {any} */ each) => element("option", { value: each.class }, each.effects.length > 1 ? `${each.class}: ${each.effects.join(", ")}` : each.class)));
    const add = async () => {
      given.before[choice.value] = "";
      showClasses();
      place.querySelector("tr:last-child input")?.focus();
    };
    place.replaceChildren(
      ...(words.length === 0 ? [] : [table("", [text("lab_class"), text("before"), text("after")], words.map((word) => [english(word), cell(word, "before"), cell(word, "after")]))]),
      element("div", { class: "row" }, element("label", {}, text("lab_class"), choice), button("add", add, { "data-add-class": log, "aria-label": `${text("add")}: ${text("lab_class")}, ${text("lab_log")} ${log}` })));
  };
  showClasses();
  return element("div", { class: "quantity" }, element("h3", {}, `${text("lab_log")} ${log}`), above(text("where_it_fails"), answerField("textarea", `hunt.${log}.reason`, given, "reason", { rows: 2 })), place);
}

async function save() {
  try {
    ({ sha256: loaded.sha256 } = await request("lab-answers", { name: work.name, sha256: loaded.sha256, answers: loaded.answers }));
  } catch (error) {
    // The file was changed by another program.
    if (error.status === 409) byId("lab-reload").hidden = false;
    throw error;
  }
  edited(false);
  byId("lab-state").textContent = text("lab_saved");
}

async function saveEdited() {
  if (isEdited) await save();
}

async function check() {
  await saveEdited();
  const { text: words, problems, code, real_stand: stand } = await request("lab-check", { name: work.name, language: document.documentElement.lang });
  const lines = words.trim().split("\n");
  // On a real stand the first line names it; then come the problems.
  const first = stand ? 1 : 0;
  const isProblem = (/** @type {number} */ k) => k >= first && k < first + problems.length;
  const line = (/** @type {string} */ words, /** @type {number} */ k) => element(k === lines.length - 1 ? "strong" : "p", isProblem(k) ? { class: "warn" } : {}, words);
  byId("lab-checked").dataset.code = code;
  byId("lab-checked").replaceChildren(...lines.map(line));
}

async function report() {
  await saveEdited();
  download(new Blob([await request(named("lab-report"))], { type: "text/html" }), `${work.lab}-report.html`);
}

export function startLaboratory() {
  addEventListener("beforeunload", (event) => isEdited && event.preventDefault());
}
