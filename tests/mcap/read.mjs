// Prints the messages of an MCAP file, one JSON object a line, then its attachments.
import { readFileSync } from "node:fs";
import { McapIndexedReader } from "@mcap/core";
import { decompress } from "fzstd";

const data = readFileSync(process.argv[2]);
const readable = {
  size: async () => BigInt(data.length),
  read: async (offset, size) => data.subarray(Number(offset), Number(offset + size)),
};
const decompressHandlers = { zstd: (buffer, size) => decompress(buffer, new Uint8Array(Number(size))) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const print = (value) => console.log(JSON.stringify(value, (_, item) => (typeof item === "bigint" ? `${item}` : item)));
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const text = Buffer.from(message.data).toString("hex");
  print([channel.topic, schema.name, schema.encoding, message.logTime, message.publishTime, text]);
}
for await (const attachment of reader.readAttachments()) {
  print([attachment.name, attachment.mediaType, Buffer.from(attachment.data).toString("hex")]);
}
