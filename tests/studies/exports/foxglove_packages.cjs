// Reads what we write with the packages of npm that Foxglove and Lichtblick read it with.
//
//   node foxglove_packages.cjs MODULES mcap FILE
//   node foxglove_packages.cjs MODULES listen URL TOPIC=COUNT...
//
// MODULES is a folder with `node_modules` in it. Written are lines of JSON: first the channels, then
// every message with its topic, time [ns] and content; of `listen` as many as were asked for.
"use strict";

const fs = require("fs");
const path = require("path");

const [, , modules, task, ...words] = process.argv;
const { createRequire } = require("module");
const need = createRequire(path.resolve(modules, "here.js"));
const { McapIndexedReader } = need("@mcap/core");
const { loadDecompressHandlers } = need("@mcap/support");
const { FoxgloveClient } = need("@foxglove/ws-protocol");
const { foxgloveMessageSchemas } = need("@foxglove/schemas/internal");
const protobuf = need("protobufjs");
const { FileDescriptorSet } = need("protobufjs/ext/descriptor");

const say = (what) => process.stdout.write(`${JSON.stringify(what)}\n`);

// How the messages of a channel are decoded, and what their schema is called.
function decoder(schema, encoding) {
  if (encoding === "json") {
    const { title, properties } = JSON.parse(Buffer.from(schema.data).toString());
    return { name: title, fields: Object.keys(properties), decode: (data) => JSON.parse(Buffer.from(data).toString()) };
  }
  const root = protobuf.Root.fromDescriptor(FileDescriptorSet.decode(schema.data));
  const type = root.lookupType(schema.name);
  const decode = (data) => type.toObject(type.decode(data), { longs: String, bytes: String, defaults: true });
  return { name: schema.name, fields: type.fieldsArray.map((each) => each.name), decode };
}

// What Foxglove's own package says of a schema: the names of its fields, as protobuf.js writes them.
function published(name) {
  const schema = foxgloveMessageSchemas[name.replace("foxglove.", "")];
  return schema ? schema.fields.map((each) => protobuf.util.camelCase(each.name)) : null;
}

function told(topic, { name, fields }) {
  return { topic, schema: name, fields, published: published(name) };
}

async function readFile(name) {
  const handle = await fs.promises.open(name);
  const readable = {
    size: async () => BigInt((await handle.stat()).size),
    read: async (offset, size) => {
      const buffer = new Uint8Array(Number(size));
      await handle.read(buffer, 0, Number(size), Number(offset));
      return buffer;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers: await loadDecompressHandlers() });
  const decoders = new Map();
  for (const channel of reader.channelsById.values()) {
    decoders.set(channel.id, decoder(reader.schemasById.get(channel.schemaId), channel.messageEncoding));
  }
  say([...reader.channelsById.values()].map((each) => told(each.topic, decoders.get(each.id))));
  for await (const message of reader.readMessages()) {
    const { topic } = reader.channelsById.get(message.channelId);
    say({ topic, time: Number(message.logTime), content: decoders.get(message.channelId).decode(message.data) });
  }
  await handle.close();
}

function listen(url, asked) {
  const WebSocket = globalThis.WebSocket || need("ws");
  const waiting = new Map(asked.map((each) => each.split("=")).map(([topic, count]) => [topic, Number(count)]));
  const client = new FoxgloveClient({ ws: new WebSocket(url, ["foxglove.sdk.v1"]) });
  const subscriptions = new Map();
  const later = new Set(); // messages of newer servers than the package, which Lichtblick leaves out, too
  client.on("error", (error) => later.add(error.message));
  client.on("advertise", (channels) => {
    const found = [];
    for (const channel of channels) {
      const data = channel.encoding === "json" ? Buffer.from(channel.schema) : Buffer.from(channel.schema, "base64");
      const how = decoder({ name: channel.schemaName, data }, channel.encoding);
      found.push(told(channel.topic, how));
      if (waiting.has(channel.topic)) subscriptions.set(client.subscribe(channel.id), [channel.topic, how]);
    }
    say(found);
  });
  client.on("message", ({ subscriptionId, timestamp, data }) => {
    const [topic, how] = subscriptions.get(subscriptionId);
    say({ topic, time: Number(timestamp), content: how.decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength)) });
    waiting.set(topic, waiting.get(topic) - 1);
    if ([...waiting.values()].every((left) => left <= 0)) {
      say({ later: [...later] });
      client.close();
    }
  });
}

if (task === "mcap") readFile(words[0]);
else listen(words[0], words.slice(1));
