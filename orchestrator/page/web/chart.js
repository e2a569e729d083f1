// One chart of curves that share a unit, drawn by uPlot, with the cursor of the page.
(function (NLOSIM) {
  "use strict";

  const { el } = NLOSIM;
  const HEIGHT = 150;

  function axes(start, unit) {
    const font = "11px system-ui, sans-serif";
    const grid = { stroke: "#e6e6e6", width: 1 };
    const values = (_, ticks) => ticks.map((value) => NLOSIM.spell(value, 6));
    return [
      { font, grid, stroke: "#555", ticks: { show: false }, size: 24, values: (_, ticks) => NLOSIM.moments(start, ticks) },
      { font, grid, stroke: "#555", ticks: { show: false }, size: 52, values, label: unit || undefined,
        labelFont: font, labelSize: 16, labelGap: 0 },
    ];
  }

  NLOSIM.chart = function chart(page, curves, { remove }) {
    const { clock } = page;
    const shades = curves.map((_, k) => ({ colour: NLOSIM.cycle[k % NLOSIM.cycle.length], dash: NLOSIM.dashes[k % NLOSIM.dashes.length] }));
    const stepped = uPlot.paths.stepped({ align: 1 });
    const series = curves.map((curve, k) => ({
      label: curve.name,
      stroke: shades[k].colour,
      dash: shades[k].dash,
      width: 1.5,
      paths: curve.holds ? stepped : undefined,
      points: { show: curve.times.length < 2 },
    }));
    const readings = curves.map(() => el("b", {}));
    const legend = el("ul", { class: "legend" }, curves.map((curve, k) => el("li", {},
      NLOSIM.swatch(shades[k].colour, shades[k].dash), el("span", {}, curve.name), " ", readings[k],
      el("button", { type: "button", class: "quiet", title: `remove ${curve.name}`,
        "aria-label": `remove ${curve.name}`, onclick: () => remove(curve) }, "×"))));
    const place = el("div", { class: "plot" });
    const whole = el("figure", { class: "chart" }, legend, place);
    const now = el("div", { class: "now" });
    const plot = new uPlot({
      width: 600,
      height: HEIGHT,
      legend: { show: false },
      cursor: { drag: { x: true, y: false, setScale: true }, points: { show: false }, y: false },
      scales: { x: { time: false, range: (_, low, high) => (low < high ? [low, high] : [low - 1, low + 1]) } },
      axes: axes(page.start, curves[0].unit),
      series: [{}, ...series],
      hooks: {
        ready: [(u) => follow(u, clock)],
        draw: [(u) => mark(u, now, clock.time)],
        setScale: [(u, key) => key === "x" && page.zoomed && page.zoomed(u)],
      },
    }, NLOSIM.aligned(curves), place);
    plot.over.append(now);
    let seen = true; // out of the window nothing needs to move
    const chart = {
      whole,
      plot,
      resize: () => plot.setSize({ width: Math.max(200, place.clientWidth), height: HEIGHT }),
      show: (time) => {
        if (!seen) return;
        mark(plot, now, time);
        curves.forEach((curve, k) => {
          const text = `${NLOSIM.spell(curve.at(time), 4)}${curve.unit ? ` ${curve.unit}` : ""}`;
          if (readings[k].textContent !== text) readings[k].textContent = text;
        });
      },
    };
    new IntersectionObserver(([entry]) => {
      seen = entry.isIntersecting;
      chart.show(clock.time);
    }).observe(whole);
    return chart;
  };

  // The shared cursor, an element above the curves: they are not drawn again for it.
  function mark(u, now, time) {
    const x = u.valToPos(time, "x");
    now.hidden = !(x >= 0 && x <= u.bbox.width / devicePixelRatio);
    now.style.transform = `translateX(${x}px)`;
  }

  // A click, or a finger that moves along, takes the time of the page with it.
  function follow(u, clock) {
    const seek = (event) => {
      const box = u.over.getBoundingClientRect();
      clock.seek(u.posToVal(event.clientX - box.left, "x"));
    };
    u.over.addEventListener("click", seek);
    u.over.addEventListener("touchmove", (event) => {
      if (event.touches.length !== 1) return;
      seek(event.touches[0]);
      event.preventDefault();
    }, { passive: false });
  }

  // A piece of line, as legends show it.
  NLOSIM.swatch = (colour, dash) => NLOSIM.svg("svg", { class: "swatch", width: 26, height: 8, viewBox: "0 0 26 8" },
    NLOSIM.svg("line", { x1: 1, y1: 4, x2: 25, y2: 4, stroke: colour, "stroke-width": 2.5,
      "stroke-dasharray": (dash || []).join(" ") }));
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
