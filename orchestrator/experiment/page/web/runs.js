// The table of runs: sorted by a click on a heading, filtered by what is typed.
(function (NLOSIM) {
  "use strict";

  const { el } = NLOSIM;
  const STEP = 100; // rows that are there at first, and more at a time

  NLOSIM.runTable = function runTable(page) {
    const { results } = page;
    const { whole, body } = NLOSIM.section("Runs", { id: "runs" });
    const columns = [
      { name: "seed", heading: "seed", of: (run) => Number(results.seedOf(run)) },
      ...results.factors.map(({ name }, f) => ({ name, heading: name, of: (run) => results.level(results.combination[run], f), order: (run) => results.combinations[results.combination[run]][f] })),
      ...results.metrics.map((metric) => ({ name: metric.name, heading: metric.heading, of: (run) => results.value(run, metric), order: (run) => { const value = results.value(run, metric); return typeof value === "boolean" ? Number(value) : value; } })),
      { name: "status", heading: "status", of: (run) => (results.error(run) === null ? "done" : `failed: ${results.error(run)}`) },
    ];
    const names = columns.map(({ name }) => name);
    const rows = Array.from({ length: results.count }, (_, run) => ({ run, ...Object.fromEntries(columns.map(({ name, of }) => [name, of(run)])) }));
    let order = { column: null, down: false };
    let most = STEP;
    let shown = rows;

    const box = el("input", { type: "search", id: "filter", placeholder: `filter: words, ${example()}`, "aria-label": "filter the runs", oninput: () => { most = STEP; update(); } });
    const said = el("span", { class: "note", role: "status" });
    const save = el("button", { type: "button", class: "tool", title: "save these rows as CSV", onclick: () => NLOSIM.save(`${NLOSIM.fileName(results.about.title, "runs")}.csv`, "text/csv", page.runsCsv()) }, "CSV");
    const heads = columns.map((column) => el("th", { scope: "col" }, el("button", { type: "button", onclick: () => { order = { column, down: order.column === column && !order.down }; update(); } }, NLOSIM.breakable(column.heading))));
    const lines = el("tbody");
    const more = el("div", { class: "bar" });
    body.append(el("div", { class: "bar" }, box, said, save),
      el("div", { class: "scroll runs" }, el("table", { class: "grid" }, el("thead", {}, el("tr", {}, heads)), lines)), more,
      el("p", { class: "note on-paper" }, "On paper there are 40 rows at most; the CSV has all."));

    function example() {
      const metric = results.drawn[0];
      return metric.kind === "share" ? `${metric.name}=true` : `${metric.name}<1`;
    }

    function line(row) {
      const failed = results.error(row.run) !== null;
      const cells = columns.map(({ name }, k) => {
        if (k === 0) return el("td", {}, el("button", { type: "button", class: "link", onclick: (event) => { event.stopPropagation(); page.select(row.run); } }, results.seedOf(row.run)));
        const text = name === "status" && failed ? `✗ ${row[name]}` : NLOSIM.spell(row[name]);
        return el("td", { class: typeof row[name] === "number" ? "number" : null }, text);
      });
      return el("tr", { class: [failed && "failed", row.run === page.chosen && "chosen"].filter(Boolean).join(" ") || null, onclick: () => page.select(row.run) }, cells);
    }

    function update() {
      const fits = NLOSIM.filterOf(box.value, names);
      shown = rows.filter(fits);
      if (order.column) {
        const key = order.column.order || order.column.of;
        shown = shown.map((row) => [key(row.run), row]).sort((a, b) => NLOSIM.compare(a[0], b[0], order.down)).map(([, row]) => row);
      }
      heads.forEach((head, k) => {
        if (columns[k] === order.column) head.setAttribute("aria-sort", order.down ? "descending" : "ascending");
        else head.removeAttribute("aria-sort");
      });
      draw();
    }

    function draw() {
      const few = shown.slice(0, most);
      lines.replaceChildren(...few.map(line));
      said.textContent = shown.length === rows.length ? `${rows.length} runs` : `${shown.length} of ${rows.length} runs`;
      const grow = (text, by) => el("button", { type: "button", onclick: () => { most += by; draw(); } }, text);
      more.replaceChildren(...(few.length < shown.length ? [el("span", { class: "note" }, `The first ${few.length} are shown.`), grow(`${STEP} more`, STEP), grow("all", shown.length)] : []));
    }

    page.runsCsv = () => NLOSIM.csv([columns.map(({ heading }) => heading), ...shown.map((row) => names.map((name) => row[name]))]);
    page.ordered = () => shown.map(({ run }) => run);
    page.filter = box;
    whole.show = draw;
    update();
    return whole;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
