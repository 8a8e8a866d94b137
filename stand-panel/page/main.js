// The page: header, STOP, tabs, language; the views are in their modules.
import { buildCompensate, startCompensate } from "./compensate.js";
import { connect, hasToken, on, state, stop } from "./connection.js";
import { buildDrive, send, startDrive } from "./drive.js";
import { byId, element, english } from "./dom.js";
import { buildIdentify, startIdentify } from "./identify.js";
import { buildLaboratory, startLaboratory } from "./laboratory.js";
import { relabelLive, startLive } from "./live.js";
import { buildMeasure, startMeasure } from "./measure.js";
import { sentence, setLanguage, text } from "./text.js";

/** Lines of the view Commands, as many as the program keeps. */
const MAX_NOTES = 500;
const VIEWS = ["live", "identify", "compensate", "measure", "laboratory", "commands"];

// STOP first: it works whatever else of the page fails.
byId("stop").addEventListener("pointerdown", stop);
byId("stop").addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
  if (event.key !== "Enter" && event.key !== " ") return;
  // Otherwise the browser makes a click of the key, which would be a second press.
  event.preventDefault();
  if (!event.repeat) stop();
});
// A click without a pointer: of a screen reader, or by voice.
byId("stop").addEventListener("click", (/** @type {MouseEvent} */ event) => event.detail === 0 && stop());
addEventListener("keydown", (event) => event.key === "Escape" && !event.repeat && stop(), { capture: true });

/** @param {...(Node|string)} parts none: nothing to tell */
function alert(...parts) {
  const place = byId("alert");
  const message = element("p", {}, ...parts);
  // A message that stays is not read again by a screen reader.
  if (place.textContent !== message.textContent) place.replaceChildren(...message.childNodes);
  place.hidden = parts.length === 0;
}

/** @param {any} now */
function showState(now) {
  byId("port").textContent = now.port;
  byId("folder").textContent = now.folder;
  const { drive } = now;
  byId("drive-state").textContent = text(drive.is_on ? "drive_on" : "drive_off") + (drive.is_on ? ` (${drive.mode})` : "") + (/^("?none"?)?$/i.test(drive.limits) ? "" : ` · ${text("limits")}: ${drive.limits}`);
  const parts = [];
  if (drive.line_error) parts.push(`${text("line_down")}: `, english(drive.line_error), ". ");
  if (drive.fault) parts.push(`${text("fault")} `, english(drive.fault.replace(",", ": ").replace(",", " – ")), ". ");
  if (drive.fault && drive.stopped_because) parts.push(`${text("stopped_because")}: ${sentence("stopped", drive.stopped_because)}.`);
  alert(...parts);
  for (const node of document.querySelectorAll(".job-stage")) node.textContent = now.job.is_running ? `${text(now.job.kind)}: ${sentence("stage", now.job.stage)}` : "";
  for (const node of document.querySelectorAll(".job-progress")) {
    if (now.job.fraction == null) node.removeAttribute("value");
    else node.setAttribute("value", now.job.fraction);
  }
}

/** @param {string} name */
function select(name) {
  for (const view of VIEWS) {
    const tab = byId(`tab-${view}`);
    tab.setAttribute("aria-selected", String(view === name));
    tab.tabIndex = view === name ? 0 : -1;
    byId(`view-${view}`).hidden = view !== name;
  }
}
VIEWS.forEach((view) => {
  const tab = byId(`tab-${view}`);
  tab.addEventListener("click", () => select(view));
  tab.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const offered = VIEWS.filter((name) => !byId(`tab-${name}`).hidden);
    const next = offered[(offered.indexOf(view) + step + offered.length) % offered.length];
    select(next);
    byId(`tab-${next}`).focus();
  });
});

/** @type {any[]} */
let sent = [];

function buildCommands() {
  const line = element("input", { id: "console-line", class: "mono", size: 50, autocomplete: "off", spellcheck: "false", maxlength: 180 });
  const submit = (/** @type {Event} */ event) => {
    event.preventDefault();
    if (line.value.trim() === "") return;
    // The reply and an error come as a command note.
    send(line.value).catch(() => {});
    line.value = "";
  };
  byId("view-commands").replaceChildren(
    element("form", { class: "row", onsubmit: submit }, element("label", {}, text("console"), line), element("button", { class: "main" }, text("send")),
      element("button", { type: "button", onclick: () => navigator.clipboard.writeText(sent.map((note) => note.line).join("\n")) }, text("copy"))),
    element("pre", { id: "log", lang: "en", tabindex: "0", role: "log", "aria-label": text("commands") }),
    element("p", { class: "faint" }, `${text("replay_note")} ${text("session_folder")}: `, element("span", { id: "folder", class: "mono" }, state?.folder ?? "")));
  sent.forEach(showCommand);
}

/** @param {any} note */
function showCommand(note) {
  const log = byId("log");
  if (!log) return;
  log.append(element("span", { class: "faint" }, `${note.t_s.toFixed(2).padStart(8)} `), element("span", { class: "sent" }, `> ${note.line}\n`));
  for (const reply of note.replies) log.append(`${" ".repeat(11)}${reply}\n`);
  for (const error of note.errors) log.append(element("span", { class: "bad" }, `${" ".repeat(11)}${error}\n`));
  log.scrollTop = log.scrollHeight;
}

async function build(/** @type {string} */ language) {
  setLanguage(language);
  localStorage.setItem("language", language);
  buildCommands();
  relabelLive();
  await buildDrive();
  await buildIdentify();
  await buildCompensate();
  await buildMeasure();
  await buildLaboratory();
}

/** One build after the other: a second one would replace elements under the first. */
let building = Promise.resolve();
const rebuild = (/** @type {string} */ language) => {
  building = building.then(() => build(language)).catch((error) => alert(error.message));
};

byId("language").addEventListener("change", () => rebuild(byId("language").value));
const language = localStorage.getItem("language") ?? (navigator.language.startsWith("uk") ? "uk" : "en");
byId("language").value = language;
setLanguage(language);
if (hasToken()) {
  on("state", showState);
  on("command", (note) => {
    sent = [...sent, note].slice(-MAX_NOTES);
    showCommand(note);
  });
  on("lost", () => {
    sent = [];
    byId("log")?.replaceChildren();
    alert(text("server_gone"));
    byId("drive-state").textContent = "";
  });
  startLive();
  startDrive();
  startIdentify();
  startCompensate();
  startMeasure();
  startLaboratory();
  connect();
  rebuild(language);
} else {
  alert(text("no_token"));
}
