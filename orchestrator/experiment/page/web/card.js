// The chosen run: its levels and settings, metrics, directory, and the command that repeats it.
(function (NLOSIM) {
  "use strict";

  const { el } = NLOSIM;

  NLOSIM.card = function card(page) {
    const { results } = page;
    const whole = el("aside", { class: "run-card", hidden: true, "aria-label": "the chosen run", tabindex: -1 });
    const link = (run, text) => el("button", { type: "button", class: "link", onclick: () => page.select(run) }, text);
    const pairs = (rows) => el("dl", { class: "tree" }, rows.flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]));

    // The folder of the run and its page, if they are there.
    function directory(run) {
      const found = results.folder(run);
      if (!found) {
        return el("p", { class: "note" }, "Its directory was not kept (--keep-runs keeps all); the command makes it anew, with its page.");
      }
      const path = found.path.split("/").map(encodeURIComponent).join("/");
      return el("p", {}, found.hasPage ? [el("a", { href: `${path}/index.html` }, "the page of this run"), ", in "] : "its directory: ",
        el("a", { href: `${path}/` }, found.path), found.hasPage ? "" : el("span", { class: "note" }, ` (\`nlosim report\` makes its page)`));
    }

    whole.show = () => {
      const run = page.chosen;
      whole.hidden = run === null;
      whole.classList.toggle("left", Boolean(page.onLeft));
      if (run === null) return;
      const error = results.error(run);
      const print = results.data.runs.fingerprints[run];
      const levels = results.factors.map(({ name }, f) => [name, results.level(results.combination[run], f)]);
      const metrics = results.metrics.map((metric) => [metric.heading, NLOSIM.spell(results.value(run, metric), 6)]);
      const settings = results.settings(run);
      const rest = page.partner === null ? "" : el("p", { class: "note" }, "compared with ", link(page.partner, results.name(page.partner)));
      whole.replaceChildren(
        el("div", { class: "bar" }, el("h3", {}, `Run: seed ${results.seedOf(run)}`),
          el("button", { type: "button", class: "quiet", title: "the run before (left arrow)", onclick: () => page.step(-1) }, "◂"),
          el("button", { type: "button", class: "quiet", title: "the next run (right arrow)", onclick: () => page.step(1) }, "▸"),
          el("button", { type: "button", class: "quiet", "aria-label": "close", title: "close (Escape)", onclick: () => page.select(null) }, "×")),
        error === null ? "" : el("p", { class: "alarm" }, `✗ failed: ${error}`),
        pairs(levels), rest,
        el("h4", {}, "metrics"), pairs(metrics),
        settings.length ? el("details", {}, el("summary", {}, `${settings.length} settings`), el("ul", { class: "settings" }, settings.map((text) => el("li", {}, el("code", {}, text))))) : "",
        directory(run),
        el("h4", {}, "repeat it"), NLOSIM.command(results.command(run)),
        ...(results.folder(run) ? [el("p", { class: "note" }, "and compare every byte:"), NLOSIM.command(NLOSIM.rerun(location, results.folder(run).path))] : []),
        print ? el("p", { class: "note" }, "the fingerprint of its recording begins with ", el("code", {}, print)) : "",
      );
    };
    return whole;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
