// Head, metrics, manifest, and the command that repeats the run.
(function (NLOSIM) {
  "use strict";

  const { el } = NLOSIM;

  // Nested values as folding lists.
  NLOSIM.tree = function tree(value, open = false) {
    if (value === null || typeof value !== "object") return el("span", {}, plain(value));
    const entries = Object.entries(value);
    if (!entries.length) return el("span", { class: "note" }, "–");
    return el("dl", { class: "tree" }, entries.flatMap(([key, each]) => {
      const simple = each === null || typeof each !== "object" || isShort(each);
      const shown = simple ? el("span", {}, isShort(each) && typeof each === "object" && each ? each.map(plain).join(", ") : plain(each))
        : el("details", { open }, el("summary", {}, `${Object.keys(each).length} entries`), NLOSIM.tree(each));
      return [el("dt", {}, NLOSIM.breakable(key)), el("dd", {}, shown)];
    }));
  };

  // A long name may be broken after an underscore.
  NLOSIM.breakable = (name) => name.split(/(?<=_)/).flatMap((part) => [part, el("wbr", {})]);

  const isShort = (value) => Array.isArray(value) && value.length <= 12 &&
    value.every((each) => each === null || typeof each !== "object");
  const plain = (value) => (value === null ? "–" : typeof value === "number" ? NLOSIM.spell(value, 6) : String(value));

  // A run that was killed could not write down that it had ended.
  NLOSIM.ended = function ended({ status, ended_early: early }) {
    if (status === "done") return early ? "ended early" : "done";
    return status === "running" ? "not ended: it goes on, or was killed" : status || "unfinished";
  };

  NLOSIM.head = function head(place, page, about) {
    const ended = NLOSIM.ended(about);
    const facts = [["seed", about.seed], ["simulated", `${NLOSIM.spell(page.clock.span)} s`], ["status", ended]];
    place.append(
      el("h1", {}, about.title),
      el("p", { class: "facts" }, facts.map(([name, value]) => el("span", {}, `${name} `, el("b", {}, value)))),
      about.description ? el("p", { class: "lead" }, about.description) : "",
    );
    if (about.error) place.append(el("p", { class: "alarm", role: "alert" }, `The run ended early: ${about.error}`));
    if (about.ended_early) {
      place.append(el("p", { class: "note" }, `Ended early by ${about.ended_early.by}: ${about.ended_early.why}`));
    }
  };

  NLOSIM.metrics = function metrics(data) {
    const { whole, body } = NLOSIM.section("Metrics", { id: "metrics" });
    const { measures = {}, measures_left_out: left = {}, ...report } = data;
    const groups = Object.keys(report).length ? { report, ...measures } : measures;
    body.append(el("div", { class: "cards" }, Object.entries(groups).map(([name, numbers]) =>
      el("section", { class: "card" }, el("h3", {}, name), NLOSIM.tree(numbers)))));
    if (!Object.keys(groups).length) body.append(el("p", { class: "note" }, "No measure was asked."));
    if (Object.keys(left).length) {
      body.append(el("details", {}, el("summary", {}, `${Object.keys(left).length} measures have no answer`), NLOSIM.tree(left)));
    }
    return whole;
  };

  // A command to type, and a button that copies it.
  NLOSIM.command = function command(text) {
    const words = el("code", { class: "command" }, text);
    const select = () => getSelection().selectAllChildren(words);
    const copy = el("button", {
      type: "button",
      onclick: () => {
        const done = () => { copy.textContent = "copied"; setTimeout(() => { copy.textContent = "copy"; }, 1500); };
        if (navigator.clipboard) navigator.clipboard.writeText(text).then(done, select);
        else select();
      },
    }, "copy");
    return el("div", { class: "bar" }, words, copy);
  };

  // The shell command that repeats a run and compares every byte: of the run in whose folder, or in the folder
  // `below` it, the page at this address is. A page that came from a server does not know its folder.
  NLOSIM.rerun = function rerun({ protocol, pathname }, below = "") {
    const here = decodeURIComponent(pathname).replace(/\/[^/]*$/, "").replace(/^\/(?=[A-Za-z]:)/, "");
    const path = protocol === "file:" ? [here, below].filter(Boolean).join("/") : below || "DIR";
    return `nlosim rerun ${/^[\w@%+=:,./-]+$/.test(path) ? path : `'${path.replaceAll("'", "'\"'\"'")}'`}`;
  };

  NLOSIM.manifest = function manifest(about) {
    const { whole, body } = NLOSIM.section("Run again", { id: "manifest" });
    const wall = about.wall_time && about.wall_time.components ? about.wall_time : null;
    const folded = (title, value) => el("details", {}, el("summary", {}, title), NLOSIM.tree(value));
    body.append(
      el("p", {}, "The same versions make the same bytes", about.fingerprint ? [", fingerprint ", el("code", { class: "print" }, about.fingerprint)] : "", ":"),
      NLOSIM.command(about.command),
      el("p", {}, "With every parameter and input file as the manifest has them, comparing every byte:"),
      NLOSIM.command(NLOSIM.rerun(location)),
      wall ? el("p", { class: "note" }, `It took ${NLOSIM.spell(wall.total, 3)} s: `,
        Object.entries(wall.components).sort((a, b) => b[1] - a[1]).map(([name, s]) => `${name} ${NLOSIM.spell(s, 2)} s`).join(", ")) : "",
      folded("scenario, with all parameters", about.scenario),
      folded(about.manifest_file, about.manifest),
    );
    return whole;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
