// Reads {"schemas": {name: schema}, "documents": [[name, document], ...]} from stdin and writes the
// errors of each document: a list of strings, empty if it is valid.
import { text } from "node:stream/consumers";
import Ajv from "ajv";

const { schemas, documents } = JSON.parse(await text(process.stdin));
// In strict mode, unknown keywords and keywords that never apply are errors in the schema.
const ajv = new Ajv({ strict: true, strictRequired: false, allowUnionTypes: true, allErrors: true });
const validators = Object.fromEntries(
  Object.entries(schemas).map(([name, schema]) => [name, ajv.compile(schema)]),
);
const errors = documents.map(([name, document]) =>
  validators[name](document)
    ? []
    : validators[name].errors.map(({ instancePath, message }) => `${instancePath} ${message}`),
);
process.stdout.write(JSON.stringify(errors));
