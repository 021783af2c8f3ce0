/** Writes QoS policies in one line. */
const UNITS = /_ms$/;

export function qosText(qos) {
  return Object.entries(qos)
    .filter(([, value]) => value !== null && value !== "automatic")
    .map(([policy, value]) => {
      if (["reliability", "durability", "history", "liveliness"].includes(policy)) return String(value).replaceAll("_", " ");
      const words = policy.replace(UNITS, "").replaceAll("_", " ");
      return `${words} ${value}${UNITS.test(policy) ? " ms" : ""}`;
    })
    .join(", ");
}
