// The figure of runs: a dot for each, a box of quartiles behind them.
(function (NLOSIM) {
  "use strict";

  const { svg } = NLOSIM;

  NLOSIM.drawSpread = function drawSpread(page, shown, width) {
    const { metric, cells, frame } = shown;
    const counted = metric.kind === "share";
    const picture = NLOSIM.picture(width, 300, `${metric.name} of every run over ${frame.axis}${frame.held ? `; ${frame.held}` : ""}`);
    const range = counted ? [-0.5, 1.5] : NLOSIM.extent(cells.flatMap(({ box }) => box || []));
    const failed = frame.labels.map((_, x) => cells.reduce((sum, cell) => sum + (cell.x === x ? cell.failed : 0), 0));
    const plan = NLOSIM.plan(picture, { ...shown, toScale: false }, width, range, counted ? ["false", "true"] : null, failed);
    const points = [];
    frame.groups.forEach((_, group) => {
      const { colour } = NLOSIM.markOf(group);
      const places = [];
      for (const cell of cells) {
        if (cell.group !== group || !cell.box) continue;
        const x = plan.at(cell);
        const half = plan.step * 0.36;
        if (counted) {
          const count = cell.points.filter(({ value }) => value).length;
          picture.append(NLOSIM.label(x, plan.to(0.5) + 4, `${count} of ${cell.points.length}`, { "text-anchor": "middle", "font-size": 11 }));
        } else {
          picture.append(boxed(cell.box.map(plan.to), x, half, colour));
        }
        for (const { run, value } of cell.points) {
          const seed = page.results.seed[run];
          const at = [x + NLOSIM.evenly(seed) * 1.7 * half, plan.to(value) + (counted ? NLOSIM.evenly(seed * 7 + 3) * 50 : 0)];
          places.push(at);
          points.push({ x: at[0], y: at[1], run, value, text: () => `${page.results.name(run)}\n${metric.heading} ${NLOSIM.spell(counted ? Boolean(value) : value)}` });
        }
      }
      picture.append(NLOSIM.marks(places, group, points.length > 4000 ? 1.4 : 2.4, { opacity: points.length > 1000 ? 0.5 : 0.7 }));
    });
    NLOSIM.rings(page, picture, points);
    NLOSIM.fit(picture, width, plan.height);
    return { picture, points };
  };

  // From the least to the greatest, with the middle half and the median.
  function boxed([least, low, middle, high, greatest], x, half, colour) {
    return svg("g", { fill: "none", stroke: colour, "stroke-width": 1.2 },
      svg("path", { d: `M${x} ${least}V${low}M${x} ${high}V${greatest}`, opacity: 0.8 }),
      svg("rect", { x: x - half, y: high, width: 2 * half, height: Math.max(0.5, low - high), fill: colour, "fill-opacity": 0.1 }),
      svg("path", { d: `M${x - half} ${middle}h${2 * half}`, "stroke-width": 2.4 }));
  }
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
