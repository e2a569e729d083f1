// Time lines: any curve, picked by name; those of one unit share a chart.
(function (NLOSIM) {
  "use strict";

  const { el } = NLOSIM;

  NLOSIM.timelines = function timelines(page, data) {
    const { clock } = page;
    const known = new Map(page.curves.map((curve) => [curve.name, curve]));
    const shown = new Set(data.shown);
    const listed = el("datalist", { id: "curves" });
    const list = () => listed.replaceChildren(...Array.from(known.values(), (curve) =>
      el("option", { value: curve.name }, curve.unit)));
    const pick = el("input", {
      type: "search", list: "curves", id: "pick", placeholder: `add one of ${known.size} signals …`,
      "aria-label": "add a signal", autocomplete: "off", spellcheck: "false",
      oninput: () => { if (known.has(pick.value)) add(pick.value, true); },
      onchange: () => add(pick.value, true),
    });
    const note = el("span", { class: "note" });
    const whole = el("button", { type: "button", class: "quiet", onclick: () => zoom(0, clock.span) }, "whole run");
    const place = el("div", { class: "charts" });
    const { whole: section, body } = NLOSIM.section("Time lines", { id: "timelines" });
    body.append(el("div", { class: "bar" }, pick, listed, whole, note), place);
    let charts = [];
    let zooming = false;

    function add(name, typed) {
      const curve = known.get(name);
      if (!curve) {
        const like = Array.from(known.keys()).filter((each) => each.includes(name));
        note.textContent = name ? (like.length ? `${like.length} names have “${name}” in them` : `nothing is called “${name}”`) : "";
        return;
      }
      note.textContent = "";
      if (typed) pick.value = "";
      shown.add(name);
      draw();
    }

    function draw() {
      const wanted = Array.from(shown, (name) => known.get(name)).filter(Boolean);
      charts = NLOSIM.charts(wanted).map((group) => NLOSIM.chart(page, group, {
        remove: (curve) => { shown.delete(curve.name); draw(); },
      }));
      place.replaceChildren(...charts.map((chart) => chart.whole));
      if (!charts.length) place.append(el("p", { class: "note" }, "No signal is picked."));
      charts.forEach((chart) => { chart.resize(); chart.show(clock.time); });
    }

    function zoom(min, max) {
      zooming = true;
      charts.forEach((chart) => chart.plot.setScale("x", { min, max }));
      zooming = false;
    }

    page.zoomed = (u) => {
      if (zooming || !charts.some((chart) => chart.plot === u)) return;
      const { min, max } = u.scales.x;
      if (Number.isFinite(min) && Number.isFinite(max)) zoom(min, max);
    };
    page.offer = (curve, show = true) => {
      known.set(curve.name, curve);
      list();
      if (show) shown.add(curve.name);
      draw();
    };
    page.withdraw = (name) => {
      known.delete(name);
      shown.delete(name);
    };
    page.isShown = (name) => shown.has(name);
    page.kept.push({
      name: "timelines",
      save: () => Array.from(shown),
      load: (names) => { shown.clear(); names.forEach((name) => shown.add(name)); draw(); },
    });
    clock.listen((time) => { if (section.open) charts.forEach((chart) => chart.show(time)); });
    const resize = () => charts.forEach((chart) => chart.resize());
    new ResizeObserver(resize).observe(place);
    page.sized.push(resize);
    section.addEventListener("toggle", () => clock.changed());
    if (data.thinned) note.textContent = "long curves keep the least and the greatest of each stretch";
    if (data.not_here.length) note.textContent = `${data.not_here.length} more signals had no place on the page`;
    list();
    requestAnimationFrame(draw);
    return section;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
