// What sensors see and what is made of it: points, objects, blind zones, matrices.
(function (NLOSIM) {
  "use strict";

  const { lastAt, colours } = NLOSIM;

  NLOSIM.Sensing = class Sensing {
    constructor(data, arrays) {
      this.objects = data.objects.map((each) => new NLOSIM.Objects(each, arrays));
      this.zones = data.zones.map((each) => ({ name: each.name, times: arrays.times(each.times), ends: arrays.array(each.ends),
        center: arrays.numbers(each.center), range: arrays.numbers(each.range) }));
      this.matrices = data.matrices.map((each) => NLOSIM.readMatrices(each, arrays));
      this.points = data.points.map((each) => ({ name: each.name, times: arrays.times(each.times), ends: arrays.array(each.ends),
        x: arrays.numbers(each.x), y: arrays.numbers(each.y), building: arrays.array(each.building), sensor: arrays.array(each.sensor) }));
    }

    get kinds() {
      return ["points", "objects", "zones", "matrices"].filter((kind) => this[kind].length);
    }

    draw(context, view, time) {
      if (view.shows("matrices")) this.drawMatrices(context, view, time);
      if (view.shows("zones")) this.drawZones(context, view, time);
    }

    // Squares along the heading of whoever they are of.
    drawZones(context, view, time) {
      view.camera.apply(context);
      const now = view.crowd.at(time), n = view.observer < 0 ? -1 : now.row[view.observer];
      const heading = n < 0 ? 0 : now.heading[n];
      for (const each of this.zones) {
        if (!view.belongs(each, view.observer)) continue;
        const [first, end] = rows(each, time);
        context.fillStyle = "#5b3a6a38";
        context.strokeStyle = "#5b3a6a";
        context.lineWidth = 1.2 / view.camera.scale;
        for (let k = first; k < end; k += 1) {
          context.beginPath();
          for (const corner of NLOSIM.square(each.center[2 * k], each.center[2 * k + 1], each.range[k], heading)) context.lineTo(...corner);
          context.closePath();
          context.fill();
          context.stroke();
        }
      }
    }

    drawPoints(context, view, time) {
      const { camera } = view;
      camera.apply(context);
      const size = Math.max(0.15, 1.6 / camera.scale);
      for (const each of this.points) {
        const [first, end] = rows(each, time);
        for (let k = first; k < end; k += 1) {
          context.fillStyle = each.building[k] ? "#6b5f4d" : colours.vermillion;
          context.fillRect(each.x[k] - size / 2, each.y[k] - size / 2, size, size);
        }
      }
    }

    // The newest matrix of each vehicle: of the chosen one, or of the listener.
    drawMatrices(context, view, time) {
      const { camera } = view;
      for (const each of this.matrices) {
        const row = newest(each, time, view.selected) ?? newest(each, time, view.observer);
        if (row === null) continue;
        camera.apply(context);
        context.translate(each.center[2 * row], each.center[2 * row + 1]);
        context.rotate(each.heading[row]);
        const [m, n, k] = [each.rows[row], each.columns[row], each.cell[row]];
        context.lineWidth = 0.6 / camera.scale;
        context.strokeStyle = "#00000018";
        for (let r = 0; r < m; r += 1) {
          for (let c = 0; c < n; c += 1) {
            const shade = each.shade[each.first[row] + r * n + c];
            const [x, y] = [(r - m / 2) * k, (c - n / 2) * k];
            if (shade) {
              context.fillStyle = `rgba(0, 114, 178, ${0.1 + (0.55 * shade) / each.most})`;
              context.fillRect(x, y, k, k);
            }
            context.strokeRect(x, y, k, k);
          }
        }
      }
    }

    // Above the bodies: points, and boxes of objects, those that others told dashed.
    drawAbove(context, view, time) {
      if (view.shows("points")) this.drawPoints(context, view, time);
      if (view.shows("objects")) this.drawObjects(context, view, time);
    }

    drawObjects(context, view, time) {
      view.camera.apply(context);
      const thin = 1 / view.camera.scale;
      for (const each of this.objects) {
        if (!view.belongs(each, view.observer)) continue;
        const [first, end] = each.rows(time);
        context.lineWidth = (each.told ? 1.6 : 1.8) * thin;
        for (let k = first; k < end; k += 1) {
          const own = each.sensor[k] === view.observer;
          if (!each.told && !own && each.sensor[k] !== view.selected) continue;
          context.setLineDash(each.told ? [5 * thin, 3 * thin] : []);
          context.strokeStyle = each.told ? "#7a3f8f" : "#b0005a";
          const [length, width] = [each.size[2 * k] + 0.6, each.size[2 * k + 1] + 0.6];
          context.save();
          context.translate(each.position[2 * k], each.position[2 * k + 1]);
          context.rotate(each.angle[k]);
          context.strokeRect(-length / 2, -width / 2, length, width);
          context.restore();
        }
      }
      context.setLineDash([]);
    }
  };

  // The corners of a square, of which `half` is half a side, along a heading.
  NLOSIM.square = function square(x, y, half, heading) {
    const [c, s] = [half * Math.cos(heading), half * Math.sin(heading)];
    return [[x + c - s, y + s + c], [x - c - s, y - s + c], [x - c + s, y - s - c], [x + c + s, y + s - c]];
  };

  NLOSIM.readMatrices = function readMatrices(data, arrays) {
    const found = { name: data.name, most: data.most, times: arrays.times(data.times), center: arrays.numbers(data.center),
      heading: arrays.numbers(data.heading), cell: arrays.numbers(data.cell) };
    for (const name of ["vehicle", "rows", "columns", "shade"]) found[name] = arrays.array(data[name]);
    found.first = new Int32Array(found.rows.length);
    for (let k = 1; k < found.first.length; k += 1) found.first[k] = found.first[k - 1] + found.rows[k - 1] * found.columns[k - 1];
    return found;
  };

  function rows(each, time) {
    const scan = lastAt(each.times, time + 1e-9);
    return scan < 0 ? [0, 0] : [scan ? each.ends[scan - 1] : 0, each.ends[scan]];
  }

  function newest(each, time, vehicle) {
    for (let row = lastAt(each.times, time + 1e-9); row >= 0 && each.times[row] > time - 2; row -= 1) {
      if (each.vehicle[row] === vehicle) return row;
    }
    return null;
  }
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
