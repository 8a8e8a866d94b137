// A plot that was clicked or reached with Tab: the wheel, + and - zoom, dragging and the arrow keys move, a double click, 0 and Esc show the whole.
// No less-than sign and no ampersand: the page is well-formed XML.
for (const svg of document.querySelectorAll("figure svg")) {
  const { x, y, width, height } = svg.viewBox.baseVal;
  let view = [x, y, width, height];
  let grip = null;
  const within = (value, least, most) => Math.min(Math.max(value, least), most);
  const show = () => {
    view[0] = within(view[0], x, x + width - view[2]);
    view[1] = within(view[1], y, y + height - view[3]);
    svg.setAttribute("viewBox", view.join(" "));
  };
  const zoom = (factor, [right, down]) => {
    const scale = within(view[2] * factor, width / 64, width) / view[2];
    view = [view[0] + right * view[2] * (1 - scale), view[1] + down * view[3] * (1 - scale), view[2] * scale, view[3] * scale];
    show();
  };
  const move = (right, down) => {
    view[0] += right * view[2];
    view[1] += down * view[3];
    show();
  };
  const whole = () => {
    view = [x, y, width, height];
    show();
  };
  const place = (event) => {
    const box = svg.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  };
  const keys = {
    "+": () => zoom(0.7, [0.5, 0.5]), "=": () => zoom(0.7, [0.5, 0.5]), "-": () => zoom(1 / 0.7, [0.5, 0.5]),
    ArrowLeft: () => move(-0.1, 0), ArrowRight: () => move(0.1, 0), ArrowUp: () => move(0, -0.1), ArrowDown: () => move(0, 0.1),
    "0": whole, Escape: whole,
  };
  svg.tabIndex = 0;
  svg.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || !keys[event.key]) return;
    keys[event.key]();
    event.preventDefault();
  });
  svg.addEventListener("wheel", (event) => {
    if (document.activeElement !== svg) return; // the wheel scrolls the page until the plot is clicked
    zoom(event.deltaY > 0 ? 1 / 0.8 : 0.8, place(event));
    event.preventDefault();
  }, { passive: false });
  svg.addEventListener("dblclick", whole);
  svg.addEventListener("pointerdown", (event) => { grip = place(event); });
  svg.addEventListener("pointermove", (event) => {
    if (!grip || event.buttons === 0) return;
    const now = place(event);
    move(grip[0] - now[0], grip[1] - now[1]);
    grip = now;
  });
}
