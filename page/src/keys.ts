/** Keys of the whole page; those of the map work while it has the focus. */

import { signal } from "@preact/signals";
import * as clock from "./clock";
import { keyOf } from "./match";
import { agent, first, menu, toggleMenu } from "./stage";
import { indexOf, momentOf } from "./time";

export const helpOpen = signal(false);

/** What each key does, in words; the help shows them. */
export const KEYS: readonly (readonly [string, string])[] = [
  ["← →", "one step back or on; with shift ten"],
  ["space", "play or pause"],
  ["[ ]", "slower, faster"],
  ["home end", "first and last step"],
  [", .", "what happened before, and next"],
  ["f", "follow a live match"],
  ["1 … 9", "choose an agent; again to choose none"],
  ["m", "layers of the map"],
  ["w a s d", "move the map while it has the focus"],
  ["+ - 0", "zoom it in, out, to the whole map"],
  ["u", "choose the next unit of the map, with shift the one before"],
  ["shift and drag", "choose units on the map"],
  ["ctrl and wheel", "zoom the time line; shift and wheel moves it"],
  ["?", "this help"],
];

/** Go so many steps of the first match on. */
export function stepBy(steps: number): void {
  const timeline = first.value?.timeline.value;
  if (!timeline) return;
  clock.playing.value = false;
  clock.go(momentOf(timeline, clock.axis.value, first.value!.index.value + steps));
}

/** Go to the next mark of the time line, or the last one before the moment. */
function toMark(forward: boolean): void {
  const timeline = first.value?.timeline.value;
  if (!timeline) return;
  const now = first.value!.step.value;
  const mark = forward ? timeline.marks.find((m) => m.step > now) : timeline.marks.findLast((m) => m.step < now);
  if (mark) clock.go(momentOf(timeline, clock.axis.value, indexOf(timeline, mark.step)));
}

function chooseAgent(number: number): void {
  const line = first.value?.agents.value[number - 1];
  if (line) agent.value = agent.value === keyOf(line) ? "" : keyOf(line);
}

const DOES: Record<string, (event: KeyboardEvent) => void> = {
  ArrowLeft: (event) => stepBy(event.shiftKey ? -10 : -1),
  ArrowRight: (event) => stepBy(event.shiftKey ? 10 : 1),
  " ": () => clock.play(!clock.playing.value),
  "[": () => clock.faster(-1),
  "]": () => clock.faster(1),
  Home: () => clock.go(clock.span.value[0]),
  End: () => clock.go(clock.span.value[1]),
  ",": () => toMark(false),
  ".": () => toMark(true),
  f: () => clock.follow(!clock.following.value),
  m: () => toggleMenu("layers"),
  "?": () => (helpOpen.value = !helpOpen.value),
};

/** Listen to the keys that no field takes; a click elsewhere closes a menu. */
export function listenToKeys(): void {
  addEventListener("pointerdown", (event) => {
    if (!(event.target as HTMLElement).closest?.(".layers, .menu")) menu.value = "";
  });
  addEventListener("keydown", (event) => {
    if (event.key === "Escape") menu.value = "";
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || !first.value || isField(event)) return;
    const does = DOES[event.key] ?? (/^[1-9]$/.test(event.key) ? () => chooseAgent(Number(event.key)) : undefined);
    if (!does) return;
    does(event);
    event.preventDefault();
  });
}

/** Whether the key belongs to what has the focus: a field takes all of them, a button the space bar. */
function isField(event: KeyboardEvent): boolean {
  const target = event.target as HTMLElement;
  if (target.closest("input:not([type=checkbox]), textarea, select")) return true;
  return event.key === " " && target.closest("button, summary, input, a") !== null;
}
