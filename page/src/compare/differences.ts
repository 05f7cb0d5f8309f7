/** Where two matches differ: their values at the moment, their decisions, and the step from which on they differ. */

import type { Match } from "../match";
import { CHARTS } from "../curves/series";
import type { SeenDecision, Timeline } from "../wire";

/** A value of both matches at the moment. */
export interface Difference {
  name: string;
  side: string;
  a: number | null;
  b: number | null;
  write: (value: number | null) => string;
}

/** Return the values of both matches, by curve and side, where one of them has any. */
export function differences(a: Match, b: Match): Difference[] {
  const sides = [...new Set([...a.sides.value, ...b.sides.value, ""])];
  return CHARTS.flatMap((chart) =>
    sides.flatMap((side) => {
      const values = [a, b].map((match) => chart.values(match, side)?.[match.index.value] ?? null);
      return values.every((v) => !v) ? [] : [{ name: chart.name, side, a: values[0], b: values[1], write: chart.write }];
    }),
  );
}

/** Return the first index at which two time lines differ, or null if one goes on as the other ended. */
export function divergence(a: Timeline, b: Timeline): number | null {
  const length = Math.min(a.steps.length, b.steps.length);
  const pairs = a.curves.flatMap((curve) => {
    const other = b.curves.find((c) => c.name === curve.name && c.side === curve.side);
    return other && curve.name !== "latency_s" && curve.name !== "cost_usd" ? [[curve.values, other.values]] : []; // those differ by chance
  });
  for (let i = 0; i < length; i++) if (a.loops[i] !== b.loops[i] || pairs.some(([x, y]) => x[i] !== y[i])) return i;
  return a.steps.length === b.steps.length ? null : length;
}

/** Whether two decisions ask for the same; texts around the calls do not matter. */
export function sameDeeds(a: SeenDecision | undefined, b: SeenDecision | undefined): boolean {
  const calls = (d: SeenDecision | undefined) => (d?.deeds ?? []).map((deed) => `${deed.team} ${deed.text} ${deed.accepted}`).join("\n");
  return calls(a) === calls(b);
}
