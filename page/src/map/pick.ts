/** Units under the pointer. */

import { placeAt, type View } from "./camera";
import type { Spot } from "./spots";
import { radius, role } from "./units";

/** Pixels around a unit that still mean it. */
const NEAR = 6;

/** A unit that is pointed at, and where on the canvas. */
export interface Pointed {
  spot: Spot;
  x: number;
  y: number;
}

/** Return the unit under a pixel: of several the smallest one, which others would hide. */
export function unitAt(spots: readonly Spot[], view: View, px: number, py: number): Spot | undefined {
  const [x, y] = placeAt(view, px, py);
  const under = spots.filter((s) => Math.hypot(s.x - x, s.y - y) * view.scale <= radius(s, view) + NEAR);
  return under.sort((a, b) => radius(a, view) - radius(b, view) || Math.hypot(a.x - x, a.y - y) - Math.hypot(b.x - x, b.y - y))[0];
}

/** Return the tag of the unit after another one, or before it: fighters first, side by side; none if there is no unit. */
export function nextUnit(spots: readonly Spot[], tag: number | undefined, by: 1 | -1): number[] {
  const order = (spot: Spot) => ["army", "other", "structure", "worker"].indexOf(role(spot)) * 4 + spot.tint;
  const all = [...spots].filter((spot) => spot.tint !== 2).sort((a, b) => order(a) - order(b) || a.unit.tag - b.unit.tag);
  const now = all.findIndex((spot) => spot.unit.tag === tag);
  const next = now < 0 ? 0 : (now + by + all.length) % all.length;
  return all.length ? [all[next].unit.tag] : [];
}

/** Return the tags of the units in a box of pixels. */
export function unitsIn(spots: readonly Spot[], view: View, from: readonly [number, number], to: readonly [number, number]): Set<number> {
  const [x0, y0] = placeAt(view, Math.min(from[0], to[0]), Math.min(from[1], to[1]));
  const [x1, y1] = placeAt(view, Math.max(from[0], to[0]), Math.max(from[1], to[1]));
  return new Set(spots.filter((s) => s.x >= x0 && s.x <= x1 && s.y >= y0 && s.y <= y1).map((s) => s.unit.tag));
}
