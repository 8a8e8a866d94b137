// The signature of an effect in a log: over the residual of the model without the effect what the effect explains of it, over time and over
// the effect's own coordinate.
import { element } from "./dom.js";
import { unitOf } from "./live.js";
import { Plot } from "./plot.js";
import { fill, number, text } from "./text.js";

/** @type {Plot[]} */
let plots = [];

/** Forgets the plots. */
export function clearSignature() {
  plots.forEach((plot) => plot.destroy());
  plots = [];
}

const rms = (/** @type {Float64Array} */ values) => Math.sqrt(values.reduce((sum, value) => sum + value * value, 0) / Math.max(1, values.length));

/** @param {HTMLElement} parent @param {any} answer @param {Record<string, Float64Array>} series */
export function showSignature(parent, answer, series) {
  clearSignature();
  parent.replaceChildren(element("h3", {}, `${text("signature_in")}: ${answer.effect}, ${answer.log}`), answer.converged ? "" : element("p", { class: "warn" }, text("signature_not_converged")));
  for (const name of Object.keys(series).filter((column) => `${column}_model_with` in series)) {
    const [measured, without, predicted] = [series[name], series[`${name}_model`], series[`${name}_model_with`]];
    const residual = measured.map((value, k) => value - without[k]);
    const explained = predicted.map((value, k) => value - without[k]);
    const unit = unitOf(name);
    const fall = fill("signature_fall", { output: name, before: number(rms(residual), 3), after: number(rms(measured.map((value, k) => value - predicted[k])), 3), unit });
    draw(parent, fall, (place) => {
      const labels = [{ label: text("residual"), unit }, { label: text("predicted"), unit }];
      const plot = new Plot(place, { title: `${name}: ${text("residual")}`, series: labels, sync: "signature" });
      plot.set([series.t_s, residual, explained]);
      return plot;
    });
    const own = name.replace("_increment", "");
    const over = (/** @type {any} */ profiles) => profiles?.[own]?.coordinates.find((/** @type {any} */ profile) => profile.coordinate === answer.coordinate);
    const [before, after] = [over(answer.profiles), over(answer.profiles_with)];
    if (!before || !after) continue;
    // The bins of the modelled rate or current differ a little between the two.
    const label = text(`coordinate_${answer.coordinate}`);
    draw(parent, `${name}: ${text("mean_residual")}, ${label}`, (place) => {
      const labels = [{ label: text("mean_residual"), unit }, { label: text("with_effect"), unit }];
      const plot = new Plot(place, { title: `${name}: ${label}`, series: labels, xLabel: `${label}, ${before.unit}`, kind: "pair" });
      plot.set(joined(before.bins, after.bins));
      return plot;
    });
  }
}

/** Two curves over one axis: where only one has a bin, the other has none. @param {[number, number, number][]} before @param {[number, number, number][]} after */
function joined(before, after) {
  const [a, b] = [before, after].map((bins) => new Map(bins.map(([at, mean]) => [at, mean])));
  const places = [...new Set([...a.keys(), ...b.keys()])].sort((x, y) => x - y);
  return [places, places.map((at) => a.get(at)), places.map((at) => b.get(at))];
}

/** @param {HTMLElement} parent @param {string} caption @param {(place: HTMLElement) => Plot} plot */
function draw(parent, caption, plot) {
  const place = element("div");
  parent.append(element("figure", { class: "plot", "aria-label": caption }, place, element("figcaption", {}, caption)));
  plots.push(plot(place));
}
