/** The ground of a map as a picture, made once: height by brightness, slopes by shadow, walls by an outline. */

import { grid, type Grid } from "../scenes";
import type { Colours } from "../theme";
import type { GridView, Terrain } from "../wire";

/** Longest side of the picture in pixels: sharp at four times the whole map, and made in 30 ms. */
const LONGEST = 1024;

/** Size of a terrain in the minimap frame. */
export function sizeOf(terrain: Terrain): [number, number] {
  const longest = Math.max(...terrain.size);
  return [(terrain.size[0] / longest) * terrain.minimap, (terrain.size[1] / longest) * terrain.minimap];
}

/** Return the picture of a terrain. */
export async function groundOf(terrain: Terrain, colours: Colours): Promise<HTMLCanvasElement> {
  const [height, walkable] = await Promise.all([grid(terrain.height), grid(terrain.walkable)]);
  const scale = LONGEST / Math.max(...terrain.size);
  const [width, tall] = [Math.round(terrain.size[0] * scale), Math.round(terrain.size[1] * scale)];
  const [low, high, wall, edge] = [colours.low, colours.high, colours.wall, colours.edge].map(rgb);
  const range = spread(height, walkable);
  return picture(width, tall, (x, y) => {
    const open = sample(walkable, x / width, y / tall);
    const level = (sample(height, x / width, y / tall) - range[0]) / range[1];
    const slope = sample(height, (x + 2) / width, (y + 2) / tall) - sample(height, (x - 2) / width, (y - 2) / tall);
    const base = open > 0.5 ? mix(low, high, level) : wall;
    const shade = open > 0.5 ? Math.min(Math.abs(slope) / 120, 0.16) : 0;
    const outlined = mix(base, edge, Math.max(0, 1 - Math.abs(open - 0.5) / 0.22) * 0.9);
    return mix(outlined, slope > 0 ? [0, 0, 0] : [255, 255, 255], shade);
  });
}

/** Return a grid as a tint, for creep and fog: the opacity of a cell is that of its value; only where `known` is not 0. */
export async function tintOf(view: GridView, colour: string, opacity: readonly number[], known?: GridView): Promise<HTMLCanvasElement> {
  const [{ width, height, cells }, seen] = await Promise.all([grid(view), known ? grid(known) : null]);
  const tint = rgb(colour);
  const knows = (x: number, y: number) => !seen || seen.cells[Math.floor((y * seen.height) / height) * seen.width + Math.floor((x * seen.width) / width)] > 0;
  return picture(width, height, (x, y) => [...tint, knows(x, y) ? 255 * (opacity[cells[y * width + x]] ?? 0) : 0]);
}

type Rgb = [number, number, number];

function picture(width: number, height: number, colour: (x: number, y: number) => readonly number[]): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  canvas.width = Math.max(1, width);
  canvas.height = Math.max(1, height);
  const context = canvas.getContext("2d")!;
  const image = context.createImageData(canvas.width, canvas.height);
  for (let y = 0, i = 0; y < height; y++)
    for (let x = 0; x < width; x++, i += 4) {
      const [r, g, b, a = 255] = colour(x, y);
      image.data[i] = r;
      image.data[i + 1] = g;
      image.data[i + 2] = b;
      image.data[i + 3] = a;
    }
  context.putImageData(image, 0, 0);
  return canvas;
}

/** Return the value of a grid between its cells, at a place from 0 to 1. */
function sample({ width, height, cells }: Grid, u: number, v: number): number {
  const x = Math.min(Math.max(u * width - 0.5, 0), width - 1);
  const y = Math.min(Math.max(v * height - 0.5, 0), height - 1);
  const [x0, y0] = [Math.floor(x), Math.floor(y)];
  const [x1, y1] = [Math.min(x0 + 1, width - 1), Math.min(y0 + 1, height - 1)];
  const top = cells[y0 * width + x0] * (1 - x + x0) + cells[y0 * width + x1] * (x - x0);
  const bottom = cells[y1 * width + x0] * (1 - x + x0) + cells[y1 * width + x1] * (x - x0);
  return top * (1 - y + y0) + bottom * (y - y0);
}

/** Return the lowest height that can be walked on, and how much higher the highest is. */
function spread(height: Grid, walkable: Grid): [number, number] {
  let [low, high] = [255, 0];
  for (let i = 0; i < height.cells.length; i++) {
    if (!walkable.cells[i]) continue;
    low = Math.min(low, height.cells[i]);
    high = Math.max(high, height.cells[i]);
  }
  return high - low > 8 ? [low, high - low] : [low - 60, 120]; // flat ground has the colour of the middle
}

const mix = (a: Rgb, b: Rgb, part: number): Rgb => {
  const p = Math.min(Math.max(part, 0), 1);
  return [a[0] + (b[0] - a[0]) * p, a[1] + (b[1] - a[1]) * p, a[2] + (b[2] - a[2]) * p];
};

/** Return the parts of a colour written as `#rrggbb`. */
export function rgb(colour: string): Rgb {
  const value = parseInt(colour.slice(1, 7), 16);
  return [(value >> 16) & 255, (value >> 8) & 255, value & 255];
}
