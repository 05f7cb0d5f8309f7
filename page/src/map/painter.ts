/** One picture of the map: what lies still comes from pictures made once, what moves is drawn again. */

import type { Match } from "../match";
import { is, type Frame } from "../scenes";
import type { Layer } from "../stage";
import type { Colours } from "../theme";
import type { GridView, Terrain } from "../wire";
import { viewOf, type Box, type Camera, type View } from "./camera";
import { groundOf, sizeOf, tintOf } from "./ground";
import { drawDeaths, drawDeeds, drawEffects, drawOrders, drawPaths, drawPower, drawRings, drawScreens, drawShots, label } from "./marks";
import { blend, sightOf, tints, type Sight, type Spot } from "./spots";
import { drawUnits, radius } from "./units";

/** Seconds before the moment of which ways are shown, and deaths; a scene at least, as steps may be longer. */
const WAYS_S = 3;
const DEATHS_S = 6;
/** Opacity of fog where it was never lifted, where it is down again, and where somebody looks. */
const FOG = [0.72, 0.42, 0];
const CREEP = [0, 0.34];

/** What the page wants to see. */
export interface Wish {
  camera: Camera | null;
  eyes: string;
  off: ReadonlySet<Layer>;
  /** The chosen agent as `side/agent`. */
  agent: string;
  colours: Colours;
  /** Units that are lit, chosen and pointed at, and places that are lit. */
  lit: readonly number[];
  places: readonly (readonly [number, number])[];
  chosen: ReadonlySet<number>;
  hovered: number;
}

export class Painter {
  /** The units of the last picture, for the pointer. */
  spots: Spot[] = [];
  view: View = { scale: 1, left: 0, top: 0, width: 1, height: 1 };
  private ground: Made | null = null;
  private creep: Made | null = null;
  private fog: Made | null = null;
  private frame: Frame | undefined;
  private readonly still = document.createElement("canvas");
  private stillOf: readonly unknown[] = [];

  /** `redraw` is called when a picture that had to be made is there. */
  constructor(private readonly match: Match, private readonly redraw: () => void) {}

  /** Return the part of the minimap frame that is played on. */
  bounds(): Box {
    const terrain = this.match.terrain.value;
    if (terrain) return terrain.bounds;
    return [0, 0, 64, 64];
  }

  /** Return the scene of the moment, or the last one that was here. */
  private scene(): Frame | undefined {
    return (this.frame = this.match.scenes.frame(this.match.step.value) ?? this.frame);
  }

  /** The step whose scene is drawn; null before there is any. */
  get step(): number | null {
    return this.frame?.step ?? null;
  }

  /** Draw the moment of the match; return false if there is no scene for it. */
  paint(context: CanvasRenderingContext2D, width: number, height: number, wish: Wish): boolean {
    this.view = viewOf(wish.camera, this.bounds(), width, height);
    const frame = this.scene();
    const sight = frame && sightOf(this.match, frame, wish.eyes);
    this.keepStill(context, frame, sight, wish);
    context.drawImage(this.still, 0, 0, width, height);
    if (!frame || !sight) return false;
    this.drawMoving(context, frame, tints(frame, this.match.sides.value), sight, wish);
    return true;
  }

  /** Draw what lies still between two scenes, unless it is drawn: scaling the ground takes longer than 400 units. */
  private keepStill(context: CanvasRenderingContext2D, frame: Frame | undefined, sight: Sight | undefined, { camera, colours, eyes, off }: Wish): void {
    const { width, height } = context.canvas;
    const screens = sight?.screens.length ? this.match.moment.value : null;
    const of = [frame, this.match.terrain.value, camera, colours, eyes, off, width, height, screens];
    if (of.every((part, i) => part === this.stillOf[i])) return;
    this.stillOf = of;
    this.still.width = width;
    this.still.height = height;
    const still = this.still.getContext("2d")!;
    still.setTransform(context.getTransform());
    this.drawStill(still, frame, sight, colours, off);
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

  private drawMoving(context: CanvasRenderingContext2D, frame: Frame, tint: (player: number) => 0 | 1 | 2, sight: Sight, wish: Wish): void {
    const { view } = this;
    const { colours, off } = wish;
    const { part, next } = this.between(frame);
    this.spots = blend(frame, next, part, tint).filter(({ unit }) => sight.sees(unit));
    const byTag = new Map(this.spots.map((spot) => [spot.unit.tag, spot]));
    if (!off.has("paths")) drawPaths(context, this.spots, this.past(frame, WAYS_S), view, colours);
    if (!off.has("effects")) drawEffects(context, frame, tint, view, colours);
    if (!off.has("orders")) drawOrders(context, this.spots, byTag, view, colours);
    if (!off.has("deaths")) drawDeaths(context, frame, this.past(frame, DEATHS_S).map((f) => ({ ...f, units: f.units.filter(sight.sees) })), tint, view, colours);
    drawUnits(context, this.spots, view, colours);
    if (!off.has("shots")) drawShots(context, this.spots, byTag, view, colours, part);
    this.drawAgents(context, byTag, wish);
    drawRings(context, this.rings(byTag, wish), view, colours.lit);
    if (!off.has("names")) this.drawNames(context, byTag, wish);
  }

  /** Return the next scene, and how much of the way to it has passed. */
  private between(frame: Frame): { part: number; next: Frame | undefined } {
    const { index, fraction } = this.match.place.value;
    const timeline = this.match.timeline.value;
    if (!timeline || frame.step !== timeline.steps[index]) return { part: 0, next: undefined };
    const next = this.match.scenes.frame(timeline.steps[index + 1] ?? -1);
    return next && next.step > frame.step ? { part: fraction, next } : { part: 0, next: undefined };
  }

  /** Return the scenes of the last seconds that are here, the newest last. */
  private past(frame: Frame, seconds: number): Frame[] {
    const { steps = [], time_s = [] } = this.match.timeline.value ?? {};
    const index = this.match.index.value;
    let from = Math.max(0, index - 1);
    while (from > 0 && time_s[from - 1] >= time_s[index] - seconds) from--;
    const frames = steps.slice(from, index).map((step) => this.match.scenes.frame(step));
    return frames.filter((f, i) => f !== undefined && f.step < frame.step && f !== frames[i - 1]) as Frame[];
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
      this.stillOf = [];
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

  private drawAgents(context: CanvasRenderingContext2D, byTag: ReadonlyMap<number, Spot>, { agent, off, colours }: Wish): void {
    const decision = this.match.decisions.value.get(agent);
    if (!decision) return;
    const side = Math.max(0, this.match.sides.value.indexOf(decision.side));
    if (!off.has("screens")) drawScreens(context, decision, colours.sides[Math.min(side, 1)], this.view, colours);
    if (!off.has("deeds")) drawDeeds(context, decision, byTag, this.view, colours);
  }

  private rings(byTag: ReadonlyMap<number, Spot>, { lit, places, chosen, hovered }: Wish): [number, number, number][] {
    const tags = [...new Set([...lit, ...chosen, hovered])];
    const units = tags.map((tag) => byTag.get(tag)).filter((spot) => spot !== undefined);
    return [
      ...units.map((spot): [number, number, number] => [spot.x, spot.y, radius(spot, this.view) + 6]),
      ...places.map(([x, y]): [number, number, number] => [x, y, 9]),
    ];
  }

  private drawNames(context: CanvasRenderingContext2D, byTag: ReadonlyMap<number, Spot>, { lit, chosen, hovered, colours }: Wish): void {
    const large = this.spots.filter((spot) => radius(spot, this.view) > 16 && !is(spot.unit, "STRUCTURE"));
    const named = new Set<Spot>(large);
    for (const tag of [...lit, hovered, ...(chosen.size <= 12 ? chosen : [])]) {
      const spot = byTag.get(tag);
      if (spot) named.add(spot);
    }
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.font = "600 11px system-ui, sans-serif";
    for (const spot of named)
      label(context, spot.unit.type, spot.x * this.view.scale + this.view.left, spot.y * this.view.scale + this.view.top + radius(spot, this.view) + 14, colours);
  }
}

interface Made {
  source: object;
  colour: string;
  canvas: HTMLCanvasElement | null;
}
