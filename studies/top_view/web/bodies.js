// Bodies from above: size and shape as they are, colours by role, white where there is no radio.
(function (NLOSIM) {
  "use strict";

  const { colours } = NLOSIM;
  const OTHERS = "#71879c";
  const ROLES = [colours.blue, colours.vermillion, colours.green, colours.black, colours.purple, "#8a6d3b", colours.sky, colours.orange];
  const SMALLEST = 5; // [pixel]
  const COARSE = 1.2; // below so many pixels for a metre, bodies have no shape
  const PEDESTRIAN = 8;
  const LONG = [3, 4, 5];
  const NARROW = [6, 7];

  NLOSIM.roleColour = (role) => (role > 0 ? ROLES[(role - 1) % ROLES.length] : OTHERS);

  function outline(context, body, length, width) {
    const [l, w] = [length / 2, width / 2];
    context.beginPath();
    if (body === PEDESTRIAN) context.arc(0, 0, Math.max(l, w), 0, 2 * Math.PI);
    else if (NARROW.includes(body)) {
      context.moveTo(l, 0);
      context.lineTo(0, w);
      context.lineTo(-l, 0);
      context.lineTo(0, -w);
      context.closePath();
    } else if (LONG.includes(body)) context.rect(-l, -w, length, width);
    else { // blunt behind, narrower in front
      context.moveTo(-l, -w);
      context.lineTo(l * 0.7, -w);
      context.quadraticCurveTo(l, -w * 0.9, l, -w * 0.4);
      context.lineTo(l, w * 0.4);
      context.quadraticCurveTo(l, w * 0.9, l * 0.7, w);
      context.lineTo(-l, w);
      context.closePath();
    }
  }

  // Windscreen, or the gap between cab and load.
  function details(context, body, length, width, thin) {
    const [l, w] = [length / 2, width / 2];
    context.fillStyle = "#ffffffb8";
    context.beginPath();
    if (body === 4) context.rect(l - 2.2, -w, 0.35, width);
    else if (body === 3 || body === 5) context.rect(l - 1.1, -w * 0.85, 0.6, width * 0.85);
    else if (body < 3) context.rect(l * 0.25, -w * 0.8, length * 0.11, width * 0.8);
    context.fill();
    context.lineWidth = thin;
  }

  NLOSIM.bodies = function bodies(context, view, time) {
    const { camera, crowd } = view;
    const now = crowd.at(time);
    const thin = 1 / camera.scale;
    for (let n = 0; n < now.n; n += 1) {
      const k = now.vehicle[n];
      const [left, top] = camera.toScreen(now.x[n], now.y[n]);
      if (left < -80 || top < -80 || left > camera.width + 80 || top > camera.height + 80) continue;
      const small = Math.max(1, SMALLEST / camera.scale / Math.max(crowd.size[3 * k], 1));
      const [length, width] = [Math.max(0.5, crowd.size[3 * k]) * small, Math.max(0.5, crowd.size[3 * k + 1]) * small];
      const colour = NLOSIM.roleColour(crowd.role[k]);
      camera.applyAt(context, now.x[n], now.y[n], now.heading[n]);
      if (camera.scale < COARSE && !crowd.role[k]) {
        context.fillStyle = colour;
        if (crowd.radio[k]) context.fillRect(-length / 2, -width / 2, length, width);
        else context.fillRect(-length / 2, -width / 6, length, width / 3); // thin without a radio
        continue;
      }
      outline(context, crowd.body[k], length, width);
      context.fillStyle = crowd.radio[k] ? colour : "#ffffff";
      context.fill();
      context.lineWidth = thin * (crowd.radio[k] ? 1 : 2);
      context.strokeStyle = crowd.radio[k] ? "#00000088" : colour;
      context.stroke();
      if (camera.scale > 2.5) details(context, crowd.body[k], length, width, thin);
      if (crowd.lidar[k]) {
        context.beginPath();
        context.arc(0, 0, Math.max(0.45, 3 * thin), 0, 2 * Math.PI);
        context.fillStyle = "#fff";
        context.fill();
        context.strokeStyle = "#000";
        context.lineWidth = Math.max(0.2, 1.5 * thin);
        context.stroke();
      }
    }
    rings(context, view, now, time);
  };

  function ring(context, view, now, k, colour, radius, dash = []) {
    const n = now.row[k];
    if (n < 0) return;
    const { camera } = view;
    const [left, top] = camera.toScreen(now.x[n], now.y[n]);
    context.beginPath();
    context.setLineDash(dash);
    context.arc(left, top, Math.max(radius, (view.crowd.size[3 * k] / 2) * camera.scale + 4), 0, 2 * Math.PI);
    context.strokeStyle = "#ffffffcc";
    context.lineWidth = 5;
    context.stroke();
    context.strokeStyle = colour;
    context.lineWidth = 2;
    context.stroke();
    context.setLineDash([]);
  }

  // Rings around who is chosen, listens, relays.
  function rings(context, view, now, time) {
    view.camera.plain(context);
    for (const relay of view.relaysAt(time)) ring(context, view, now, relay, colours.purple, 12, [3, 3]);
    if (view.observer >= 0 && view.radio) ring(context, view, now, view.observer, colours.blue, 11, [8, 3]);
    if (view.selected >= 0) ring(context, view, now, view.selected, colours.black, 14);
  }

  NLOSIM.names = function names(context, view, time) {
    const { camera, crowd } = view;
    const now = crowd.at(time);
    camera.plain(context);
    context.font = "600 12px system-ui, sans-serif";
    context.textAlign = "left";
    context.lineJoin = "round";
    const relays = view.relaysAt(time);
    const taken = [];
    for (let n = 0; n < now.n; n += 1) {
      const k = now.vehicle[n];
      const told = crowd.role[k] > 0 || k === view.selected || k === view.hovered || relays.includes(k);
      if (!told && !(camera.scale > 9)) continue;
      const [left, top] = camera.toScreen(now.x[n], now.y[n]);
      const text = relays.includes(k) ? `${crowd.labels[k]}: relay` : crowd.labels[k];
      const [x, y] = [left + 9 + (crowd.size[3 * k + 1] / 2) * camera.scale * 0.7, top - 8];
      if (x > camera.width || y > camera.height || x < -120 || y < 0) continue;
      if (taken.some(([a, b]) => Math.abs(a - x) < 7 * text.length && Math.abs(b - y) < 12)) continue;
      taken.push([x, y]);
      context.strokeStyle = "#ffffffe0";
      context.lineWidth = 3.5;
      context.strokeText(text, x, y);
      context.fillStyle = crowd.role[k] > 0 ? NLOSIM.roleColour(crowd.role[k]) : "#333";
      context.fillText(text, x, y);
    }
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
