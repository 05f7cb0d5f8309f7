/** One picture of the map: what lies still comes from pictures made once, what moves is drawn again. */

import type { Match } from "../match";
import { is, type Frame } from "../scenes";
import type { Layer } from "../stage";
import type { Colours } from "../theme";
import { viewOf, type Box, type Camera, type View } from "./camera";
import { drawDeaths, drawDeeds, drawEffects, drawOrders, drawPaths, drawRings, drawScreens, drawShots, label } from "./marks";
import { blend, sightOf, tints, type Sight, type Spot } from "./spots";
import { Still } from "./still";
import { drawUnits, radius } from "./units";

/** Seconds before the moment of which ways are shown, and deaths; a scene at least, as steps may be longer. */
const WAYS_S = 3;
const DEATHS_S = 6;

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
  private frame: Frame | undefined;
  private readonly still: Still;

  /** `redraw` is called when a picture that had to be made is there. */
  constructor(private readonly match: Match, redraw: () => void) {
    this.still = new Still(match, redraw);
  }

  /** Return the part of the minimap frame that is played on. */
  bounds(): Box {
    const terrain = this.match.terrain.value;
    if (terrain) return terrain.bounds;
    return [0, 0, 64, 64];
  }

  /** Return the scene of the moment; while it is on its way, the one that was shown before. */
  private scene(): Frame | undefined {
    const frame = this.match.scenes.frame(this.match.step.value);
    if (frame !== undefined) this.frame = frame ?? undefined;
    return this.frame;
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
    context.drawImage(this.still.of(context, frame, sight, this.view, wish), 0, 0, width, height);
    if (!frame || !sight) return false;
    this.drawMoving(context, frame, tints(frame, this.match.sides.value), sight, wish);
    return true;
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
    return frames.filter((f, i) => f && f.step < frame.step && f !== frames[i - 1]) as Frame[];
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
