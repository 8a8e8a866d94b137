// The plots of an answer: measured beside modelled, the residual over time, over each coordinate and over the harmonic order, each with its
// worst place in words and a table.
import { element, table } from "./dom.js";
import { unitOf } from "./live.js";
import { PlotGroup, extremes } from "./plot-group.js";
import { Plot } from "./plot.js";
import { number, text } from "./text.js";

/** @typedef {{coordinate: string, name: string, unit: string, bins: [number, number, number][], worst: number|null}} Profile */
/** @typedef {{percent: number[], level_percent: number[], strongest: number, significant: boolean}} Orders */

/** Length of the intervals of time that are compared, s: as in the report of the command line. */
const INTERVAL_S = 2;

/** @type {import("./plot-group.js").Source} */
let shown = { names: ["t_s"], columns: [new Float64Array()], of: "" };
/** @type {Plot[]} */
let plots = [];
const group = new PlotGroup("answer", () => shown, (name) => unitOf(name.replace(/_(model|residual)$/, "")));

/** The names of the coordinates of a rotary axis; those of a linear one come with the answer. */
const COORDINATES = {
  theta: "coordinate_theta", omega: "coordinate_omega", current: "coordinate_current", temperature: "coordinate_temperature", time: "coordinate_time",
  acceleration: "coordinate_acceleration", history: "coordinate_history", log: "coordinate_log",
};
/** @param {Profile} profile */
const nameOf = ({ coordinate, name, unit }) => (/^m(\/s²?)?$/.test(unit) ? name : text(COORDINATES[/** @type {keyof typeof COORDINATES} */ (coordinate)] ?? name));

/** Plots over coordinates are drawn when they come near the visible part of the page. @type {Map<Element, () => void>} */
const waiting = new Map();
const nearby = new IntersectionObserver((entries) => entries.forEach(({ target, isIntersecting }) => isIntersecting && waiting.get(target)?.()), { rootMargin: "400px" });

/** Forgets the plots. */
export function clearResiduals() {
  nearby.disconnect();
  waiting.clear();
  plots.forEach((plot) => plot.destroy());
  plots = [];
}

/** A plot with a caption in words and a table that is made when it is opened; `isLate`: drawn when it is needed.
 * @param {HTMLElement} parent @param {string} label @param {(figure: HTMLElement) => Plot} draw @param {string} caption @param {() => HTMLElement} [rows] @param {boolean} [isLate] */
function figure(parent, label, draw, caption, rows, isLate = false) {
  const made = element("figure", { class: "plot", "aria-label": caption === "" ? label : `${label}. ${caption}` });
  parent.append(made);
  const canvas = element("div", { class: isLate ? "late" : "" });
  made.append(canvas);
  const make = () => {
    canvas.className = "";
    waiting.delete(canvas);
    nearby.unobserve(canvas);
    plots.push(draw(canvas));
  };
  if (isLate) {
    waiting.set(canvas, make);
    nearby.observe(canvas);
  } else make();
  if (caption !== "") made.append(element("figcaption", {}, caption), element("div", { class: "tip", "aria-hidden": "true" }, caption));
  if (rows) {
    const place = element("div");
    const open = (/** @type {any} */ event) => event.target.open && place.childNodes.length === 0 && place.append(rows());
    made.append(element("details", { ontoggle: open }, element("summary", {}, text("table"), element("span", { class: "hidden" }, `: ${label}`)), place));
  }
  return made;
}

/** @param {HTMLElement} parent @param {any} answer @param {Record<string, Float64Array>} series */
export function showResiduals(parent, answer, series) {
  clearResiduals();
  parent.replaceChildren();
  const outputs = Object.keys(series).filter((column) => `${column}_model` in series);
  const residuals = outputs.map((name) => series[name].map((value, k) => value - series[`${name}_model`][k]));
  shown = {
    names: ["t_s", ...outputs.flatMap((name) => [name, `${name}_model`, `${name}_residual`])],
    columns: [series.t_s, ...outputs.flatMap((name, k) => [series[name], series[`${name}_model`], residuals[k]])], of: answer.series,
  };
  group.cursors.A = group.cursors.B = null;
  parent.append(element("h2", {}, text("residuals")), group.build());
  // An angle is compared by its increments, whose column has a name of its own.
  const profilesOf = (/** @type {string} */ name) => answer.profiles?.[name] ?? answer.profiles?.[name.replace("_increment", "")];
  outputs.forEach((name, k) => showTime(parent, name, series, residuals[k], profilesOf(name)?.noise ?? null));
  parent.append(group.buildTable());
  outputs.forEach((name) => {
    const profiles = profilesOf(name);
    if (!profiles) return;
    const grid = element("div", { class: "pair" });
    parent.append(element("h3", {}, `${name}: ${text("over_coordinates")}`), grid);
    profiles.coordinates.forEach((/** @type {Profile} */ profile) => showProfile(grid, name, profiles.unit, profile));
    if (profiles.orders) showOrders(grid, name, profiles.orders);
  });
  group.refresh();
}

/** Rms of the residual in intervals of time. @param {Float64Array} t @param {Float64Array} residual */
function overTime(t, residual) {
  const count = Math.max(1, Math.floor((t[t.length - 1] - t[0]) / INTERVAL_S));
  const length = (t[t.length - 1] - t[0]) / count || 1;
  const intervals = Array.from({ length: count }, (_, k) => ({ from: t[0] + k * length, to: t[0] + (k + 1) * length, squares: 0, rows: 0, largest: 0, at: t[0] }));
  residual.forEach((value, k) => {
    if (!Number.isFinite(value)) return;
    const interval = intervals[Math.min(count - 1, Math.floor((t[k] - t[0]) / length))];
    interval.squares += value * value;
    interval.rows++;
    if (Math.abs(value) >= interval.largest) [interval.largest, interval.at] = [Math.abs(value), t[k]];
  });
  return intervals.map((interval) => ({ ...interval, rms: interval.rows > 0 ? Math.sqrt(interval.squares / interval.rows) : NaN }));
}

/** @param {HTMLElement} parent @param {string} name @param {Record<string, Float64Array>} series @param {Float64Array} residual @param {number|null} noise */
function showTime(parent, name, series, residual, noise) {
  const unit = unitOf(name);
  const common = { sync: "answer", cursors: group.cursors };
  const { low, high } = extremes(series[name]);
  const both = figure(parent, `${name}: ${text("measured")}, ${text("modelled")}`, (place) => {
    const plot = new Plot(place, { title: name, series: [{ label: text("measured"), unit }, { label: text("modelled"), unit }], ...common });
    plot.set([series.t_s, series[name], series[`${name}_model`]]);
    return plot;
  }, `${text("measured")}: ${number(low, 4)} … ${number(high, 4)} ${unit}`);
  const intervals = overTime(series.t_s, residual);
  const worst = intervals.reduce((a, b) => (b.rms > a.rms ? b : a));
  const ratio = (/** @type {number} */ rms) => (noise ? ` (${number(rms / noise, 3)} × ${text("noise")})` : "");
  const caption = `${text("worst")}: ${number(worst.from, 4)} … ${number(worst.to, 4)} s, ${text("rms")} ${number(worst.rms, 3)} ${unit}${ratio(worst.rms)}; ${text("largest")} ${number(worst.largest, 3)} ${unit}, t = ${number(worst.at, 6)} s`;
  const heads = [text("time_s"), `${text("rms")}, ${unit}`, text("ratio"), `${text("largest")}, ${unit}`];
  const rows = () => table(`${name}: ${text("residual")}`, heads, intervals.map((interval) => [`${number(interval.from, 5)} … ${number(interval.to, 5)}`, number(interval.rms, 4), noise ? number(interval.rms / noise, 3) : "–", number(interval.largest, 4)]));
  const difference = figure(parent, `${name}: ${text("residual")}`, (place) => {
    const plot = new Plot(place, { title: `${name}: ${text("residual")}`, series: [{ label: text("residual"), unit }], height: 130, ...common });
    plot.worst = worst.at;
    plot.set([series.t_s, residual]);
    return plot;
  }, caption, rows);
  [both, difference].forEach((place, k) => group.attach(plots[plots.length - 2 + k], place));
}

/** @param {HTMLElement} parent @param {string} output @param {string} unit @param {Profile} profile */
function showProfile(parent, output, unit, profile) {
  const label = nameOf(profile);
  const { bins, worst } = profile;
  const value = (/** @type {[number, number, number]} */ [at, mean, confidence]) => `${number(at, 4)} ${profile.unit}: ${number(mean, 3)} ± ${number(confidence, 2)} ${unit}`;
  const caption = worst == null ? text("no_worst") : `${text("worst")}: ${label} ${value(bins[worst])}`;
  const rows = () => table(`${output}, ${label}; ${text("interval_95")}`, [`${label}, ${profile.unit}`, `${text("mean_residual")}, ${unit}`, `± 95 %, ${unit}`], bins.map((bin) => [number(bin[0], 5), number(bin[1], 4), number(bin[2], 3)]));
  figure(parent, `${output}: ${text("mean_residual")}, ${label}`, (place) => {
    const series = [{ label: text("mean_residual"), unit }, { label: "− 95 %", unit }, { label: "+ 95 %", unit }];
    const plot = new Plot(place, { title: `${output}: ${label}`, series, height: 190, xLabel: `${label}, ${profile.unit}`, kind: "profile" });
    plot.worst = worst == null ? null : bins[worst][0];
    plot.set([bins.map(([at]) => at), bins.map(([, mean]) => mean), bins.map(([, mean, c]) => mean - c), bins.map(([, mean, c]) => mean + c)]);
    return plot;
  }, caption, rows, true);
}

/** @param {HTMLElement} parent @param {string} output @param {Orders} orders */
function showOrders(parent, output, { percent, level_percent, strongest, significant }) {
  const caption = `${text("strongest_order")}: ${strongest}, ${number(percent[strongest - 1], 3)} % ${text("of_variance")}; ${text(significant ? "significant" : "not_significant")}`;
  const heads = [text("order"), `${text("of_variance")}, %`, `${text("significance_level")}, %`];
  const rows = () => table(`${output}: ${text("order_spectrum")}`, heads, percent.map((part, k) => [String(k + 1), number(part, 4), number(level_percent[k], 4)]));
  figure(parent, `${output}: ${text("order_spectrum")}`, (place) => {
    const series = [{ label: text("of_variance"), unit: "%" }, { label: text("significance_level"), unit: "%" }];
    const plot = new Plot(place, { title: `${output}: ${text("order_spectrum")}`, series, height: 190, xLabel: text("order"), kind: "bars" });
    plot.worst = significant ? strongest : null;
    // The level of an empty neighbourhood can be far above all bars.
    const top = 1.08 * Math.max(...percent);
    plot.set([percent.map((_, k) => k + 1), percent, level_percent.map((level) => Math.min(level, top))]);
    return plot;
  }, caption, rows, true);
}
