/**
 * Pans and zooms a picture.
 *
 * The viewBox of the SVG contains the whole picture, so it is complete initially and in print. Pan
 * and zoom are a scale and a shift relative to that, in SVG units. `onscale` is called with the pixels
 * per unit whenever they may have changed.
 */
const MIN_SCALE = 0.2;
const MAX_PIXELS_PER_UNIT = 4;
/** A small picture is not enlarged beyond this scale to fill the window. */
const MAX_FIT_PIXELS_PER_UNIT = 1.6;
/** The minimum scale for an item that is centered. */
const MIN_READABLE_PIXELS_PER_UNIT = 1.1;
const MIN_DRAG_PIXELS = 4;
const CLEARANCE_PIXELS = 24;

export function createViewport(picture, onscale = () => {}) {
  const { svg, world } = picture;
  const size = svg.viewBox.baseVal;
  let scale = 1;
  let shownScale = null;
  let shift = { x: 0, y: 0 };
  let dragged = { x: 0, y: 0 };

  function pixelsPerUnit() {
    const { width, height } = svg.getBoundingClientRect();
    return Math.min(width / size.width, height / size.height) || 1;
  }

  /** `pixels` are those per unit, which take time to measure after a change. */
  function show(pixels) {
    world.style.transform = `translate(${shift.x}px, ${shift.y}px) scale(${scale})`;
    svg.dataset.scale = scale.toFixed(3);
    if (scale !== shownScale) rescale(pixels);
  }

  function rescale(pixels = pixelsPerUnit()) {
    shownScale = scale;
    onscale(pixels * scale);
  }

  /** Show the whole picture. */
  function fit(pixels = pixelsPerUnit()) {
    scale = Math.min(1, MAX_FIT_PIXELS_PER_UNIT / pixels);
    shift = { x: (size.width * (1 - scale)) / 2, y: (size.height * (1 - scale)) / 2 };
    show(pixels);
  }

  /** Return a point of the screen in SVG units. */
  function pointAt(clientX, clientY) {
    return new DOMPoint(clientX, clientY).matrixTransform(svg.getScreenCTM().inverse());
  }

  function zoomAt(factor, point) {
    const most = Math.max(MAX_PIXELS_PER_UNIT / pixelsPerUnit(), 1);
    const wanted = Math.min(Math.max(scale * factor, MIN_SCALE), most);
    shift.x = point.x - ((point.x - shift.x) * wanted) / scale;
    shift.y = point.y - ((point.y - shift.y) * wanted) / scale;
    scale = wanted;
    show();
  }

  function zoom(factor) {
    zoomAt(factor, { x: size.width / 2, y: size.height / 2 });
  }

  function pan(x, y) {
    shift.x += x;
    shift.y += y;
    show();
  }

  /** Move the picture by pixels until it is dropped, which is quick: nothing is painted again. */
  function drag(x, y) {
    dragged = { x: dragged.x + x, y: dragged.y + y };
    svg.style.transform = `translate(${dragged.x}px, ${dragged.y}px)`;
  }

  function drop() {
    const units = 1 / pixelsPerUnit();
    svg.style.transform = "";
    if (dragged.x || dragged.y) pan(dragged.x * units, dragged.y * units);
    dragged = { x: 0, y: 0 };
  }

  /** Center a box, given in SVG units, and make it large enough to read. */
  function center(box) {
    scale = Math.max(scale, MIN_READABLE_PIXELS_PER_UNIT / pixelsPerUnit());
    shift.x = size.width / 2 - (box.x + box.width / 2) * scale;
    shift.y = size.height / 2 - (box.y + box.height / 2) * scale;
    show();
  }

  /** Center an element unless it is visible. */
  function reveal(element, box) {
    const frame = svg.getBoundingClientRect();
    const place = element.getBoundingClientRect();
    const seen =
      place.left >= frame.left && place.right <= frame.right &&
      place.top >= frame.top && place.bottom <= frame.bottom;
    if (!seen) center(box);
  }

  /** Pan so that an element is not covered by the panel on the right or at the bottom. */
  function uncover(element, panel) {
    const place = element.getBoundingClientRect();
    const cover = panel.getBoundingClientRect();
    const isBelow = cover.width > svg.clientWidth / 2;
    const hidden = isBelow ? place.bottom - cover.top : place.right - cover.left;
    if (hidden + CLEARANCE_PIXELS < 0) return;
    const units = -(hidden + CLEARANCE_PIXELS) / pixelsPerUnit();
    pan(isBelow ? 0 : units, isBelow ? units : 0);
  }

  listenToWheel(svg, zoomAt, pointAt);
  listenToPointers(svg, { zoomAt, drag, drop, pointAt });
  return { fit, zoom, center, reveal, uncover, rescale };
}

function listenToWheel(svg, zoomAt, pointAt) {
  svg.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
      zoomAt(Math.exp((-event.deltaY * lines) / 500), pointAt(event.clientX, event.clientY));
    },
    { passive: false },
  );
}

/** Drag with one pointer, pinch with two. A press without movement is a click. */
function listenToPointers(svg, viewport) {
  const pointers = new Map();
  let dragging = false;
  let pressedAt = null;

  svg.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    pointers.set(event.pointerId, event);
    pressedAt = { x: event.clientX, y: event.clientY };
    dragging = false;
  });

  svg.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const far = Math.hypot(event.clientX - pressedAt.x, event.clientY - pressedAt.y);
    if (!dragging && far < MIN_DRAG_PIXELS) return;
    if (!dragging) {
      dragging = true;
      svg.setPointerCapture(event.pointerId);
      svg.classList.add("dragged");
    }
    const other = [...pointers.values()].find((one) => one.pointerId !== event.pointerId);
    if (other) pinch(before, event, other);
    else viewport.drag(event.clientX - before.clientX, event.clientY - before.clientY);
    pointers.set(event.pointerId, event);
  });

  for (const name of ["pointerup", "pointercancel"]) {
    svg.addEventListener(name, (event) => {
      if (pointers.delete(event.pointerId)) viewport.drop();
      svg.classList.remove("dragged");
    });
  }

  // The end of a drag must not be a click on the element below the pointer.
  svg.addEventListener("click", (event) => { if (dragging) event.stopPropagation(); }, true);

  function pinch(before, event, other) {
    viewport.drop();
    const distance = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
    if (distance(before) === 0) return;
    const middle = [(event.clientX + other.clientX) / 2, (event.clientY + other.clientY) / 2];
    viewport.zoomAt(distance(event) / distance(before), viewport.pointAt(...middle));
  }
}
