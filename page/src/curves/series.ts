/** What can be drawn as a curve, and its values over the clock. */

import { signal } from "@preact/signals";
import type { Match } from "../match";
import type { Axis } from "../time";
import { dollars, seconds, short } from "../words";
import type { Curve } from "../wire";

export interface Chart {
  id: string;
  name: string;
  write: (value: number | null) => string;
  values: (match: Match, side: string) => readonly (number | null)[] | undefined;
}

const plain = (id: Curve["name"], name: string, write: Chart["write"] = short): Chart => ({ id, name, write, values: (match, side) => match.curve(id, side) });

const decimals = (value: number | null) => (value === null ? "–" : value.toFixed(2));

export const CHARTS: readonly Chart[] = [
  plain("army_value", "Army value"),
  plain("workers", "Workers"),
  plain("supply_used", "Supply"),
  plain("income_minerals", "Income, minerals"),
  plain("income_vespene", "Income, vespene"),
  plain("minerals", "Minerals"),
  plain("vespene", "Vespene"),
  { id: "kd", name: "K/D", write: decimals, values: killsPerLoss },
  plain("killed_value", "Destroyed"),
  plain("lost_value", "Lost"),
  plain("score", "Score"),
  plain("latency_s", "Latency", seconds),
  plain("tokens", "Tokens"),
  plain("cost_usd", "Money", dollars),
  plain("refused", "Refused actions"),
];

/** Ids of the charts that are shown. */
export const charts = signal<readonly string[]>(["army_value"]);

export function toggleChart(id: string): void {
  const without = charts.value.filter((c) => c !== id);
  charts.value = without.length < charts.value.length ? without : CHARTS.map((c) => c.id).filter((c) => c === id || without.includes(c));
}

/** A curve with the tint of its side, and of which match it is. */
export interface Line {
  x: readonly number[];
  y: readonly (number | null)[];
  tint: 0 | 1 | 2;
  match: number;
}

/** Return the lines of a chart. */
export function linesOf(chart: Chart, matches: readonly Match[], axis: Axis): Line[] {
  return matches.flatMap((match, i) =>
    [...match.sides.value, ""].flatMap((side): Line[] => {
      const y = chart.values(match, side);
      const timeline = match.timeline.value;
      if (!y || !timeline || y.every((v) => v === null)) return [];
      const tint = side === "" ? 2 : (Math.min(match.sides.value.indexOf(side), 1) as 0 | 1);
      return [{ x: axis === "time" ? timeline.time_s : timeline.steps, y, tint, match: i }];
    }),
  );
}

function killsPerLoss(match: Match, side: string): (number | null)[] | undefined {
  const [killed, lost] = [match.curve("killed_value", side), match.curve("lost_value", side)];
  return killed && lost && killed.map((k, i) => (k === null || !lost[i] ? null : k / lost[i]!));
}
