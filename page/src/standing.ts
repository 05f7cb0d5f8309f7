/** Who is winning, and why: the numbers of both sides at a moment, and a sentence about them. */

import type { Match } from "./match";
import { capital, count, whole } from "./words";

/** The state of one side; null is what nobody knows. */
export interface Standing {
  side: string;
  army: number | null;
  workers: number | null;
  killed: number | null;
  lost: number | null;
}

/** Return the state of both sides at the moment of a match. */
export function standings(match: Match): Standing[] {
  const sides = match.sides.value.map((side) => ({
    side,
    army: match.now("army_value", side),
    workers: match.now("workers", side),
    killed: match.now("killed_value", side),
    lost: match.now("lost_value", side),
  }));
  const [a, b] = sides;
  // what one of two sides destroys is what the other one loses
  if (a && b && b.killed === null && b.lost === null) Object.assign(b, { killed: a.lost, lost: a.killed });
  return sides;
}

/** A side leads if it has more than this times the other's army. */
const LEAD = 1.15;

/** Return who is ahead and why, in a sentence. */
export function story(a: Standing, b: Standing): string {
  const [ahead, behind] = (a.army ?? 0) >= (b.army ?? 0) ? [a, b] : [b, a];
  const trade = a.killed && a.lost !== null ? ` ${capital(a.side)} destroyed ${whole(a.killed)} and lost ${whole(a.lost)}.` : "";
  if (ahead.army === null || behind.army === null) return trade.trim() || "Nothing is known of the armies yet.";
  if (ahead.army === 0) return `No side has an army${work(a, b)}.${trade}`;
  if (behind.army === 0) return `${capital(ahead.side)} is ahead: ${capital(behind.side)} has no army in sight.${trade}`;
  const times = ahead.army / behind.army;
  if (times < LEAD) return `Even: armies of ${whole(a.army)} and ${whole(b.army)}.${trade}`;
  return `${capital(ahead.side)} is ahead: ${times.toFixed(1)} times the army of ${capital(behind.side)}.${trade}`;
}

/** Return who has more workers, as the end of a sentence. */
function work(a: Standing, b: Standing): string {
  if (!a.workers || !b.workers) return "";
  const more = a.workers >= b.workers ? a : b;
  return a.workers === b.workers ? `; both have ${whole(a.workers)} workers` : `; ${capital(more.side)} has more workers`;
}

/** Return the result as one side sees it, in words: `Blue wins at 0:25: enemy defeated`. */
export function result(match: Match): { text: string; winner: number } | null {
  const line = match.line.value;
  const side = match.run.value?.sides[0];
  const outcome = side ? line?.outcomes[side] : undefined;
  if (!line || !side || !outcome) return null;
  const cause = line.causes[side] ?? "";
  const winner = outcome === "win" ? 0 : outcome === "loss" ? 1 : -1;
  const name = capital(match.sides.value[winner] ?? "");
  if (outcome === "cut") return { text: `Cut at ${count(line.steps, "step")}`, winner };
  return { text: `${winner >= 0 ? `${name} wins` : outcome === "draw" ? "Draw" : "Aborted"}${cause ? `: ${cause}` : ""}`, winner };
}
