// Logs of other programs: a file that is dropped or chosen is copied into the session's folder; its columns and units are shown, corrected
// and accepted.
import { request } from "./connection.js";
import { attemptIn, byId, element, english, table } from "./dom.js";
import { number, parse, text } from "./text.js";

/** Names that are tried where a file of the name exists. */
const MAX_COPIES = 20;
const UNITS = ["s", "ms", "us", "rad", "deg", "rev", "counts:4096", "rad/s", "rpm", "deg/s", "V", "mV", "A", "mA", "N m", "mN m", "°C", "K", "m/s²", "g"];

const attempt = attemptIn("import-error");
/** @type {any} the inspection that is shown */
let inspection = null;
/** What the person states: column of the file to column of the project, unit, note. */
let stated = { columns: new Map(), units: new Map(), notes: new Map(), rate: NaN };
/** @type {(name: string) => Promise<void>} */
let accepted = async () => {};
/** @type {() => string} */
let chosen = () => "";

/** The area of the view, in which a file may be dropped. @param {() => string} chosenLog @param {(name: string) => Promise<void>} onAccepted */
export function buildImport(chosenLog, onAccepted) {
  chosen = chosenLog;
  accepted = onAccepted;
  const input = element("input", { type: "file", id: "import-file", hidden: true, onchange: () => attempt(() => open(input.files[0])) });
  const area = element("section", { id: "import", "aria-label": text("import") },
    element("div", { class: "row" },
      element("button", { type: "button", id: "import-open", onclick: () => input.click() }, text("import_open")), input,
      element("button", { type: "button", id: "import-columns", onclick: () => attempt(() => inspectChosen()) }, text("import_columns")),
      element("span", { class: "faint" }, text("import_drop"))),
    element("p", { id: "import-error", class: "error", role: "alert", hidden: true }), element("p", { id: "import-message", role: "status" }), element("div", { id: "import-form" }));
  if (inspection) queueMicrotask(show);
  return area;
}

export function startImport() {
  const hasFile = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes("Files");
  document.addEventListener("dragover", (event) => {
    if (!hasFile(event)) return;
    event.preventDefault();
    byId("import")?.classList.add("drop");
  });
  document.addEventListener("dragleave", (event) => event.relatedTarget == null && byId("import")?.classList.remove("drop"));
  document.addEventListener("drop", (event) => {
    if (!hasFile(event)) return;
    // Otherwise the browser would leave the page for the file.
    event.preventDefault();
    byId("import")?.classList.remove("drop");
    byId("tab-identify").click();
    const file = event.dataTransfer?.files[0];
    if (file && byId("import")) attempt(() => open(file));
  });
}

/** A name of the session: letters of other alphabets, spaces and the rest become `-`. @param {string} name */
function sessionName(name) {
  const plain = name.normalize("NFKD").replace(/[\u0300-\u036f]/g, "").replace(/[^A-Za-z0-9._-]+/g, "-").replace(/^[.-]+/, "");
  const [stem, ending] = plain.includes(".") ? [plain.slice(0, plain.lastIndexOf(".")), plain.slice(plain.lastIndexOf(".") + 1)] : ["", plain];
  return { stem: (stem.replace(/[.-]+$/, "") || "log").slice(0, 60), ending };
}

/** @param {File} file */
async function open(file) {
  const { max_upload_bytes: limit, log_endings: endings } = await request("session");
  const { stem, ending } = sessionName(file.name);
  if (!endings.includes(ending.toLowerCase())) throw new Error(`${file.name}: ${text("import_endings")} .${endings.join(", .")}`);
  if (file.size > limit) throw new Error(`${file.name}: ${text("import_too_large")} ${limit / 1048576} MiB`);
  message(`${file.name} …`);
  for (let copy = 1; ; copy++) {
    try {
      const { name } = await request(`upload?name=${encodeURIComponent(`${stem}${copy === 1 ? "" : `-${copy}`}.${ending}`)}`, file);
      message(`${file.name} → ${name}`);
      return begin(name);
    } catch (error) {
      message("");
      if (error.status !== 409 || copy === MAX_COPIES) throw error;
    }
  }
}

/** @param {string} words */
function message(words) {
  byId("import-message").textContent = words;
}

async function inspectChosen() {
  if (chosen() === "") throw new Error(text("no_log"));
  await begin(chosen());
}

/** @param {string} name */
async function begin(name) {
  stated = { columns: new Map(), units: new Map(), notes: new Map(), rate: NaN };
  inspection = { name };
  await inspect(false);
  byId("import-title").focus();
}

/** @param {boolean} accept */
async function inspect(accept) {
  const { name } = inspection;
  const rate = Number.isFinite(stated.rate) ? stated.rate : null;
  inspection = await request("inspect", { name, columns: [...stated.columns], units: [...stated.units], notes: [...stated.notes], sample_rate_Hz: rate, accept });
  if (!accept) return show();
  close();
  message(`${text("import_accepted")}: ${name.replace(/\.[^.]*$/, "")}.import.toml`);
  await accepted(name);
}

function close() {
  inspection = null;
  byId("import-form").replaceChildren();
}

/** States something about a column, or takes it back. @param {Map<string, string>} map @param {string} column @param {string} value */
function state(map, column, value) {
  if (value === "") map.delete(column);
  else map.set(column, value);
  return attempt(() => inspect(false));
}

/** The column for a statement: its name, or its number where the name could be misread. @param {any} column */
const keyOf = ({ name, number: position }) => (name === "" || name.includes("=") || name.trim() !== name ? String(position) : name);

function show() {
  const { name, columns } = inspection;
  const cell = (/** @type {any} */ column, /** @type {string} */ key, /** @type {string} */ value, /** @type {string} */ list, /** @type {Map<string, string>} */ map) => element("input", {
    id: `import-${key.replace("import_", "")}-${column.number}`, value, list, size: 14, autocomplete: "off", "aria-label": `${column.name}: ${text(key)}`,
    onchange: (/** @type {any} */ event) => state(map, keyOf(column), event.target.value.trim()),
  });
  const rows = columns.map((/** @type {any} */ column) => [
    String(column.number), column.name, cell(column, "import_is", column.is ?? "-", "import-known", stated.columns), cell(column, "unit", column.unit ?? "", column.alternatives.length > 0 ? `import-units-${column.number}` : "import-units", stated.units),
    column.min == null ? text("no_numbers") : `${number(column.min, 4)} … ${number(column.max, 4)}`, english(column.why)]);
  const options = (/** @type {string} */ id, /** @type {any[]} */ values) => element("datalist", { id }, ...values.map((value) => element("option", { value: value.name ?? value, label: value.description ?? "" })));
  const own = columns.filter((/** @type {any} */ column) => column.alternatives.length > 0).map((/** @type {any} */ column) => options(`import-units-${column.number}`, column.alternatives));
  const rate = element("input", { id: "import-rate", size: 10, inputmode: "decimal", value: inspection.sample_rate_Hz == null ? "" : number(inspection.sample_rate_Hz, 9), onchange: () => { stated.rate = parse(rate.value); attempt(() => inspect(false)); } });
  const note = element("input", { id: "import-note", size: 30, placeholder: "u_V=at t", maxlength: 200 });
  const problem = inspection.open ?? inspection.refused;
  fill(byId("import-form"),
    element("h2", { id: "import-title", tabindex: "-1" }, `${text("import_title")}: ${name}`), element("p", {}, summary()),
    ...inspection.warnings.map((/** @type {string} */ warning) => element("p", { class: "warn", lang: "en" }, warning)),
    problem ? element("p", { id: "import-open-question", class: "warn", role: "status" }, `${text("import_question")}: `, english(problem)) : null,
    inspection.is_own ? element("p", { class: "good" }, text("import_own")) : null,
    table(text("import_table"), ["№", text("import_column"), text("import_is"), text("unit"), text("range"), text("why")], rows), options("import-known", [{ name: "-", description: text("import_unused") }, ...inspection.known]), options("import-units", UNITS), ...own,
    element("p", { class: "faint" }, text("import_note_help")),
    element("div", { class: "row" }, element("label", {}, text("import_rate"), rate), element("label", {}, text("import_note"), note), element("button", { type: "button", id: "import-note-add", onclick: () => attempt(() => addNote(note.value)) }, text("add")),
      ...Object.entries(inspection.notes).map(([key, value]) => element("span", { class: "row" }, element("span", { class: "mono" }, `${key}=${value}`),
        element("button", { type: "button", "data-remove-note": key, "aria-label": `${text("remove")}: ${key}=${value}`, onclick: () => attempt(() => removeNote(key)) }, text("remove"))))),
    element("p", {}, element("code", {}, inspection.command)),
    element("div", { class: "row" }, element("button", { type: "button", id: "import-accept", class: "main", disabled: problem != null, onclick: () => attempt(() => inspect(true)) }, text("import_accept")), element("button", { type: "button", onclick: close }, text("close"))),
    element("details", {}, element("summary", {}, text("import_as_text")), element("pre", { class: "mono", tabindex: "0", lang: "en" }, inspection.text)));
}

/** Replaces the form under the person's hands: the focus, and what is being typed, stay. @param {HTMLElement} place @param {...(Node|null)} children */
function fill(place, ...children) {
  const active = /** @type {any} */ (document.activeElement);
  const kept = place.contains(active) && active.id !== "" ? { id: active.id, typed: active.value !== active.defaultValue ? active.value : null } : null;
  place.replaceChildren(...children.filter((child) => child != null));
  const again = kept && byId(kept.id);
  if (!again) return;
  if (kept.typed != null && again.id !== "import-accept") again.value = kept.typed;
  again.focus();
}

function summary() {
  const { rows, duration_s, interval_s, gaps, jitter, separator, decimal } = inspection;
  const parts = [`${number(rows, 9)} ${text("rows")}`];
  if (interval_s) parts.push(`${number(duration_s, 5)} s`, `${number(1 / interval_s, 5)} ${text("hertz")}`, `${text("gaps")}: ${gaps}`, `${text("jitter")}: ${number(jitter < 1e-4 ? 0 : 100 * jitter, 2)} %`);
  if (separator) parts.push(`${text("separator")}: ${separator === "\t" ? "Tab" : `"${separator}"`}`, `${text("decimal_mark")}: "${decimal}"`);
  return parts.join("; ");
}

/** @param {string} typed */
async function addNote(typed) {
  const [key, value] = [typed.slice(0, typed.indexOf("=")).trim(), typed.slice(typed.indexOf("=") + 1).trim()];
  if (!typed.includes("=") || key === "" || value === "") throw new Error(`${text("import_note")}: u_V=at t`);
  stated.notes.set(key, value);
  try {
    await inspect(false);
    byId("import-note").value = "";
  } catch (error) {
    // One that is not understood is not stated.
    stated.notes.delete(key);
    throw error;
  }
}

/** Takes back what was stated; a note of the import file itself is removed with the next acceptance. @param {string} key */
async function removeNote(key) {
  stated.notes.delete(key);
  await inspect(false);
  if (!(key in inspection.notes)) return;
  stated.notes.set(key, "");
  await inspect(false);
}
