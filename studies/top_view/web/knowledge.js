// What one knows of whom: by messages, by its own sensor, by what others told of theirs.
(function (NLOSIM) {
  "use strict";

  const { lastAt } = NLOSIM;
  const MARGIN = 0.5; // around a body [m], as the measures of knowledge have it

  const UNKNOWN = -2;

  NLOSIM.Objects = class Objects {
    constructor(data, arrays) {
      this.name = data.name;
      this.told = data.told;
      this.times = arrays.times(data.times);
      this.ends = arrays.array(data.ends);
      this.sensor = arrays.array(data.sensor);
      this.scanned = arrays.times(data.scanned);
      this.position = arrays.numbers(data.position);
      this.angle = arrays.numbers(data.angle);
      this.size = arrays.numbers(data.size);
      this.owners = new Int32Array(this.sensor.length).fill(UNKNOWN);
    }

    // Rows of the newest scan at a time.
    rows(time) {
      const scan = lastAt(this.times, time + 1e-9);
      if (scan < 0) return [0, 0];
      return [scan ? this.ends[scan - 1] : 0, this.ends[scan]];
    }

    // The vehicle in whose body the middle of a box lay when it was seen, or nearly; -1: none.
    owner(crowd, k) {
      if (this.owners[k] === UNKNOWN) this.owners[k] = this.found(crowd, crowd.at(this.scanned[k], crowd.then), k);
      return this.owners[k];
    }

    found(crowd, now, k) {
      const [x, y] = [this.position[2 * k], this.position[2 * k + 1]];
      let [best, least] = [-1, MARGIN];
      for (let n = 0; n < now.n; n += 1) {
        const [east, north, vehicle] = [x - now.x[n], y - now.y[n], now.vehicle[n]];
        const reach = crowd.size[3 * vehicle] + crowd.size[3 * vehicle + 1];
        if (Math.abs(east) > reach || Math.abs(north) > reach) continue;
        const [cosine, sine] = [Math.cos(now.heading[n]), Math.sin(now.heading[n])];
        const outside = Math.max(Math.abs(east * cosine + north * sine) - crowd.size[3 * vehicle] / 2,
          Math.abs(north * cosine - east * sine) - crowd.size[3 * vehicle + 1] / 2);
        if (outside <= least) [best, least] = [vehicle, outside];
      }
      return best;
    }

    // Who is in the boxes that a sensor sees: vehicle -> row.
    seen(crowd, time, sensor) {
      const found = new Map();
      const [first, end] = this.rows(time);
      for (let k = first; k < end; k += 1) {
        if (sensor !== null && this.sensor[k] !== sensor) continue;
        const owner = this.owner(crowd, k);
        if (owner >= 0) found.set(owner, k);
      }
      return found;
    }
  };

  // vehicle -> { message, sees, told }: how old each is [s], where there is one
  NLOSIM.knowledge = function knowledge(view, observer, time) {
    const found = new Map();
    const of = (vehicle) => {
      if (!found.has(vehicle)) found.set(vehicle, {});
      return found.get(vehicle);
    };
    const { crowd, radio, objects } = view;
    if (radio) {
      for (const [source, k] of radio.known(observer, time)) of(source).message = time - radio.packets.time[radio.heard.packet[k]];
    }
    for (const each of objects) {
      if (each.told && !view.belongs(each, observer)) continue;
      for (const [vehicle, k] of each.seen(crowd, time, each.told ? null : observer)) {
        of(vehicle)[each.told ? "told" : "sees"] = Math.max(0, time - each.scanned[k]);
      }
    }
    found.delete(observer);
    return found;
  };

  NLOSIM.freshest = ({ message = Infinity, sees = Infinity, told = Infinity }) => Math.min(message, sees, told);
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
