// The card of a vehicle: what it is, what it hears, what it knows, its last messages.
(function (NLOSIM) {
  "use strict";

  const { el, spell } = NLOSIM;
  const MOST = 12;
  const TOGETHER = 1e-5; // [s]
  const SHOWN = 60; // [m], further ones are not asked about

  const ms = (seconds) => (seconds === undefined ? "–" : seconds < 1 ? `${Math.round(seconds * 1000)} ms` : `${spell(seconds, 3)} s`);

  NLOSIM.vehicleCard = function vehicleCard(view, k, time) {
    const { crowd, radio } = view;
    const now = crowd.at(time);
    const n = now.row[k];
    const facts = [crowd.kind(k), `${[0, 1, 2].map((i) => crowd.size[3 * k + i].toFixed(1)).join(" × ")} m`,
      crowd.radio[k] ? "radio" : "no radio", crowd.lidar[k] ? "lidar" : null].filter(Boolean);
    const speed = crowd.speed(k, time);
    return [
      el("h3", {}, el("span", { class: "dot", style: `background:${NLOSIM.roleColour(crowd.role[k])}` }), crowd.title(k)),
      el("p", { class: "note" }, facts.join(" · ")),
      n < 0 ? el("p", {}, "It is not here now.")
        : el("p", { class: "numbers" }, el("b", {}, `${spell(speed, 3)} m/s`), ` (${spell(speed * 3.6, 3)} km/h) at `,
          `${now.x[n].toFixed(1)}, ${now.y[n].toFixed(1)} m`),
      actions(view, k),
      radio && crowd.radio[k] ? hearing(view, k, time) : null,
      knowing(view, k, time),
      radio ? messages(view, k, time) : null,
    ].filter(Boolean);
  };

  function actions(view, k) {
    const { crowd, radio, page } = view;
    const button = (text, act, title) => el("button", { type: "button", onclick: act, title }, text);
    const heard = radio && radio.listeners.has(view.observer) && k !== view.observer && crowd.radio[k];
    return el("div", { class: "bar" },
      button("chart speed", () => page.offer(crowd.speedCurve(k)), "adds its speed to the time lines"),
      heard ? button(`chart power at ${crowd.labels[view.observer]}`, () =>
        page.offer(radio.powerCurve(view.observer, k, `power of ${crowd.labels[k]} at ${crowd.labels[view.observer]}`))) : null,
      button(view.followed === k ? "stop following" : "follow", () => view.follow(view.followed === k ? -1 : k)),
      radio && radio.full.includes(k) && view.observer !== k ? button("its links", () => view.observe(k)) : null);
  }

  // How the listener hears this one, or, of the listener, how many it hears.
  function hearing(view, k, time) {
    const { crowd, radio, observer } = view;
    if (k === observer) {
      const links = Array.from(radio.links(k, time, 0.2 * radio.stride).values());
      const received = links.filter((row) => radio.outcome(row) === 0);
      const classes = NLOSIM.LINKS.map((name, link) => `${received.filter((row) => radio.link(row) === link).length} of ${links.filter((row) => radio.link(row) === link).length} ${name}`);
      return el("p", { class: "note" }, `Frames of ${links.length} radios reached it in the last ${spell(0.2 * radio.stride)} s; received of the last of each: ${classes.join(", ")}.`);
    }
    const row = observer >= 0 ? radio.links(observer, time, 1 * radio.stride).get(k) : undefined;
    if (row === undefined) return el("p", { class: "note" }, `${observer >= 0 ? crowd.labels[observer] : "The listener"} has not heard of it in the last ${spell(radio.stride)} s.`);
    return el("p", {}, `Last frame at ${crowd.labels[observer]}: `, el("b", {}, NLOSIM.LINKS[radio.link(row)]), `, ${spell(radio.heard.power[row], 4)} dBm, `,
      Number.isFinite(radio.heard.snir[row]) ? `SNIR ${spell(radio.heard.snir[row], 3)} dB, ` : "", NLOSIM.OUTCOMES[radio.outcome(row)], ".");
  }

  function knowing(view, k, time) {
    const { crowd, radio } = view;
    const listens = radio && radio.listeners.has(k);
    const sees = view.objects.some((each) => !each.told) && crowd.lidar[k];
    if (!listens && !sees) {
      return radio && crowd.radio[k] ? el("p", { class: "note" }, "What it hears is not on this page: there is room for those whom the run is about only.") : null;
    }
    const now = crowd.at(time);
    const own = now.row[k];
    if (own < 0) return null;
    const known = NLOSIM.knowledge(view, k, time);
    const near = [];
    for (let n = 0; n < now.n; n += 1) {
      const distance = Math.hypot(now.x[n] - now.x[own], now.y[n] - now.y[own]);
      if (now.vehicle[n] !== k && distance < SHOWN) near.push([distance, now.vehicle[n]]);
    }
    near.sort((a, b) => (crowd.role[b[1]] > 0) - (crowd.role[a[1]] > 0) || a[0] - b[0]);
    const unknown = near.filter(([, v]) => !known.has(v)).length;
    const partly = listens && !radio.full.includes(k) ? " Of BSMs, only those among these vehicles are on the page." : radio && radio.stride > 1 ? ` One BSM in ${radio.stride} is on the page: ages are too large by up to ${spell((radio.stride - 1) * 0.1)} s.` : "";
    return el("div", {},
      el("h4", {}, `knows ${near.length - unknown} of ${near.length} road users within ${SHOWN} m; how old`),
      el("table", {},
        el("thead", {}, el("tr", {}, ["whom", "BSM", "sees", "told"].map((name) => el("th", {}, name)))),
        el("tbody", {}, near.slice(0, MOST).map(([distance, v]) => {
          const what = known.get(v) || {};
          return el("tr", { class: known.has(v) ? "" : "unknown" },
            el("td", {}, el("button", { type: "button", class: "link", onclick: () => view.select(v) }, crowd.labels[v]), ` ${distance.toFixed(0)} m`),
            known.has(v) ? ["message", "sees", "told"].map((how) => el("td", {}, ms(what[how]))) : el("td", { colspan: 3 }, "not known"));
        }))),
      partly ? el("p", { class: "note" }, partly) : null);
  }

  function messages(view, k, time) {
    const { radio, crowd } = view;
    if (!crowd.radio[k]) return null;
    const rare = radio.recent(k, time, 24, false);
    const found = alike(radio, rare.length ? rare : radio.recent(k, time, 4, true)).slice(0, 7);
    if (!found.length) return el("p", { class: "note" }, "It has sent nothing yet.");
    return el("div", {}, el("h4", {}, "last messages"), el("ul", { class: "messages" }, found.map(({ packet, count }) => {
      const way = radio.way(packet).map((v) => (v < 0 ? "all" : crowd.labels[v]));
      return el("li", {}, el("button", { type: "button", class: "link", onclick: () => view.showPacket(packet) },
        `${NLOSIM.KINDS[radio.packets.kind[packet]]} ${way.join(" → ")}`), `${count > 1 ? ` × ${count}` : ""} ${ms(time - radio.packets.time[packet])} ago`);
    })));
  }

  // Packets of one message: of one kind, with one way, handed to the radio together.
  function alike(radio, packets) {
    const found = [];
    for (const packet of packets) {
      const last = found[found.length - 1];
      const { kind, time } = radio.packets;
      if (last && kind[last.packet] === kind[packet] && Math.abs(time[last.packet] - time[packet]) < TOGETHER &&
        String(radio.way(last.packet)) === String(radio.way(packet))) last.count += 1;
      else found.push({ packet, count: 1 });
    }
    return found;
  }
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
