/** Steps and game time: where a moment of the clock lies in an episode, and the reverse. */

/** What the clock counts: seconds of the game, or steps. Two runs are aligned by it. */
export type Axis = "time" | "step";

/** The columns of a time line that say when its steps are. */
export interface Columns {
  steps: readonly number[];
  time_s: readonly number[];
}

/** A place in an episode: the step that it shows, and how far the next one is reached, 0 to below 1. */
export interface Place {
  index: number;
  fraction: number;
}

const column = (columns: Columns, axis: Axis) => (axis === "time" ? columns.time_s : columns.steps);

/** Return the last place that is not after a moment of the clock; the first one if the moment is before it. */
export function locate(columns: Columns, axis: Axis, at: number): Place {
  const times = column(columns, axis);
  const index = lastNotAfter(times, at);
  if (index >= times.length - 1) return { index: Math.max(0, times.length - 1), fraction: 0 };
  const length = times[index + 1] - times[index];
  const fraction = length > 0 ? Math.min(Math.max((at - times[index]) / length, 0), 0.999) : 0;
  return { index, fraction };
}

/** Return the moment of the clock at which a step begins. */
export function momentOf(columns: Columns, axis: Axis, index: number): number {
  const times = column(columns, axis);
  return times[Math.min(Math.max(index, 0), times.length - 1)] ?? 0;
}

/** Return the index of a step, or of the last one before it. */
export const indexOf = (columns: Columns, step: number) => lastNotAfter(columns.steps, step);

/** Return the first and the last moment of episodes together. */
export function spanOf(episodes: readonly Columns[], axis: Axis): [number, number] {
  const all = episodes.map((e) => column(e, axis)).filter((times) => times.length > 0);
  if (all.length === 0) return [0, 1];
  const first = Math.min(...all.map((times) => times[0]));
  const last = Math.max(...all.map((times) => times[times.length - 1]));
  return [first, Math.max(last, first + 1e-3)];
}

function lastNotAfter(sorted: readonly number[], value: number): number {
  let low = 0;
  let high = sorted.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (sorted[middle] <= value + 1e-9) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** Return seconds as the game's clock shows them, `12:07`. */
export function clockText(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds + 1e-6));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}
