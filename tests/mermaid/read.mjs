/**
 * Reads diagrams with Mermaid's own parser.
 *
 * stdin: a JSON list of texts. stdout: a JSON list of what Mermaid found in each,
 * {type, vertices: {id: text}, edges: [[start, end, text]], frames: [title]} or {error}.
 */
import { readFileSync } from "node:fs";
import { JSDOM } from "jsdom";

// Mermaid cleans texts by means of a document.
const { window } = new JSDOM("");
globalThis.window = window;
globalThis.document = window.document;
const { default: mermaid } = await import("mermaid");

async function read(text) {
  try {
    const { diagramType } = await mermaid.parse(text);
    const { db } = await mermaid.mermaidAPI.getDiagramFromText(text);
    return {
      type: diagramType,
      vertices: Object.fromEntries([...db.getVertices()].map(([id, vertex]) => [id, vertex.text])),
      edges: db.getEdges().map((edge) => [edge.start, edge.end, edge.text]),
      frames: db.getSubGraphs().map((frame) => frame.title),
    };
  } catch (error) {
    return { error: String(error) };
  }
}

const found = [];
for (const text of JSON.parse(readFileSync(0, "utf8"))) found.push(await read(text));
process.stdout.write(JSON.stringify(found));
