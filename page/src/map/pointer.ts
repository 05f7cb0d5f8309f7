/** Mouse, touch and keys on a map: drag to move it, wheel or two fingers to zoom, shift and drag to choose units. */

import { camera, moved, whole, zoomedAt, type Box, type View } from "./camera";

/** What a map does with what is pointed at. */
export interface Target {
  bounds(): Box;
  view(): View;
  hover(px: number, py: number): void;
  leave(): void;
  pick(px: number, py: number, add: boolean): void;
  /** Choose the unit after the one that is chosen, or the one before it. */
  next(by: 1 | -1): void;
  box(from: readonly [number, number], to: readonly [number, number], done: boolean): void;
}

/** Pixels that a click may wander. */
const CLICK = 5;

/** Listen on a canvas; return a function that ends it. */
export function listen(canvas: HTMLElement, target: Target): () => void {
  const fingers = new Map<number, [number, number]>();
  let start: [number, number] | null = null;
  let far = false;
  const at = (event: MouseEvent): [number, number] => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const down = (event: PointerEvent) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, at(event));
    start = at(event);
    far = false;
  };
  const move = (event: PointerEvent) => {
    const before = fingers.get(event.pointerId);
    const now = at(event);
    if (!before || !start) return target.hover(...now);
    if (Math.hypot(now[0] - start[0], now[1] - start[1]) > CLICK) far = true;
    const others = [...fingers].filter(([id]) => id !== event.pointerId);
    if (others.length) pinch(target, others[0][1], before, now);
    else if (event.shiftKey) target.box(start, now, false);
    else if (far) pan(target, now[0] - before[0], now[1] - before[1]);
    fingers.set(event.pointerId, now);
  };
  const up = (event: PointerEvent) => {
    const now = at(event);
    if (start && fingers.size === 1) {
      if (far && event.shiftKey) target.box(start, now, true);
      else if (!far) target.pick(...now, event.shiftKey);
    }
    fingers.delete(event.pointerId);
    if (!fingers.size) start = null;
  };
  const wheel = (event: WheelEvent) => {
    event.preventDefault();
    zoom(target, Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.0015)), ...at(event));
  };
  const key = (event: KeyboardEvent) => {
    if (mapKey(target, event)) event.preventDefault();
  };
  const events = { pointerdown: down, pointermove: move, pointerup: up, pointercancel: up, pointerleave: () => target.leave(), wheel, keydown: key };
  for (const [name, handler] of Object.entries(events)) canvas.addEventListener(name, handler as EventListener, { passive: false });
  return () => {
    for (const [name, handler] of Object.entries(events)) canvas.removeEventListener(name, handler as EventListener);
  };
}

function pan(target: Target, dx: number, dy: number): void {
  camera.value = moved(camera.value ?? whole(target.bounds()), target.view(), target.bounds(), dx, dy);
}

/** Zoom a map by a factor around a pixel. */
export function zoom(target: Target, factor: number, px: number, py: number): void {
  camera.value = zoomedAt(camera.value ?? whole(target.bounds()), target.view(), target.bounds(), factor, px, py);
}

function pinch(target: Target, other: readonly [number, number], before: readonly [number, number], now: readonly [number, number]): void {
  const length = (p: readonly [number, number]) => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
  zoom(target, length(now) / length(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
}

/** Move or zoom by a key; return whether it was one of ours. */
function mapKey(target: Target, event: KeyboardEvent): boolean {
  const view = target.view();
  const by = { w: [0, 60], s: [0, -60], a: [60, 0], d: [-60, 0] }[event.key];
  if (by) pan(target, by[0], by[1]);
  else if (event.key === "+" || event.key === "=") zoom(target, 1.4, view.width / 2, view.height / 2);
  else if (event.key === "-") zoom(target, 1 / 1.4, view.width / 2, view.height / 2);
  else if (event.key === "0") camera.value = null;
  else if (event.key === "u" || event.key === "U") target.next(event.shiftKey ? -1 : 1);
  else return false;
  return true;
}
