/** Which recordings a reader wants, and in which order. */

import type { RunLine } from "../wire";

/** Return the endings of a recording for its first side: `win`, `blue: win` of two sides, `win 3, loss 1` of episodes. */
export function outcomeOf(run: RunLine): string {
  const [[side, endings] = ["", []], ...others] = Object.entries(run.outcomes);
  const counts = new Map<string, number>();
  for (const ending of endings) counts.set(ending, (counts.get(ending) ?? 0) + 1);
  const words = [...counts].map(([ending, n]) => (endings.length > 1 ? `${ending} ${n}` : ending)).join(", ");
  return others.length && words ? `${side}: ${words}` : words;
}

/** Return the recordings that have every word somewhere. */
export function matching(runs: readonly RunLine[], words: string): RunLine[] {
  const wanted = words.toLowerCase().split(/\s+/).filter(Boolean);
  return runs.filter((run) => {
    const text = haystack(run);
    return wanted.every((word) => text.includes(word));
  });
}

const haystack = (run: RunLine) =>
  [run.run, run.path, run.task, run.map, `seed ${run.seed}`, run.opponent, run.clock, ...run.models, outcomeOf(run), run.valid ? "" : "invalid", run.live ? "live" : "", run.complete ? "" : "incomplete", ...Object.entries(run.labels).flat()]
    .join(" ")
    .toLowerCase();

/** Return the recordings in the order of a column. */
export function ordered(runs: readonly RunLine[], value: (run: RunLine) => string | number, down: boolean): RunLine[] {
  const sorted = [...runs].sort((a, b) => {
    const [x, y] = [value(a), value(b)];
    return typeof x === "number" && typeof y === "number" ? x - y : String(x).localeCompare(String(y), "en", { numeric: true });
  });
  return down ? sorted.reverse() : sorted;
}
