// The only module that knows the plot library (uPlot: canvas, min/max per pixel column when points are denser than pixels, so a spike of
// one sample stays visible).
import uPlot from "/vendor/uPlot.esm.js";
import { number, text } from "./text.js";

// Okabe and Ito's palette, distinguishable with colour blindness; dashes distinguish without colour.
const STYLES = [
  { stroke: "#0072b2" }, { stroke: "#c04a00", dash: [8, 4] }, { stroke: "#007a56", dash: [2, 3] }, { stroke: "#8e4585", dash: [10, 3, 2, 3] },
];
const INK = "#1a1d21";
const WORST = "#b00020";

/** @typedef {{label: string, unit: string}} Series */
/** @typedef {{A: number|null, B: number|null}} Cursors times of the cursors, s */

export class Plot {
  /**
   * `kind`: `lines` over time; `profile` has the series mean, low, high; `pair` has two curves over a coordinate; `bars` has the bars and a level.
   * @param {HTMLElement} parent
   * @param {{title: string, series: Series[], height?: number, sync?: string, xLabel?: string, kind?: "lines"|"profile"|"pair"|"bars", cursors?: Cursors}} options
   */
  constructor(parent, { title, series, height = 150, sync, xLabel = text("time_s"), kind = "lines", cursors }) {
    this.parent = parent;
    this.title = title;
    this.labels = series.map((s) => s.label);
    this.isZoomed = false;
    this.cursors = cursors;
    /** @type {number|null} where the worst place is marked */
    this.worst = null;
    const value = (/** @type {Series} */ s) => (/** @type {any} */ _u, /** @type {number|null} */ v) => (v == null ? "–" : `${number(v, 6)} ${s.unit}`);
    const axis = { stroke: INK, grid: { stroke: "#e2e5ea" }, font: "12px sans-serif", labelFont: "12px sans-serif", labelSize: 18 };
    const ticks = (/** @type {any} */ _u, /** @type {number[]} */ all) => all.map((tick) => number(tick, 8));
    this.plot = new uPlot({
      title,
      width: this.width(),
      height,
      scales: { x: { time: false, ...(kind === "bars" ? { range: (/** @type {any} */ _u, /** @type {number} */ _low, /** @type {number} */ high) => [0, high + 1] } : {}) } },
      cursor: { drag: { x: kind === "lines", y: false }, sync: sync ? { key: sync } : undefined },
      axes: [{ ...axis, label: xLabel, size: 34, values: ticks }, { ...axis, label: series[0].unit, size: 68, space: 22, values: ticks }],
      series: [{ label: xLabel, value: (/** @type {any} */ _u, /** @type {number|null} */ v) => (v == null ? "–" : number(v, 8)) },
        ...series.map((s, k) => ({ label: s.label, value: value(s), ...look(kind, k) }))],
      bands: kind === "profile" ? [{ series: [3, 2], fill: "rgba(0, 114, 178, 0.2)" }] : [],
      hooks: {
        setSelect: [(/** @type {any} */ u) => { this.isZoomed = u.select.width > 0; }],
        draw: [(/** @type {any} */ u) => this.drawMarks(u)],
      },
    }, [[], ...series.map(() => [])], parent);
    // The observer also reports the first size, which needs no second drawing.
    this.observer = new ResizeObserver(() => this.width() !== this.plot.width && this.plot.setSize({ width: this.width(), height }));
    this.observer.observe(parent);
  }

  width() {
    return Math.max(260, this.parent.clientWidth);
  }

  /** @param {any} data arrays: time or coordinate, then each series; a zoomed plot keeps its range */
  set(data) {
    this.plot.setData(data.map(withGaps), !this.isZoomed);
    if (this.isZoomed) this.plot.redraw();
  }

  /** The visible range of time. @returns {[number, number]} */
  range() {
    const { min, max } = this.plot.scales.x;
    return [min ?? -Infinity, max ?? Infinity];
  }

  /** @param {number} min @param {number} max */
  zoom(min, max) {
    this.isZoomed = true;
    this.plot.setScale("x", { min, max });
  }

  whole() {
    this.isZoomed = false;
    this.plot.setData(this.plot.data, true);
  }

  /** After a change of the cursors. */
  redraw() {
    this.plot.redraw(false);
  }

  /** The time under the pointer. @param {MouseEvent} event @returns {number} */
  timeAt(event) {
    return this.plot.posToVal(event.clientX - this.plot.over.getBoundingClientRect().left, "x");
  }

  /** @param {string} kind @param {(event: any) => void} listener */
  onPointer(kind, listener) {
    this.plot.over.addEventListener(kind, listener);
  }

  /** Vertical lines at the cursors, a triangle at the worst place. @param {any} u */
  drawMarks(u) {
    const { ctx, bbox } = u;
    const ratio = devicePixelRatio;
    const position = (/** @type {number|null|undefined} */ value) => {
      if (value == null || value < u.scales.x.min || value > u.scales.x.max) return null;
      return u.valToPos(value, "x", true);
    };
    ctx.save();
    ctx.font = `bold ${12 * ratio}px sans-serif`;
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.lineWidth = 1.5 * ratio;
    for (const [name, dash] of /** @type {["A"|"B", number[]][]} */ ([["A", []], ["B", [6, 4]]])) {
      const x = position(this.cursors?.[name]);
      if (x == null) continue;
      ctx.strokeStyle = ctx.fillStyle = INK;
      ctx.setLineDash(dash.map((length) => length * ratio));
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.fillText(name, x + 3 * ratio, bbox.top + 12 * ratio);
    }
    const x = position(this.worst);
    if (x != null) {
      const half = 6 * ratio;
      ctx.fillStyle = WORST;
      ctx.beginPath();
      ctx.moveTo(x - half, bbox.top);
      ctx.lineTo(x + half, bbox.top);
      ctx.lineTo(x, bbox.top + 1.6 * half);
      ctx.fill();
    }
    ctx.restore();
  }

  /** The plot as a picture, with its title and the colours of its series: draws it at this height and returns the next one. @param {CanvasRenderingContext2D} context @param {number} top */
  paint(context, top) {
    const { canvas } = this.plot.ctx;
    const line = 22 * devicePixelRatio;
    context.font = `${13 * devicePixelRatio}px sans-serif`;
    context.fillStyle = INK;
    context.fillText(this.title, 8 * devicePixelRatio, top + 0.7 * line);
    let x = 16 * devicePixelRatio + context.measureText(this.title).width;
    this.labels.forEach((label, k) => {
      context.fillStyle = STYLES[k % STYLES.length].stroke;
      context.fillText(`■ ${label}`, x, top + 0.7 * line);
      x += context.measureText(`■ ${label}  `).width;
    });
    context.drawImage(canvas, 0, top + line);
    return top + line + canvas.height;
  }

  /** Width and height of what `paint` draws, in pixels of the device. @returns {[number, number]} */
  size() {
    const { canvas } = this.plot.ctx;
    return [canvas.width, canvas.height + 22 * devicePixelRatio];
  }

  destroy() {
    this.observer.disconnect();
    this.plot.destroy();
  }
}

/** @param {string} kind @param {number} k */
function look(kind, k) {
  const style = STYLES[k % STYLES.length];
  if (kind === "profile") return k === 0 ? { ...style, width: 1, points: { show: true, size: 5, fill: style.stroke } } : { class: "bound", stroke: "rgba(0, 114, 178, 0.5)", width: 1, points: { show: false } };
  if (kind === "pair") return { ...style, width: 1.5, spanGaps: true, points: { show: true, size: 4 } };
  if (kind === "bars" && k === 0) return { ...style, fill: style.stroke, paths: uPlot.paths.bars?.({ size: [0.7, 40] }), points: { show: false } };
  if (kind === "bars") return { ...style, width: 1.5, points: { show: false } };
  return { ...style, width: 1.5, points: { show: (/** @type {any} */ u) => visiblePoints(u) < 150 } };
}

/** A missing value is a gap for the library only as null; NaN would spoil the range of the axis. @param {Float64Array} values */
function withGaps(values) {
  return values.some(Number.isNaN) ? Array.from(values, (value) => (Number.isNaN(value) ? null : value)) : values;
}

/** @param {any} u */
function visiblePoints(u) {
  const [from, to] = u.series[0].idxs ?? [0, 0];
  return to - from;
}
