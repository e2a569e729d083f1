// What is on the air: packets, their frames, and who heard them.
(function (NLOSIM) {
  "use strict";

  const { lastAt } = NLOSIM;
  NLOSIM.KINDS = ["BSM", "APM", "sensor data", "request", "noise"];
  NLOSIM.LINKS = ["LOS", "NLOSv", "NLOSb"];
  NLOSIM.OUTCOMES = ["received", "lost to noise", "lost to interference", "lost: the receiver was busy with another frame",
    "lost: the receiver was sending", "below the sensitivity"];

  NLOSIM.Radio = class Radio {
    constructor(data, arrays) {
      const many = (part, names) => Object.fromEntries(names.map((name) => [name, arrays.array(data[part][name])]));
      this.stride = data.stride;
      this.full = data.full;
      this.fateWords = data.fate_words;
      this.packets = { ...many("packets", ["id", "source", "destination", "route", "size", "kind", "fates"]),
        time: arrays.times(data.packets.time), first: data.packets.first };
      this.count = this.packets.id.length;
      this.readSent(data.sent ? many("sent", ["packet", "wait", "late", "duration", "hop", "fate", "transmitter"]) : null);
      this.readHeard(data.heard, many("heard", ["packet", "hop", "transmitter", "code"]), arrays);
    }

    // Frames that were sent: when each was on the air, and which are those of a packet.
    readSent(sent) {
      const { packets } = this;
      if (!sent) {
        const zeros = new Int32Array(this.count);
        sent = { packet: zeros.map((_, k) => k), wait: zeros, late: zeros, duration: zeros, hop: zeros, fate: zeros, transmitter: packets.source };
      }
      const n = sent.packet.length;
      this.sent = { ...sent, start: new Float64Array(n), end: new Float64Array(n) };
      this.sentOf = new Int32Array(this.count + 1).fill(n);
      for (let k = n - 1; k >= 0; k -= 1) {
        const p = sent.packet[k];
        this.sentOf[p] = k;
        this.sent.start[k] = packets.time[p] + sent.late[k] * 1e-6;
        this.sent.end[k] = this.sent.start[k] + sent.duration[k] * 1e-6;
      }
      for (let p = this.count - 1; p >= 0; p -= 1) this.sentOf[p] = Math.min(this.sentOf[p], this.sentOf[p + 1]);
      const byStart = Array.from({ length: n }, (_, k) => k).filter((k) => sent.fate[k] === 0)
        .sort((a, b) => this.sent.start[a] - this.sent.start[b]);
      const rare = byStart.filter((k) => packets.kind[sent.packet[k]] !== 0);
      this.orders = [byStart, rare].map((order) => ({ order, start: Float64Array.from(order, (k) => this.sent.start[k]) }));
    }

    readHeard(data, heard, arrays) {
      const n = heard.packet.length;
      this.heard = { ...heard, power: arrays.numbers(data.power), snir: arrays.numbers(data.snir), time: new Float64Array(n) };
      this.addressed = new Map(); // of packets that were sent to one: by packet, hop and receiver
      this.listeners = new Map();
      let begin = 0;
      data.receivers.forEach((receiver, r) => {
        for (let k = begin; k < data.ends[r]; k += 1) {
          const p = heard.packet[k];
          this.heard.time[k] = this.endOf(p, heard.hop[k]);
          if (this.packets.destination[p] >= 0 && heard.code[k] >> 5) this.addressed.set(`${p} ${heard.hop[k]} ${receiver}`, k);
        }
        const order = Array.from({ length: data.ends[r] - begin }, (_, k) => begin + k)
          .sort((a, b) => this.heard.time[a] - this.heard.time[b]);
        this.listeners.set(receiver, { begin, end: data.ends[r], order, times: Float64Array.from(order, (k) => this.heard.time[k]), sources: null });
        begin = data.ends[r];
      });
    }

    endOf(packet, hop) {
      for (let k = this.sentOf[packet]; k < this.sentOf[packet + 1]; k += 1) if (this.sent.hop[k] === hop) return this.sent.end[k];
      return this.packets.time[packet];
    }

    outcome(k) { return this.heard.code[k] & 7; }

    link(k) { return (this.heard.code[k] >> 3) & 3; }

    // The vehicles that a packet goes through, the source first; -1 at the end: everybody.
    way(packet) {
      const { source, route, destination } = this.packets;
      const relays = [route[packet], route[this.count + packet]].filter((relay) => relay >= 0);
      return [source[packet], ...relays, destination[packet]];
    }

    // The newest frame that a listener noticed of each transmitter within a time [s] before now.
    links(listener, time, window) {
      const found = new Map();
      const known = this.listeners.get(listener);
      if (!known) return found;
      for (let n = lastAt(known.times, time); n >= 0 && known.times[n] > time - window; n -= 1) {
        const k = known.order[n];
        if (!found.has(this.heard.transmitter[k])) found.set(this.heard.transmitter[k], k);
      }
      return found;
    }

    // The newest message that a listener received of each source: source -> row of `heard`.
    known(listener, time) {
      const found = new Map();
      const all = this.listeners.get(listener);
      if (!all) return found;
      if (!all.sources) all.sources = this.bySource(all);
      for (const [source, { rows, times }] of all.sources) {
        const n = lastAt(times, time);
        if (n >= 0) found.set(source, rows[n]);
      }
      return found;
    }

    bySource({ order }) {
      const sources = new Map();
      for (const k of order) {
        if (this.outcome(k) !== 0) continue;
        const source = this.packets.source[this.heard.packet[k]];
        if (!sources.has(source)) sources.set(source, []);
        sources.get(source).push(k);
      }
      return new Map(Array.from(sources, ([source, rows]) =>
        [source, { rows, times: Float64Array.from(rows, (k) => this.heard.time[k]) }]));
    }

    // Frames that began within a time before now [s]; `every`: BSMs, too.
    frames(time, window, every) {
      const { order, start } = this.orders[every ? 0 : 1];
      const found = [];
      for (let n = lastAt(start, time); n >= 0 && start[n] > time - window; n -= 1) found.push(order[n]);
      return found;
    }

    // The last packets that one sent or that were sent to it, the newest first.
    recent(vehicle, time, most, every) {
      const { source, destination, kind } = this.packets;
      const found = [];
      for (let p = lastAt(this.packets.time, time); p >= 0 && found.length < most && this.packets.time[p] > time - 20; p -= 1) {
        if (!every && kind[p] === 0) continue;
        if (source[p] === vehicle || destination[p] === vehicle || this.way(p).includes(vehicle)) found.push(p);
      }
      return found;
    }

    // All that is on the page about who heard a packet.
    hearers(packet) {
      const found = [];
      for (const [receiver, { begin, end }] of this.listeners) {
        for (let k = lastAt(this.heard.packet, packet - 1, begin, end) + 1; k < end && this.heard.packet[k] === packet; k += 1) {
          found.push({ receiver, k });
        }
      }
      return found;
    }

    // What a listener receives of a transmitter over time, as a curve.
    powerCurve(listener, transmitter, name) {
      const { order } = this.listeners.get(listener) || { order: [] };
      const rows = order.filter((k) => this.heard.transmitter[k] === transmitter);
      return new NLOSIM.Curve({ name, unit: "dBm", holds: false, times: Float64Array.from(rows, (k) => this.heard.time[k]),
        values: Float64Array.from(rows, (k) => this.heard.power[k]) });
    }
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
