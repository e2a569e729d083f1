// The card of a packet: its way, its hops, and why it was lost where it was.
(function (NLOSIM) {
  "use strict";

  const { el, spell } = NLOSIM;
  const ACCOUNT = ["received", "noise", "interference", "busy", "sending", "too weak"];

  NLOSIM.packetCard = function packetCard(view, p) {
    const { radio, crowd, page } = view;
    const { packets, sent } = radio;
    const name = (v) => (v < 0 ? "everybody" : crowd.title(v));
    const way = radio.way(p);
    const time = packets.time[p];
    const hops = [];
    for (let s = radio.sentOf[p]; s < radio.sentOf[p + 1]; s += 1) hops.push(hop(view, p, s, way[sent.hop[s] + 1], time));
    return [
      el("h3", {}, `${NLOSIM.KINDS[packets.kind[p]]} ${packets.first + packets.id[p]}`),
      el("p", {}, way.map(name).join(" → ")),
      el("p", { class: "note" }, `${packets.size[p]} bytes, handed to the radio at `,
        el("button", { type: "button", class: "link", onclick: () => { page.clock.play(false); page.clock.seek(time); } }, `${(page.start + time).toFixed(4)} s`)),
      el("ol", { class: "hops" }, hops, hops.length ? null : el("li", {}, "No frame of it is known.")),
      account(radio, p),
      known(view, p),
      el("div", { class: "bar" }, el("button", { type: "button", onclick: () => view.select(packets.source[p]) }, `to ${crowd.labels[packets.source[p]]}`)),
    ];
  };

  function hop(view, p, s, to, time) {
    const { radio, crowd } = view;
    const { sent } = radio;
    const from = crowd.labels[sent.transmitter[s]] || "?";
    if (sent.fate[s]) return el("li", {}, `${from} gave it up: ${radio.fateWords[sent.fate[s]]}`);
    const when = `on the air after ${spell((sent.start[s] - time) * 1000, 3)} ms for ${spell(sent.duration[s] / 1000, 3)} ms, of which ${spell(sent.wait[s] / 1000, 3)} ms for the medium`;
    const k = to >= 0 ? radio.addressed.get(`${p} ${sent.hop[s]} ${to}`) : undefined;
    return el("li", {}, el("b", {}, `${from} → ${to >= 0 ? crowd.labels[to] : "everybody"}`), k === undefined ? "" : [": ", fate(radio, k)], el("br", {}), el("small", {}, when));
  }

  function fate(radio, k) {
    const outcome = radio.outcome(k);
    return el("span", { class: outcome ? "lost" : "got" }, `${outcome ? "✕" : "✓"} ${NLOSIM.OUTCOMES[outcome]}, ${NLOSIM.LINKS[radio.link(k)]}, ` +
      `${spell(radio.heard.power[k], 4)} dBm${Number.isFinite(radio.heard.snir[k]) ? `, SNIR ${spell(radio.heard.snir[k], 3)} dB` : ""}`);
  }

  // How many had which outcome, of all whom it was for.
  function account(radio, p) {
    const counts = ACCOUNT.map((_, outcome) => radio.packets.fates[outcome * radio.count + p]);
    const every = counts.reduce((sum, count) => sum + count, 0);
    if (!every) return null;
    return el("p", {}, `Of ${every} ${every > 1 ? "radios" : "radio"} that it was for and that were in range: `,
      counts.map((count, outcome) => (count ? `${count} ${ACCOUNT[outcome]}` : null)).filter(Boolean).join(", "), ".");
  }

  function known(view, p) {
    const { radio, crowd } = view;
    const rows = radio.hearers(p).filter(({ k }) => radio.packets.destination[p] < 0 || !(radio.heard.code[k] >> 5));
    if (!rows.length) return null;
    const hops = radio.way(p).length - 1;
    return el("div", {}, el("h4", {}, radio.packets.destination[p] < 0 ? "heard by" : "overheard by"), el("ul", { class: "messages" },
      rows.slice(0, 14).map(({ receiver, k }) => el("li", {}, `${crowd.labels[receiver]}${hops > 1 ? `, hop ${radio.heard.hop[k] + 1}` : ""}: `, fate(radio, k)))));
  }
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
