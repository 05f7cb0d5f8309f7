/** The one clock: everything on the page shows its moment. */

import { computed, effect, signal } from "@preact/signals";
import type { Axis } from "./time";

export const SPEEDS = [0.5, 1, 2, 4, 8, 16] as const;

/** What the clock counts. */
export const axis = signal<Axis>("time");
/** The moment, in units of the axis. */
export const at = signal(0);
/** The first and the last moment of what is open. */
export const span = signal<[number, number]>([0, 1]);
/** Units of the axis that pass in a second at ×1. */
export const pace = signal(1);
export const playing = signal(false);
export const speed = signal<number>(1);
/** Whether the clock goes with the newest step of a live match. */
export const following = signal(false);
/** The part of the span that the time line shows; null for all of it. */
export const zoomed = signal<[number, number] | null>(null);
export const shown = computed<[number, number]>(() => zoomed.value ?? span.value);

/** Go to a moment, and no longer follow. */
export function go(moment: number): void {
  following.value = false;
  set(moment);
}

/** Go to the newest step now and whenever another one comes. */
export function follow(on: boolean): void {
  following.value = on;
  playing.value = false;
  if (on) set(span.value[1]);
}

/** Play, from the beginning if it is at the end. */
export function play(on: boolean): void {
  if (on && at.value >= span.value[1] - 1e-6) set(span.value[0]);
  following.value &&= !on;
  playing.value = on;
}

/** Play faster or slower by so many of `SPEEDS`. */
export function faster(by: number): void {
  const now = SPEEDS.findIndex((s) => s >= speed.value);
  speed.value = SPEEDS[Math.min(Math.max(now + by, 0), SPEEDS.length - 1)];
}

function set(moment: number): void {
  at.value = Math.min(Math.max(moment, span.value[0]), span.value[1]);
  const window = zoomed.value;
  if (!window || (at.value >= window[0] && at.value <= window[1])) return;
  const half = (window[1] - window[0]) / 2;
  zoomed.value = [at.value - half, at.value + half];
}

/** Have time pass while `playing`; return a function that ends it. */
export function run(): () => void {
  let request = 0;
  let last = 0;
  const tick = (now: number) => {
    const passed = Math.min((now - last) / 1000, 0.1); // a hidden tab gets no frames: it does not catch up
    last = now;
    set(at.value + passed * speed.value * pace.value);
    if (at.value >= span.value[1]) playing.value = false;
    request = playing.value ? requestAnimationFrame(tick) : 0;
  };
  const stopPlaying = effect(() => {
    cancelAnimationFrame(request);
    if (!playing.value) return;
    last = performance.now();
    request = requestAnimationFrame(tick);
  });
  const stopFollowing = effect(() => {
    if (following.value) set(span.value[1]);
  });
  return () => {
    cancelAnimationFrame(request);
    stopPlaying();
    stopFollowing();
  };
}
