// The figure of differences: two levels of a factor by the same seeds, a line for each condition.
(function (NLOSIM) {
  "use strict";

  const { svg } = NLOSIM;
  const MOST = 40; // lines in a picture
  const LINE = 44; // [pixel]

  NLOSIM.drawPairs = function drawPairs(page, shown, width) {
    const { metric, names } = shown;
    const rows = shown.rows.slice(0, MOST);
    const [first, second] = names.map((name) => NLOSIM.short(name, 24));
    const picture = NLOSIM.picture(width, 300, `${metric.name}: ${first} minus ${second}, by the same seeds`);
    const [left, right, top] = [14, width - 14, 34];
    const bottom = top + Math.max(1, rows.length) * LINE;
    const range = NLOSIM.extent([0, ...rows.flatMap(({ low, high, value, points }) => [low, high, value, ...points.map((point) => point.value)])]);
    const to = NLOSIM.scale(range, [left, right]);
    for (const value of NLOSIM.ticks(...range, Math.max(2, Math.floor(width / 110)))) {
      picture.append(svg("line", { x1: to(value), x2: to(value), y1: top - 4, y2: bottom, stroke: "#e2e2e2" }),
        NLOSIM.label(to(value), bottom + 15, NLOSIM.spell(value, 6), { "text-anchor": "middle", fill: "#595959", "font-size": 11 }));
    }
    picture.append(svg("line", { x1: to(0), x2: to(0), y1: top - 8, y2: bottom, stroke: "#333333", "stroke-dasharray": "4 3" }));
    picture.append(NLOSIM.label(left, 16, `◂ greater at ${second}`, { fill: "#a33d00" }),
      NLOSIM.label(right, 16, `greater at ${first} ▸`, { "text-anchor": "end", fill: "#00527f" }));
    const points = [];
    rows.forEach((row, k) => line(page, shown, picture, points, row, to, top + k * LINE, width));
    const unit = metric.unit ? ` [${metric.unit}]` : "";
    picture.append(NLOSIM.label(width / 2, bottom + 33, NLOSIM.short(`difference of ${metric.name}${unit}`, Math.floor(width / 7)), { "text-anchor": "middle" }));
    NLOSIM.rings(page, picture, points);
    NLOSIM.fit(picture, width, bottom + 42);
    return { picture, points };
  };

  function line(page, shown, picture, points, row, to, y0, width) {
    const { metric } = shown;
    const y = y0 + 29;
    picture.append(NLOSIM.label(14, y0 + 12, NLOSIM.short(row.label, Math.floor(width / 7.5)), { fill: "#595959", "font-size": 11, stroke: "#ffffff", "stroke-width": 3, "paint-order": "stroke" }));
    const signs = [["up", 1, NLOSIM.colours.blue], ["down", -1, NLOSIM.colours.vermillion], ["circle", 0, NLOSIM.colours.grey]];
    for (const [shape, sign, colour] of signs) {
      const own = row.points.filter(({ value }) => Math.sign(value) === sign);
      const d = own.map((point) => {
        const at = [to(point.value), y + NLOSIM.evenly(page.results.seed[point.run]) * 18];
        points.push({ x: at[0], y: at[1], ...point, text: () => `seed ${page.results.seedOf(point.run)}\n${row.label}\ndifference ${NLOSIM.spell(point.value)}` });
        return NLOSIM.shapes[shape](...at, 3);
      });
      if (d.length) picture.append(svg("path", { d: d.join(""), fill: colour, opacity: 0.55 }));
    }
    if (row.value === null) return;
    const x = to(row.value);
    if (row.low !== null) {
      const [from, end] = [to(row.low), to(row.high)];
      picture.append(svg("path", { d: `M${from} ${y}H${end}M${from} ${y - 6}v12M${end} ${y - 6}v12`, stroke: "#000000", "stroke-width": 2 }));
    }
    picture.append(svg("path", { d: `M${x - 6} ${y}l6 -7l6 7l-6 7Z`, fill: "#000000", stroke: "#ffffff" }));
    const said = row.low === null ? "no interval: one pair" : `95 %: ${NLOSIM.spell(row.low)} to ${NLOSIM.spell(row.high)}`;
    points.push({ x, y, value: row.value, text: () => `${row.label}\nmean difference of ${metric.name} ${NLOSIM.spell(row.value)}\n${said}\n${row.n} seeds: greater in ${row.more}, less in ${row.less}` });
  }
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
