/** Where the map is looked at from: the minimap frame, in which all positions are, to pixels and back. */

import { signal } from "@preact/signals";

/** The middle of what is shown, in the minimap frame, and how many times larger than the whole map it is. */
export interface Camera {
  x: number;
  y: number;
  zoom: number;
}

/** One camera for all maps of the page, so that two matches show the same place; null shows the whole map. */
export const camera = signal<Camera | null>(null);

export const MOST_ZOOM = 24;

/** x0, y0, x1, y1. */
export type Box = readonly [number, number, number, number];

/** A camera on a canvas: pixels of a place are `x * scale + left`, `y * scale + top`. */
export interface View {
  scale: number;
  left: number;
  top: number;
  width: number;
  height: number;
}

/** Return the view of a camera on a canvas of a size in pixels; without a camera all of the bounds. */
export function viewOf(camera: Camera | null, bounds: Box, width: number, height: number): View {
  const fit = Math.min(width / (bounds[2] - bounds[0]), height / (bounds[3] - bounds[1]));
  const { x, y, zoom } = camera ?? whole(bounds);
  const scale = fit * zoom;
  return { scale, left: width / 2 - x * scale, top: height / 2 - y * scale, width, height };
}

/** Return the camera that shows all of the bounds. */
export const whole = (bounds: Box): Camera => ({ x: (bounds[0] + bounds[2]) / 2, y: (bounds[1] + bounds[3]) / 2, zoom: 1 });

/** Room around units that are to be seen, as a part of the box that holds them. */
const ROOM = 0.4;
/** Least size of that box in the minimap frame: a single unit is shown with its surroundings. */
const LEAST_BOX = 6;

/** Return the camera that shows these places, or null if that is the whole map. */
export function around(places: readonly { x: number; y: number }[], bounds: Box, width: number, height: number): Camera | null {
  if (!places.length) return null;
  const [xs, ys] = [places.map((p) => p.x), places.map((p) => p.y)];
  const box = [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
  const size = (from: number, to: number) => Math.max(to - from, LEAST_BOX) * (1 + ROOM);
  const scale = Math.min(width / size(box[0], box[2]), height / size(box[1], box[3]));
  const zoom = Math.min(scale / viewOf(null, bounds, width, height).scale, MOST_ZOOM);
  return held({ x: (box[0] + box[2]) / 2, y: (box[1] + box[3]) / 2, zoom }, bounds);
}

/** Return the place of the minimap frame under a pixel. */
export const placeAt = (view: View, px: number, py: number): [number, number] => [(px - view.left) / view.scale, (py - view.top) / view.scale];

/** Return the camera moved by pixels, within the bounds. */
export function moved(from: Camera, view: View, bounds: Box, dx: number, dy: number): Camera | null {
  return held({ ...from, x: from.x - dx / view.scale, y: from.y - dy / view.scale }, bounds);
}

/** Return the camera zoomed by a factor, so that the place under a pixel stays there. */
export function zoomedAt(from: Camera, view: View, bounds: Box, factor: number, px: number, py: number): Camera | null {
  const zoom = Math.min(Math.max(from.zoom * factor, 1), MOST_ZOOM);
  const by = zoom / from.zoom;
  const [x, y] = placeAt(view, px, py);
  return held({ x: x + (from.x - x) / by, y: y + (from.y - y) / by, zoom }, bounds);
}

/** Keep a camera within the bounds; the whole map needs none. */
function held(camera: Camera, bounds: Box): Camera | null {
  if (camera.zoom <= 1.001) return null;
  const clamp = (value: number, low: number, high: number) => Math.min(Math.max(value, low), high);
  return { ...camera, x: clamp(camera.x, bounds[0], bounds[2]), y: clamp(camera.y, bounds[1], bounds[3]) };
}
