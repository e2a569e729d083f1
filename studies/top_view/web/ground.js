// What does not move: roads and buildings, which are drawn when the view changes, and with some
// room beyond it; traffic lights; a scale.
(function (NLOSIM) {
  "use strict";

  const ROAD = "#e4e4e2";
  const BUILDING = "#b9b1a4";
  // what a signal shows: off, red, red and yellow, yellow, yielding green, green, green for a turn on red
  const LIGHTS = ["#7F7F7F", "#D55E00", "#D55E00", "#E69F00", "#66c2a5", "#009E73", "#66c2a5"];
  const STOPS = [1, 2];

  function polygons(data, arrays, bounds) {
    const path = new Path2D();
    if (!data) return path;
    const [x, y, ends] = [arrays.numbers(data.x), arrays.numbers(data.y), arrays.array(data.ends)];
    let k = 0;
    for (const end of ends) {
      for (let first = true; k < end; k += 1, first = false) {
        if (first) path.moveTo(x[k], y[k]);
        else path.lineTo(x[k], y[k]);
        bounds[0] = Math.min(bounds[0], x[k]);
        bounds[1] = Math.min(bounds[1], y[k]);
        bounds[2] = Math.max(bounds[2], x[k]);
        bounds[3] = Math.max(bounds[3], y[k]);
      }
      path.closePath();
    }
    return path;
  }

  NLOSIM.Ground = class Ground {
    constructor(data, arrays) {
      this.bounds = [Infinity, Infinity, -Infinity, -Infinity];
      this.road = polygons(data.road, arrays, this.bounds);
      this.building = polygons(data.building, arrays, this.bounds);
      this.light = data.light ? {
        x: arrays.numbers(data.light.x), y: arrays.numbers(data.light.y), heading: arrays.numbers(data.light.heading),
        times: arrays.times(data.light.times), state: arrays.array(data.light.state),
      } : null;
    }

    draw(context, camera) {
      camera.plain(context);
      context.fillStyle = "#fafaf8";
      context.fillRect(0, 0, camera.width, camera.height);
      camera.apply(context);
      context.fillStyle = ROAD;
      context.fill(this.road, "nonzero");
      context.fillStyle = BUILDING;
      context.fill(this.building, "nonzero");
      context.strokeStyle = "#8d8577";
      context.lineWidth = 1 / camera.scale;
      context.stroke(this.building);
    }

    // A bar of a round length.
    scale(context, camera) {
      camera.plain(context);
      const least = 70 / camera.scale;
      const power = 10 ** Math.floor(Math.log10(least));
      const length = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= least);
      const [left, top, width] = [14, camera.height - 16, length * camera.scale];
      context.fillStyle = "#ffffffcc";
      context.fillRect(left - 6, top - 18, width + 12, 26);
      context.strokeStyle = context.fillStyle = "#333";
      context.lineWidth = 1.5;
      context.beginPath();
      context.moveTo(left, top - 5);
      context.lineTo(left, top);
      context.lineTo(left + width, top);
      context.lineTo(left + width, top - 5);
      context.stroke();
      context.font = "11px system-ui, sans-serif";
      context.textAlign = "center";
      context.fillText(`${length} m`, left + width / 2, top - 6);
    }

    // A bar across the lane where the signal stops it, a mark along it where it lets it go.
    lights(context, camera, time) {
      const { light } = this;
      if (!light || camera.scale < 0.8) return;
      const count = light.x.length;
      const row = Math.max(0, NLOSIM.lastAt(light.times, time + 1e-9)) * count;
      camera.apply(context);
      context.lineCap = "butt";
      for (let k = 0; k < count; k += 1) {
        const state = light.state[row + k];
        const [along, across] = [Math.cos(light.heading[k]), Math.sin(light.heading[k])];
        const stops = STOPS.includes(state);
        context.strokeStyle = LIGHTS[state];
        context.lineWidth = Math.max(stops ? 0.7 : 0.5, 2.5 / camera.scale);
        context.beginPath();
        if (stops || state === 3) {
          context.moveTo(light.x[k] - across * 1.4, light.y[k] + along * 1.4);
          context.lineTo(light.x[k] + across * 1.4, light.y[k] - along * 1.4);
        } else {
          context.moveTo(light.x[k] - along * 1.8, light.y[k] - across * 1.8);
          context.lineTo(light.x[k], light.y[k]);
        }
        context.stroke();
      }
    }
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
