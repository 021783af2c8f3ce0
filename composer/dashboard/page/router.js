/**
 * The address of the page: `/topics/sensor_data?tab=plot` is the view, the name, and the query.
 *
 * A full ROS name begins with a slash, and so does the rest of a path.
 */
export function createRouter(onroute) {
  function read() {
    const [, view, ...names] = location.pathname.split("/");
    const name = names.length > 0 ? `/${names.map(decodeURIComponent).join("/")}` : "";
    return { view: view || "graph", name, query: new URLSearchParams(location.search) };
  }

  function go(path, { replace = false } = {}) {
    if (path === location.pathname + location.search) return;
    history[replace ? "replaceState" : "pushState"](null, "", path);
    onroute(read());
  }

  addEventListener("popstate", () => onroute(read()));
  // A click on a link to a view stays in this page, unless it opens another one.
  document.addEventListener("click", (event) => {
    const link = event.target.closest?.("a[href^='/']");
    if (!link || event.defaultPrevented || event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    go(link.getAttribute("href"));
  });
  return { read, go };
}

/** Return the path of a view, and of what is called `name` in it. */
export function pathOf(view, name = "", query = {}) {
  const written = name.split("/").map(encodeURIComponent).join("/");
  const parameters = new URLSearchParams(Object.entries(query).filter(([, value]) => value !== ""));
  return `/${view}${written}${parameters.size > 0 ? `?${parameters}` : ""}`;
}
