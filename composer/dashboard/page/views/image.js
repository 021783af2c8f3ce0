/** An image topic: as many images as are drawn, scaled down by the server. */
import { empty, h, setText } from "../dom.js";
import { timeOfDay } from "../format.js";
import { dropNote } from "../widgets/parts.js";

const RATES_HZ = [1, 5, 10, 15];

export function createImage(app, topic) {
  const canvas = h("canvas", { class: "image", role: "img", "aria-label": `Last image of ${topic.name}`, hidden: true });
  const waiting = empty("Waiting for an image …");
  const problem = h("p", { class: "problem", role: "alert", hidden: true });
  const status = h("output", { class: "status" });
  const drops = dropNote();
  const rate = h("select", { "aria-label": "Images per second", onchange: () => subscription.update(params()) },
    RATES_HZ.map((hz) => h("option", { value: String(hz) }, `${hz} Hz`)));
  rate.value = "5";
  const element = h("div", { class: "echo" }, h("div", { class: "toolbar" }, rate, status, drops.element), problem, waiting, canvas);

  function params() {
    return { topic: topic.name, max_hz: Number(rate.value), max_width: Math.min(1280, Math.max(320, Math.ceil(element.clientWidth) || 640)) };
  }

  async function receive(payload, header) {
    const { width, height, encoding } = header;
    let drawable;
    try {
      drawable = encoding === "rgba8"
        ? await createImageBitmap(new ImageData(new Uint8ClampedArray(payload), width, height))
        : await createImageBitmap(new Blob([payload], { type: `image/${encoding}` }));
    } catch (error) {
      fail(error);
      return;
    }
    problem.hidden = true;
    waiting.hidden = true;
    canvas.hidden = false;
    canvas.width = drawable.width;
    canvas.height = drawable.height;
    canvas.getContext("2d").drawImage(drawable, 0, 0);
    drawable.close();
    // The server does not decode compressed images, so it does not know their size.
    const { source_width: sourceWidth = canvas.width, source_height: sourceHeight = canvas.height } = header;
    setText(status, `${sourceWidth} × ${sourceHeight} ${header.source_encoding}   ${timeOfDay(header.at_s)}`);
    drops.show(header.dropped, "only as many as chosen are shown in a second");
  }

  function fail(error) {
    problem.hidden = false;
    problem.textContent = error.message;
  }

  const subscription = app.connection.subscribe("image", params(), receive, { onerror: fail });
  return { element, end: subscription.end };
}
