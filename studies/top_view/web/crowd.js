// Everybody on the road: who each is, and where each is at a time.
(function (NLOSIM) {
  "use strict";

  const BODIES = ["car", "SUV or MPV", "van", "bus", "truck", "tram or train", "motorcycle", "bicycle", "pedestrian"];

  NLOSIM.Crowd = class Crowd {
    constructor(data, entities, arrays) {
      const of = (name) => arrays.array(data[name]);
      this.ids = of("ids");
      this.count = this.ids.length;
      this.size = arrays.numbers(data.size); // length, width, height of each
      this.body = of("body");
      this.role = of("role");
      this.radio = of("radio");
      this.lidar = of("lidar");
      this.kinds = data.kinds;
      this.times = arrays.times(data.times);
      this.x = arrays.numbers(data.x);
      this.y = arrays.numbers(data.y);
      this.heading = of("heading");
      this.turn = (2 * Math.PI) / data.directions;
      const stretches = ["vehicle", "first", "count"].map((name) => arrays.array(data.stretches[name]));
      [this.owner, this.first, this.lasts] = stretches;
      this.begins = new Int32Array(this.lasts.length);
      for (let s = 1; s < this.begins.length; s += 1) this.begins[s] = this.begins[s - 1] + this.lasts[s - 1];
      this.labels = Array.from(this.ids, (id, k) => data.names[k] || entities[this.role[k] - 1] || `${id}`);
      this.now = this.moment();
      this.then = this.moment(); // for looks at another time than that of the picture
    }

    // Whether somebody on the page has none, or one.
    get hasNoRadio() {
      return this.radio.some((it) => !it);
    }

    get hasLidar() {
      return this.lidar.some((it) => it);
    }

    moment() {
      return { time: NaN, n: 0, vehicle: new Int32Array(this.count), x: new Float64Array(this.count),
        y: new Float64Array(this.count), heading: new Float64Array(this.count), row: new Int32Array(this.count).fill(-1) };
    }

    kind(k) {
      return this.kinds[k] || BODIES[this.body[k]] || "vehicle";
    }

    title(k) {
      return this.labels[k] === String(this.ids[k]) ? `vehicle ${this.ids[k]}` : `${this.labels[k]} (${this.ids[k]})`;
    }

    // Where everybody is: one object, which the next call fills anew.
    at(time, now = this.now) {
      const { times } = this;
      if (now.time === time) return now;
      now.row.fill(-1);
      now.time = time;
      now.n = 0;
      const frame = Math.max(0, NLOSIM.lastAt(times, time + 1e-9));
      const part = frame + 1 < times.length ? Math.min(1, Math.max(0, (time - times[frame]) / (times[frame + 1] - times[frame]))) : 0;
      for (let s = 0; s < this.owner.length; s += 1) {
        const offset = frame - this.first[s];
        if (offset < 0 || offset >= this.lasts[s]) continue;
        const row = this.begins[s] + offset;
        const next = offset + 1 < this.lasts[s] ? row + 1 : row;
        const k = now.n++;
        now.vehicle[k] = this.owner[s];
        now.row[this.owner[s]] = k;
        now.x[k] = this.x[row] + (this.x[next] - this.x[row]) * part;
        now.y[k] = this.y[row] + (this.y[next] - this.y[row]) * part;
        let turned = (this.heading[next] - this.heading[row]) * this.turn;
        if (turned > Math.PI) turned -= 2 * Math.PI;
        if (turned < -Math.PI) turned += 2 * Math.PI;
        now.heading[k] = this.heading[row] * this.turn + turned * part;
      }
      return now;
    }

    stretchOf(k, frame) {
      for (let s = 0; s < this.owner.length; s += 1) {
        if (this.owner[s] === k && frame >= this.first[s] && frame < this.first[s] + this.lasts[s]) return s;
      }
      return -1;
    }

    // How fast one is [m/s], from its places; NaN if it is not there.
    speed(k, time) {
      const frame = NLOSIM.lastAt(this.times, time + 1e-9);
      const s = this.stretchOf(k, frame);
      if (s < 0 || this.lasts[s] < 2) return NaN;
      const row = Math.min(frame, this.first[s] + this.lasts[s] - 2) - this.first[s] + this.begins[s];
      const at = row - this.begins[s] + this.first[s];
      return Math.hypot(this.x[row + 1] - this.x[row], this.y[row + 1] - this.y[row]) / (this.times[at + 1] - this.times[at]);
    }

    // Its speed over time, as a curve.
    speedCurve(k) {
      const times = [];
      const values = [];
      for (let s = 0; s < this.owner.length; s += 1) {
        if (this.owner[s] !== k) continue;
        for (let n = 0; n + 1 < this.lasts[s]; n += 1) {
          const [row, at] = [this.begins[s] + n, this.first[s] + n];
          times.push(this.times[at]);
          values.push(Math.hypot(this.x[row + 1] - this.x[row], this.y[row + 1] - this.y[row]) / (this.times[at + 1] - this.times[at]));
        }
      }
      return new NLOSIM.Curve({ name: `speed of ${this.title(k)}`, unit: "m/s", holds: false,
        times: Float64Array.from(times), values: Float64Array.from(values) });
    }
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
