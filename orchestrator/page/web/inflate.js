// Inflate (RFC 1951) for browsers without DecompressionStream. Bytes in, bytes out.
(function (NLOSIM) {
  "use strict";

  const LENGTHS = [3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99,
    115, 131, 163, 195, 227, 258];
  const LENGTH_BITS = [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5,
    5, 0];
  const DISTANCES = [1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769,
    1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577];
  const DISTANCE_BITS = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11,
    11, 12, 12, 13, 13];
  const ORDER = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
  const LONGEST = 15;

  // A canonical Huffman code: how many symbols there are of each length, and the symbols in order.
  function codeOf(lengths) {
    const counts = new Uint16Array(LONGEST + 1);
    for (const length of lengths) counts[length] += 1;
    counts[0] = 0;
    const next = new Uint16Array(LONGEST + 2);
    for (let n = 1; n <= LONGEST; n += 1) next[n + 1] = next[n] + counts[n];
    const symbols = new Uint16Array(lengths.length);
    lengths.forEach((length, symbol) => {
      if (length) symbols[next[length]++] = symbol;
    });
    return { counts, symbols };
  }

  const fixed = (() => {
    const lengths = new Array(288).fill(8).fill(9, 144, 256).fill(7, 256, 280);
    return { literals: codeOf(lengths), distances: codeOf(new Array(30).fill(5)) };
  })();

  class Bits {
    constructor(bytes) {
      this.bytes = bytes;
      this.at = 0;
      this.held = 0;
      this.count = 0;
    }

    take(count) {
      while (this.count < count) {
        if (this.at >= this.bytes.length) throw new Error("the arrays of this page are cut short");
        this.held |= this.bytes[this.at++] << this.count;
        this.count += 8;
      }
      const found = this.held & ((1 << count) - 1);
      this.held >>>= count;
      this.count -= count;
      return found;
    }

    symbol({ counts, symbols }) {
      let code = 0;
      let first = 0;
      let index = 0;
      for (let length = 1; length <= LONGEST; length += 1) {
        code |= this.take(1);
        const count = counts[length];
        if (code - count < first) return symbols[index + code - first];
        index += count;
        first = (first + count) << 1;
        code <<= 1;
      }
      throw new Error("the arrays of this page are damaged");
    }

    align() {
      this.held = 0;
      this.count = 0;
    }
  }

  class Growing {
    constructor(size) {
      this.bytes = new Uint8Array(size);
      this.size = 0;
    }

    room(more) {
      if (this.size + more <= this.bytes.length) return;
      const larger = new Uint8Array(Math.max(2 * this.bytes.length, this.size + more));
      larger.set(this.bytes.subarray(0, this.size));
      this.bytes = larger;
    }
  }

  function dynamicCodes(bits) {
    const literals = bits.take(5) + 257;
    const distances = bits.take(5) + 1;
    const lengths = new Array(19).fill(0);
    const used = bits.take(4) + 4;
    for (let k = 0; k < used; k += 1) lengths[ORDER[k]] = bits.take(3);
    const code = codeOf(lengths);
    const all = [];
    while (all.length < literals + distances) {
      const symbol = bits.symbol(code);
      if (symbol < 16) {
        all.push(symbol);
        continue;
      }
      const value = symbol === 16 ? all[all.length - 1] : 0;
      const times = symbol === 16 ? bits.take(2) + 3 : symbol === 17 ? bits.take(3) + 3 : bits.take(7) + 11;
      for (let k = 0; k < times; k += 1) all.push(value);
    }
    return { literals: codeOf(all.slice(0, literals)), distances: codeOf(all.slice(literals)) };
  }

  function block(bits, out, codes) {
    for (;;) {
      const symbol = bits.symbol(codes.literals);
      if (symbol === 256) return;
      if (symbol < 256) {
        out.room(1);
        out.bytes[out.size++] = symbol;
        continue;
      }
      const length = LENGTHS[symbol - 257] + bits.take(LENGTH_BITS[symbol - 257]);
      const far = bits.symbol(codes.distances);
      const distance = DISTANCES[far] + bits.take(DISTANCE_BITS[far]);
      if (distance > out.size) throw new Error("the arrays of this page are damaged");
      out.room(length);
      for (let k = 0; k < length; k += 1) {
        out.bytes[out.size] = out.bytes[out.size - distance];
        out.size += 1;
      }
    }
  }

  function stored(bits, out) {
    bits.align();
    const size = bits.take(8) | (bits.take(8) << 8);
    bits.take(8);
    bits.take(8);
    out.room(size);
    for (let k = 0; k < size; k += 1) out.bytes[out.size++] = bits.take(8);
  }

  NLOSIM.inflate = function inflate(bytes) {
    const bits = new Bits(bytes);
    const out = new Growing(4 * bytes.length + 64);
    let last = 0;
    while (!last) {
      last = bits.take(1);
      const kind = bits.take(2);
      if (kind === 0) stored(bits, out);
      else block(bits, out, kind === 1 ? fixed : dynamicCodes(bits));
    }
    return out.bytes.slice(0, out.size);
  };
})((globalThis.NLOSIM = globalThis.NLOSIM || { layers: {} }));
