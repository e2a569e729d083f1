// Marks of runs and means: groups differ in shape, not in colour alone.
(function (NLOSIM) {
  "use strict";

  const round = (value) => Math.round(value * 100) / 100;
  const polygon = (corners) => (x, y, r) => `M${corners.map(([dx, dy]) => `${round(x + dx * r)} ${round(y + dy * r)}`).join("L")}Z`;
  const cross = (x, y, r) => `M${round(x - r)} ${round(y - r)}l${2 * r} ${2 * r}M${round(x - r)} ${round(y + r)}l${2 * r} ${-2 * r}`;
  const plus = (x, y, r) => `M${round(x - r)} ${round(y)}h${2 * r}M${round(x)} ${round(y - r)}v${2 * r}`;
  const circle = (x, y, r) => `M${round(x - r)} ${round(y)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
  const up = polygon([[0, -1.2], [1.1, 0.8], [-1.1, 0.8]]);
  const down = polygon([[0, 1.2], [1.1, -0.8], [-1.1, -0.8]]);
  const SHAPES = [circle, polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]]), up, polygon([[0, -1.3], [1.3, 0], [0, 1.3], [-1.3, 0]]), down, cross, plus];
  const OPEN = new Set([cross, plus]);

  // How a group is drawn; after seven, shapes come again with the next colour.
  NLOSIM.markOf = function markOf(group) {
    const shape = SHAPES[group % SHAPES.length];
    const colour = NLOSIM.cycle[(group + Math.floor(group / SHAPES.length)) % NLOSIM.cycle.length];
    return { shape, colour, isOpen: OPEN.has(shape) };
  };

  NLOSIM.shapes = { circle, up, down };

  // One element for many marks of a group.
  NLOSIM.marks = function marks(places, group, r, attributes = {}) {
    const { shape, colour, isOpen } = NLOSIM.markOf(group);
    const d = places.map(([x, y]) => shape(x, y, r)).join("");
    return NLOSIM.svg("path", { d, fill: isOpen ? "none" : colour, stroke: colour, "stroke-width": isOpen ? 1.6 : 0.8, ...attributes });
  };

  // Numbers from -0.5 to 0.5 that lie evenly however many are taken: van der Corput's.
  NLOSIM.evenly = function evenly(index) {
    let found = 0;
    for (let part = 0.5, rest = index + 1; rest > 0; part /= 2, rest >>= 1) if (rest & 1) found += part;
    return found - 0.5;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
