// Cursors A and B, zoom and export for plots over a common time: by mouse and by keyboard.
import { exportColumns } from "./connection.js";
import { attemptIn, byId, download, element, table } from "./dom.js";
import { number, parse, text } from "./text.js";

/** @typedef {import("./plot.js").Plot} Plot */
/** @typedef {{names: string[], columns: Float64Array[], of: string}} Source columns of the plots; the first is the time, s; `of`: what they are, for the export */

/** Part of the visible range by which Shift and an arrow key move a cursor, and the factor of + and −. */
const STEP = 0.01;
const ZOOM = 2;

/** The first index whose time is not below. @param {Float64Array} t @param {number} time */
export function lowerBound(t, time) {
  let [low, high] = [0, t.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle] < time) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** @param {Float64Array} t @param {number} time */
function nearest(t, time) {
  const k = lowerBound(t, time);
  if (k === 0) return 0;
  return k === t.length || time - t[k - 1] < t[k] - time ? k - 1 : k;
}

/** Smallest, largest, mean of the finite values. @param {Float64Array} values */
export function extremes(values) {
  let [low, high, sum, count] = [Infinity, -Infinity, 0, 0];
  for (const value of values) if (Number.isFinite(value)) {
    low = Math.min(low, value);
    high = Math.max(high, value);
    sum += value;
    count++;
  }
  return { low, high, mean: sum / count };
}

export class PlotGroup {
  /** @param {string} id prefix of the elements' ids @param {() => Source} source @param {(name: string) => string} unitOf */
  constructor(id, source, unitOf) {
    this.id = id;
    this.source = source;
    this.unitOf = unitOf;
    /** @type {import("./plot.js").Cursors} */
    this.cursors = { A: null, B: null };
    /** @type {"A"|"B"} the cursor that the arrow keys of a plot move */
    this.active = "A";
    /** @type {Plot[]} */
    this.plots = [];
    this.attempt = attemptIn(`${id}-error`);
  }

  /** The controls, to be placed above the plots; forgets the plots. */
  build() {
    this.plots = [];
    const { id } = this;
    const button = (/** @type {string} */ key, /** @type {string} */ name, /** @type {() => any} */ action) =>
      element("button", { type: "button", id: `${id}-${name}`, onclick: () => this.attempt(async () => action()) }, text(key));
    const cursor = (/** @type {"A"|"B"} */ name) => element("label", {}, `${name}, s`, element("input", {
      id: `${id}-${name}`, size: 11, inputmode: "decimal", autocomplete: "off", value: this.shown(name),
      onchange: (/** @type {any} */ event) => this.typed(name, event.target.value),
      onkeydown: (/** @type {KeyboardEvent} */ event) => this.inputKey(name, event),
    }));
    return element("div", { class: "plot-group", role: "group", "aria-label": text("cursors") },
      element("div", { class: "row" }, cursor("A"), cursor("B"), button("zoom_cursors", "zoom", () => this.zoomToCursors()), button("whole_range", "whole", () => this.whole()), button("clear_cursors", "clear", () => this.clear()),
        button("export_csv", "csv", () => this.export("csv")), button("export_parquet", "parquet", () => this.export("parquet")), button("export_png", "png", () => this.exportPng())),
      element("details", { class: "hint" }, element("summary", {}, text("cursor_keys")), text("cursor_hint")),
      element("p", { id: `${id}-cursors`, class: "mono", role: "status" }),
      element("p", { id: `${id}-message`, role: "status" }),
      element("p", { id: `${id}-error`, class: "error", role: "alert", hidden: true }));
  }

  /** The place of the table, below the plots: they stay where they are when a cursor is set. */
  buildTable() {
    return element("div", { id: `${this.id}-table` });
  }

  /** @param {Plot} plot @param {HTMLElement} figure its element, which takes the focus */
  attach(plot, figure) {
    this.plots.push(plot);
    figure.tabIndex = 0;
    figure.addEventListener("keydown", (event) => this.plotKey(event));
    plot.onPointer("click", (event) => this.place(event.shiftKey ? "B" : "A", plot.timeAt(event)));
    plot.onPointer("dblclick", () => this.whole());
  }

  /** @param {"A"|"B"} name */
  shown(name) {
    const at = this.cursors[name];
    return at == null ? "" : number(at, 9);
  }

  /** Sets a cursor at the sample nearest to a time. @param {"A"|"B"} name @param {number} time */
  place(name, time) {
    const [t] = this.source().columns;
    if (t.length === 0 || !Number.isFinite(time)) return;
    this.active = name;
    this.cursors[name] = t[nearest(t, time)];
    this.changed();
  }

  /** @param {"A"|"B"} name @param {string} typed */
  typed(name, typed) {
    if (typed.trim() === "") this.cursors[name] = null;
    else if (Number.isFinite(parse(typed))) this.place(name, parse(typed));
    this.changed();
  }

  changed() {
    for (const name of /** @type {const} */ (["A", "B"])) byId(`${this.id}-${name}`).value = this.shown(name);
    this.plots.forEach((plot) => plot.redraw());
    this.refresh();
  }

  /** @param {"A"|"B"} name @param {number} samples @param {number} [part] of the visible range, instead of samples */
  move(name, samples, part) {
    const [t] = this.source().columns;
    const [low, high] = this.visible();
    const at = this.cursors[name];
    if (t.length === 0) return;
    if (at == null) this.place(name, (low + high) / 2);
    else if (part != null) this.place(name, at + part * (high - low));
    else this.place(name, t[Math.min(t.length - 1, Math.max(0, nearest(t, at) + samples))]);
    const now = this.cursors[name] ?? 0;
    // A cursor that leaves the zoomed range takes the range along.
    if (this.plots[0]?.isZoomed && (now < low || now > high)) this.zoom(now - (high - low) / 2, now + (high - low) / 2);
  }

  /** The visible range of time within the data. @returns {[number, number]} */
  visible() {
    const [t] = this.source().columns;
    const [low, high] = this.plots[0]?.range() ?? [-Infinity, Infinity];
    return [Math.max(low, t[0]), Math.min(high, t[t.length - 1])];
  }

  /** @param {"A"|"B"} name @param {KeyboardEvent} event */
  inputKey(name, event) {
    const step = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    this.move(name, step, event.shiftKey ? step * STEP : undefined);
  }

  /** @param {KeyboardEvent} event */
  plotKey(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target !== event.currentTarget) return;
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    // By position, so that the keys are the same in every layout.
    const name = /** @type {"A"|"B"|undefined} */ ({ KeyA: "A", KeyB: "B" }[event.code]);
    if (step) this.move(this.active, step, event.shiftKey ? step * STEP : undefined);
    else if (name) {
      this.active = name;
      if (this.cursors[name] == null) this.move(name, 0);
    } else if (event.key === "+" || event.key === "=") this.zoomBy(1 / ZOOM);
    else if (event.key === "-") this.zoomBy(ZOOM);
    else if (event.key === "0") this.whole();
    else return;
    event.preventDefault();
  }

  /** @param {number} low @param {number} high */
  zoom(low, high) {
    if (high > low) this.plots.forEach((plot) => plot.zoom(low, high));
  }

  /** Around the active cursor, or the middle. @param {number} factor of the range */
  zoomBy(factor) {
    const [t] = this.source().columns;
    const [low, high] = this.visible();
    const at = this.cursors[this.active];
    const centre = at != null && at >= low && at <= high ? at : (low + high) / 2;
    const half = (factor * (high - low)) / 2;
    if (2 * half >= t[t.length - 1] - t[0]) this.whole();
    else if (half > 0) this.zoom(centre - half, centre + half);
  }

  zoomToCursors() {
    const { A, B } = this.cursors;
    if (A == null || B == null || A === B) throw new Error(text("two_cursors"));
    const margin = 0.02 * Math.abs(B - A);
    this.zoom(Math.min(A, B) - margin, Math.max(A, B) + margin);
  }

  whole() {
    this.plots.forEach((plot) => plot.whole());
  }

  clear() {
    this.cursors.A = this.cursors.B = null;
    this.changed();
  }

  words() {
    const { A, B } = this.cursors;
    if (A == null && B == null) return text("no_cursors");
    const difference = A != null && B != null ? `; Δt = ${number(B - A, 6)} s; 1/Δt = ${number(1 / Math.abs(B - A), 6)} ${text("hertz")}` : "";
    return `${text("cursors")}: A = ${number(A, 9)} s, B = ${number(B, 9)} s${difference}`;
  }

  /** The words and the table of the cursors. */
  refresh() {
    const place = byId(`${this.id}-table`);
    if (!place) return;
    const { A, B } = this.cursors;
    const words = this.words();
    // A status is spoken when it changes, so it is not set again.
    if (byId(`${this.id}-cursors`).textContent !== words) byId(`${this.id}-cursors`).textContent = words;
    if (A == null && B == null) return place.replaceChildren();
    const { names, columns } = this.source();
    const [t] = columns;
    const at = (/** @type {number|null} */ time, /** @type {Float64Array} */ values) => (time == null || time < t[0] || time > t[t.length - 1] ? null : values[nearest(t, time)]);
    const cell = (/** @type {number|null} */ value) => element("span", { class: "mono" }, number(value, 6));
    const rows = names.slice(1).map((name, k) => {
      const values = columns[k + 1];
      const [a, b] = [at(A, values), at(B, values)];
      const within = A != null && B != null ? extremes(values.subarray(lowerBound(t, Math.min(A, B)), nearest(t, Math.max(A, B)) + 1)) : { low: null, high: null, mean: null };
      return [name, this.unitOf(name), cell(a), cell(b), cell(a == null || b == null ? null : b - a), cell(within.low), cell(within.high), cell(within.mean)];
    });
    place.replaceChildren(table(words, [text("channel"), text("unit"), "A", "B", "B − A", ...["minimum", "maximum", "mean"].map(text)], rows));
  }

  /** The visible range into a file of the session, written by the library. @param {"csv"|"parquet"} format */
  async export(format) {
    const { names, columns, of } = this.source();
    const [low, high] = this.visible();
    const [from, to] = [lowerBound(columns[0], low), nearest(columns[0], high) + 1];
    const { name, rows, left_out, without } = await exportColumns({ format, of, columns: names, rows: to - from }, columns.map((values) => values.slice(from, to)));
    byId(`${this.id}-message`).textContent = `${text("written")}: ${name}, ${rows} ${text("rows")}${left_out > 0 ? `; ${text("left_out")}: ${left_out}` : ""}${without.length > 0 ? `; ${text("without_columns")}: ${without.join(", ")}` : ""}`;
  }

  exportPng() {
    const sizes = this.plots.map((plot) => plot.size());
    const whole = element("canvas", { width: Math.max(...sizes.map(([width]) => width)), height: sizes.reduce((sum, [, height]) => sum + height, 0) });
    const context = whole.getContext("2d");
    context.fillStyle = "#fff";
    context.fillRect(0, 0, whole.width, whole.height);
    this.plots.reduce((top, plot) => plot.paint(context, top), 0);
    whole.toBlob((/** @type {Blob} */ blob) => download(blob, "plots.png"));
  }
}
