// What the figures show, as numbers: means with their intervals, runs, differences by seed.
(function (NLOSIM) {
  "use strict";

  // The combinations of a figure: the level of `x`, one mark for each level of `group`, all others held.
  NLOSIM.cellsOf = function cellsOf(results, view) {
    const cells = [];
    results.combinations.forEach((levels, combination) => {
      const fits = view.x < 0 || levels.every((level, f) => f === view.x || f === view.group || level === view.held[f]);
      if (fits) {
        const group = view.x < 0 || view.group < 0 ? 0 : levels[view.group];
        cells.push({ combination, x: view.x < 0 ? combination : levels[view.x], group });
      }
    });
    return cells;
  };

  // A view that shows something: if no combination has all levels that are held, those of the most alike one.
  NLOSIM.settled = function settled(results, view, before = view) {
    if (NLOSIM.cellsOf(results, view).length) return view;
    const changed = view.held.findIndex((level, f) => level !== before.held[f]);
    const alike = (levels) => levels.reduce((sum, level, f) => sum + (level === view.held[f]), 0);
    const fits = results.combinations.filter((levels) => changed < 0 || levels[changed] === view.held[changed]);
    const [best] = [...fits].sort((a, b) => alike(b) - alike(a));
    return { ...view, held: [...(best ?? results.combinations[0])] };
  };

  // The names along the axis, those of the groups, and what is held.
  NLOSIM.frameOf = function frameOf(results, view) {
    const { factors } = results;
    const all = view.x < 0;
    const grouped = !all && view.group >= 0;
    const isThere = (text) => results.about.parts.length === 1 || text !== "-";
    const held = all ? [] : factors.map(({ name, levels }, f) => (f === view.x || f === view.group || !isThere(levels[view.held[f]]) ? null : `${name} ${levels[view.held[f]]}`));
    return {
      labels: all ? results.combinations.map((_, c) => results.label(c)) : factors[view.x].levels,
      numbers: all ? null : factors[view.x].numbers,
      axis: all ? factors.map(({ name }) => name).join(", ") : factors[view.x].name,
      unit: all ? "" : factors[view.x].unit,
      groups: grouped ? factors[view.group].levels : [""],
      by: grouped ? factors[view.group].name : "",
      held: held.filter((text) => text !== null).join(", "),
    };
  };

  const known = (value) => (Number.isNaN(value) ? null : value);

  // Means or shares with their intervals, as `summary.csv` has them.
  NLOSIM.meansOf = function meansOf(results, view) {
    const metric = results.drawn[view.metric];
    const cells = NLOSIM.cellsOf(results, view).map((cell) => ({
      ...cell, n: metric.n[cell.combination], value: known(metric.mean.value[cell.combination]),
      low: known(metric.mean.low[cell.combination]), high: known(metric.mean.high[cell.combination]),
    }));
    const unit = metric.unit ? ` [${metric.unit}]` : "";
    const head = [...results.factors.map(({ name }) => name), "n", metric.name + unit, `${metric.name}_low${unit}`,
      `${metric.name}_high${unit}`, `${metric.name}_n`];
    const rows = cells.map((cell) => [...results.levels(cell.combination), results.data.counts[cell.combination],
      cell.value, cell.low, cell.high, cell.n]);
    return { metric, cells, frame: NLOSIM.frameOf(results, view), table: [head, ...rows] };
  };

  // A quantile of ascending numbers, straight between them.
  NLOSIM.quantile = function quantile(ascending, share) {
    const at = share * (ascending.length - 1);
    const below = Math.floor(at);
    const next = ascending[Math.min(below + 1, ascending.length - 1)];
    return ascending[below] + (at - below) * (next - ascending[below]);
  };

  // The runs one by one, with least, quartiles and greatest.
  NLOSIM.spreadOf = function spreadOf(results, view) {
    const metric = results.drawn[view.metric];
    const rows = [];
    const cells = NLOSIM.cellsOf(results, view).map((cell) => {
      const points = [];
      let failed = 0;
      for (const run of results.runAt[cell.combination].values()) {
        const error = results.error(run);
        const value = results.value(run, metric);
        if (error !== null) failed += 1;
        else if (value !== null) points.push({ run, value: Number(value) });
        rows.push([...results.levels(cell.combination), results.seedOf(run), error === null ? value : null, error]);
      }
      const ascending = points.map(({ value }) => value).sort((a, b) => a - b);
      const box = ascending.length ? [0, 0.25, 0.5, 0.75, 1].map((share) => NLOSIM.quantile(ascending, share)) : null;
      return { ...cell, points, failed, box };
    });
    const head = [...results.factors.map(({ name }) => name), "seed", metric.heading, "error"];
    return { metric, cells, frame: NLOSIM.frameOf(results, view), table: [head, ...rows] };
  };

  // Level `a` minus level `b` of a factor by seed, under every condition of the others.
  NLOSIM.pairsOf = function pairsOf(results, view) {
    const metric = results.drawn[view.metric];
    const { pairs } = results;
    const of = pairs.of.get(metric.name);
    const others = results.factors.map((_, f) => f).filter((f) => f !== view.factor);
    const rows = [];
    for (let k = 0; of && k < pairs.factor.length; k += 1) {
      if (pairs.factor[k] !== view.factor) continue;
      const ends = [pairs.first[k], pairs.second[k]];
      const [first, second] = ends.map((combination) => results.combinations[combination][view.factor]);
      const turned = first === view.b && second === view.a;
      if (!turned && !(first === view.a && second === view.b)) continue;
      if (turned) ends.reverse();
      const sign = (value) => (Number.isNaN(value) ? null : turned ? 0 - value : value);
      const [low, high] = turned ? [of.high[k], of.low[k]] : [of.low[k], of.high[k]];
      const [more, less] = turned ? [of.less[k], of.more[k]] : [of.more[k], of.less[k]];
      rows.push({ ends, label: results.condition(ends[0], others) || "all runs", n: of.n[k], value: sign(of.value[k]), low: sign(low),
        high: sign(high), more, less, points: NLOSIM.bySeed(results, metric, ends) });
    }
    const { levels } = results.factors[view.factor];
    const unit = metric.unit ? ` [${metric.unit}]` : "";
    const head = [...others.map((f) => results.factors[f].name), "first", "second", "n", `difference${unit}`,
      `difference_low${unit}`, `difference_high${unit}`, "first_greater", "second_greater"];
    const body = rows.map((row) => [...others.map((f) => results.level(row.ends[0], f)), levels[view.a], levels[view.b],
      row.n, row.value, row.low, row.high, row.more, row.less]);
    return { metric, rows, names: [levels[view.a], levels[view.b]], factor: results.factors[view.factor].name, table: [head, ...body] };
  };

  // The differences of single runs with the same seed.
  NLOSIM.bySeed = function bySeed(results, metric, [first, second]) {
    const points = [];
    for (const [seed, run] of results.runAt[first]) {
      const other = results.runAt[second].get(seed);
      if (other === undefined || results.error(run) !== null || results.error(other) !== null) continue;
      const value = metric.values[run] - metric.values[other];
      if (!Number.isNaN(value)) points.push({ run, other, value });
    }
    return points;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
