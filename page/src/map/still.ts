/** What lies still between two scenes, as one picture: ground, creep, resources, power, fog. */

import type { Match } from "../match";
import type { Frame } from "../scenes";
import type { Layer } from "../stage";
import type { Colours } from "../theme";
import type { GridView, Terrain } from "../wire";
import type { Camera, View } from "./camera";
import { groundOf, sizeOf, tintOf } from "./ground";
import { drawPower } from "./marks";
import { tints, type Sight } from "./spots";

/** Opacity of fog where it was never lifted, where it is down again, and where somebody looks; of creep likewise. */
const FOG = [0.72, 0.42, 0];
const CREEP = [0, 0.34];

/** What of a wish concerns it; see `Wish`. */
interface StillWish {
  camera: Camera | null;
  eyes: string;
  off: ReadonlySet<Layer>;
  colours: Colours;
}

/** A picture that is made from a source, once it is made. */
interface Made {
  source: object;
  colour: string;
  canvas: HTMLCanvasElement | null;
}

export class Still {
  private readonly canvas = document.createElement("canvas");
  private drawnOf: readonly unknown[] = [];
  private view!: View;
  private ground: Made | null = null;
  private creep: Made | null = null;
  private fog: Made | null = null;

  /** `redraw` is called when a picture that had to be made is there. */
  constructor(private readonly match: Match, private readonly redraw: () => void) {}

  /** Return the picture for a canvas, drawn if anything of it has changed: scaling the ground takes longer than 400 units. */
  of(context: CanvasRenderingContext2D, frame: Frame | undefined, sight: Sight | undefined, view: View, { camera, colours, eyes, off }: StillWish): HTMLCanvasElement {
    const { width, height } = context.canvas;
    const screens = sight?.screens.length ? this.match.moment.value : null;
    const of = [frame, this.match.terrain.value, camera, colours, eyes, off, width, height, screens];
    if (of.every((part, i) => part === this.drawnOf[i])) return this.canvas;
    this.drawnOf = of;
    this.view = view;
    this.canvas.width = width;
    this.canvas.height = height;
    const still = this.canvas.getContext("2d")!;
    still.setTransform(context.getTransform());
    this.drawStill(still, frame, sight, colours, off);
    return this.canvas;
  }

  private drawStill(context: CanvasRenderingContext2D, frame: Frame | undefined, sight: Sight | undefined, colours: Colours, off: ReadonlySet<Layer>): void {
    context.fillStyle = colours.ground;
    context.fillRect(0, 0, this.view.width, this.view.height);
    if (!off.has("terrain")) this.drawGround(context, colours);
    if (!frame || !sight) return;
    if (!off.has("creep")) this.drawCreep(context, frame, sight, colours);
    if (!off.has("resources")) this.drawResources(context, frame, colours);
    if (!off.has("power")) drawPower(context, frame, tints(frame, this.match.sides.value), this.view, colours);
    if (!off.has("fog")) this.drawFog(context, frame, sight, colours);
  }

  private drawGround(context: CanvasRenderingContext2D, colours: Colours): void {
    const terrain = this.match.terrain.value;
    if (!terrain) return this.drawGrid(context, colours);
    this.ground = this.made(this.ground, terrain, colours.low, () => groundOf(terrain, colours));
    this.drawWhole(context, this.ground.canvas, terrain);
  }

  /** Draw lines every eight cells, where no recording says what the ground is like. */
  private drawGrid(context: CanvasRenderingContext2D, colours: Colours): void {
    const { scale, left, top } = this.view;
    context.beginPath();
    for (let i = 0; i <= 64; i += 8) {
      context.moveTo(i * scale + left, top);
      context.lineTo(i * scale + left, 64 * scale + top);
      context.moveTo(left, i * scale + top);
      context.lineTo(64 * scale + left, i * scale + top);
    }
    context.strokeStyle = colours.line;
    context.lineWidth = 1;
    context.stroke();
  }

  private drawCreep(context: CanvasRenderingContext2D, frame: Frame, sight: Sight, colours: Colours): void {
    const terrain = this.match.terrain.value;
    if (!terrain || !frame.creep) return;
    const view = frame.creep;
    const known = frame.fog[sight.side];
    this.creep = this.made(this.creep, view, `${colours.creep} ${sight.side}`, () => tintOf(view, colours.creep, CREEP, known));
    this.drawWhole(context, this.creep.canvas, terrain);
  }

  private drawFog(context: CanvasRenderingContext2D, frame: Frame, sight: Sight, colours: Colours): void {
    const { scale, left, top, width, height } = this.view;
    if (sight.screens.length) {
      context.beginPath();
      context.rect(0, 0, width, height);
      for (const { minimap, screen } of sight.screens)
        context.rect((minimap![0] - screen / 2) * scale + left, (minimap![1] - screen / 2) * scale + top, screen * scale, screen * scale);
      context.globalAlpha = FOG[1];
      context.fillStyle = colours.fog;
      context.fill("evenodd");
      context.globalAlpha = 1;
      return;
    }
    const view: GridView | undefined = frame.fog[sight.side];
    const terrain = this.match.terrain.value;
    if (!view || !terrain) return;
    this.fog = this.made(this.fog, view, colours.fog, () => tintOf(view, colours.fog, FOG));
    this.drawWhole(context, this.fog.canvas, terrain);
  }

  /** Return the picture of a source: the one before it until it is made. */
  private made(held: Made | null, source: object, colour: string, make: () => Promise<HTMLCanvasElement>): Made {
    if (held?.source === source && held.colour === colour) return held;
    const made: Made = { source, colour, canvas: held?.canvas ?? null };
    void make().then((canvas) => {
      made.canvas = canvas;
      this.drawnOf = [];
      this.redraw();
    });
    return made;
  }

  private drawWhole(context: CanvasRenderingContext2D, canvas: HTMLCanvasElement | null, terrain: Terrain): void {
    if (!canvas) return;
    const [width, height] = sizeOf(terrain);
    context.imageSmoothingQuality = "high";
    context.drawImage(canvas, this.view.left, this.view.top, width * this.view.scale, height * this.view.scale);
  }

  private drawResources(context: CanvasRenderingContext2D, frame: Frame, colours: Colours): void {
    const gone = new Set(frame.gone);
    const { scale, left, top } = this.view;
    for (const [tag, type, x, y, radius] of this.match.terrain.value?.resources ?? []) {
      if (gone.has(tag)) continue;
      const r = Math.max(2, radius * scale * 0.8);
      const [px, py] = [x * scale + left, y * scale + top];
      context.fillStyle = /mineral/i.test(type) ? colours.mineral : /geyser/i.test(type) ? colours.geyser : colours.edge;
      context.beginPath();
      if (/mineral/i.test(type)) context.roundRect(px - r * 1.2, py - r * 0.55, r * 2.4, r * 1.1, r * 0.4);
      else context.arc(px, py, r, 0, 2 * Math.PI);
      context.fill();
    }
  }
}
