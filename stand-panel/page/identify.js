// The loop: model, compare, explain, candidates, add an effect, and the staircase of the error.
import { on, readLog, request } from "./connection.js";
import { attemptIn, byId, element, english, svgFigure, table } from "./dom.js";
import { commandLineText, comparison, judgement, verdict } from "./explanation.js";
import { hasFailed, jobError } from "./fields.js";
import { buildImport, startImport } from "./import.js";
import { clearResiduals, showResiduals } from "./residuals.js";
import { clearSignature, showSignature } from "./signature.js";
import { number, parse, text } from "./text.js";

let log = "";
let model = "model.toml";
/** @type {any} */
let parameters = null;
/** @type {{answer: string, effects: string[], ratio: number, kind: string}[]} */
let steps = [];
/** @type {Map<string, any>} the last fit of each model: its answer, with its name as `file` */
const fits = new Map();
/** @type {any} the answer that is shown */
let shown = null;
let handled = 0;
/** Jobs whose progress and answer belong to this view. */
const JOBS = ["compare", "fit", "explain", "signature"];

const attempt = attemptIn("identify-error");

const button = (/** @type {string} */ key, /** @type {() => Promise<any>} */ action, /** @type {any} */ more = {}) =>
  element("button", { type: "button", onclick: () => attempt(action), ...more }, text(key));

export async function buildIdentify() {
  byId("view-identify").replaceChildren(
    element("p", { id: "identify-error", class: "error", role: "alert", hidden: true }),
    element("div", { class: "row" },
      element("label", {}, text("log"), element("select", { id: "log-choice", onchange: (/** @type {any} */ e) => { log = e.target.value; } })),
      element("label", {}, text("model"), element("select", { id: "model-choice", onchange: (/** @type {any} */ e) => { model = e.target.value; attempt(loadModel); } })),
      button("compare", () => start("compare", {}), { id: "compare", class: "main" }),
      button("fit", () => start("compare", { fit: true }), { id: "fit" }),
      button("explain", () => start("explain", {}), { id: "explain" }),
      element("span", { id: "job-identify", class: "row", hidden: true }, element("span", { class: "job-stage", role: "status" }), button("cancel", () => request("cancel", {}), { id: "cancel" }))),
    buildImport(() => log, async (name) => {
      log = name;
      await loadSession();
    }),
    element("div", { class: "two" },
      element("div", {}, element("section", { id: "staircase", "aria-label": text("staircase") }), element("section", { id: "model" })),
      element("div", {}, element("section", { id: "effect" }), element("section", { id: "answer" }, element("div", { id: "answer-text", "aria-live": "polite" }), element("div", { id: "answer-plots" })))));
  await loadSession();
}

async function loadSession() {
  const session = await request("session");
  const offer = (/** @type {string} */ id, /** @type {{name: string}[]} */ files, /** @type {string} */ chosen, /** @type {string} */ none) => {
    const names = files.map(({ name }) => name);
    const value = names.includes(chosen) ? chosen : (names.at(-1) ?? "");
    byId(id).replaceChildren(...(names.length === 0 ? [element("option", { value: "" }, text(none))] : names.map((name) => element("option", { value: name, selected: name === value }, name))));
    return value;
  };
  log = offer("log-choice", session.logs, log, "no_log");
  model = offer("model-choice", session.models, model, "model");
  if (steps.length === 0) await restore(session.answers.map((/** @type {any} */ file) => file.name));
  await loadModel();
  showStaircase();
  if (shown) await showAnswer(shown);
}

/** Shows a log of the session in this view, with its own model if it has one. @param {string} name @param {string|null} ownModel */
export async function openLog(name, ownModel) {
  log = name;
  model = ownModel ?? model;
  byId("tab-identify").click();
  await loadSession();
}

/** The staircase of earlier comparisons, and the last of them: the answers are files of the session. @param {string[]} names */
async function restore(names) {
  const order = (/** @type {string} */ name) => Number(name.match(/-(\d+)\.json$/)?.[1] ?? 0);
  const own = names.filter((name) => /^(compare|fit)-\d+\.json$/.test(name)).sort((a, b) => order(a) - order(b));
  for (const name of own.slice(-20)) {
    shown = await request(`answer?name=${name}`);
    addStep(name, shown);
  }
}

const worst = (/** @type {any} */ answer) => Math.max(...Object.values(answer.outputs).map((/** @type {any} */ output) => output.ratio ?? 0));

/** @param {string} name @param {any} answer */
function addStep(name, answer) {
  if (answer.parameters && answer.outputs) fits.set(answer.model, { ...answer, file: name });
  if (!answer.outputs || steps.some((step) => step.answer === name)) return;
  steps.push({ answer: name, effects: answer.model_effects ?? [], ratio: worst(answer), kind: name.split("-")[0] });
}

/** @param {string} path @param {any} more */
async function start(path, more) {
  if (log === "") throw new Error(text("no_log"));
  await request(path, { log, model, ...more });
}

async function loadModel() {
  parameters = await request(`model?name=${encodeURIComponent(model)}`);
  showModel();
}

/** @param {any} change */
async function edit(change) {
  parameters = await request("model", { name: model, ...change });
  showModel();
}

function showModel() {
  const entries = Object.entries(parameters.parameters);
  const fit = fits.get(model);
  const rows = entries.map(([name, p]) => [name, element("input", { "data-parameter": name, value: number(p.value, 6), inputmode: "decimal", "aria-label": name, title: p.description ?? "" }), uncertainty(fit, name, p), p.unit ?? ""]);
  const effects = parameters.effects.map((/** @type {string} */ effect) => element("li", { class: "row" },
    element("button", { type: "button", onclick: () => attempt(() => showEffect(effect)), "aria-label": `${text("page")}: ${effect}` }, effect), button("remove", () => edit({ remove: effect }), { "aria-label": `${text("remove")}: ${effect}` })));
  const name = element("input", { "aria-label": text("own_name"), placeholder: text("own_name"), size: 12 });
  const torque = element("input", { "aria-label": text("own_expression"), placeholder: text("own_expression"), size: 34, maxlength: 1000, class: "mono" });
  const starts = element("input", { "aria-label": text("own_parameters"), placeholder: text("own_parameters"), size: 34, class: "mono" });
  byId("model").replaceChildren(
    element("h2", {}, `${text("model")}: ${model}`),
    table(text("parameters"), [text("parameter"), text("value"), "± 1σ", text("unit")], rows),
    element("p", { class: "faint" }, `${text("sigma_note")} ${fit ? `${text("last_fit")}: ${fit.file}, ${fit.log}${fit.converged ? "" : `; ${text("not_converged")}`}.` : text("no_fit")}`),
    element("div", { class: "row" }, button("save", save)),
    element("h3", {}, text("effects")), element("ul", {}, ...effects),
    element("h3", {}, text("own_effect")), element("div", { class: "row" }, name, torque, starts,
      button("add", () => edit({ add_expression: { name: name.value.trim(), torque_N_m: torque.value, parameters: startsOf(starts.value) } }))));
}

/** The standard uncertainty of a value that the last fit has found, or why there is none; a value that was changed since has none. @param {any} fit @param {string} name @param {any} parameter */
function uncertainty(fit, name, parameter) {
  const fitted = fit?.parameters[name];
  if (!fitted || Math.abs(fitted.value - parameter.value) > 1e-9 * Math.abs(fitted.value)) return "–";
  if (fit.not_identifiable.includes(name)) return text("not_determined");
  if (fitted.fixed) return text("fixed");
  if (fitted.at_bound) return text("at_bound");
  return fitted.sigma == null ? "–" : element("span", { class: "mono" }, `± ${number(fitted.sigma, 2)}`);
}

/** @param {string} typed `a=0.001 w0=0.5` */
function startsOf(typed) {
  const pairs = typed.split(/\s+/).filter(Boolean).map((pair) => pair.split("="));
  const wrong = pairs.find(([, value]) => !Number.isFinite(parse(value ?? "")));
  if (wrong) throw new Error(`${text("own_parameters")}: ${wrong.join("=")}?`);
  return Object.fromEntries(pairs.map(([name, value]) => [name, parse(value)]));
}

async function save() {
  const changed = [...document.querySelectorAll("[data-parameter]")].map((node) => /** @type {HTMLInputElement} */ (node)).filter((node) => node.value !== node.defaultValue);
  const values = changed.map((node) => [node.dataset.parameter, parse(node.value)]);
  const wrong = values.find(([, value]) => !Number.isFinite(value));
  if (wrong) throw new Error(`${wrong[0]}: ?`);
  if (values.length > 0) await edit({ set: Object.fromEntries(values) });
}

/** One click: the effect, and the fitted values of all parameters with it, if there are any. @param {any} candidate */
async function addEffect(candidate) {
  await edit({ add: candidate.effect });
  const values = Object.entries(candidate.parameters ?? {}).map(([name, p]) => [name, p.value]).filter(([name, value]) => value != null && name in parameters.parameters);
  if (values.length > 0) await edit({ set: Object.fromEntries(values) });
  await start("compare", { fit: true });
}

/** The page of an effect: its card with simulated pictures, and on request its signature in the chosen log. @param {string} name @param {any} [candidate] with values from which its fit starts */
async function showEffect(name, candidate) {
  const { card, plots: pictures } = await request(`effect?name=${encodeURIComponent(name)}`);
  const picture = (/** @type {string} */ svg) => svgFigure(svg, `${card.title}: ${card.shows}`);
  const entry = (/** @type {string} */ key, /** @type {string} */ value) => [element("strong", {}, text(key)), english(value)];
  const starts = Object.entries(candidate?.parameters ?? {}).map(([parameter, p]) => [parameter, p.value]).filter(([, value]) => value != null);
  const close = () => {
    clearSignature();
    byId("effect").replaceChildren();
  };
  clearSignature();
  byId("effect").replaceChildren(element("h2", { lang: "en" }, `${card.title} (${name})`), element("p", { lang: "en" }, card.what),
    element("div", { class: "row" }, button("signature_start", () => start("signature", { effect: name, parameters: Object.fromEntries(starts) }), { id: "signature-start" }), element("button", { type: "button", onclick: close }, text("close"))),
    element("div", { id: "signature" }), ...pictures.map(picture),
    table(card.id, ["", ""], [entry("equation", card.equation), entry("signature", card.shows), entry("experiment", card.experiment), entry("similar", card.looks_like)]));
  byId("effect").scrollIntoView({ block: "nearest" });
}

/** @param {any} answer */
async function showAnswer(answer) {
  shown = answer;
  clearResiduals();
  const place = byId("answer");
  place.dataset.series = answer.series ?? "";
  place.dataset.drawn = "";
  const parts = [];
  place.dataset.verdict = answer.verdict ?? "";
  if (answer.outputs) parts.push(...comparison(answer));
  if (answer.verdict) {
    // The effects that the search has chosen come first: members of a family can be equal in evidence.
    const chosen = (/** @type {any} */ candidate) => Number((answer.missing ?? []).includes(candidate.effect));
    const candidates = [...(answer.candidates ?? [])].sort((a, b) => chosen(b) - chosen(a)).slice(0, 8);
    // What has no evidence is not offered by a click; the command `stand model add` adds any effect.
    const isOffered = (/** @type {any} */ candidate) => candidate.refitted && candidate.refused === null && candidate.delta_bic < 0;
    const rows = candidates.map((/** @type {any} */ candidate) => [candidate.effect, element("span", { class: "mono" }, number(candidate.delta_bic, 5)),
      Object.entries(candidate.parameters ?? {}).map(([name, p]) => `${name} = ${number(/** @type {any} */ (p).value, 4)}`).join(", "),
      judgement(candidate),
      element("span", { class: "row" }, isOffered(candidate) ? button("add", () => addEffect(candidate), { "data-add": candidate.effect, "aria-label": `${text("add")}: ${candidate.effect}` }) : null, button("page", () => showEffect(candidate.effect, candidate), { "data-page": candidate.effect, "aria-label": `${text("page")}: ${candidate.effect}` }))]);
    parts.push(...verdict(answer), table(text("candidates"), [text("effect"), text("evidence"), text("parameters"), text("judgement"), ""], rows), commandLineText(answer.text));
  }
  byId("answer-text").replaceChildren(...parts.filter((part) => part != null));
  byId("answer-plots").replaceChildren();
  if (!answer.series) return;
  const series = await readLog(answer.series);
  // Another answer was chosen meanwhile.
  if (shown !== answer) return;
  showResiduals(byId("answer-plots"), answer, series);
  place.dataset.drawn = answer.series;
}

function showStaircase() {
  const place = byId("staircase");
  if (!place || steps.length === 0) return;
  const top = Math.max(2, ...steps.map(({ ratio }) => ratio));
  const bar = (/** @type {typeof steps[0]} */ step, /** @type {number} */ k) => {
    const height = Math.max(2, (90 * Math.log(Math.max(step.ratio, 1))) / Math.log(top));
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("width", "44");
    svg.setAttribute("height", "92");
    svg.setAttribute("aria-hidden", "true");
    const box = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    for (const [name, value] of Object.entries({ x: 4, width: 36, y: 92 - height, height, fill: step.ratio < 1.2 ? "#007a56" : "#0072b2" })) box.setAttribute(name, String(value));
    svg.append(box);
    const before = steps[k - 1]?.effects ?? [];
    const added = step.effects.filter((effect) => !before.includes(effect));
    const label = k === 0 ? step.effects.join(", ") || text("model") : added.length > 0 ? `+ ${added.join(", ")}` : step.kind;
    const open = () => attempt(async () => showAnswer(await request(`answer?name=${encodeURIComponent(step.answer)}`)));
    return element("div", {}, element("button", { type: "button", "data-answer": step.answer, "aria-label": `${step.answer}: ${number(step.ratio, 3)}, ${label}`, onclick: open }, svg, element("strong", {}, number(step.ratio, 3)), element("br"), label));
  };
  place.replaceChildren(element("h2", {}, text("staircase")), element("div", { class: "steps" }, ...steps.map(bar)));
}

/** @param {any} now the state of the program */
async function follow(now) {
  const { job } = now;
  if (!byId("job-identify")) return;
  const running = job.is_running && JOBS.includes(job.kind);
  byId("job-identify").hidden = !running;
  for (const id of ["compare", "fit", "explain", "signature-start"]) if (byId(id)) byId(id).disabled = job.is_running;
  if (job.is_running || job.number === handled || job.number === 0) return;
  handled = job.number;
  await attempt(async () => {
    if (job.answer && job.kind === "record") log = job.answer;
    if (job.answer && JOBS.includes(job.kind)) {
      const answer = await request(`answer?name=${job.answer}`);
      if (job.kind === "signature") {
        const place = byId("signature");
        if (place) showSignature(place, answer, await readLog(answer.series));
        return;
      }
      addStep(job.answer, answer);
      shown = answer;
    }
    // Values that were typed and not saved stay, unless this view has a new answer.
    if (JOBS.includes(job.kind) || job.kind === "record") await loadSession();
    if (hasFailed(job) && (JOBS.includes(job.kind) || job.kind === "record")) throw jobError(job);
  });
}

export function startIdentify() {
  on("state", follow);
  startImport();
}
