// The published client of the Foxglove protocol. Reads commands and writes events, one JSON object a line.
// Usage: node client.mjs URL SUBPROTOCOL
import { createRequire } from "node:module";
import { createInterface } from "node:readline";

const require = createRequire(import.meta.url);
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { WebSocket } = require("ws");

const [url, subprotocol] = process.argv.slice(2);
const socket = new WebSocket(url, [subprotocol]);
const client = new FoxgloveClient({ ws: socket });
const channels = new Map(); // by topic
const services = new Map(); // by name
const readers = new Map(); // of the messages of each subscription
let calls = 0;
const pending = new Map(); // services, by the numbers of calls

const definitions = (schema) => parse(schema, { ros2: true });
const plain = (_, value) =>
  typeof value === "bigint" ? Number(value) : ArrayBuffer.isView(value) ? Array.from(value) : value;
const emit = (event, data) => process.stdout.write(JSON.stringify({ event, data }, plain) + "\n");

client.on("open", () => emit("open", socket.protocol));
client.on("close", (event) => emit("close", { code: event.code, reason: event.reason }));
client.on("error", (error) => emit("error", String(error?.message ?? error)));
for (const event of ["serverInfo", "status", "serviceCallFailure"]) {
  client.on(event, (data) => emit(event, data));
}
client.on("time", (data) => emit("time", data.timestamp));
client.on("advertise", (found) => {
  found.forEach((channel) => channels.set(channel.topic, channel));
  emit("advertise", found);
});
client.on("unadvertise", (ids) => emit("unadvertise", ids));
client.on("advertiseServices", (found) => {
  found.forEach((service) => services.set(service.name, service));
  emit("advertiseServices", found);
});
client.on("unadvertiseServices", (ids) => emit("unadvertiseServices", ids));
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, reader } = readers.get(subscriptionId);
  emit("message", { subscription: subscriptionId, topic, timestamp, value: reader.readMessage(data) });
});
client.on("serviceCallResponse", ({ callId, data }) => {
  const { name, response } = pending.get(callId);
  emit("response", { name, value: new MessageReader(definitions(response.schema)).readMessage(data) });
});

const commands = {
  subscribe({ topic }) {
    const channel = channels.get(topic);
    readers.set(client.subscribe(channel.id), { topic, reader: new MessageReader(definitions(channel.schema)) });
  },
  unsubscribe({ subscription }) {
    client.unsubscribe(subscription);
  },
  // Every schema must be readable.
  check() {
    const schemas = [...channels.values(), ...[...services.values()].flatMap((item) => [item.request, item.response])];
    schemas.forEach(({ schema }) => new MessageReader(definitions(schema)));
    emit("checked", schemas.length);
  },
  call({ name, request }) {
    const service = services.get(name);
    const writer = new MessageWriter(definitions(service.request.schema));
    const callId = ++calls;
    pending.set(callId, service);
    client.sendServiceCallRequest({ serviceId: service.id, callId, encoding: "cdr", data: writer.writeMessage(request) });
  },
  advertise({ topic, schemaName }) {
    emit("advertised", client.advertise({ topic, encoding: "cdr", schemaName }));
  },
  publish({ channel, topic, message }) {
    client.sendMessage(channel, new MessageWriter(definitions(channels.get(topic).schema)).writeMessage(message));
  },
  raw({ text }) {
    socket.send(text);
  },
};

createInterface({ input: process.stdin })
  .on("line", (line) => {
    const command = JSON.parse(line);
    try {
      commands[command.do](command);
    } catch (error) {
      emit("error", `${command.do}: ${error.message}`);
    }
  })
  .on("close", () => process.exit(0));
