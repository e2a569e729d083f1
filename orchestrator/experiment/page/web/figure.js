// The frame of a figure: its picture, what a mark says, a click to the run, export as SVG and CSV.
(function (NLOSIM) {
  "use strict";

  const { el, svg } = NLOSIM;
  const REACH = 14; // of a pointer [pixel]

  // Offers a text as a file.
  NLOSIM.save = function save(name, type, text) {
    const address = URL.createObjectURL(new Blob([text], { type }));
    el("a", { href: address, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  };

  // A picture that stands alone: everything it needs is in its attributes.
  NLOSIM.picture = function picture(width, height, title) {
    const whole = svg("svg", {
      xmlns: "http://www.w3.org/2000/svg", viewBox: `0 0 ${width} ${height}`, width, height, role: "img",
      "font-family": "system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif", "font-size": 12,
    }, svg("title", {}, title), svg("rect", { width, height, fill: "#ffffff" }));
    return whole;
  };

  NLOSIM.fileName = (...parts) => parts.filter(Boolean).join("-").replace(/[^\w.-]+/g, "_").slice(0, 80);

  // `make()` says what is shown, `draw(shown, width)` returns the picture and its points.
  NLOSIM.figure = function figure(page, { id, title, make, draw, note = null }) {
    const heading = el("h3", {}, title);
    const place = el("div", { class: "picture" });
    const tip = el("div", { class: "tip", hidden: true });
    const numbers = el("details", { class: "numbers" }, el("summary", {}, "numbers"));
    const remark = el("p", { class: "note" });
    const tool = (text, what, onclick) => el("button", { type: "button", class: "tool", title: what, onclick }, text);
    const name = () => NLOSIM.fileName(page.results.about.title, id, shown.metric.name);
    let shown = null;
    let drawn = null;
    const bar = el("div", { class: "figure-head" }, heading,
      tool("SVG", `save "${title}" as SVG`, () => NLOSIM.save(`${name()}.svg`, "image/svg+xml", chart.svg())),
      tool("CSV", `save the numbers of "${title}" as CSV`, () => NLOSIM.save(`${name()}.csv`, "text/csv", chart.csv())));
    const whole = el("figure", { class: "figure", id }, bar, place, remark, numbers);

    const nearest = (event) => {
      if (!drawn) return null;
      const area = drawn.picture.getBoundingClientRect();
      const ratio = drawn.width / area.width;
      const [x, y] = [(event.clientX - area.left) * ratio, (event.clientY - area.top) * ratio];
      let best = null;
      let least = REACH * ratio * REACH * ratio;
      for (const point of drawn.points) {
        const far = (point.x - x) ** 2 + (point.y - y) ** 2;
        if (far < least) [best, least] = [point, far];
      }
      return best && { point: best, left: best.x / ratio, top: best.y / ratio, width: area.width };
    };
    const hover = (event) => {
      const found = nearest(event);
      tip.hidden = !found;
      place.style.cursor = found && found.point.run !== undefined ? "pointer" : "";
      if (!found) return;
      tip.textContent = found.point.text();
      tip.style.top = `${found.top + 12}px`;
      tip.style.left = `${Math.max(0, Math.min(found.left + 10, found.width - 230))}px`;
    };
    place.addEventListener("pointermove", hover);
    place.addEventListener("pointerleave", () => { tip.hidden = true; });
    place.addEventListener("click", (event) => {
      const found = nearest(event);
      if (!found || found.point.run === undefined) return;
      page.onLeft = event.clientX > innerWidth / 2; // the card does not cover what was clicked
      page.select(found.point.run, found.point.other);
    });

    function table() {
      const [head, ...rows] = shown.table;
      const most = 200;
      const body = rows.slice(0, most).map((row) => el("tr", {}, row.map((value) => el("td", {}, NLOSIM.spell(value, 6)))));
      numbers.replaceChildren(el("summary", {}, "numbers"), el("div", { class: "scroll" }, el("table", { class: "grid" },
        el("thead", {}, el("tr", {}, head.map((text) => el("th", { scope: "col" }, text)))), el("tbody", {}, body))),
      rows.length > most ? el("p", { class: "note" }, `The first ${most} of ${rows.length} rows; the CSV has all.`) : "");
    }
    numbers.addEventListener("toggle", () => numbers.open && table());

    const chart = {
      whole,
      get shown() { return shown; },
      get points() { return drawn ? drawn.points : []; },
      svg: () => `<?xml version="1.0" encoding="UTF-8"?>\n${new XMLSerializer().serializeToString(drawn.picture)}\n`,
      csv: () => NLOSIM.csv(shown.table),
      update() {
        shown = make();
        whole.hidden = shown === null;
        if (shown === null) return;
        remark.textContent = note ? note(shown) : "";
        chart.redraw();
        if (numbers.open) table();
      },
      redraw() {
        if (shown === null) return;
        const width = document.documentElement.classList.contains("printing") ? 640 : Math.max(280, place.clientWidth || 640);
        drawn = { width, ...draw(shown, width) };
        place.replaceChildren(drawn.picture, tip);
        tip.hidden = true;
      },
    };
    page.sized.push(() => chart.redraw());
    return chart;
  };

  // Rings around the chosen run, and thin ones around those with the same seed.
  NLOSIM.rings = function rings(page, picture, points) {
    const { results, chosen } = page;
    if (chosen === null) return;
    const seed = results.seed[chosen];
    for (const point of points) {
      if (point.run === undefined || results.seed[point.run] !== seed) continue;
      const own = point.run === chosen || point.other === chosen;
      picture.append(svg("circle", { cx: point.x, cy: point.y, r: own ? 7 : 5, fill: "none", stroke: own ? "#000000" : "#6b6b6b", "stroke-width": own ? 2 : 1 }));
    }
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
