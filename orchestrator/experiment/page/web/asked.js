// What was asked and what is there: head, factors, failed runs, where the results come from.
(function (NLOSIM) {
  "use strict";

  const { el } = NLOSIM;

  const count = (number, noun) => `${number} ${noun}${number === 1 ? "" : "s"}`;

  NLOSIM.experimentHead = function experimentHead(place, page) {
    const { about, data } = page.results;
    const facts = [["runs", about.done], ["failed", about.failed], ["combinations", about.combinations], ["seeds", about.seeds]];
    place.append(el("h1", {}, about.title),
      el("p", { class: "facts" }, facts.map(([name, value]) => el("span", {}, `${name} `, el("b", {}, value)))),
      ...about.parts.slice(0, 12).map((part) => el("p", { class: "lead" }, about.parts.length > 1 ? `${part.title}: ` : "", el("b", {}, part.scenario_title), part.description ? ` – ${part.description}` : "")));
    const alarms = [];
    for (const { title, missing, planned, go_on: goOn } of about.parts) {
      if (!missing) continue;
      const what = `${about.parts.length > 1 ? `${title} is not complete` : "Not complete"}: ${count(missing, "run")} of ${planned} ${missing === 1 ? "is" : "are"} missing.`;
      alarms.push(el("div", { class: "alarm", role: "alert" }, `${what} All numbers here are of those that are there. Go on with `, NLOSIM.command(goOn)));
    }
    if (about.failed) {
      alarms.push(el("p", { class: "alarm", role: "alert" }, `✗ ${count(about.failed, "run")} failed and ${about.failed === 1 ? "is" : "are"} in no number; see `, el("a", { href: "#failed", onclick: go }, "failed runs"), "."));
    }
    if (about.damaged.length) {
      alarms.push(el("p", { class: "alarm", role: "alert" }, ["Damaged results are left out, the rest is used:", ...about.damaged].join("\n")));
    }
    const left = [[data.runs_left_out, "run", "dots and rows"], [data.combinations_left_out, "combination", "marks"]];
    for (const [number, noun, what] of left) {
      if (number) alarms.push(el("p", { class: "note" }, `${count(number, noun)} more would make this page too large: ${what} are of the first ${noun === "run" ? "seeds" : "ones"}; means and intervals are of all runs. runs.parquet and summary.csv have everything.`));
    }
    place.append(...alarms);
  };

  // The address keeps the view, so that a link within the page must not replace it.
  function go(event) {
    event.preventDefault();
    document.getElementById("failed").scrollIntoView();
  }

  NLOSIM.asked = function asked(page) {
    const { results } = page;
    const { about, factors, metrics } = results;
    const { whole, body } = NLOSIM.section("What was asked", { id: "asked", open: factors.length <= 4 });
    const set = (texts) => (texts.length ? texts.map((text) => el("code", { class: "set" }, text)) : el("span", { class: "note" }, "–"));
    const rows = factors.flatMap(({ name, levels, sets }) => levels.map((level, k) => el("tr", {},
      k === 0 ? el("th", { scope: "rowgroup", rowspan: levels.length }, name) : "", el("td", {}, level), el("td", {}, set(sets[k])))));
    const table = (heads, lines) => el("div", { class: "scroll" }, el("table", { class: "grid asked" }, el("thead", {}, el("tr", {}, heads.map((text) => el("th", { scope: "col" }, text)))), el("tbody", {}, lines)));
    for (const part of about.parts) {
      body.append(el("p", {}, about.parts.length > 1 ? [el("b", {}, part.title), ": "] : "", `${count(part.combinations, "combination")} with the seeds ${part.seeds}: ${count(part.planned, "run")} of `, el("code", {}, part.scenario), "; every combination has the same seeds."));
    }
    if (about.common.length) body.append(el("p", {}, "In every run: ", set(about.common)));
    if (rows.length) body.append(table(["factor", "level", "set in all its runs"], rows));
    body.append(table(["metric", "unit", "where it comes from", "what is said of it"], metrics.map((metric) => el("tr", {}, [metric.name, metric.unit || "–", metric.path,
      { number: "mean, Student's t", share: "share, Wilson", text: "rows only" }[metric.kind]].map((text) => el("td", {}, text))))));
    return whole;
  };

  NLOSIM.failedRuns = function failedRuns(page) {
    const { results } = page;
    const runs = Object.keys(results.data.runs.errors).map(Number);
    if (!runs.length) return null;
    const { whole, body } = NLOSIM.section("Failed runs", { id: "failed" });
    const most = 50;
    body.append(...runs.slice(0, most).map((run) => el("div", { class: "failed-run" },
      el("button", { type: "button", class: "link", onclick: () => page.select(run) }, results.name(run)),
      el("p", { class: "why" }, `✗ ${results.error(run)}`), NLOSIM.command(results.command(run)))));
    if (runs.length > most) body.append(el("p", { class: "note" }, `${runs.length - most} more are in the table: type status=failed, or failed, above it.`));
    return whole;
  };

  NLOSIM.provenance = function provenance(page) {
    const { results } = page;
    const { about } = results;
    const { whole, body } = NLOSIM.section("Where it comes from", { id: "provenance" });
    const walls = results.metrics.at(-1).values;
    const total = walls.reduce((sum, value) => sum + value, 0);
    const hours = total >= 5400 ? `${NLOSIM.spell(total / 3600, 3)} h` : `${NLOSIM.spell(total, 3)} s`;
    if (walls.length) body.append(el("p", {}, `${count(walls.length, "run")} took ${hours} of wall time, ${NLOSIM.spell(total / walls.length, 3)} s each.`));
    const sessions = about.parts.flatMap((part) => part.sessions.map((session, k) => ({ ...session, k })));
    sessions.forEach(({ command, created, commit, versions = {}, host = {}, k }) => {
      const machine = [host.cpu, host.cpus && `${host.cpus} cores`, host.memory_gib && `${host.memory_gib} GiB`, host.platform].filter(Boolean).join(", ");
      body.append(el("h4", {}, `${k ? "gone on with" : "begun"} ${created ?? ""}`), NLOSIM.command(command ?? ""),
        el("p", { class: "note" }, `nlosim ${versions.nlosim ?? "?"}, commit ${commit ?? "unknown"}, ${machine}`),
        el("details", {}, el("summary", {}, "versions"), NLOSIM.tree(versions)));
    });
    const files = results.data.files;
    body.append(...about.parts.map(({ title, resolved }) => el("details", {}, el("summary", {}, `the scenario of ${title} with all parameters, as in its first combination`), NLOSIM.tree(resolved))),
      files.length ? el("p", {}, "Beside this page: ", files.flatMap((name, k) => [k ? ", " : "", el("a", { href: name.split("/").map(encodeURIComponent).join("/") }, name)])) : "");
    return whole;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
