// Reads schemas, a JSON object by name, as clients of the Foxglove protocol do; writes their definitions.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

const require = createRequire(import.meta.url);
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

const read = (schema) => {
  try {
    const found = parse(schema, { ros2: true });
    const isOnlyConstants = found[0].definitions.length > 0 && found[0].definitions.every((item) => item.isConstant);
    if (!isOnlyConstants) new MessageReader(found); // it refuses those
    return found;
  } catch (error) {
    return { error: String(error.message) };
  }
};
const plain = (_, value) => (typeof value === "bigint" ? Number(value) : ArrayBuffer.isView(value) ? Array.from(value) : value);
const schemas = JSON.parse(readFileSync(0, "utf8"));
const found = Object.fromEntries(Object.entries(schemas).map(([name, schema]) => [name, read(schema)]));
process.stdout.write(JSON.stringify(found, plain));
