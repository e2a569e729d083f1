// Messages as they fly: far slower than radio waves, so that they can be seen. A mark goes from the
// transmitter to whom the frame is for; a broadcast is a ring that grows. Lost ones end in a cross.
(function (NLOSIM) {
  "use strict";

  const { colours } = NLOSIM;
  const FLIGHT = 0.25; // how long one is seen [s of watching], the last part of it where it ends
  const REACH = 60; // of the ring of a broadcast [m]
  NLOSIM.KIND_COLOURS = [colours.grey, colours.sky, colours.purple, colours.black, colours.grey];

  NLOSIM.flightTime = (view) => Math.max(0.004, FLIGHT * view.page.clock.speed);

  NLOSIM.flights = function flights(context, view, time, every) {
    const { camera, crowd, radio } = view;
    const now = crowd.at(time);
    const lasts = NLOSIM.flightTime(view);
    camera.plain(context);
    context.setLineDash([]);
    view.flying = [];
    for (const s of radio.frames(time, lasts, every)) {
      const p = radio.sent.packet[s];
      const from = now.row[radio.sent.transmitter[s]];
      if (from < 0) continue;
      const part = (time - radio.sent.start[s]) / lasts;
      const to = radio.way(p)[radio.sent.hop[s] + 1];
      const kind = radio.packets.kind[p];
      const start = camera.toScreen(now.x[from], now.y[from]);
      if (to === undefined || to < 0) ripple(context, start, part, kind, camera);
      else if (now.row[to] >= 0) {
        const end = camera.toScreen(now.x[now.row[to]], now.y[now.row[to]]);
        const heard = radio.addressed.get(`${p} ${radio.sent.hop[s]} ${to}`);
        const place = dart(context, start, end, part, kind, heard === undefined ? null : radio.outcome(heard));
        view.flying.push({ packet: p, place });
      }
    }
    context.globalAlpha = 1;
  };

  function ripple(context, [x, y], part, kind, camera) {
    context.globalAlpha = (kind === 0 ? 0.35 : 0.6) * (1 - part) ** 2;
    context.strokeStyle = NLOSIM.KIND_COLOURS[kind];
    context.lineWidth = kind === 0 ? 1 : 1.4;
    context.beginPath();
    context.arc(x, y, 6 + part * Math.min(REACH * camera.scale, 160), 0, 2 * Math.PI);
    context.stroke();
  }

  function dart(context, [x0, y0], [x1, y1], part, kind, outcome) {
    const gone = Math.min(1, part / 0.7);
    const [x, y] = [x0 + (x1 - x0) * gone, y0 + (y1 - y0) * gone];
    const colour = NLOSIM.KIND_COLOURS[kind];
    context.globalAlpha = part > 0.7 ? Math.max(0, (1 - part) / 0.3) : 1;
    context.strokeStyle = colour;
    context.lineWidth = 2.5;
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x, y);
    context.stroke();
    if (gone >= 1 && outcome !== 0 && outcome !== null) NLOSIM.cross(context, x, y, 8, colours.vermillion);
    else NLOSIM.kindMark(context, kind, x, y, 5.5);
    return [x, y];
  }

  // Kinds differ in shape, too.
  NLOSIM.kindMark = function kindMark(context, kind, x, y, r) {
    context.fillStyle = NLOSIM.KIND_COLOURS[kind];
    context.strokeStyle = "#fff";
    context.lineWidth = 1.2;
    context.beginPath();
    if (kind === 2) context.rect(x - r, y - r, 2 * r, 2 * r);
    else if (kind === 3) {
      context.moveTo(x, y - r * 1.2);
      context.lineTo(x + r * 1.1, y + r * 0.9);
      context.lineTo(x - r * 1.1, y + r * 0.9);
      context.closePath();
    } else context.arc(x, y, r, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
