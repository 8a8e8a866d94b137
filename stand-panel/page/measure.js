// The other measurements: Allan deviation, drift session, calibration session. Each is a job of the program; results are a table, the
// pictures of the report and its text.
import { drives, on, request, state, takeControl } from "./connection.js";
import { attemptIn, byId, element, english, svgFigure, table } from "./dom.js";
import { commandLineText, remarkList } from "./explanation.js";
import { field, hasFailed, jobError, showControl, typed } from "./fields.js";
import { fill, number, parse, sentence, text } from "./text.js";

const KINDS = ["allan", "drift", "calibrate"];
const DEVICES = { drive: "device_drive", gyro: "device_gyro", accel: "device_accel" };
/** @type {any} the answer that is shown, and its name */
let shown = null;
let handled = 0;
/** @type {{name: string, seconds: number}[]} steps of the calibration session */
let steps = [];
const chosen = { log: "", column: "" };

const attempt = attemptIn("measure-error");

const input = (/** @type {string} */ id, /** @type {string} */ value) => element("input", { id, value, autocomplete: "off" });
const button = (/** @type {string} */ key, /** @type {() => Promise<any>} */ action) => element("button", { type: "button", id: key.replace("_", "-"), class: "main measure-start", onclick: () => attempt(action) }, text(key));
const places = (/** @type {string} */ id) => element("select", { id }, element("option", { value: "simulated" }, text("place_simulated")), element("option", { value: "stand" }, text("place_stand")));

export async function buildMeasure() {
  byId("view-measure").replaceChildren(
    element("p", { id: "measure-error", class: "error", role: "alert", hidden: true }),
    element("div", { class: "two" },
      element("div", {},
        element("fieldset", {}, element("legend", {}, text("control")), element("p", { id: "measure-driver" }),
          element("button", { type: "button", id: "measure-take", onclick: takeControl }, text("take_control"))),
        element("fieldset", {}, element("legend", {}, text("allan")),
          field("log", element("select", { id: "allan-log", onchange: (/** @type {any} */ e) => attempt(() => loadColumns(e.target.value)) })),
          field("column", element("select", { id: "allan-column", onchange: (/** @type {any} */ e) => { chosen.column = e.target.value; } })),
          element("div", { class: "row" }, button("allan_start", startAllan)),
          field("seconds", input("still-seconds", "60")),
          element("button", { type: "button", id: "still-start", onclick: () => attempt(recordStill) }, text("still_start"))),
        element("fieldset", {}, element("legend", {}, text("drift")),
          field("place", places("drift-place")), field("cycles", input("drift-cycles", "10")), field("pulse_s", input("drift-pulse", number(5))), field("rest_s", input("drift-rest", number(4))),
          field("rates_deg_s", input("drift-rates", [0.05, 0.02].map((rate) => number(rate)).join("; "))), field("positions_deg", input("drift-positions", "0; 180")),
          field("latitude_deg", input("drift-latitude", "")), button("drift_start", startDrift)),
        element("fieldset", {}, element("legend", {}, text("calibration")),
          field("place", places("calibrate-place")),
          field("device", element("select", { id: "calibrate-kind", onchange: () => attempt(loadSteps) }, ...Object.entries(DEVICES).map(([kind, key]) => element("option", { value: kind }, text(key))))),
          field("serial", input("calibrate-serial", "")), field("operator", input("calibrate-operator", "")), field("seed", input("calibrate-seed", "1")),
          button("calibrate_start", startCalibration), element("div", { id: "calibrate-interrupted" }), element("div", { id: "calibrate-steps" }))),
      element("div", {},
        element("fieldset", { id: "job-measure", hidden: true }, element("legend", {}, text("running")), element("p", { class: "job-stage", role: "status" }), element("progress", { class: "job-progress", max: 1, "aria-label": text("running") }),
          element("div", { id: "job-asks", class: "row", role: "alert", hidden: true }, element("strong", { id: "job-asks-text" }), input("job-remark", ""), element("button", { type: "button", id: "job-reply", class: "main", onclick: () => attempt(reply) }, text("done"))),
          element("button", { type: "button", id: "measure-cancel", onclick: () => attempt(() => request("cancel", {})) }, text("cancel"))),
        element("section", { id: "measure-answer", "aria-live": "polite" }, element("p", { class: "faint" }, text("no_measurement"))))));
  byId("job-remark").setAttribute("aria-label", text("remark"));
  await loadSteps();
  await loadSession();
  show(state);
  if (shown) await showAnswer(shown.name, shown.answer);
}

async function loadSession() {
  const { logs, interrupted } = await request("session");
  showInterrupted(interrupted);
  const names = logs.map((/** @type {any} */ file) => file.name);
  const log = names.includes(chosen.log) ? chosen.log : (names.at(-1) ?? "");
  byId("allan-log").replaceChildren(...(names.length === 0 ? [element("option", { value: "" }, text("no_log"))] : names.map((/** @type {string} */ name) => element("option", { value: name, selected: name === log }, name))));
  if (log !== "") await loadColumns(log);
}

/** The calibration sessions that can be continued. @param {{name: string, kind: string, serial: string, done: number, steps: [string, number][]}[]} sessions */
function showInterrupted(sessions) {
  const row = (/** @type {typeof sessions[0]} */ session) => {
    const words = fill("interrupted_session", { name: session.name, done: session.done, steps: session.steps.length });
    const resume = async () => {
      await request("resume", { client: client(), name: session.name });
      byId("calibrate-kind").value = session.kind;
      steps = session.steps.map(([name, seconds]) => ({ name, seconds }));
      showSteps(state?.job);
    };
    return element("div", { class: "row" }, element("span", {}, `${words}${session.serial === "" ? "" : ` (${session.serial})`}`),
      element("button", { type: "button", class: "measure-start", "data-resume": session.name, "aria-label": `${text("resume_session")}: ${session.name}`, onclick: () => attempt(resume) }, text("resume_session")));
  };
  byId("calibrate-interrupted").replaceChildren(...(sessions.length === 0 ? [] : [element("h3", {}, text("interrupted")), ...sessions.map(row)]));
}

/** @param {string} log */
async function loadColumns(log) {
  chosen.log = log;
  const { columns } = await request(`columns?name=${encodeURIComponent(log)}`);
  const sensors = columns.filter((/** @type {string} */ name) => name !== "t_s");
  if (!sensors.includes(chosen.column)) chosen.column = sensors.find((/** @type {string} */ name) => /rate|gyro|omega/.test(name)) ?? sensors[0] ?? "";
  byId("allan-column").replaceChildren(...sensors.map((/** @type {string} */ name) => element("option", { value: name, selected: name === chosen.column }, name)));
}

async function loadSteps() {
  ({ steps } = await request(`steps?kind=${byId("calibrate-kind").value}`));
  showSteps(state?.job);
}

/** The steps with their state. @param {any} job */
function showSteps(job) {
  const place = byId("calibrate-steps");
  if (!place) return;
  const isOurs = job?.kind === "calibrate";
  const stage = isOurs ? job.stage : { kind: "" };
  const at = stage.kind === "step" ? stage.number : stage.kind === "record" ? steps.length + 1 : 0;
  const stateOf = (/** @type {number} */ k) => (at === 0 ? "step_waits" : k + 1 < at || (!job.is_running && job.answer) ? "step_done" : k + 1 > at ? "step_waits" : job.is_running ? "step_runs" : "step_ended");
  const states = steps.map((_, k) => stateOf(k));
  // Rebuilt only after a change: a screen reader reads it again otherwise.
  const key = document.documentElement.lang + steps.map((step) => step.name).join() + states.join();
  if (place.dataset.key === key) return;
  place.dataset.key = key;
  place.replaceChildren(table(text("steps"), [text("step"), "s", text("state")], steps.map((step, k) => [step.name, step.seconds, text(states[k])])));
}

/** Numbers separated by semicolons; a comma is a decimal sign. @param {string} id @param {string} key */
function typedList(id, key) {
  const values = byId(id).value.split(";").map((/** @type {string} */ part) => parse(part));
  if (values.some((/** @type {number} */ value) => !Number.isFinite(value))) throw new Error(`${text(key)}: ${byId(id).value}? (0; 180)`);
  return values;
}

const client = () => state?.client ?? 0;

async function startAllan() {
  if (chosen.log === "") throw new Error(text("no_log"));
  await request("allan", { log: chosen.log, column: chosen.column });
}

/** A log with zero voltage: the platform rests. */
async function recordStill() {
  await request("record", { client: client(), profile: "constant", mode: "voltage", amplitude: 0, seconds: typed("still-seconds", "seconds"), seed: 1 });
}

async function startDrift() {
  const latitude = byId("drift-latitude").value.trim() === "" ? null : typed("drift-latitude", "latitude_deg");
  await request("drift", {
    client: client(), place: byId("drift-place").value, cycles: typed("drift-cycles", "cycles"), pulse_s: typed("drift-pulse", "pulse_s"), rest_s: typed("drift-rest", "rest_s"),
    rates_deg_s: typedList("drift-rates", "rates_deg_s"), positions_deg: typedList("drift-positions", "positions_deg"), latitude_deg: latitude, seed: 1,
  });
}

async function startCalibration() {
  await request("calibrate", {
    client: client(), place: byId("calibrate-place").value, kind: byId("calibrate-kind").value, serial: byId("calibrate-serial").value.trim(), operator: byId("calibrate-operator").value.trim(), seed: typed("calibrate-seed", "seed"),
  });
}

async function reply() {
  await request("reply", { text: byId("job-remark").value });
  byId("job-remark").value = "";
}

/** The quantities of any of the three answers: a list, the coefficients of a deviation with reasons for those without a value, or the entries of a record. @param {any} answer */
function quantitiesOf(answer) {
  const entries = (/** @type {any} */ from) => Object.entries(from).filter(([, q]) => q && typeof q === "object" && "value" in q && typeof q.unit === "string").map(([name, q]) => ({ name, ...q }));
  return answer.coefficients ? entries(answer.coefficients) : (answer.quantities ?? entries(answer));
}

/** Why a quantity has no value. @param {any} quantity */
function absence({ reason, says, below, unit }) {
  if (!reason) return says ?? "";
  const minimum = reason.has_minimum == null ? "" : text(reason.has_minimum ? "minimum_explained" : "minimum_absent");
  return sentence("allan", { ...reason, below, unit }) + minimum;
}

/** Remarks on an Allan deviation, a drift session or a calibration. @param {any} answer */
function remarksOf(answer) {
  if (answer.coefficients) return remarkList("allan_note", answer.notes);
  return answer.record ? remarkList("calibration", answer.remarks) : remarkList("drift", answer.notes);
}

/** @param {string} name @param {any} answer */
async function showAnswer(name, answer) {
  shown = { name, answer };
  const cell = (/** @type {number|null|undefined} */ value, /** @type {number} */ digits) => element("span", { class: "mono" }, number(value, digits));
  const rows = quantitiesOf(answer).map((/** @type {any} */ q) => [english(q.name), q.value == null ? absence(q) : cell(q.value, 6), cell(q.U, 2), cell(q.k, 3), q.unit === "1" ? "" : q.unit]);
  const absent = (answer.absent ?? []).map((/** @type {any} */ each) => [english(each.quantity), sentence("absent", each.reason), "–", "–", ""]);
  const { plots } = await request(`pictures?name=${encodeURIComponent(name.replace(/\.json$/, ".html"))}`);
  const picture = (/** @type {any} */ plot) => svgFigure(plot.svg, plot.name);
  const files = answer.folder ? `${answer.folder}/record.json, ${name}` : name;
  byId("measure-answer").dataset.answer = name;
  byId("measure-answer").replaceChildren(element("h2", {}, name.replace(/\.json$/, "")), table(`${text("uncertainty_note")} ${files}`, [text("quantity"), text("value"), "U", "k", text("unit")], [...rows, ...absent]),
    ...remarksOf(answer), ...plots.map(picture), commandLineText(answer.text) ?? "");
}

/** @param {any} now the state of the program */
async function show(now) {
  if (!now || !byId("measure-driver")) return;
  const { job } = now;
  showControl(now, "measure-driver", "measure-take");
  for (const button of document.querySelectorAll(".measure-start")) /** @type {HTMLButtonElement} */ (button).disabled = job.is_running;
  byId("still-start").disabled = job.is_running || !drives();
  byId("job-measure").hidden = !(job.is_running && (KINDS.includes(job.kind) || job.kind === "record"));
  const asks = job.asks.map((/** @type {any} */ ask) => sentence("ask", ask)).join(" ");
  byId("job-asks").hidden = asks === "";
  if (byId("job-asks-text").textContent !== asks) byId("job-asks-text").textContent = asks;
  showSteps(job);
  if (job.is_running || job.number === handled || job.number === 0) return;
  handled = job.number;
  await attempt(async () => {
    if (job.answer && job.kind === "record") chosen.log = job.answer;
    if (job.kind === "record" || job.kind === "calibrate") await loadSession();
    if (!KINDS.includes(job.kind)) return;
    if (hasFailed(job)) throw jobError(job);
    await showAnswer(job.answer, await request(`answer?name=${job.answer}`));
  });
}

export function startMeasure() {
  on("state", show);
}
