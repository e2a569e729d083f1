// What the figures show: metric, factors, levels that are held; the address of the page keeps it.
(function (NLOSIM) {
  "use strict";

  const { el } = NLOSIM;

  // What the page shows when it opens: the two factors that show most of the first metric, one whose
  // levels are numbers along the axis, and a pair of levels that has differences.
  NLOSIM.firstView = function firstView(results) {
    const { factors } = results;
    const isNumeric = (f) => Boolean(factors[f].numbers);
    const several = factors.map(({ levels }, f) => (levels.length > 1 ? f : -1)).filter((f) => f >= 0);
    const along = [...several].sort((a, b) => isNumeric(b) - isNumeric(a));
    const groups = [-1, ...several.filter((f) => factors[f].levels.length <= 7)];
    const held = [...results.combinations[0]];
    const known = results.drawn[0].mean.value.map((value) => !Number.isNaN(value));
    const score = ([x, group]) => NLOSIM.cellsOf(results, { x, group, held }).filter(({ combination }) => known[combination]).length;
    const choices = along.flatMap((x) => groups.filter((group) => group !== x).map((group) => [x, group]));
    const scores = choices.map(score);
    const [x, group] = choices[scores.indexOf(Math.max(...scores))] ?? [-1, -1];
    return { metric: 0, x, group, held, toScale: true, ...firstPair(results, [...along].reverse()) };
  };

  // A factor with two levels whose difference is known; the first of these factors if there is none.
  function firstPair(results, among) {
    const { factor, first, second, of } = results.pairs;
    const values = of.get(results.drawn[0].name).value;
    const level = (combination, f) => results.combinations[combination][f];
    const pairs = [...factor.keys()].filter((k) => !Number.isNaN(values[k]) && among.includes(factor[k]));
    pairs.sort((k, l) => among.indexOf(factor[k]) - among.indexOf(factor[l]) || k - l);
    if (!pairs.length) return { factor: among[0] ?? -1, a: 0, b: among.length ? 1 : 0 };
    const [best] = pairs;
    return { factor: factor[best], a: level(first[best], factor[best]), b: level(second[best], factor[best]) };
  }

  // A view as the part of an address behind `#`, and back; what an address does not know stays as it is.
  NLOSIM.hashOf = function hashOf(results, view) {
    const said = new Map([["metric", results.drawn[view.metric].name], ["x", view.x], ["group", view.group], ["held", view.held.join(".")],
      ["scale", Number(view.toScale)], ["factor", view.factor], ["a", view.a], ["b", view.b]]);
    return [...said].map(([key, value]) => `${key}=${encodeURIComponent(value)}`).join("&");
  };

  NLOSIM.viewOf = function viewOf(results, hash) {
    const view = NLOSIM.firstView(results);
    const known = new Map(hash.split("&").map((part) => part.split("=")).filter((pair) => pair.length === 2));
    const whole = (key, low, high) => {
      const value = Number(known.get(key) || NaN);
      return Number.isInteger(value) && value >= low && value < high ? value : view[key];
    };
    const count = results.factors.length;
    const name = safe(known.get("metric"));
    const metric = results.drawn.findIndex((each) => each.name === name);
    const held = (known.get("held") || "").split(".").map(Number);
    const factor = whole("factor", 0, count);
    const levels = factor < 0 ? 0 : results.factors[factor].levels.length;
    return {
      metric: metric < 0 ? view.metric : metric, x: whole("x", -1, count), group: whole("group", -1, count), factor,
      a: Math.min(whole("a", 0, levels), Math.max(0, levels - 1)), b: Math.min(whole("b", 0, levels), Math.max(0, levels - 1)),
      toScale: known.get("scale") !== "0",
      held: view.held.map((_, f) => (held[f] >= 0 && held[f] < results.factors[f].levels.length ? held[f] : view.held[f])),
    };
  };

  function safe(text) {
    try { return decodeURIComponent(text || ""); } catch { return ""; }
  }

  function choice(title, options, value, change) {
    const box = el("select", { onchange: () => change(Number(box.value)) }, options.map(([text, at]) => el("option", { value: at, selected: at === value }, text)));
    return el("label", { class: "choice" }, el("span", {}, title), box);
  }

  const numbered = (texts) => texts.map((text, index) => [text, index]);

  // Above the figures: metric, axis, groups, and what is held.
  NLOSIM.controls = function controls(page) {
    const { results } = page;
    const bar = el("div", { class: "controls" });
    const names = results.factors.map(({ name }, f) => [name, f]).filter(([, f]) => results.factors[f].levels.length > 1);
    bar.show = () => {
      const { view } = page;
      const parts = [choice("metric", numbered(results.drawn.map(({ heading }) => heading)), view.metric, (metric) => page.show({ metric }))];
      if (names.length) {
        parts.push(choice("over", [...names, ["every combination", -1]], view.x, (x) => page.show({ x, group: view.group === x ? -1 : view.group })));
      }
      if (view.x >= 0 && names.length > 1) {
        parts.push(choice("marks by", [["–", -1], ...names.filter(([, f]) => f !== view.x)], view.group, (group) => page.show({ group })));
      }
      for (const [name, f] of view.x < 0 ? [] : names) {
        if (f === view.x || f === view.group) continue;
        parts.push(choice(name, numbered(results.factors[f].levels), view.held[f], (level) => page.show({ held: view.held.map((each, k) => (k === f ? level : each)) })));
      }
      if (view.x >= 0 && results.factors[view.x].numbers) {
        const box = el("input", { type: "checkbox", checked: view.toScale, onchange: () => page.show({ toScale: box.checked }) });
        parts.push(el("label", { class: "tick" }, box, " to scale"));
      }
      bar.replaceChildren(...parts);
    };
    return bar;
  };

  // Above the differences: which two levels of which factor.
  NLOSIM.pairControls = function pairControls(page) {
    const { results } = page;
    const bar = el("div", { class: "controls" });
    bar.show = () => {
      const { view } = page;
      const names = results.factors.map(({ name }, f) => [name, f]).filter(([, f]) => results.factors[f].levels.length > 1);
      bar.hidden = !names.length;
      if (bar.hidden) return;
      const levels = numbered(results.factors[view.factor].levels);
      const turn = el("button", { type: "button", title: "exchange them", "aria-label": "exchange the two levels", onclick: () => page.show({ a: view.b, b: view.a }) }, "⇄");
      bar.replaceChildren(choice("difference of", names, view.factor, (factor) => page.show({ factor, a: 0, b: 1 })),
        choice("level", levels, view.a, (a) => page.show({ a })), turn, choice("minus level", levels, view.b, (b) => page.show({ b })));
    };
    return bar;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
