// Puts the page of an experiment together.
(async function start(NLOSIM) {
  "use strict";

  const { el } = NLOSIM;
  const main = document.getElementById("main");
  const began = performance.now();

  try {
    const data = JSON.parse(document.getElementById("data").textContent);
    const letters = document.getElementById("arrays");
    const bytes = await NLOSIM.unpacked(letters.textContent.trim());
    letters.remove();
    const arrays = new NLOSIM.Arrays(bytes);
    const results = new NLOSIM.Results(data, arrays);
    const page = { arrays, results, view: NLOSIM.viewOf(results, location.hash.slice(1)), chosen: null, partner: null, sized: [] };
    NLOSIM.page = page;
    page.hint = "A click on a dot or a row chooses its run; thin rings are runs with the same seed.";
    NLOSIM.keys(page);
    NLOSIM.experimentHead(document.getElementById("head"), page);

    const controls = NLOSIM.controls(page);
    const pairControls = NLOSIM.pairControls(page);
    const figures = [
      NLOSIM.figure(page, {
        id: "means", title: "Means with intervals of 95 %",
        make: () => ({ ...NLOSIM.meansOf(results, page.view), toScale: page.view.toScale }),
        draw: (shown, width) => NLOSIM.drawMeans(page, shown, width),
        note: ({ metric }) => (metric.kind === "share" ? "Shares with intervals of Wilson." : "Means with intervals of Student's t."),
      }),
      NLOSIM.figure(page, {
        id: "spread", title: "Every run",
        make: () => NLOSIM.spreadOf(results, page.view),
        draw: (shown, width) => NLOSIM.drawSpread(page, shown, width),
        note: ({ metric }) => (metric.kind === "share" ? "A dot is a run." : "A dot is a run; boxes hold the middle half with the median, lines reach the least and the greatest."),
      }),
    ];
    const pairs = NLOSIM.figure(page, {
      id: "pairs", title: "Differences by the same seeds",
      make: () => (page.view.factor < 0 ? null : NLOSIM.pairsOf(results, page.view)),
      draw: (shown, width) => NLOSIM.drawPairs(page, shown, width),
      note: pairNote,
    });
    page.charts = { means: figures[0], spread: figures[1], pairs };
    const card = NLOSIM.card(page);
    const table = NLOSIM.runTable(page);

    function pairNote({ rows, metric, names }) {
      const left = data.pairs.left_out && !rows.length ? "These differences are not on this page, which has those to the first level of each factor first. " : "";
      const none = !rows.length && !left ? (names[0] === names[1] ? "Choose two levels. " : "No condition has both. ") : "";
      const more = rows.length > 40 ? `The first 40 of ${rows.length} conditions are drawn; the numbers have all. ` : "";
      const how = metric.kind === "share" ? "Newcombe's interval for pairs." : "Student's t of the differences.";
      return `${left}${none}${more}A triangle is a pair of runs with the same seed; a diamond is the mean with its interval of 95 %: ${how}`;
    }

    page.show = (changes) => {
      page.view = NLOSIM.settled(results, { ...page.view, ...changes }, page.view);
      for (const each of [controls, pairControls]) each.show();
      for (const each of [...figures, pairs]) each.update();
      history.replaceState(null, "", `#${NLOSIM.hashOf(results, page.view)}`);
    };
    page.select = (run, partner = null) => {
      page.chosen = run;
      page.partner = partner;
      card.show();
      table.show();
      for (const each of [...figures, pairs]) each.redraw();
    };
    page.step = (by) => {
      const runs = page.ordered();
      if (!runs.length) return;
      const at = runs.indexOf(page.chosen);
      page.select(runs[at < 0 ? 0 : Math.max(0, Math.min(runs.length - 1, at + by))]);
    };

    const cycle = (value, from, count) => from + ((value - from + 1) % (count - from));
    page.key(["m"], "the next metric", () => page.show({ metric: cycle(page.view.metric, 0, results.drawn.length) }));
    page.key(["x"], "the next factor along the axis", () => {
      const x = cycle(page.view.x, -1, results.factors.length);
      page.show({ x, group: page.view.group === x ? -1 : page.view.group });
    });
    page.key(["ArrowLeft", "ArrowRight"], "the run before, the next one, in the order of the table", (event) => page.step(event.key === "ArrowLeft" ? -1 : 1));
    page.key(["/"], "filter the runs", () => page.filter.focus());
    page.key(["Escape"], "choose no run", () => page.select(null));

    const whole = NLOSIM.section("Figures", { id: "figures" });
    const help = el("button", { type: "button", class: "quiet", title: "keys (?)", "aria-label": "help", onclick: () => page.help() }, "?");
    whole.body.append(el("div", { class: "bar" }, controls, help), el("div", { class: "figures" }, figures.map((each) => each.whole)), pairControls, pairs.whole);
    main.replaceChildren(...[whole.whole, table, NLOSIM.failedRuns(page), NLOSIM.asked(page), NLOSIM.provenance(page)].filter(Boolean));
    document.body.append(card);
    page.show({});
    let width = main.clientWidth;
    new ResizeObserver(() => {
      if (main.clientWidth === width) return;
      width = main.clientWidth;
      for (const resize of page.sized) resize();
    }).observe(main);
    for (const [when, on] of [["beforeprint", true], ["afterprint", false]]) {
      window.addEventListener(when, () => {
        document.documentElement.classList.toggle("printing", on);
        for (const resize of page.sized) resize();
      });
    }
    page.ready = performance.now() - began; // [ms]
  } catch (error) {
    main.replaceChildren(el("p", { class: "alarm", role: "alert" }, `This page cannot be shown: ${error.message}`));
    throw error;
  }
})(NLOSIM);
