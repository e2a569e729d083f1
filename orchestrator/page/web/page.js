// Puts the page together.
(async function start(NLOSIM) {
  "use strict";

  const { el } = NLOSIM;
  const main = document.getElementById("main");
  const fail = (error) => {
    main.replaceChildren(el("p", { class: "alarm", role: "alert" }, `This page cannot be shown: ${error.message}`));
    throw error;
  };
  const began = performance.now();

  try {
    const data = JSON.parse(document.getElementById("data").textContent);
    const letters = document.getElementById("arrays");
    const bytes = await NLOSIM.unpacked(letters.textContent.trim());
    letters.remove();
    const arrays = new NLOSIM.Arrays(bytes);
    const clock = new NLOSIM.Clock(data.span, (next) => requestAnimationFrame(next));
    const page = { data, arrays, clock, start: data.start, sized: [], kept: [], curves: NLOSIM.curvesOf(data, arrays) };
    NLOSIM.page = page;
    NLOSIM.head(document.getElementById("head"), page, data.about);
    page.hint = "Drag a chart to zoom into it, click it to go there.";
    NLOSIM.keys(page);
    NLOSIM.timeKeys(page);
    const parts = [];
    const lines = NLOSIM.timelines(page, data);
    for (const [name, content] of Object.entries(data.layers)) {
      parts.push(...NLOSIM.layers[name].start(page, content));
    }
    const left = Object.entries(data.left_out).map(([name, why]) =>
      el("p", { class: "note" }, `The ${name} is left out: ${why}`));
    main.replaceChildren(...parts, ...left, lines, NLOSIM.wiring(page, data.wiring), NLOSIM.metrics(data.metrics),
      NLOSIM.manifest(data.about));
    NLOSIM.player(document.getElementById("player"), page);
    for (const [when, on] of [["beforeprint", true], ["afterprint", false]]) {
      window.addEventListener(when, () => { // pictures have to have the width of the paper before it is laid out
        document.documentElement.classList.toggle("printing", on);
        for (const resize of page.sized) resize();
      });
    }
    // What a reader has chosen, for a newer page of the same run.
    page.save = () => ({
      time: clock.time,
      open: Array.from(document.querySelectorAll("details.section[id]"), (each) => [each.id, each.open]),
      scroll: window.scrollY,
      parts: Object.fromEntries(page.kept.map(({ name, save }) => [name, save()])),
    });
    page.restore = (saved) => {
      for (const [id, open] of saved.open) {
        const section = document.getElementById(id);
        if (section) section.open = open;
      }
      for (const { name, load } of page.kept) if (saved.parts[name]) load(saved.parts[name]);
      clock.seek(saved.time);
      window.scrollTo(0, saved.scroll);
    };
    page.ready = performance.now() - began; // [ms]
    const { hash } = location;
    clock.seek(hash.startsWith("#t=") ? Number(hash.slice(3)) - data.start : page.opening || 0);
  } catch (error) {
    fail(error);
  }
})(NLOSIM);
