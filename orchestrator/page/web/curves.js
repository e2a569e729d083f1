// Curves: numbers over time, and what they are at a time.
(function (NLOSIM) {
  "use strict";

  NLOSIM.Curve = class Curve {
    // `times` [s] since the start, ascending; `holds`: until the next one, without a line between
    constructor({ name, unit, times, values, holds }) {
      Object.assign(this, { name, unit, times, values, holds });
    }

    at(time) {
      const { times, values } = this;
      const k = NLOSIM.lastAt(times, time + 1e-9);
      if (k < 0) return NaN;
      const [here, next] = [values[k], values[k + 1]];
      if (this.holds || k + 1 >= times.length || !Number.isFinite(next)) return here;
      return here + ((next - here) * (time - times[k])) / (times[k + 1] - times[k]);
    }

    get changes() {
      return this.values.some((value) => value !== this.values[0]);
    }
  };

  NLOSIM.curvesOf = function curvesOf(data, arrays) {
    return data.curves.map((each) => new NLOSIM.Curve({
      name: each.name,
      unit: each.unit,
      holds: each.holds,
      times: arrays.times(each.times),
      values: each.whole ? Float64Array.from(arrays.array(each.whole)) : arrays.numbers(each.numbers),
    }));
  };

  // Curves that share a chart: those of one unit; truths and codes apart from measured numbers.
  NLOSIM.charts = function charts(curves, most = 7) {
    const groups = new Map();
    for (const curve of curves) {
      const key = `${curve.unit} ${curve.unit === "" && curve.holds}`;
      if (!groups.has(key)) groups.set(key, []);
      groups.get(key).push(curve);
    }
    const found = [];
    for (const group of groups.values()) {
      for (let k = 0; k < group.length; k += most) found.push(group.slice(k, k + most));
    }
    return found;
  };

  // Times since the start as those of the run, which may begin at another one than 0.
  NLOSIM.moments = (start, times) => times.map((time) => `${NLOSIM.spell(start + time, 9)} s`);

  // The rows of several curves: all their times, and for each curve a value, null for a gap, or
  // undefined where only another curve has one.
  NLOSIM.aligned = function aligned(curves) {
    const same = curves.every((curve) => curve.times === curves[0].times);
    const clean = (value) => (Number.isFinite(value) ? value : null);
    if (same) return [Array.from(curves[0].times), ...curves.map((c) => Array.from(c.values, clean))];
    const times = Float64Array.from(new Set(curves.flatMap((curve) => Array.from(curve.times)))).sort();
    const columns = curves.map((curve) => {
      const column = new Array(times.length).fill(undefined);
      let k = 0;
      curve.times.forEach((time, n) => {
        while (times[k] < time) k += 1;
        column[k] = clean(curve.values[n]);
      });
      return column;
    });
    return [Array.from(times), ...columns];
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
