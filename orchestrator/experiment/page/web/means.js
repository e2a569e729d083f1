// The figure of means: one mark with its interval for each combination.
(function (NLOSIM) {
  "use strict";

  const { svg } = NLOSIM;

  // The box of a figure with categories, what is above and below it, and where these are.
  NLOSIM.plan = function plan(picture, shown, width, range, names, failed) {
    const { frame, metric } = shown;
    const ticks = names || NLOSIM.ticks(...range).map((value) => NLOSIM.spell(value, 6));
    const left = 30 + Math.max(...ticks.map((text) => NLOSIM.width(text, 11)));
    const right = width - 12;
    const top = NLOSIM.legend(picture, frame.groups, frame.by, left, right, 6) + 6;
    const band = (right - left) / Math.max(1, frame.labels.length);
    const room = NLOSIM.below(frame.labels, band);
    const box = { left, right, top, bottom: top + 230 };
    const numeric = shown.toScale ? frame.numbers : null;
    const along = numeric && NLOSIM.scale(NLOSIM.extent(numeric), [left, right]);
    const places = frame.labels.map((_, k) => (along ? along(numeric[k]) : left + (k + 0.5) * band));
    const to = NLOSIM.upward(picture, box, range, metric.heading, names);
    const heading = frame.held ? `${frame.axis}   (${frame.held})` : frame.axis;
    const most = Math.floor((right - left) / 6.7);
    let end;
    if (along) {
      end = NLOSIM.categories(picture, box, [], { texts: [], turned: false, height: 16 }, NLOSIM.short(frame.unit ? `${frame.axis} [${frame.unit}]${frame.held ? `   (${frame.held})` : ""}` : heading, most), []);
      for (const value of NLOSIM.ticks(...NLOSIM.extent(numeric))) {
        picture.append(svg("line", { x1: along(value), x2: along(value), y1: box.bottom, y2: box.bottom + 4, stroke: "#8a8a8a" }),
          NLOSIM.label(along(value), box.bottom + 16, NLOSIM.spell(value, 6), { "text-anchor": "middle", fill: "#595959", "font-size": 11 }));
      }
    } else {
      end = NLOSIM.categories(picture, box, places, room, NLOSIM.short(heading, most), frame.labels, failed);
    }
    const step = along ? 5 : Math.min(band / (frame.groups.length + 0.6), 90);
    return { to, places, step, along: Boolean(along), height: end + 10, at: (cell) => places[cell.x] + (cell.group - (frame.groups.length - 1) / 2) * step };
  };

  // A picture that is as high as what was drawn into it.
  NLOSIM.fit = function fit(picture, width, height) {
    picture.setAttribute("viewBox", `0 0 ${width} ${height}`);
    for (const each of [picture, picture.querySelector("rect")]) each.setAttribute("height", height);
  };

  NLOSIM.drawMeans = function drawMeans(page, shown, width) {
    const { metric, cells, frame } = shown;
    const title = `${metric.name} over ${frame.axis}: ${metric.kind === "share" ? "shares" : "means"} with intervals of 95 %${frame.held ? `; ${frame.held}` : ""}`;
    const picture = NLOSIM.picture(width, 300, title);
    const limits = metric.kind === "share" ? [-0.03, 1.03] : undefined;
    const range = NLOSIM.extent(cells.flatMap(({ value, low, high }) => [value, low, high]), limits);
    const plan = NLOSIM.plan(picture, shown, width, range, null, []);
    const points = [];
    frame.groups.forEach((name, group) => {
      const own = cells.filter((cell) => cell.group === group && cell.value !== null);
      const { colour } = NLOSIM.markOf(group);
      const places = own.map((cell) => [plan.at(cell), plan.to(cell.value)]);
      if (plan.along) {
        const line = [...places].sort((a, b) => a[0] - b[0]).map(([x, y]) => `${x} ${y}`).join("L");
        if (line) picture.append(svg("path", { d: `M${line}`, fill: "none", stroke: colour, "stroke-width": 1.2, "stroke-dasharray": NLOSIM.dashes[group % NLOSIM.dashes.length].join(" ") }));
      }
      own.forEach((cell, k) => {
        const [x, y] = places[k];
        if (cell.low !== null) {
          const [top, bottom] = [plan.to(cell.high), plan.to(cell.low)];
          picture.append(svg("path", { d: `M${x} ${top}V${bottom}M${x - 4} ${top}h8M${x - 4} ${bottom}h8`, fill: "none", stroke: colour, "stroke-width": 1.6 }));
        }
        const said = cell.low === null ? "no interval: one value" : `${NLOSIM.spell(cell.low)} to ${NLOSIM.spell(cell.high)}`;
        const where = page.results.label(cell.combination);
        points.push({ x, y, value: cell.value, text: () => `${where}\n${metric.heading} ${NLOSIM.spell(cell.value)}\n95 %: ${said}\nn ${cell.n}` });
      });
      picture.append(NLOSIM.marks(places, group, 4.5));
    });
    NLOSIM.fit(picture, width, plan.height);
    return { picture, points };
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
