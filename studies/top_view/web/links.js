// Links to the listener: colour and dash by class, thin and with a cross where the last frame was lost.
(function (NLOSIM) {
  "use strict";

  const { colours } = NLOSIM;
  const WINDOW = 0.2; // [s]

  NLOSIM.LINK_STYLES = [
    { colour: colours.green, dash: [] },
    { colour: colours.orange, dash: [9, 4] },
    { colour: colours.vermillion, dash: [2, 3] },
  ];

  NLOSIM.links = function links(context, view, time) {
    const { camera, crowd, radio, observer } = view;
    if (!radio || observer < 0) return;
    const now = crowd.at(time);
    if (now.row[observer] < 0) return;
    const [left, top] = camera.toScreen(now.x[now.row[observer]], now.y[now.row[observer]]);
    camera.plain(context);
    context.lineCap = "butt";
    for (const [vehicle, k] of radio.links(observer, time, WINDOW * radio.stride)) {
      const n = now.row[vehicle];
      if (n < 0 || vehicle === observer) continue;
      const received = radio.outcome(k) === 0;
      const important = crowd.role[vehicle] > 0 || vehicle === view.selected || vehicle === view.hovered;
      const { colour, dash } = NLOSIM.LINK_STYLES[radio.link(k)] || NLOSIM.LINK_STYLES[0];
      const [x, y] = camera.toScreen(now.x[n], now.y[n]);
      context.globalAlpha = important ? 1 : received ? 0.4 : 0.22;
      context.setLineDash(dash);
      context.lineWidth = (important ? 2.4 : 1.1) * (received ? 1 : 0.6);
      context.strokeStyle = colour;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(left, top);
      context.stroke();
      if (!received) cross(context, x + (left - x) * 0.25, y + (top - y) * 0.25, important ? 5 : 3, colour);
    }
    context.globalAlpha = 1;
    context.setLineDash([]);
  };

  function cross(context, x, y, r, colour) {
    context.setLineDash([]);
    context.strokeStyle = colour;
    context.lineWidth = r > 4 ? 2.2 : 1.2;
    context.beginPath();
    context.moveTo(x - r, y - r);
    context.lineTo(x + r, y + r);
    context.moveTo(x + r, y - r);
    context.lineTo(x - r, y + r);
    context.stroke();
  }
  NLOSIM.cross = cross;
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
