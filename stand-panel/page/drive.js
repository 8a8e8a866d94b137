// Control, drive, recording: every click sends one SCPI line or one command of `stand`, which the list of commands shows.
import { drives, leaveControl, on, request, state, takeControl } from "./connection.js";
import { attemptIn, byId, element, programError } from "./dom.js";
import { field, showControl, typed } from "./fields.js";
import { number, text } from "./text.js";

/** @type {{name: string, description: string, parameters: string[]}[]} */
let profiles = [];

/** Sends a line; an error is shown where the control is. @param {string} line */
export async function send(line) {
  const answer = await request("command", { client: state?.client ?? 0, line });
  if (answer.errors.length > 0) throw programError(answer.errors.join("; "));
  return answer.replies;
}

export const attempt = attemptIn("drive-error");

export async function buildDrive() {
  if (profiles.length === 0) profiles = (await request("profiles")).profiles;
  const input = (/** @type {string} */ id, /** @type {string} */ value) => element("input", { id, value, inputmode: "decimal", autocomplete: "off" });
  const modes = (/** @type {string} */ id) => element("select", { id, onchange: () => id === "record-mode" && suggest() },
    element("option", { value: "rate" }, text("mode_rate")), element("option", { value: "voltage" }, text("mode_voltage")));
  byId("drive-panel").replaceChildren(
    element("p", { id: "drive-error", class: "error", role: "alert", hidden: true }),
    element("fieldset", {}, element("legend", {}, text("control")), element("p", { id: "driver" }),
      element("div", { class: "row" }, element("button", { type: "button", id: "take", class: "main", onclick: takeControl }, text("take_control")),
        element("button", { type: "button", id: "leave", onclick: leaveControl }, text("release_control"))),
      element("p", { class: "faint" }, text("hidden_stops"))),
    element("fieldset", { id: "drive-fields" }, element("legend", {}, text("drive_start")),
      field("mode", modes("drive-mode")), field("setpoint", input("setpoint", number(5))),
      element("div", { class: "row" },
        element("button", { type: "button", id: "drive-start", onclick: () => attempt(driveOn) }, text("drive_start")),
        element("button", { type: "button", id: "drive-stop", onclick: () => attempt(() => send("OUTPut OFF")) }, text("drive_stop")),
        element("button", { type: "button", id: "clear", onclick: () => attempt(() => send("FAULt:CLEar")) }, text("clear_fault")))),
    element("fieldset", { id: "record-fields" }, element("legend", {}, text("record")),
      field("profile", element("select", { id: "profile" }, ...profiles.map(({ name, description }) => element("option", { value: name, selected: name === "multi-step", title: description }, name)))),
      field("mode", modes("record-mode")), field("amplitude", input("amplitude", number(15))), field("seconds", input("seconds", number(10))), field("seed", input("seed", "1")),
      element("p", {}, element("label", {}, element("input", { type: "checkbox", id: "find-index", checked: true }), text("find_index"))),
      element("p", {}, element("label", {}, element("input", { type: "checkbox", id: "unattended" }), text("unattended"))),
      element("button", { type: "button", id: "record", class: "main", onclick: () => attempt(record) }, text("start_recording"))),
    element("fieldset", { id: "job-drive" }, element("legend", {}, text("running")), element("p", { class: "job-stage", role: "status" }), element("progress", { class: "job-progress", max: 1 }),
      element("button", { type: "button", onclick: () => attempt(() => request("cancel", {})) }, text("cancel"))));
  show(state);
}

function suggest() {
  byId("amplitude").value = number(byId("record-mode").value === "rate" ? 15 : 0.7);
}

async function driveOn() {
  const isRate = byId("drive-mode").value === "rate";
  const setpoint = typed("setpoint", "setpoint");
  await send(isRate ? `SOURce:RATE ${setpoint}` : `SOURce:VOLTage ${setpoint}`);
  await send(`SOURce:MODE ${isRate ? "RATE" : "VOLTage"}`);
  await send("OUTPut ON");
}

async function record() {
  await request("record", {
    client: state?.client ?? 0, profile: byId("profile").value, mode: byId("record-mode").value, amplitude: typed("amplitude", "amplitude"),
    seconds: typed("seconds", "seconds"), seed: typed("seed", "seed"), find_index: byId("find-index").checked, unattended: byId("unattended").checked,
  });
}

/** @param {any} now the state of the program */
function show(now) {
  if (!now || !byId("driver")) return;
  const own = drives();
  showControl(now, "driver", "take");
  byId("leave").disabled = !own;
  const running = now.job.is_running;
  for (const id of ["drive-start", "drive-stop", "clear"]) byId(id).disabled = !own;
  byId("record").disabled = !own || running;
  byId("job-drive").hidden = !(running && now.job.kind === "record");
}

export function startDrive() {
  on("state", show);
}
