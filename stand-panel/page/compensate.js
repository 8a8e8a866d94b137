// Compensation on the stand: friction and cogging of a fitted model, or measured by the stand itself, with the ripple of the rate before
// and after.
import { drives, on, request, state, takeControl } from "./connection.js";
import { attemptIn, byId, element, table } from "./dom.js";
import { field, hasFailed, jobError, showControl } from "./fields.js";
import { number, sentence, text } from "./text.js";

const SVG = "http://www.w3.org/2000/svg";
const BEFORE = "#0072b2";
const AFTER = "#c04a00";

/** @type {any} the answer that is shown */
let shown = null;
let handled = 0;
const chosen = { model: "model.toml", log: "", source: "model" };

const attempt = attemptIn("compensate-error");

export async function buildCompensate() {
  const choose = (/** @type {"model"|"log"|"source"} */ name) => ({ id: `compensate-${name}`, onchange: (/** @type {any} */ e) => { chosen[name] = e.target.value; show(state); } });
  byId("view-compensate").replaceChildren(
    element("p", { id: "compensate-error", class: "error", role: "alert", hidden: true }),
    element("div", { class: "two" },
      element("div", {},
        element("fieldset", {}, element("legend", {}, text("control")), element("p", { id: "compensate-driver" }),
          element("button", { type: "button", id: "compensate-take", onclick: takeControl }, text("take_control"))),
        element("fieldset", {}, element("legend", {}, text("compensate")),
          field("source", element("select", choose("source"), element("option", { value: "model", selected: chosen.source === "model" }, text("fitted_model")),
            element("option", { value: "measured", selected: chosen.source === "measured" }, text("own_measurement")))),
          field("model", element("select", choose("model"))), field("log", element("select", choose("log"))),
          element("p", {}, element("label", {}, element("input", { type: "checkbox", id: "compensate-save" }), text("save_in_flash"))),
          element("p", { class: "faint" }, text("compensate_note")),
          element("button", { type: "button", id: "compensate-start", class: "main", onclick: () => attempt(start) }, text("start_compensation"))),
        element("fieldset", { id: "job-compensate", hidden: true }, element("legend", {}, text("running")), element("p", { class: "job-stage", role: "status" }),
          element("button", { type: "button", onclick: () => attempt(() => request("cancel", {})) }, text("cancel")))),
      element("section", { id: "compensate-answer", "aria-live": "polite" }, element("p", { class: "faint" }, text("no_compensation")))));
  await loadSession();
  show(state);
  if (shown) showAnswer(shown);
}

async function loadSession() {
  const session = await request("session");
  for (const [name, files] of /** @type {["model"|"log", {name: string}[]][]} */ ([["model", session.models], ["log", session.logs]])) {
    const names = files.map((file) => file.name);
    if (!names.includes(chosen[name])) chosen[name] = names.at(-1) ?? "";
    byId(`compensate-${name}`).replaceChildren(...names.map((each) => element("option", { value: each, selected: each === chosen[name] }, each)));
  }
  if (shown) return;
  const last = session.answers.map((/** @type {any} */ file) => file.name).filter((/** @type {string} */ name) => /^compensate-\d+\.json$/.test(name)).at(-1);
  if (last) showAnswer(await request(`answer?name=${last}`));
}

async function start() {
  const of = chosen.source === "model" ? { model: chosen.model, log: chosen.log || null } : {};
  await request("compensate", { client: state?.client ?? 0, save: byId("compensate-save").checked, ...of });
}

const rss = (/** @type {number[]} */ values) => Math.sqrt(values.reduce((sum, value) => sum + value * value, 0));

/** @param {any} answer as `stand compensate --json` writes it, with the spectrum of orders */
function showAnswer(answer) {
  shown = answer;
  const parts = [];
  const { ripple, spectrum } = answer;
  if (ripple) {
    const [was, is] = ["before_rad_s", "after_rad_s"].map((key) => rss(ripple.orders.map((/** @type {any} */ order) => order[key])));
    const sentence = `${number(was, 3)} rad/s → ${number(is, 3)} rad/s (÷ ${number(was / is, 3)})`;
    parts.push(element("h2", {}, text(answer.withdrawn ? "compensation_withdrawn" : "ripple_of_orders")),
      element("p", { class: answer.withdrawn ? "warn" : "good", id: "ripple-fall", "data-factor": was / is }, element("strong", {}, sentence)));
  } else parts.push(element("h2", {}, text("compensation_in_force")));
  if (spectrum) parts.push(bars(spectrum));
  if (ripple) {
    const cell = (/** @type {number} */ value, /** @type {number} */ digits) => element("span", { class: "mono" }, number(value, digits));
    const rows = ripple.orders.map((/** @type {any} */ o) => [String(o.order), cell(o.before_rad_s, 4), cell(o.after_rad_s, 4), cell(o.factor, 3)]);
    parts.push(table(`${text("ripple_at")} ${number(ripple.rate_rad_s, 4)} rad/s`, ["harmonic_order", "before", "after", "ratio"].map((key, k) => text(key) + (k === 1 || k === 2 ? ", rad/s" : "")), rows));
  }
  parts.push(element("h3", {}, text("compensation_in_force")), element("pre", { class: "mono", tabindex: "0" }, answer.in_force.join("\n")));
  // Answers of earlier versions have the program's sentences only.
  const left = answer.left_out_reasons?.map((/** @type {any} */ reason) => element("li", {}, sentence("left_out", reason))) ?? answer.left_out.map((/** @type {string} */ line) => element("li", { lang: "en" }, line));
  if (left.length > 0) parts.push(element("h3", {}, text("not_compensated")), element("ul", {}, ...left));
  parts.push(element("p", { class: "faint" }, text(answer.saved ? "saved_in_flash" : "not_saved")));
  byId("compensate-answer").replaceChildren(...parts);
}

/** @param {string} tag @param {Record<string, any>} properties @param {...(Node|string)} children */
function svg(tag, properties, ...children) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(properties)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}

/** Amplitude of each order before (filled) and after (outlined). @param {{orders: number[], before_rad_s: number[], after_rad_s: number[]}} spectrum */
function bars({ orders, before_rad_s, after_rad_s }) {
  const [width, height, left, bottom, top] = [980, 260, 64, 34, 26];
  const largest = Math.max(...before_rad_s, ...after_rad_s, 1e-12);
  const step = (width - left - 10) / orders.length;
  const y = (/** @type {number} */ value) => height - bottom - ((height - bottom - top) * value) / largest;
  const bar = (/** @type {number} */ value, /** @type {number} */ x, /** @type {any} */ style) => svg("rect", { x, width: step * 0.4, y: y(value), height: Math.max(0.5, height - bottom - y(value)), ...style });
  const label = (/** @type {string} */ words, /** @type {any} */ at) => svg("text", { "font-size": 12, fill: "#1a1d21", ...at }, words);
  const picture = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${text("ripple_of_orders")}: ${text("before")}, ${text("after")}`, id: "ripple-bars" });
  for (const part of [0, 0.5, 1]) {
    picture.append(svg("line", { x1: left, x2: width - 10, y1: y(part * largest), y2: y(part * largest), stroke: "#e2e5ea" }),
      label(number(part * largest, 2), { x: left - 6, y: y(part * largest) + 4, "text-anchor": "end" }));
  }
  orders.forEach((order, k) => {
    const x = left + k * step;
    picture.append(bar(before_rad_s[k], x + step * 0.08, { fill: BEFORE }), bar(after_rad_s[k], x + step * 0.52, { fill: "#fff", stroke: AFTER, "stroke-width": 1.5 }));
    if (order === 1 || order % 8 === 0) picture.append(label(String(order), { x: x + step / 2, y: height - bottom + 15, "text-anchor": "middle" }));
  });
  picture.append(svg("rect", { x: left, y: 4, width: 12, height: 12, fill: BEFORE }), label(`${text("before")}, rad/s`, { x: left + 18, y: 15 }),
    svg("rect", { x: left + 160, y: 4.5, width: 12, height: 11, fill: "#fff", stroke: AFTER, "stroke-width": 1.5 }), label(`${text("after")}, rad/s`, { x: left + 178, y: 15 }),
    label(text("harmonic_order"), { x: width - 10, y: height - 4, "text-anchor": "end" }));
  return element("figure", {}, picture);
}

/** @param {any} now the state of the program */
async function show(now) {
  if (!now || !byId("compensate-driver")) return;
  const { job } = now;
  showControl(now, "compensate-driver", "compensate-take");
  byId("compensate-start").disabled = !drives() || job.is_running;
  for (const name of ["model", "log"]) byId(`compensate-${name}`).disabled = chosen.source !== "model";
  byId("job-compensate").hidden = !(job.is_running && job.kind === "compensate");
  if (job.is_running || job.number === handled || job.number === 0) return;
  handled = job.number;
  await attempt(async () => {
    if (job.answer && job.kind === "record") chosen.log = job.answer;
    await loadSession();
    if (job.kind !== "compensate") return;
    if (hasFailed(job)) throw jobError(job);
    showAnswer(await request(`answer?name=${job.answer}`));
  });
}

export function startCompensate() {
  on("state", show);
}
