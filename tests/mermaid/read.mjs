/**
 * Parses diagrams with Mermaid.
 *
 * stdin: a JSON list of diagrams. stdout: a JSON list with an object per diagram,
 * {type, vertices: {id: text}, edges: [[start, end, text]], frames: [title]} or {error}.
 */
import { readFileSync } from "node:fs";
import { JSDOM } from "jsdom";

// Mermaid sanitizes text with a DOM document.
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

const diagrams = [];
for (const text of JSON.parse(readFileSync(0, "utf8"))) diagrams.push(await read(text));
process.stdout.write(JSON.stringify(diagrams));
