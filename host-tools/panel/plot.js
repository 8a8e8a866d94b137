// The only module that knows the plot library (uPlot: canvas, min/max per pixel column when points are denser than pixels, so a spike of one sample stays visible).
import uPlot from "/vendor/uPlot.esm.js";
import { number, text } from "./text.js";

// Okabe and Ito's palette, distinguishable with colour blindness; dashes distinguish without colour.
const STYLES = [
  { stroke: "#0072b2" }, { stroke: "#c04a00", dash: [8, 4] }, { stroke: "#007a56", dash: [2, 3] }, { stroke: "#8e4585", dash: [10, 3, 2, 3] },
];

/** @typedef {{label: string, unit: string}} Series */

export class Plot {
  /**
   * @param {HTMLElement} parent
   * @param {{title: string, series: Series[], height?: number, sync?: string, onRange?: (min: number, max: number) => void}} options
   */
  constructor(parent, { title, series, height = 150, sync, onRange }) {
    this.parent = parent;
    this.isZoomed = false;
    const value = (/** @type {Series} */ s) => (/** @type {any} */ _u, /** @type {number|null} */ v) => (v == null ? "–" : `${number(v, 6)} ${s.unit}`);
    const axis = { stroke: "#1a1d21", grid: { stroke: "#e2e5ea" }, font: "12px sans-serif", labelFont: "12px sans-serif", labelSize: 18 };
    this.plot = new uPlot({
      title,
      width: this.width(),
      height,
      scales: { x: { time: false } },
      cursor: { drag: { x: true, y: false }, sync: sync ? { key: sync } : undefined },
      axes: [{ ...axis, label: text("time_s"), size: 34 }, { ...axis, label: series[0].unit, size: 68, space: 22, values: (/** @type {any} */ _u, /** @type {number[]} */ ticks) => ticks.map((tick) => number(tick, 6)) }],
      series: [{ label: "t, s", value: (/** @type {any} */ _u, /** @type {number|null} */ v) => (v == null ? "–" : number(v, 8)) },
        ...series.map((s, k) => ({ label: s.label, value: value(s), width: 1.5, points: { show: (/** @type {any} */ u) => visiblePoints(u) < 150 }, ...STYLES[k % STYLES.length] }))],
      hooks: { setSelect: [(/** @type {any} */ u) => { this.isZoomed = u.select.width > 0; }], setScale: [(/** @type {any} */ u, /** @type {string} */ key) => { if (key === "x" && onRange) onRange(u.scales.x.min, u.scales.x.max); }] },
    }, [[], ...series.map(() => [])], parent);
    this.plot.over.addEventListener("dblclick", () => { this.isZoomed = false; });
    this.observer = new ResizeObserver(() => this.plot.setSize({ width: this.width(), height }));
    this.observer.observe(parent);
  }

  width() {
    return Math.max(260, this.parent.clientWidth);
  }

  /** @param {any} data arrays: time, then each series; a zoomed plot keeps its range */
  set(data) {
    this.plot.setData(data.map(withGaps), !this.isZoomed);
    if (this.isZoomed) this.plot.redraw();
  }

  /** The visible range of time. @returns {[number, number]} */
  range() {
    const { min, max } = this.plot.scales.x;
    return [min ?? -Infinity, max ?? Infinity];
  }

  canvas() {
    return this.plot.ctx.canvas;
  }

  destroy() {
    this.observer.disconnect();
    this.plot.destroy();
  }
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
