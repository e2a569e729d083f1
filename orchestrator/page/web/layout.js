// Places of the boxes and lines of a wiring: layers from left to right in the order of turns, long
// lines with a slot of their own in each layer that they pass, feedback beneath.
(function (NLOSIM) {
  "use strict";

  const BOX = { width: 190, height: 46 };
  const SLOT = 10; // height of a line that passes a layer
  const GAP = { x: 66, y: 20 };
  const MARGIN = 12;
  const RAIL = 13;
  const SWEEPS = 8;

  // One edge for all connections between two components, in one direction.
  function edgesOf(components, connections) {
    const turn = new Map(components.map((each, k) => [each.name, k]));
    const edges = new Map();
    for (const each of connections) {
      const key = `${turn.get(each.source)} ${turn.get(each.target)}`;
      if (!edges.has(key)) {
        edges.set(key, { source: each.source, target: each.target, connections: [],
          forward: turn.get(each.source) < turn.get(each.target) });
      }
      edges.get(key).connections.push(each);
    }
    return Array.from(edges.values());
  }

  function layersOf(components, edges) {
    const layer = new Map(components.map((each) => [each.name, 0]));
    for (const { name } of components) { // in turn, so every source is done before its targets
      for (const edge of edges) {
        if (edge.forward && edge.target === name) {
          layer.set(name, Math.max(layer.get(name), layer.get(edge.source) + 1));
        }
      }
    }
    return layer;
  }

  // Items of each layer: boxes, and slots of the lines that pass; `links` are pairs of neighbours.
  function columnsOf(components, edges, layer) {
    const columns = [];
    const put = (item, k) => {
      while (columns.length <= k) columns.push([]);
      columns[k].push({ ...item, before: [], after: [] });
      return columns[k][columns[k].length - 1];
    };
    const boxes = new Map(components.map((each) =>
      [each.name, put({ name: each.name, height: BOX.height }, layer.get(each.name))]));
    for (const edge of edges.filter((each) => each.forward)) {
      let last = boxes.get(edge.source);
      edge.slots = [];
      for (let k = layer.get(edge.source) + 1; k < layer.get(edge.target); k += 1) {
        const slot = put({ height: SLOT }, k);
        last.after.push(slot);
        slot.before.push(last);
        edge.slots.push(slot);
        last = slot;
      }
      last.after.push(boxes.get(edge.target));
      boxes.get(edge.target).before.push(last);
    }
    return { columns, boxes };
  }

  function stack(column) {
    let y = 0;
    for (const item of column) {
      item.y = y;
      y += item.height + GAP.y;
    }
    const middle = (y - GAP.y) / 2;
    for (const item of column) item.y -= middle;
  }

  const middleOf = (item) => item.y + item.height / 2;

  function wished(item, side) {
    const near = item[side];
    if (!near.length) return middleOf(item);
    return near.reduce((sum, each) => sum + middleOf(each), 0) / near.length;
  }

  // Every item as near as it can be to those that it is linked with, in the order of the column.
  function settle(column, side) {
    const wish = new Map(column.map((item) => [item, wished(item, side)]));
    column.sort((a, b) => wish.get(a) - wish.get(b)); // stable
    let floor = -Infinity;
    for (const item of column) {
      item.y = Math.max(floor, wish.get(item) - item.height / 2);
      floor = item.y + item.height + GAP.y;
    }
    const drift = column.reduce((sum, item) => sum + middleOf(item) - wish.get(item), 0) / column.length;
    for (const item of column) item.y -= drift;
  }

  NLOSIM.layout = function layout(components, connections) {
    const edges = edgesOf(components, connections);
    const layer = layersOf(components, edges);
    const { columns, boxes } = columnsOf(components, edges, layer);
    columns.forEach(stack);
    for (let sweep = 0; sweep < SWEEPS; sweep += 1) {
      if (sweep % 2) for (let k = columns.length - 2; k >= 0; k -= 1) settle(columns[k], "after");
      else for (let k = 1; k < columns.length; k += 1) settle(columns[k], "before");
    }
    const top = Math.min(0, ...columns.flat().map((item) => item.y));
    columns.forEach((column, k) => column.forEach((item) => {
      item.x = MARGIN + k * (BOX.width + GAP.x);
      item.y += MARGIN - top;
    }));
    const bottom = Math.max(0, ...columns.flat().map((item) => item.y + item.height));
    const back = edges.filter((edge) => !edge.forward);
    const way = (edge) => {
      const [source, target] = [boxes.get(edge.source), boxes.get(edge.target)];
      if (edge.forward) return forward(source, edge.slots, target);
      const k = back.indexOf(edge);
      return beneath(source, target, bottom + RAIL * (k + 1.5), k, back.length);
    };
    const paths = edges.map((edge) => ({ source: edge.source, target: edge.target, forward: edge.forward,
      connections: edge.connections, path: way(edge) }));
    return {
      boxes: Array.from(boxes.values(), ({ name, x, y }) => ({ name, x, y, ...BOX })),
      edges: paths,
      width: 2 * MARGIN + columns.length * (BOX.width + GAP.x) - GAP.x,
      height: bottom + RAIL * (back.length + 1.5) + MARGIN,
    };
  };

  function forward(source, slots, target) {
    const points = [[source.x + BOX.width, middleOf(source)]];
    for (const slot of slots) points.push([slot.x, middleOf(slot)], [slot.x + BOX.width, middleOf(slot)]);
    points.push([target.x, middleOf(target)]);
    let path = `M${points[0]}`;
    for (let k = 1; k < points.length; k += 1) {
      const [[x0, y0], [x1, y1]] = [points[k - 1], points[k]];
      const bend = (x1 - x0) / 2;
      path += k % 2 ? ` C${x0 + bend},${y0} ${x1 - bend},${y1} ${x1},${y1}` : ` L${x1},${y1}`;
    }
    return path;
  }

  function beneath(source, target, rail, k, count) {
    const shift = (BOX.width * (k + 1)) / (count + 1) / 2;
    const x0 = source.x + BOX.width - shift;
    const x1 = target.x + shift;
    const r = 6;
    const way = x1 < x0 ? -1 : 1;
    return `M${x0},${source.y + BOX.height} V${rail - r} Q${x0},${rail} ${x0 + way * r},${rail} ` +
      `H${x1 - way * r} Q${x1},${rail} ${x1},${rail - r} V${target.y + BOX.height}`;
  }
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
