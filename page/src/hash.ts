/** The address after `#`: a link that holds the moment, the agent and the layers. */

/** What a link says; the library if it names no run. */
export interface Link {
  /** Id of the run, and of the one beside it. */
  a: string;
  b: string;
  /** Episodes of both. */
  e: number;
  eb: number;
  /** Step of the first run; null for none. */
  s: number | null;
  /** Id of an experiment. */
  x: string;
  agent: string;
  /** Whose eyes the map has: "", a side, or `side/agent`. */
  eyes: string;
  /** Layers of the map that are off. */
  off: string[];
  by: "time" | "step";
}

export const NOWHERE: Link = { a: "", b: "", e: 0, eb: 0, s: null, x: "", agent: "", eyes: "", off: [], by: "time" };

/** Return the link of an address. */
export function readHash(hash: string): Link {
  const given = new URLSearchParams(hash.replace(/^#/, ""));
  const text = (name: string) => given.get(name) ?? "";
  const number = (name: string) => Math.max(0, Math.floor(Number(text(name)) || 0));
  return {
    a: text("a"),
    b: text("b"),
    e: number("e"),
    eb: number("eb"),
    s: given.has("s") ? number("s") : null,
    x: text("x"),
    agent: text("agent"),
    eyes: text("eyes"),
    off: text("off").split(",").filter(Boolean),
    by: text("by") === "step" ? "step" : "time",
  };
}

/** Return the address of a link, without what is as usual. */
export function writeHash(link: Partial<Link>): string {
  const all = { ...NOWHERE, ...link };
  const parts = new URLSearchParams();
  for (const [name, value] of Object.entries(all)) {
    const usual = NOWHERE[name as keyof Link];
    const words = Array.isArray(value) ? value.join(",") : String(value ?? "");
    if (words !== "" && words !== String(usual ?? "")) parts.set(name, words);
  }
  return `#${parts.toString().replaceAll("%2F", "/").replaceAll("%2C", ",")}`;
}
