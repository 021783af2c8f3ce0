/** Writes QoS policies in one line, of an endpoint or of all endpoints of a topic. */
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

/** Write reliability and durability of {qos} endpoints: "mixed" where they differ. */
export function sharedQosText(ends) {
  const known = ends.map(({ qos }) => qos).filter(Boolean);
  if (known.length === 0) return "";
  return ["reliability", "durability"]
    .map((policy) => {
      const values = new Set(known.map((qos) => qos[policy]));
      return values.size > 1 ? `mixed ${policy}` : String([...values][0]).replaceAll("_", " ");
    })
    .join(", ");
}
