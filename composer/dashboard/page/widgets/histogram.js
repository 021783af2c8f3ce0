/** A histogram of durations: bins grow by a constant factor, so the axis is logarithmic. */
import { empty, h, s } from "../dom.js";
import { count, milliseconds } from "../format.js";

const WIDTH = 480;
const HEIGHT = 180;
const BOTTOM = 22;
const LEFT = 8;
const GROWTH = 1.2;

export function createHistogram() {
  const element = h("figure", { class: "histogram" });

  /** `bins` are [upper edge in ms, count], ascending. */
  function update(bins) {
    if (bins.length === 0) {
      element.replaceChildren(empty("No durations yet.", "The callback was not called since it was created."));
      return;
    }
    const total = bins.reduce((sum, [, calls]) => sum + calls, 0);
    const least = bins[0][0] / GROWTH;
    const most = bins.at(-1)[0];
    const steps = Math.max(Math.round(Math.log(most / least) / Math.log(GROWTH)), 1);
    const width = (WIDTH - 2 * LEFT) / steps;
    const highest = Math.max(...bins.map(([, calls]) => calls));
    const x = (edge) => LEFT + (Math.log(edge / least) / Math.log(most / least)) * (WIDTH - 2 * LEFT);
    const bars = bins.map(([edge, calls]) => {
      // A bin with a single call must be seen.
      const height = Math.max(((HEIGHT - BOTTOM - 8) * calls) / highest, 1.5);
      return s(
        "rect",
        { x: x(edge) - width, y: HEIGHT - BOTTOM - height, width: Math.max(width - 1, 1), height, rx: 1 },
        s("title", {}, `up to ${milliseconds(edge)}: ${count(calls)} calls`),
      );
    });
    const label = (edge, anchor) => s("text", { class: anchor, x: x(edge), y: HEIGHT - 6 }, milliseconds(edge));
    const middle = Math.sqrt(least * most);
    element.replaceChildren(
      s(
        "svg",
        { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": `Histogram of ${count(total)} calls, from ${milliseconds(least)} to ${milliseconds(most)}` },
        s("path", { class: "axis", d: `M${LEFT} ${HEIGHT - BOTTOM}H${WIDTH - LEFT}` }),
        bars,
        label(least, "start"),
        label(middle, "middle"),
        label(most, "end"),
      ),
      h("figcaption", {}, `${count(total)} calls by duration, logarithmic`),
    );
  }

  return { element, update };
}
