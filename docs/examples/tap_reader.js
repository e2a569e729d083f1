// Reads the messages of a tap (docs/wire-format.md). Nothing but the language is needed:
//
//   const reader = new TapReader();
//   const socket = new WebSocket(url);          // `url` of tap.json in the run directory
//   socket.binaryType = "arraybuffer";
//   socket.onmessage = (event) => show(reader.read(event.data));

"use strict";

const HEADER = 48;
const KINDS = { 1: "schema", 2: "values", 3: "end" };
const UNCHANGED = 0, DECLARED = 1, FOREIGN = 2, BINARY = 3;
const ARRAYS = {
  "|b1": Uint8Array, "|i1": Int8Array, "|u1": Uint8Array,
  "<i2": Int16Array, "<u2": Uint16Array, "<i4": Int32Array, "<u4": Uint32Array,
  "<i8": BigInt64Array, "<u8": BigUint64Array, "<f4": Float32Array, "<f8": Float64Array,
};

function padded(length) {
  return 16 * Math.ceil(length / 16);
}

class TapReader {
  constructor() {
    this.schema = null;
    this.last = [];
  }

  // The message in an ArrayBuffer: {kind, leftOut, points, t, wall, document, values}.
  // `t` and `wall` are BigInt [ns]; `values` maps names to {shape, data}, `data` a typed array in
  // C order, or to a Uint8Array if the signal is binary.
  read(buffer) {
    const view = new DataView(buffer);
    const magic = String.fromCharCode(...new Uint8Array(buffer, 0, 4));
    const version = view.getUint16(4, true);
    if (magic !== "NTAP" || version !== 1) {
      throw new Error(`expected NTAP 1, got ${magic} ${version}`);
    }
    const length = view.getUint32(12, true);
    const message = {
      kind: KINDS[view.getUint16(6, true)],
      leftOut: view.getUint32(8, true),
      points: Number(view.getBigUint64(16, true)),
      t: view.getBigInt64(24, true),
      wall: view.getBigInt64(32, true),
      document: length ? JSON.parse(utf8(new Uint8Array(buffer, HEADER, length))) : null,
      values: null,
    };
    if (message.kind === "schema") {
      this.schema = message.document;
      this.last = [];
    } else if (message.kind === "values") {
      message.values = this.block(buffer, view, HEADER + padded(length));
    }
    return message;
  }

  block(buffer, view, offset) {
    const values = {};
    let left = view.getUint32(offset, true);
    offset += 16;
    for (; left > 0; left -= 1) {
      const index = view.getUint16(offset, true);
      const form = view.getUint8(offset + 2);
      const rank = view.getUint8(offset + 3);
      const length = Number(view.getBigUint64(offset + 8, true));
      offset += 16;
      const signal = this.schema.signals[index];
      if (form === BINARY) {
        this.last[index] = new Uint8Array(buffer, offset, length);
        offset += padded(length);
      } else if (form === DECLARED || form === FOREIGN) {
        let type = signal.dtype;
        if (form === FOREIGN) {
          type = utf8(new Uint8Array(buffer, offset, 16)).replace(/\0+$/, "");
          offset += 16;
        }
        const shape = [];
        for (let axis = 0; axis < rank; axis += 1) {
          shape.push(Number(view.getBigUint64(offset + 8 * axis, true)));
        }
        offset += padded(8 * rank);
        const Kind = ARRAYS[type] || Uint8Array; // of other types: the bytes
        const data = new Kind(buffer, offset, length / Kind.BYTES_PER_ELEMENT);
        this.last[index] = { shape, data };
        offset += padded(length);
      } else if (form !== UNCHANGED) {
        throw new Error(`a value of the form ${form}`);
      }
      values[signal.name] = this.last[index];
    }
    return values;
  }
}

// The messages of a file that `nlosim tap --record` wrote, as ArrayBuffers.
function* messagesOf(buffer) {
  const view = new DataView(buffer);
  let offset = 0;
  while (offset + 8 <= buffer.byteLength) {
    const length = Number(view.getBigUint64(offset, true));
    offset += 8;
    if (offset + length > buffer.byteLength) return; // cut off
    yield buffer.slice(offset, offset + length);
    offset += length;
  }
}

function utf8(bytes) {
  if (typeof TextDecoder !== "undefined") return new TextDecoder().decode(bytes);
  let text = "";
  for (const byte of bytes) text += `%${byte.toString(16).padStart(2, "0")}`;
  return decodeURIComponent(text);
}
