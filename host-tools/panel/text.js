// All words of the page: one table of keys, each in English and Ukrainian.
// Units, channel names, SCPI lines and the answers of the analyses are the same in both.

/** @type {Record<string, [string, string]>} */
export const TEXT = {
  language: ["Language", "Мова"],
  stop: ["STOP (Esc)", "СТОП (Esc)"],
  stop_note: ["STOP is not an emergency stop: it is a command over a computer. A bench needs a switch that removes the supply.", "СТОП не є аварійною зупинкою: це команда через комп'ютер. Стенд потребує вимикача, який знімає живлення."],
  live: ["Live", "Вимірювання"],
  identify: ["Identify", "Ідентифікація"],
  commands: ["Commands", "Команди"],
  drive_on: ["Drive on", "Привод увімкнено"],
  drive_off: ["Drive off", "Привод вимкнено"],
  limits: ["limits in force", "діють обмеження"],
  fault: ["Fault", "Відмова"],
  stopped_because: ["Stopped", "Зупинено"],
  line_down: ["The line to the stand is down", "Зв'язок зі стендом втрачено"],
  server_gone: ["No connection to the program `stand panel`. The drive is switched off within 0.5 s by the stand itself. Reload the page when the program runs again.", "Немає зв'язку з програмою `stand panel`. Стенд сам вимикає привод за 0,5 с. Перезавантажте сторінку, коли програма знову працюватиме."],
  no_token: ["The address lacks its key. Open the page with the address that `stand panel` has printed.", "В адресі немає ключа. Відкрийте сторінку за адресою, яку надрукувала `stand panel`."],
  control: ["Control", "Керування"],
  take_control: ["Take the control", "Взяти керування"],
  release_control: ["Release the control", "Віддати керування"],
  you_drive: ["This page drives the stand.", "Ця сторінка керує стендом."],
  other_drives: ["Another page drives the stand. STOP works here too.", "Стендом керує інша сторінка. СТОП діє і тут."],
  nobody_drives: ["No page drives the stand.", "Жодна сторінка не керує стендом."],
  hidden_stops: ["A hidden or frozen page stops the drive.", "Прихована або зависла сторінка зупиняє привод."],
  mode: ["Mode", "Режим"],
  mode_rate: ["rate", "швидкість"],
  mode_voltage: ["voltage", "напруга"],
  setpoint: ["Setpoint", "Завдання"],
  drive_start: ["Drive on", "Увімкнути"],
  drive_stop: ["Drive off", "Вимкнути"],
  clear_fault: ["Clear the fault", "Скинути відмову"],
  record: ["Record", "Запис"],
  profile: ["Profile", "Профіль"],
  amplitude: ["Amplitude", "Амплітуда"],
  seconds: ["Duration, s", "Тривалість, с"],
  seed: ["Seed", "Зерно"],
  find_index: ["Find the index first", "Спершу знайти індекс"],
  unattended: ["Unattended: keep driving if this page is hidden or closed, for the duration and 60 s at most", "Без нагляду: не зупиняти, якщо сторінку приховано чи закрито, щонайбільше на тривалість і 60 с"],
  start_recording: ["Run the profile and record", "Виконати профіль і записати"],
  pause: ["Pause", "Пауза"],
  resume: ["Resume", "Продовжити"],
  export_csv: ["Visible range as CSV", "Видимий діапазон у CSV"],
  export_png: ["Plots as PNG", "Графіки у PNG"],
  summary: ["Values", "Значення"],
  channel: ["channel", "канал"],
  value: ["value", "значення"],
  minimum: ["min", "мін"],
  maximum: ["max", "макс"],
  mean: ["mean", "середнє"],
  rows_lost: ["rows lost", "втрачено рядків"],
  time_s: ["time, s", "час, с"],
  log: ["Log", "Журнал"],
  model: ["Model", "Модель"],
  no_log: ["no log yet: record one", "ще немає журналу: зробіть запис"],
  compare: ["Compare", "Порівняти"],
  fit: ["Fit the parameters", "Підібрати параметри"],
  explain: ["Explain", "Пояснити"],
  cancel: ["Cancel", "Скасувати"],
  running: ["running", "виконується"],
  parameters: ["Parameters", "Параметри"],
  parameter: ["parameter", "параметр"],
  unit: ["unit", "одиниця"],
  effects: ["Effects", "Ефекти"],
  save: ["Save the values", "Зберегти значення"],
  remove: ["Remove", "Вилучити"],
  add: ["Add", "Додати"],
  own_effect: ["Effect of your own: torque, N m", "Власний ефект: момент, Н·м"],
  own_name: ["name", "назва"],
  own_expression: ["expression of t theta omega i u T", "вираз від t theta omega i u T"],
  own_parameters: ["parameters, e.g. a=0.001 w0=0.5", "параметри, напр. a=0.001 w0=0.5"],
  where_it_fails: ["Where the model fails", "Де модель не сходиться"],
  adequate: ["No misfit is significant.", "Значущих розбіжностей немає."],
  output: ["output", "вихід"],
  rms: ["rms of the residual", "СКЗ залишку"],
  noise: ["noise", "шум"],
  ratio: ["ratio", "відношення"],
  candidates: ["Candidates", "Кандидати"],
  effect: ["effect", "ефект"],
  evidence: ["ΔBIC", "ΔBIC"],
  judgement: ["judgement", "оцінка"],
  page: ["Page", "Сторінка"],
  verdict: ["Verdict", "Висновок"],
  staircase: ["Error after each step (rms / noise of the worst output, logarithmic)", "Похибка після кожного кроку (СКЗ / шум найгіршого виходу, логарифмічно)"],
  measured: ["measured", "виміряно"],
  modelled: ["model", "модель"],
  residual: ["residual", "залишок"],
  console: ["SCPI line to the stand", "Рядок SCPI до стенда"],
  send: ["Send", "Надіслати"],
  copy: ["Copy all", "Копіювати все"],
  replay_note: ["The same commands are in commands.txt of the session's folder, as a script for a shell.", "Ті самі команди є у commands.txt у теці сеансу, як сценарій для оболонки."],
  session_folder: ["Session folder", "Тека сеансу"],
  signature: ["Signature", "Ознака"],
  equation: ["Equation", "Рівняння"],
  experiment: ["Experiment", "Дослід"],
  similar: ["Similar effects", "Подібні ефекти"],
  close: ["Close", "Закрити"],
};

let column = 0;

/** The text of a key in the language of the page. @param {string} key */
export function text(key) {
  const pair = TEXT[key];
  return pair ? pair[column] : key;
}

/** A number with `digits` significant digits, with the decimal sign of the language. @param {number|null|undefined} value @param {number} [digits] */
export function number(value, digits = 5) {
  if (value == null || !Number.isFinite(value)) return "–";
  const plain = value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6) ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
  return column === 1 ? plain.replace(".", ",") : plain;
}

/** A number that a person has typed, with a decimal point or comma. @param {string} typed */
export function parse(typed) {
  const value = Number(typed.trim().replace(",", "."));
  return typed.trim() === "" ? NaN : value;
}

/** Switches the language and every element with `data-text`. @param {string} language */
export function setLanguage(language) {
  column = language === "uk" ? 1 : 0;
  document.documentElement.lang = language;
  for (const node of document.querySelectorAll("[data-text]")) node.textContent = text(/** @type {HTMLElement} */ (node).dataset.text ?? "");
}
