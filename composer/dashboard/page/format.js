/** Writes numbers with their units, in three significant digits. */

const NONE = "–";

function digits(value) {
  const size = Math.abs(value);
  if (size >= 100 || Number.isInteger(value)) return value.toFixed(0);
  return value.toFixed(size >= 10 ? 1 : size >= 0.1 || size === 0 ? 2 : 3);
}

function known(value) {
  return typeof value === "number" && Number.isFinite(value);
}

export function count(value) {
  return known(value) ? value.toLocaleString("en-US") : NONE;
}

export function hertz(value) {
  return known(value) ? `${digits(value)} Hz` : NONE;
}

export function milliseconds(value) {
  if (!known(value)) return NONE;
  if (value > 0 && value < 0.1) return `${digits(value * 1000)} µs`;
  return value >= 10_000 ? `${digits(value / 1000)} s` : `${digits(value)} ms`;
}

/** Write a share, 0 ... 1, in percent. */
export function percent(share) {
  return known(share) ? `${digits(share * 100)} %` : NONE;
}

/** Write the use of the processors and of memory by processes; ["–", "–"] if it is not known. */
export function usage({ cpu_percent: cpu, memory_mb: memory } = {}) {
  return [known(cpu) ? `${digits(cpu)} %` : NONE, known(memory) ? bytes(memory * 1e6) : NONE];
}

export function bytes(value) {
  if (!known(value)) return NONE;
  let left = value;
  for (const unit of ["B", "kB", "MB"]) {
    if (left < 1000) return `${digits(left)} ${unit}`;
    left /= 1000;
  }
  return `${digits(left)} GB`;
}

export function bandwidth(value) {
  return known(value) ? `${bytes(value)}/s` : NONE;
}

/** Write a duration in seconds as its two largest units. */
export function duration(seconds) {
  if (!known(seconds)) return NONE;
  const whole = Math.max(0, Math.floor(seconds));
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  if (whole < 86_400) return `${Math.floor(whole / 3600)} h ${Math.floor((whole % 3600) / 60)} min`;
  return `${Math.floor(whole / 86_400)} d ${Math.floor((whole % 86_400) / 3600)} h`;
}

/** Write a time, in seconds since 1970, as local time of day with milliseconds. */
export function timeOfDay(seconds) {
  if (!known(seconds)) return NONE;
  const date = new Date(seconds * 1000);
  const two = (part) => String(part).padStart(2, "0");
  const time = [date.getHours(), date.getMinutes(), date.getSeconds()].map(two).join(":");
  return `${time}.${String(date.getMilliseconds()).padStart(3, "0")}`;
}

/** Write a number of a message: every digit that matters, none that floating point made up. */
export function number(value) {
  if (typeof value !== "number" || Number.isInteger(value)) return String(value);
  return String(Number(value.toPrecision(9)));
}
