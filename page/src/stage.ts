/** What is open and what is pointed at: the state of the page that all its parts share. */

import { batch, computed, effect, signal } from "@preact/signals";
import * as clock from "./clock";
import { NOWHERE, readHash, writeHash, type Link } from "./hash";
import { Live } from "./live";
import { camera } from "./map/camera";
import { Match } from "./match";
import { indexOf, momentOf, spanOf } from "./time";

export const LAYERS = ["terrain", "creep", "fog", "resources", "power", "effects", "orders", "shots", "paths", "deaths", "screens", "deeds", "names"] as const;
export type Layer = (typeof LAYERS)[number];

/** The link that was followed last; the library if it names no run. */
export const link = signal<Link>(NOWHERE);
/** One match, or two side by side. */
export const matches = signal<Match[]>([]);
export const lives = signal<Live[]>([]);
/** The chosen agent as `side/agent`; "" for none. */
export const agent = signal("");
/** Whose eyes the map has: "" for an observer, a side, or `side/agent`. */
export const eyes = signal("");
/** Layers that are off: paths of everybody, unless they are asked for, hide the fight. */
export const off = signal<ReadonlySet<Layer>>(new Set());
/** What a text that is pointed at speaks of. */
export const spoken = signal<{ tags: readonly number[]; at: readonly (readonly [number, number])[] } | null>(null);
/** The unit of the map that is pointed at; 0 for none. */
export const hovered = signal(0);
/** Units that were chosen on the map. */
export const chosen = signal<ReadonlySet<number>>(new Set());

/** The menu that is open over the page, if any. */
export const menu = signal<"" | "layers" | "curves">("");

/** Open a menu, or close it if it is open. */
export function toggleMenu(name: "layers" | "curves"): void {
  menu.value = menu.value === name ? "" : name;
}

export const first = computed<Match | undefined>(() => matches.value[0]);

/** Turn a layer of the map on or off. */
export function toggleLayer(layer: Layer): void {
  const next = new Set(off.value);
  if (!next.delete(layer)) next.add(layer);
  off.value = next;
}

/** Begin a page that follows its address, and whose address follows it. */
export function begin(): void {
  // by the event's own address: that of the page may have been written over before the event came
  addEventListener("hashchange", (event) => void visit(readHash(new URL(event.newURL).hash)));
  void visit(readHash(location.hash));
  clock.run();
  effect(keepSpan);
  effect(goToPending);
  effect(keepAddress);
}

let visits = 0;

/** Show what a link says; a later link overtakes one whose matches are still being opened. */
export async function visit(to: Link): Promise<void> {
  const visit = ++visits;
  clearTimeout(writing);
  const wanted = [to.a && `${to.a} ${to.e}`, to.b && `${to.b} ${to.eb}`].filter(Boolean).join("|");
  const open = matches.value.map((m) => `${m.id} ${m.episode}`).join("|");
  batch(() => {
    link.value = to;
    agent.value = to.agent;
    eyes.value = to.eyes;
    off.value = new Set(LAYERS.filter((l) => to.off.includes(l)));
    clock.axis.value = to.by;
  });
  if (wanted !== open) await openMatches(to);
  if (visit !== visits) return;
  pending = to.s;
  goToPending();
}

/** The step of a link that is not there yet: its recording is still read. */
let pending: number | null = null;

function goToPending(): void {
  const match = first.value;
  const timeline = match?.timeline.value;
  if (pending === null || !match || !timeline?.steps.length) return;
  const there = timeline.steps[timeline.steps.length - 1] >= pending;
  if (!there && match.grows()) return;
  const step = pending;
  pending = null; // first, so that the address follows
  clock.go(momentOf(timeline, clock.axis.value, indexOf(timeline, step)));
}

async function openMatches(to: Link): Promise<void> {
  for (const live of lives.value) live.close();
  for (const match of matches.value) match.close();
  const opened = [to.a && new Match(to.a, to.e), to.b && new Match(to.b, to.eb)].filter((m) => m instanceof Match);
  batch(() => {
    matches.value = opened;
    lives.value = [];
    clock.playing.value = false;
    clock.following.value = false;
    clock.zoomed.value = null;
    clock.at.value = 0;
    chosen.value = new Set();
    camera.value = null;
  });
  await Promise.all(opened.map((m) => m.open()));
  if (matches.value !== opened) return;
  keepSpan();
  lives.value = opened.filter((m) => m.grows()).map((m) => new Live(m));
  if (to.s === null && opened.some((m) => m.isLive())) clock.follow(true);
}

/** Keep the span of the clock that of the open episodes. */
function keepSpan(): void {
  const timelines = matches.value.map((m) => m.timeline.value).filter((t) => t !== null);
  const [from, to] = spanOf(timelines, clock.axis.value);
  const steps = timelines[0]?.steps.length ?? 1;
  batch(() => {
    if (clock.span.peek()[0] !== from || clock.span.peek()[1] !== to) clock.span.value = [from, to];
    clock.pace.value = clock.axis.value === "time" ? 1 : stepsPerSecond(timelines[0]?.time_s ?? [], steps);
  });
}

const stepsPerSecond = (times: readonly number[], steps: number) => {
  const length = (times[times.length - 1] ?? 0) - (times[0] ?? 0);
  return length > 0 ? (steps - 1) / length : 1;
};

let writing: ReturnType<typeof setTimeout> | undefined;

/** Write the moment into the address, a few times a second at most: browsers refuse more than a hundred in 30 s. */
function keepAddress(): void {
  const [a, b] = matches.value;
  if (pending !== null) return;
  const to: Partial<Link> = a
    ? { a: a.id, e: a.episode, b: b?.id ?? "", eb: b?.episode ?? 0, s: clock.following.value ? null : a.step.value }
    : { x: link.value.x };
  Object.assign(to, { agent: agent.value, eyes: eyes.value, off: [...off.value], by: clock.axis.value });
  if (a && !a.timeline.value) return;
  clearTimeout(writing);
  writing = setTimeout(() => {
    const written = writeHash(to);
    if (location.hash !== written) history.replaceState(null, "", written);
  }, 400);
}
