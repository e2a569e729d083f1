// Scales, ticks and labels of a figure.
(function (NLOSIM) {
  "use strict";

  const { svg } = NLOSIM;
  const SOFT = "#595959";

  // Round numbers between two others.
  NLOSIM.ticks = function ticks(low, high, count = 5) {
    if (!(high > low)) return [low];
    const rough = (high - low) / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 2.5, 5, 10].map((each) => each * power).find((each) => each >= rough * 0.999);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k += 1) found.push(Number((k * step).toPrecision(12)));
    return found;
  };

  // The range of numbers with a margin; a single one is in the middle of it.
  NLOSIM.extent = function extent(values, [least, greatest] = [-Infinity, Infinity]) {
    let low = Infinity;
    let high = -Infinity;
    for (const value of values) {
      if (value === null || Number.isNaN(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    if (low > high) return [0, 1];
    const margin = (high - low) * 0.06 || Math.abs(low) * 0.1 || 0.5;
    return [Math.max(least, low - margin), Math.min(greatest, high + margin)];
  };

  NLOSIM.scale = ([low, high], [from, to]) => (value) => from + ((value - low) / (high - low)) * (to - from);

  // About how wide a text is [pixel], without a browser to ask.
  NLOSIM.width = (text, size = 12) => [...String(text)].length * size * 0.56;

  NLOSIM.short = (text, most) => ([...text].length > most ? `${[...text].slice(0, most - 1).join("")}…` : text);

  NLOSIM.label = (x, y, text, attributes = {}) => svg("text", { x, y, fill: "#1b1b1b", ...attributes }, text);

  // The upward axis with its grid; returns where a value is.
  NLOSIM.upward = function upward(parent, box, range, heading, names = null) {
    const to = NLOSIM.scale(range, [box.bottom, box.top]);
    for (const value of names ? [0, 1] : NLOSIM.ticks(...range)) {
      const y = to(value);
      parent.append(svg("line", { x1: box.left, x2: box.right, y1: y, y2: y, stroke: "#e2e2e2" }),
        NLOSIM.label(box.left - 6, y + 4, names ? names[value] : NLOSIM.spell(value, 6), { "text-anchor": "end", fill: SOFT, "font-size": 11 }));
    }
    const middle = (box.top + box.bottom) / 2;
    parent.append(NLOSIM.label(13, middle, NLOSIM.short(heading, 44), { "text-anchor": "middle", transform: `rotate(-90 13 ${middle})` }));
    return to;
  };

  // What room the labels below an axis need, and whether they are turned.
  NLOSIM.below = function below(labels, band) {
    const texts = labels.map((label) => NLOSIM.short(label, 30));
    const longest = Math.max(0, ...texts.map((text) => NLOSIM.width(text, 11)));
    const turned = longest > band - 4;
    return { texts, turned, height: turned ? Math.min(130, longest * 0.62 + 12) : 16 };
  };

  // Labels of categories; a second line says how many runs failed there.
  NLOSIM.categories = function categories(parent, box, places, { texts, turned, height }, heading, labels, failed = []) {
    const every = turned ? Math.ceil(12 / Math.max(1, (box.right - box.left) / Math.max(1, texts.length))) : 1;
    texts.forEach((text, k) => {
      if (k % every) return;
      const at = turned ? { "text-anchor": "end", transform: `rotate(-38 ${places[k]} ${box.bottom + 12})` } : { "text-anchor": "middle" };
      const said = NLOSIM.label(places[k], box.bottom + (turned ? 12 : 15), text, { ...at, fill: SOFT, "font-size": 11 });
      if (labels[k] !== text) said.append(svg("title", {}, labels[k]));
      parent.append(said);
    });
    failed.forEach((count, k) => {
      if (count) parent.append(NLOSIM.label(places[k], box.bottom + height + 13, `✗ ${count} failed`, { "text-anchor": "middle", fill: "#a33d00", "font-size": 11, "font-weight": 600 }));
    });
    const under = box.bottom + height + (failed.some(Boolean) ? 31 : 17);
    parent.append(svg("line", { x1: box.left, x2: box.right, y1: box.bottom, y2: box.bottom, stroke: "#8a8a8a" }),
      NLOSIM.label((box.left + box.right) / 2, under, heading, { "text-anchor": "middle" }));
    return under;
  };

  // What the marks of groups mean, in as many lines as it takes; returns the room below it.
  NLOSIM.legend = function legend(parent, groups, by, x0, right, top) {
    if (groups.length < 2) return top;
    let x = x0;
    let y = top + 12;
    const entries = [[by, -1], ...groups.map((name, k) => [name, k])];
    for (const [name, group] of entries) {
      const text = NLOSIM.short(group < 0 ? `${name}:` : name, 32);
      const room = NLOSIM.width(text) + (group < 0 ? 8 : 30);
      if (x + room > right && x > x0) { x = x0; y += 18; }
      if (group >= 0) parent.append(NLOSIM.marks([[x + 6, y - 4]], group, 4));
      parent.append(NLOSIM.label(group < 0 ? x : x + 15, y, text, group < 0 ? { fill: SOFT } : {}));
      x += room;
    }
    return y + 8;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
