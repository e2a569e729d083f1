// Mouse, fingers, wheel: pan, zoom, pinch, point at, click.
(function (NLOSIM) {
  "use strict";

  const NEAR = 14; // [pixel]
  const STILL = 5;

  // Who is at a place of the picture: { vehicle } or { packet } or null.
  NLOSIM.hit = function hit(view, left, top, time) {
    const { camera, crowd } = view;
    for (const { packet, place } of view.flying || []) {
      if (Math.hypot(place[0] - left, place[1] - top) < NEAR) return { packet };
    }
    const now = crowd.at(time);
    let best = null;
    let least = NEAR;
    for (let n = 0; n < now.n; n += 1) {
      const [x, y] = camera.toScreen(now.x[n], now.y[n]);
      const reach = (crowd.size[3 * now.vehicle[n]] / 2) * camera.scale;
      const far = Math.max(0, Math.hypot(x - left, y - top) - Math.min(reach, 40));
      if (far < least) [best, least] = [{ vehicle: now.vehicle[n] }, far];
    }
    return best;
  };

  NLOSIM.pointer = function pointer(canvas, view, { over, click }) {
    const held = new Map();
    let moved = 0;
    const at = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "mouse" && event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, at(event));
      if (held.size === 1) moved = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const place = at(event);
      const before = held.get(event.pointerId);
      if (!before) {
        over(place);
        return;
      }
      const others = Array.from(held).filter(([id]) => id !== event.pointerId).map(([, each]) => each);
      if (others.length) pinch(view.camera, before, place, others[0]);
      else view.camera.move(place[0] - before[0], place[1] - before[1]);
      moved += Math.hypot(place[0] - before[0], place[1] - before[1]);
      held.set(event.pointerId, place);
      if (moved > STILL) view.touched();
    });
    const release = (event) => {
      const known = held.delete(event.pointerId);
      if (known && event.type === "pointerup" && !held.size && moved <= STILL) click(at(event));
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointerleave", () => over(null));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 33 : 1;
      view.camera.zoom(Math.exp(-Math.max(-300, Math.min(300, event.deltaY * lines)) / 400), ...at(event));
      view.redraw();
    }, { passive: false });
  };

  function pinch(camera, before, now, other) {
    const spread = (a) => Math.max(10, Math.hypot(a[0] - other[0], a[1] - other[1]));
    const middle = (a) => [(a[0] + other[0]) / 2, (a[1] + other[1]) / 2];
    const [from, to] = [middle(before), middle(now)];
    camera.move(to[0] - from[0], to[1] - from[1]);
    camera.zoom(spread(now) / spread(before), ...to);
  }
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
