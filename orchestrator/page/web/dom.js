// Elements of the page. Text is only ever set as text: names come from users.
(function (NLOSIM) {
  "use strict";

  function fill(element, attributes, children) {
    for (const [name, value] of Object.entries(attributes || {})) {
      if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
      else if (value === true) element.setAttribute(name, "");
      else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
    }
    for (const child of children.flat()) {
      if (child === null || child === undefined || child === false) continue;
      element.append(child instanceof Node ? child : String(child));
    }
    return element;
  }

  NLOSIM.el = (tag, attributes, ...children) =>
    fill(document.createElement(tag), attributes, children);

  NLOSIM.svg = (tag, attributes, ...children) =>
    fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);

  // A folding part of the page.
  NLOSIM.section = function section(title, { open = true, id = null } = {}) {
    const body = NLOSIM.el("div", { class: "body" });
    const summary = NLOSIM.el("summary", {}, NLOSIM.el("h2", {}, title));
    const whole = NLOSIM.el("details", { class: "section", open, id }, summary, body);
    return { whole, body };
  };

  // Five significant digits, as short as they can be.
  NLOSIM.spell = function spell(value, digits = 5) {
    if (value === null || value === undefined || Number.isNaN(value)) return "–";
    if (typeof value !== "number") return String(value);
    if (Number.isInteger(value) && Math.abs(value) < 1e9) return String(value).replace("-", "−");
    const text = Number(value.toPrecision(digits)).toString();
    return text.replace("-", "−").replace("e+", "e");
  };

  NLOSIM.colours = {
    blue: "#0072B2", vermillion: "#D55E00", green: "#009E73", purple: "#CC79A7", orange: "#E69F00",
    sky: "#56B4E9", black: "#000000", grey: "#7F7F7F",
  };
  const { blue, vermillion, green, purple, orange, sky, black } = NLOSIM.colours;
  NLOSIM.cycle = [blue, vermillion, green, purple, orange, sky, black];
  NLOSIM.dashes = [[], [7, 3], [2, 3], [9, 3, 2, 3], [12, 4], [4, 2], [1, 3]];
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
