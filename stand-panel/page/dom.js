// Small helpers for elements. Text is always set as text: file names, notes and replies of a stand are data.

/**
 * An element with properties and children.
 * @param {string} tag
 * @param {Record<string, any>} [properties] attributes; `on…` are listeners
 * @param {...(Node|string|number|null)} children
 * @returns {any}
 */
export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value != null) made.setAttribute(name, String(value));
  }
  made.append(...children.filter((child) => child != null).map((child) => (child instanceof Node ? child : String(child))));
  return made;
}

/** @param {string} id @returns {any} */
export function byId(id) {
  return document.getElementById(id);
}

/** Text of the program, its firmware or the catalogue of effects: English in both languages. @param {string} words */
export const english = (words) => element("span", { lang: "en" }, words);

/** An error that the program states; `before`: words of the page before it. @param {string} message @param {any} [more] */
export const programError = (message, more = {}) => Object.assign(new Error(message), { isEnglish: true, before: "", ...more });

/** Runs actions of buttons and shows the error of the last one in the element of this id. @param {string} id */
export const attemptIn = (id) => async (/** @type {() => Promise<any>} */ action) => {
  const place = byId(id);
  place.hidden = true;
  try {
    await action();
  } catch (error) {
    const { message, isEnglish, before } = /** @type {any} */ (error);
    place.replaceChildren(before ?? "", isEnglish ? english(message) : message);
    place.hidden = false;
  }
};

/** @param {Blob} blob @param {string} name */
export function download(blob, name) {
  const address = URL.createObjectURL(blob);
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** A picture of the program's reports: an image, in which no script runs. @param {string} svg @param {string} alt */
export function svgFigure(svg, alt) {
  const src = URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
  return element("figure", {}, element("img", { alt, src, onload: () => URL.revokeObjectURL(src) }));
}

/** A table with a caption. The cells of numbers are right-aligned.
 * @param {string} caption @param {string[]} heads @param {(Node|string|number)[][]} rows */
export function table(caption, heads, rows) {
  const cell = (/** @type {any} */ value) => element("td", typeof value === "number" ? { class: "number" } : {}, value);
  return element("table", {}, element("caption", { class: "faint" }, caption),
    element("thead", {}, element("tr", {}, ...heads.map((head) => element("th", { scope: "col" }, head)))),
    element("tbody", {}, ...rows.map((row) => element("tr", {}, ...row.map(cell)))));
}
