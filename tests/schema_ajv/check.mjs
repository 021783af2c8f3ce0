// Reads {"schemas": {name: schema}, "documents": [[name, document], ...]} from stdin and writes, for
// each document, what ajv has against it: a list of texts, empty where it is right.
import { text } from "node:stream/consumers";
import Ajv from "ajv";

const { schemas, documents } = JSON.parse(await text(process.stdin));
// Strict: a keyword that ajv does not know, or that never applies, is a mistake in the schema.
const ajv = new Ajv({ strict: true, strictRequired: false, allowUnionTypes: true, allErrors: true });
const validators = Object.fromEntries(
  Object.entries(schemas).map(([name, schema]) => [name, ajv.compile(schema)]),
);
const found = documents.map(([name, document]) =>
  validators[name](document)
    ? []
    : validators[name].errors.map(({ instancePath, message }) => `${instancePath} ${message}`),
);
process.stdout.write(JSON.stringify(found));
