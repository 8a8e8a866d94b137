// The live plots: the last 30 s of every channel, its values, pause and export.
import { columns, on, state } from "./connection.js";
import { byId, element, table } from "./dom.js";
import { PlotGroup, extremes, lowerBound } from "./plot-group.js";
import { Plot } from "./plot.js";
import { number, text } from "./text.js";

const WINDOW_S = 30;
const CAPACITY = 64_000;
const DRAW_INTERVAL_MS = 80;
const TABLE_INTERVAL_MS = 500;

// Command beside measured; a group is shown if the stream has one of its channels.
const GROUPS = [
  ["omega_rad_s", "rate_cmd_rad_s", "gyro_rad_s"], ["theta_rad", "theta_cmd_rad"], ["i_A"], ["u_V"], ["supply_V"], ["temp_C"],
];
/** @param {string} name */
export const unitOf = (name) => ["rad_s", "rad", "A", "V", "C", "N_m", "m_s2", "s"].find((unit) => name.endsWith(`_${unit}`))?.replace("rad_s", "rad/s").replace("N_m", "N m").replace("m_s2", "m/s²").replace(/^C$/, "°C") ?? "";

/** @type {Float64Array[]} */
let store = [];
let length = 0;
let paused = false;
let changed = false;
let shown = 0;
/** @type {{plot: Plot, names: string[]}[]} */
let plots = [];
const group = new PlotGroup("live", source, unitOf);

/** @param {string[]} names */
function begin(names) {
  store = ["t", ...names].map(() => new Float64Array(CAPACITY));
  length = 0;
  build();
}

function build() {
  plots.forEach(({ plot }) => plot.destroy());
  const parent = byId("plots");
  parent.replaceChildren();
  const bar = element("div", { class: "row" },
    element("button", { type: "button", id: "pause", "aria-pressed": paused, onclick: togglePause }, text(paused ? "resume" : "pause")),
    element("span", { id: "losses", class: "faint" }));
  parent.append(bar, group.build());
  plots = GROUPS.map((group) => group.filter((name) => columns.includes(name))).filter((group) => group.length > 0).map((names, k) => {
    const figure = element("figure", { class: "plot", "aria-label": names.join(", ") });
    parent.append(figure);
    const height = k === 0 ? 190 : 135;
    const plot = new Plot(figure, { title: names.join(" · "), series: names.map((name) => ({ label: name, unit: unitOf(name) })), height, sync: "live", cursors: group.cursors });
    group.attach(plot, figure);
    return { names, plot };
  });
  parent.append(group.buildTable(), element("div", { id: "values" }));
  group.refresh();
  changed = true;
}

/** @param {{width: number, values: Float64Array}} block */
function append({ width, values }) {
  if (paused || width !== store.length) return;
  const rows = values.length / width;
  if (length > 0 && values[0] < store[0][length - 1]) length = 0;
  if (length + rows > CAPACITY) {
    const keep = WINDOW_S * 1000;
    store.forEach((column) => column.copyWithin(0, length - keep, length));
    length = keep;
  }
  for (let row = 0; row < rows; row++) for (let c = 0; c < width; c++) store[c][length + row] = values[row * width + c];
  length += rows;
  changed = true;
}

const windowBegin = () => (length > 0 ? lowerBound(store[0].subarray(0, length), store[0][length - 1] - WINDOW_S) : 0);

/** What the cursors measure and the export writes: the window of all channels. */
function source() {
  if (store.length === 0) return { names: ["t_s"], columns: [new Float64Array()], of: "live" };
  const from = windowBegin();
  return { names: ["t_s", ...columns], columns: store.map((column) => column.subarray(from, length)), of: "live" };
}

/** @param {string} name */
const columnOf = (name) => store[columns.indexOf(name) + 1];

function draw() {
  if (changed && !byId("view-live").hidden) {
    changed = false;
    const from = windowBegin();
    for (const { plot, names } of plots) plot.set([store[0].subarray(from, length), ...names.map((name) => columnOf(name).subarray(from, length))]);
    if (performance.now() - shown > TABLE_INTERVAL_MS) showValues(from);
  }
  setTimeout(() => requestAnimationFrame(draw), DRAW_INTERVAL_MS);
}

/** The table beside the plots: the same in numbers. @param {number} from */
function showValues(from) {
  shown = performance.now();
  const rows = plots.flatMap(({ names }) => names).map((name) => {
    const values = columnOf(name).subarray(from, length);
    const { low, high, mean } = extremes(values);
    const cell = (/** @type {number} */ value) => element("span", { class: "mono" }, number(value, 6));
    return [`${name}`, cell(values[values.length - 1]), cell(low), cell(high), cell(mean)];
  });
  byId("values").replaceChildren(table(`${text("summary")}, ${WINDOW_S} s`, ["channel", "value", "minimum", "maximum", "mean"].map(text), rows));
  group.refresh();
  byId("losses").textContent = `${text("rows_lost")}: ${state?.lost_rows ?? 0}`;
}

function togglePause() {
  paused = !paused;
  byId("pause").textContent = text(paused ? "resume" : "pause");
  byId("pause").setAttribute("aria-pressed", String(paused));
}

export function startLive() {
  on("columns", begin);
  on("rows", append);
  requestAnimationFrame(draw);
}

/** After a change of the language. */
export const relabelLive = () => store.length > 0 && build();
