// The arrays of the page: base 64, inflated, planes of bytes, differences; see arrays.py.
(function (NLOSIM) {
  "use strict";

  const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const TYPES = { u1: Uint8Array, i2: Int16Array, u2: Uint16Array, i4: Int32Array, f4: Float32Array,
    f8: Float64Array };
  const MISSING = -32768;

  NLOSIM.bytesOf = function bytesOf(letters) {
    const value = new Uint8Array(128);
    for (let k = 0; k < LETTERS.length; k += 1) value[LETTERS.charCodeAt(k)] = k;
    const end = letters.indexOf("=");
    const count = end < 0 ? letters.length : end;
    const bytes = new Uint8Array(Math.floor((count * 3) / 4));
    for (let k = 0, at = 0; k < count; k += 4) {
      const word = (value[letters.charCodeAt(k)] << 18) | (value[letters.charCodeAt(k + 1)] << 12) |
        ((k + 2 < count ? value[letters.charCodeAt(k + 2)] : 0) << 6) |
        (k + 3 < count ? value[letters.charCodeAt(k + 3)] : 0);
      bytes[at++] = word >> 16;
      if (at < bytes.length) bytes[at++] = (word >> 8) & 255;
      if (at < bytes.length) bytes[at++] = word & 255;
    }
    return bytes;
  };

  // The bytes of all arrays; a promise.
  NLOSIM.unpacked = async function unpacked(letters) {
    const packed = NLOSIM.bytesOf(letters);
    if (typeof DecompressionStream !== "undefined") {
      try {
        const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
        return new Uint8Array(await new Response(stream).arrayBuffer());
      } catch (error) {
        if (!(error instanceof TypeError)) throw error; // an older one knows no "deflate-raw"
      }
    }
    return NLOSIM.inflate(packed);
  };

  NLOSIM.Arrays = class Arrays {
    constructor(bytes) {
      this.bytes = bytes;
      this.known = new Map();
    }

    // The typed array that a reference stands for; one for all who ask.
    array(reference) {
      const key = `${reference.at} ${reference.n} ${reference.type} ${reference.deltas}`;
      if (!this.known.has(key)) this.known.set(key, this.decoded(reference));
      return this.known.get(key);
    }

    decoded({ at, n, type, deltas }) {
      const found = new TYPES[type](n);
      const width = found.BYTES_PER_ELEMENT;
      const raw = new Uint8Array(found.buffer);
      for (let plane = 0; plane < width; plane += 1) {
        const from = at + plane * n;
        for (let k = 0; k < n; k += 1) raw[k * width + plane] = this.bytes[from + k];
      }
      for (let round = 0; round < deltas; round += 1) {
        for (let k = 1; k < n; k += 1) found[k] += found[k - 1]; // modulo, as it was written
      }
      return found;
    }

    // Real numbers; NaN where there is none.
    numbers({ whole, step, middle }) {
      const from = this.array(whole);
      const found = new Float64Array(from.length);
      for (let k = 0; k < from.length; k += 1) {
        found[k] = from[k] === MISSING ? NaN : from[k] * step + middle;
      }
      return found;
    }

    // Seconds since the start of the run; one array for all who ask.
    times({ whole, unit }) {
      const key = `times ${whole.at} ${whole.n} ${unit}`;
      if (!this.known.has(key)) {
        this.known.set(key, Float64Array.from(this.array(whole), (count) => count * unit));
      }
      return this.known.get(key);
    }
  };

  // The last place in ascending numbers at which they are not above `value`; -1 before the first.
  NLOSIM.lastAt = function lastAt(ascending, value, low = 0, high = ascending.length) {
    let from = low;
    let to = high;
    while (from < to) {
      const middle = (from + to) >> 1;
      if (ascending[middle] <= value) from = middle + 1;
      else to = middle;
    }
    return from - 1;
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
