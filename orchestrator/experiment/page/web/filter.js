// What the table of runs shows, and in which order: words, `column=value`, `column<number`.
(function (NLOSIM) {
  "use strict";

  const WORD = /(?:([^\s"<>=!]+)(<=|>=|!=|=|<|>))?(?:"([^"]*)"|(\S+))/g;
  const OPERATIONS = {
    "=": (a, b) => same(a, b), "!=": (a, b) => !same(a, b),
    "<": (a, b) => isNumber(a) && a < Number(b), ">": (a, b) => isNumber(a) && a > Number(b),
    "<=": (a, b) => isNumber(a) && a <= Number(b), ">=": (a, b) => isNumber(a) && a >= Number(b),
  };
  const isNumber = (value) => typeof value === "number";
  const same = (value, text) => (isNumber(value) && text !== "" && !Number.isNaN(Number(text))
    ? value === Number(text) : String(value ?? "").toLowerCase() === text.toLowerCase());

  // A function that says whether a row, values by column, has all that the text asks for.
  NLOSIM.filterOf = function filterOf(text, columns) {
    const tests = [];
    for (const [whole, name, operation, quoted, word] of text.matchAll(WORD)) {
      if (name && columns.includes(name)) {
        const wanted = quoted ?? word;
        tests.push((row) => OPERATIONS[operation](row[name], wanted));
      } else {
        const wanted = (name ? whole : quoted ?? word).toLowerCase();
        tests.push((row) => columns.some((column) => String(row[column] ?? "").toLowerCase().includes(wanted)));
      }
    }
    return (row) => tests.every((test) => test(row));
  };

  // Compares values of a column; what there is not comes last, upwards and downwards.
  NLOSIM.compare = function compare(a, b, down = false) {
    const missing = [a, b].map((value) => value === null || value === undefined || Number.isNaN(value));
    if (missing[0] || missing[1]) return missing[0] - missing[1];
    const order = typeof a === "string" || typeof b === "string" ? String(a).localeCompare(String(b), "en") : a - b;
    return down ? -order : order;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
