// Labelled fields of the forms, what is typed in them, and who has the control.
import { drives } from "./connection.js";
import { byId, element, programError } from "./dom.js";
import { parse, text } from "./text.js";

/** @param {string} key @param {any} input */
export const field = (key, input) => element("label", { class: "field" }, text(key), input);

/** The number in a field. @param {string} id @param {string} key of its label */
export function typed(id, key) {
  const value = parse(byId(id).value);
  if (!Number.isFinite(value)) throw new Error(`${text(key)}: ${byId(id).value}?`);
  return value;
}

/** The job has no answer. @param {any} job */
export const hasFailed = (job) => job.error !== "" || job.is_cancelled;

/** Why a job has no answer. @param {any} job */
export function jobError(job) {
  if (job.error === "") return new Error(`${text(job.kind)}: ${text("cancelled")}.`);
  return programError(job.error, { before: `${text(job.kind)}: ${job.is_cancelled ? `${text("cancelled")}. ` : ""}` });
}

/** Who has the control, and whether it can be taken. @param {any} now the state of the program @param {string} words @param {string} take ids of the text and the button */
export function showControl(now, words, take) {
  byId(words).textContent = text(drives() ? "you_drive" : now.driver == null ? "nobody_drives" : "other_drives");
  byId(take).disabled = now.driver != null;
}
