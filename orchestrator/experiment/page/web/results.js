// The results as the page knows them: runs, combinations, metrics, paired differences.
(function (NLOSIM) {
  "use strict";

  NLOSIM.Results = class Results {
    constructor(data, arrays) {
      const { runs, metrics, pairs } = data;
      this.data = data;
      this.about = data.about;
      this.factors = data.factors;
      this.combinations = data.levels.map((levels) => levels.map((level, f) => data.factors[f].levels.indexOf(level)));
      this.count = runs.fingerprints.length;
      this.seeds = runs.seeds;
      this.seed = arrays.array(runs.seed);
      this.combination = arrays.array(runs.combination);
      this.metrics = metrics.map((metric) => this.metric(metric, arrays));
      this.pairs = {
        first: arrays.array(pairs.first), second: arrays.array(pairs.second), factor: arrays.array(pairs.factor),
        of: new Map(Object.entries(pairs.metrics).map(([name, columns]) => [name, Object.fromEntries(
          Object.entries(columns).map(([key, reference]) => [key, arrays.array(reference)]))])),
      };
      this.runAt = this.combinations.map(() => new Map());
      this.seed.forEach((seed, run) => this.runAt[this.combination[run]].set(seed, run));
    }

    metric(said, arrays) {
      if (said.kind === "text") return { ...said, heading: said.name };
      const read = (key) => arrays.array(said[key]);
      return {
        ...said, heading: said.unit ? `${said.name} [${said.unit}]` : said.name, values: read("values"), n: read("n"),
        mean: { value: read("mean_value"), low: read("mean_low"), high: read("mean_high") },
      };
    }

    // The metrics that have figures.
    get drawn() { return this.metrics.filter(({ kind }) => kind !== "text"); }

    error(run) { return this.data.runs.errors[run] ?? null; }

    seedOf(run) { return this.seeds[this.seed[run]]; }

    level(combination, factor) { return this.factors[factor].levels[this.combinations[combination][factor]]; }

    levels(combination) { return this.factors.map((_, factor) => this.level(combination, factor)); }

    // A metric of a run: number, boolean, text, or null.
    value(run, metric) {
      if (metric.kind === "text") return metric.texts[run];
      const value = metric.values[run];
      if (Number.isNaN(value)) return null;
      return metric.kind === "share" ? value === 1 : value;
    }

    // What a combination is called: all its levels, or those of some factors.
    label(combination, factors = this.factors.map((_, factor) => factor)) {
      return factors.map((factor) => this.level(combination, factor)).join(", ") || "all runs";
    }

    // The levels of some factors with the names of these; not of those that an experiment does not have.
    condition(combination, factors = this.factors.map((_, factor) => factor)) {
      const has = (factor) => this.about.parts.length === 1 || this.level(combination, factor) !== "-";
      return factors.filter(has).map((factor) => `${this.factors[factor].name} ${this.level(combination, factor)}`).join(", ");
    }

    name(run) {
      return [`seed ${this.seedOf(run)}`, this.condition(this.combination[run])].filter(Boolean).join(", ");
    }

    settings(run) {
      const { settings, of } = this.data.commands;
      return of[this.combination[run]].map((index) => settings[index]);
    }

    // The shell command that repeats a run.
    command(run) {
      const { parts, quoted, of } = this.data.commands;
      const { head, tail } = parts.findLast(({ first }) => first <= this.combination[run]);
      const sets = of[this.combination[run]].map((index) => ` --set ${quoted[index]}`);
      return `${head} ${this.seedOf(run)}${tail}${sets.join("")}`;
    }

    // Where its directory is, relative to the page, and whether it has a page; null if it was not kept.
    folder(run) {
      const found = this.data.folders[run];
      return found ? { path: found[0], hasPage: found[1] } : null;
    }
  };

  // A table as CSV; numbers with all their digits, nothing for what there is not.
  NLOSIM.csv = function csv(rows) {
    const cell = (value) => {
      const text = value === null || value === undefined || Number.isNaN(value) ? "" : String(value);
      return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
    };
    return rows.map((row) => `${row.map(cell).join(",")}\n`).join("");
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
