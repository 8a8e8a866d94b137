// The answers of compare and explain in words: the misfits, the verdict with its evidence, what is left, detection limits, the next
// experiment. The sentences are made here from the kinds and numbers of the answer; what the catalogue of effects says stays English.
import { english, element, table } from "./dom.js";
import { fill, number, sentence, text } from "./text.js";

/** Share of the variance below which no figure is given, %. */
const MIN_PERCENT = 0.1;

const mono = (/** @type {number|null|undefined} */ value, /** @type {number} */ digits = 4) => element("span", { class: "mono" }, number(value, digits));

/** The outputs of a linear axis have the names of its own, and their sentences stay those of the program. @param {any} answer */
const isLinear = (answer) => Object.keys(answer.outputs ?? answer.steps?.[0]?.ratio ?? {}).some((name) => /^(x_m|v_m_s)$/.test(name));

/** A misfit in one sentence. @param {any} misfit @param {boolean} linear */
function misfitItem(misfit, linear) {
  // Answers of earlier versions have the program's sentence only.
  if (linear || misfit.form === undefined) return element("li", { lang: "en" }, misfit.says);
  const percent = 100 * misfit.share;
  const form = misfit.form ? sentence("form", misfit.form) : text("form_weak");
  const args = {
    output: misfit.output, percent: percent < MIN_PERCENT ? fill("less_than", { limit: MIN_PERCENT }) : Number(percent.toPrecision(percent < 1 ? 1 : 2)), form,
    coordinate: text(`with_${misfit.coordinate}`), orders: misfit.orders.length > 0 ? fill("misfit_orders", { orders: misfit.orders.join(", ") }) : "",
  };
  return element("li", {}, fill(misfit.coordinate === "log" ? "misfit_by_log" : "misfit", args));
}

/** The misfits, or that there are none. @param {any} answer @param {any[]} misfits */
export const misfitList = (answer, misfits) => (misfits.length === 0 ? element("p", { class: "good" }, text("adequate")) : element("ol", {}, ...misfits.map((misfit) => misfitItem(misfit, isLinear(answer)))));

/** Where the model fails: the answer of compare or fit. @param {any} answer */
export function comparison(answer) {
  const rows = Object.entries(answer.outputs).map(([name, o]) => [name, mono(o.rms), mono(o.noise), mono(o.ratio)]);
  return [element("h2", {}, text("where_it_fails")), table(`${answer.log}, ${answer.model}`, ["output", "rms", "noise", "ratio"].map(text), rows), misfitList(answer, answer.failures ?? [])];
}

/** Why a candidate was not added. @param {any} candidate */
export function judgement({ fate, reason }) {
  const words = text(`fate_${fate.replaceAll(" ", "_")}`);
  return reason ? `${words}: ${sentence(fate === "refused" ? "refusal" : "hidden", reason)}` : words;
}

const strengthOf = (/** @type {string} */ strength) => text(`strength_${strength.replaceAll(" ", "_")}`);

/** The verdict with what it rests on. @param {any} answer */
export function verdict(answer) {
  const key = `verdict_${answer.verdict.replaceAll("-", "_")}`;
  const { missing = [], steps = [], remaining = [], unexplained = [], detection_limits = [], next_experiment: next } = answer;
  const parts = [element("h2", {}, missing.length > 0 ? `${text("verdict")}: ${missing.join(", ")}` : text("verdict")), element("p", { class: answer.verdict === "adequate" || answer.verdict === "effect-found" ? "good" : "warn" }, text(key))];
  if (missing.length > 0) parts.push(table(text("missing_effects"), ["effect", "confidence", "explained_share", "parameters", "same_as"].map(text), missing.map((/** @type {string} */ name) => foundEffect(answer, name))));
  if (steps.length > 0) {
    const names = Object.keys(steps[0].ratio);
    const heads = [text("output"), ...(missing.length > 0 ? [text("before"), text("after")] : [text("ratio")])];
    const cells = (/** @type {string} */ name) => (missing.length > 0 ? [steps[0], steps.at(-1)] : [steps.at(-1)]).map((step) => mono(step.ratio[name], 3));
    parts.push(table(text("residual_to_noise"), heads, names.map((name) => [name, ...cells(name)])));
  }
  if (answer.verdict === "partly-explained" || answer.verdict === "unknown-structure") parts.push(element("h3", {}, text("what_is_left")), misfitList(answer, remaining), ...unexplained.flatMap(shape));
  if (detection_limits.length > 0) parts.push(limits(detection_limits));
  if (next) parts.push(...experiment(next));
  return parts;
}

/** A row of the table of effects that were found: the evidence is that of the first step, for the first effect. @param {any} answer @param {string} name */
function foundEffect(answer, name) {
  const candidate = answer.candidates.find((/** @type {any} */ each) => each.effect === name && each.refitted);
  const isFirst = name === answer.missing[0];
  const p = candidate?.log10_p == null ? "–" : candidate.log10_p < -12 ? "< 1e-12" : `= ${number(10 ** candidate.log10_p, 2)}`;
  const evidence = isFirst && candidate?.delta_bic != null ? fill("evidence_of", { delta_bic: candidate.delta_bic, strength: strengthOf(candidate.strength), p }) : "–";
  const share = answer.explained_fraction?.[name];
  const own = Object.keys(candidate?.parameters ?? {}).filter((parameter) => parameter in answer.parameters);
  const value = (/** @type {string} */ parameter) => {
    const { value: found, sigma, unit } = answer.parameters[parameter];
    return `${parameter} = ${number(found, 4)}${sigma > 0 ? ` ± ${number(sigma, 2)}` : ""}${unit === "1" ? "" : ` ${unit}`}`;
  };
  return [name, evidence, share == null ? "–" : mono(100 * share, 3), own.map(value).join("; "), (answer.not_distinguishable?.[name] ?? []).join(", ")];
}

/** The form of what no effect explains. @param {any} of */
function shape(of) {
  // Answers of earlier versions have the program's sentence only.
  const words = of.form ? element("p", {}, sentence("shape", { ...of.form, coordinate: text(`coordinate_${of.coordinate}`) })) : element("p", {}, english(of.says));
  return of.expression ? [words, element("p", {}, text("add_by_text")), element("pre", { class: "mono", tabindex: "0" }, of.expression)] : [words];
}

/** @param {any[]} all */
function limits(all) {
  const with_unit = (/** @type {number} */ value, /** @type {string} */ unit) => `${number(value, 2)}${unit === "1" ? "" : ` ${unit}`}`;
  const rows = all.map(({ effect, parameter, value, unit, at }) => [effect, parameter, with_unit(value, unit), Object.entries(at).map(([name, place]) => `${name} = ${number(place, 3)}`).join(", ")]);
  return element("details", {}, element("summary", {}, text("detection_limits")), table("", ["effect", "parameter", "smallest", "least_visible_at"].map(text), rows));
}

/** @param {any} next */
function experiment({ purpose, says, command, expected = [] }) {
  const parts = [element("h3", {}, text("next_experiment"))];
  if (purpose) {
    const catalogue = purpose.catalogue ?? [];
    parts.push(element("p", {}, sentence("purpose", purpose)));
    if (catalogue.length > 0) parts.push(element("p", {}, text("from_catalogue"), " ", ...catalogue.map((/** @type {string} */ line) => english(`${line.replace(/\.$/, "")}. `))));
  } else parts.push(element("p", {}, english(says ?? "")));
  if (expected.length > 0) parts.push(element("p", {}, fill("expected_gain", { delta_bic: expected[0].delta_bic })));
  parts.push(element("p", {}, element("code", {}, command)), element("p", { class: "faint" }, text("simulated_command")));
  return parts;
}

/** The full report of the command line. @param {string|undefined} report */
export const commandLineText = (report) => (report ? element("details", {}, element("summary", {}, text("command_line_text")), element("pre", { class: "mono", tabindex: "0", lang: "en" }, report)) : null);

/** Remarks: kinds with numbers; a warning about the log is the program's sentence. @param {string} prefix @param {any[]|undefined} notes */
export function remarkList(prefix, notes) {
  if (!notes || notes.length === 0) return [];
  const item = (/** @type {any} */ note) => (note.kind === "log" ? element("li", { lang: "en" }, note.says) : element("li", {}, sentence(prefix, note)));
  return [element("h3", {}, text("remarks")), element("ul", {}, ...notes.map(item))];
}
