/** Units as shapes: a square is a structure, a small dot a worker, a disc with a nose a fighter, a ring what flies. */

import { is } from "../scenes";
import type { Colours } from "../theme";
import type { View } from "./camera";
import type { Spot } from "./spots";

/** Pixels below which a shape cannot be made out. */
const LEAST = { structure: 3, worker: 2.2, army: 3.6, other: 2.4 } as const;
/** Radius in pixels from which a unit has room for two letters, and for its name. */
const ROOM_FOR_LETTERS = 9;
const ROOM_FOR_NAME = 22;
/** Radius in pixels from which health is drawn as arcs. */
const ROOM_FOR_ARCS = 8;

type Role = keyof typeof LEAST;

/** Return what a unit is for. */
export function role({ unit }: Spot): Role {
  if (is(unit, "STRUCTURE")) return "structure";
  if (is(unit, "WORKER")) return "worker";
  return is(unit, "ARMY") ? "army" : "other";
}

/** Return the radius of a unit in pixels. */
export const radius = (spot: Spot, view: View) => Math.max(LEAST[role(spot)], spot.unit.radius * view.scale * (role(spot) === "structure" ? 0.92 : 1));

/** Draw all units, by layer and colour. */
export function drawUnits(context: CanvasRenderingContext2D, all: readonly Spot[], view: View, colours: Colours): void {
  const spots = all.filter((spot) => isOnCanvas(spot, view));
  const groups = new Map<string, Spot[]>();
  for (const spot of spots) {
    const key = `${layer(spot)}${spot.tint}${pale(spot) ? "p" : ""}`;
    const group = groups.get(key);
    if (group) group.push(spot);
    else groups.set(key, [spot]);
  }
  for (const key of [...groups.keys()].sort()) drawGroup(context, groups.get(key)!, view, colours);
  drawHealth(context, spots, view, colours);
  drawLetters(context, spots, view, colours);
}

/** Whether any of a unit may be on the canvas. */
export function isOnCanvas(spot: Spot, view: View): boolean {
  const [x, y, r] = [spot.x * view.scale + view.left, spot.y * view.scale + view.top, radius(spot, view) * 2 + 10];
  return x > -r && y > -r && x < view.width + r && y < view.height + r;
}

/** Order of drawing: structures, then what walks, then what flies. */
const layer = (spot: Spot) => (role(spot) === "structure" ? 0 : is(spot.unit, "FLYING") ? 3 : role(spot) === "army" ? 2 : 1);

/** Whether a unit is not wholly there: remembered, cloaked, burrowed, a hallucination. */
const pale = ({ unit }: Spot) => is(unit, "REMEMBERED") || is(unit, "CLOAKED") || is(unit, "BURROWED") || is(unit, "HALLUCINATION");

/**
 * Draw units of one colour. Each shape is a small path of its own: one path of 400 shapes with its outline takes 10 ms
 * in a browser without a GPU, 400 polygons filled twice take 2 ms.
 */
function drawGroup(context: CanvasRenderingContext2D, group: readonly Spot[], view: View, colours: Colours): void {
  const colour = colours.sides[group[0].tint];
  context.globalAlpha = pale(group[0]) ? 0.45 : 1;
  if (layer(group[0]) === 3) drawFlying(context, group, view, colour);
  else
    for (const spot of group) {
      context.fillStyle = colours.ground;
      shape(context, spot, view, 1.2);
      context.fillStyle = colour;
      shape(context, spot, view, 0);
    }
  const unfinished = group.filter(({ unit }) => is(unit, "STRUCTURE") && unit.progress < 1);
  if (unfinished.length) drawUnfinished(context, unfinished, view, colours);
  context.globalAlpha = 1;
}

function drawFlying(context: CanvasRenderingContext2D, group: readonly Spot[], view: View, colour: string): void {
  context.lineWidth = 2;
  context.fillStyle = `${colour}66`;
  context.strokeStyle = colour;
  for (const spot of group) {
    context.beginPath();
    context.arc(spot.x * view.scale + view.left, spot.y * view.scale + view.top, radius(spot, view), 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  }
}

/** Fill the shape of a unit, so many pixels larger. */
function shape(context: CanvasRenderingContext2D, spot: Spot, view: View, grow: number): void {
  const [x, y, r] = [spot.x * view.scale + view.left, spot.y * view.scale + view.top, radius(spot, view) + grow];
  context.beginPath();
  if (role(spot) === "structure") context.roundRect(x - r, y - r, 2 * r, 2 * r, Math.min(r / 3, 6));
  else if (role(spot) === "army") drop(context, x, y, r, spot.facing);
  else context.arc(x, y, r, 0, 2 * Math.PI);
  context.fill();
}

/** Half the angle at which a disc runs out into its point, and corners of a disc that is too small for a circle. */
const OPEN = 0.62;
const CORNERS = 8;

/** Outline a disc that runs out into a point in front. */
function drop(context: CanvasRenderingContext2D, x: number, y: number, r: number, facing: number): void {
  context.moveTo(x + Math.cos(facing) * r * 1.65, y + Math.sin(facing) * r * 1.65);
  if (r >= ROOM_FOR_ARCS) return context.arc(x, y, r, facing + OPEN, facing - OPEN + 2 * Math.PI);
  for (let i = 0; i < CORNERS; i++) {
    const angle = facing + OPEN + (i / (CORNERS - 1)) * 2 * (Math.PI - OPEN);
    context.lineTo(x + Math.cos(angle) * r, y + Math.sin(angle) * r);
  }
}

/** Dim the part of a structure that is still to be built. */
function drawUnfinished(context: CanvasRenderingContext2D, group: readonly Spot[], view: View, colours: Colours): void {
  context.fillStyle = colours.ground;
  context.globalAlpha = 0.65;
  for (const spot of group) {
    const [x, y, r] = [spot.x * view.scale + view.left, spot.y * view.scale + view.top, radius(spot, view) - 1.5];
    context.fillRect(x - r, y - r, 2 * r, 2 * r * (1 - spot.unit.progress));
  }
}

/** Draw what is left of health and shield, of those that are hurt or large: arcs around large units, bars over small ones. */
function drawHealth(context: CanvasRenderingContext2D, spots: readonly Spot[], view: View, colours: Colours): void {
  const shown = spots.filter((spot) => spot.tint !== 2 && hasBar(spot, view));
  const [large, small] = [shown.filter((s) => radius(s, view) >= ROOM_FOR_ARCS), shown.filter((s) => radius(s, view) < ROOM_FOR_ARCS)];
  drawArcs(context, large, view, colours);
  drawBars(context, small, view, colours);
}

const healthLeft = ({ health, unit }: Spot) => (unit.healthMax ? health / unit.healthMax : 0);
const shieldLeft = ({ shield, unit }: Spot) => (unit.shieldMax ? shield / unit.shieldMax : 0);

function drawArcs(context: CanvasRenderingContext2D, spots: readonly Spot[], view: View, colours: Colours): void {
  context.lineCap = "butt";
  const ring = (colour: string, out: number, part: (spot: Spot) => number) => {
    context.beginPath();
    for (const spot of spots) {
      if (part(spot) <= 0) continue;
      const [x, y] = [spot.x * view.scale + view.left, spot.y * view.scale + view.top];
      const r = radius(spot, view) * (role(spot) === "structure" ? 1.25 : 1) + out;
      context.moveTo(x, y - r);
      context.arc(x, y, r, -Math.PI / 2, -Math.PI / 2 + 2 * Math.PI * part(spot));
    }
    context.strokeStyle = colour;
    context.stroke();
  };
  context.lineWidth = 2;
  ring(colours.edge, 3, () => 1);
  ring(colours.health, 3, healthLeft);
  context.lineWidth = 1.5;
  ring(colours.shield, 5.5, shieldLeft);
}

/** Rectangles take a tenth of the time of arcs, and most of 400 units are small. */
function drawBars(context: CanvasRenderingContext2D, spots: readonly Spot[], view: View, colours: Colours): void {
  const bars = (colour: string, up: number, height: number, grow: number, part: (spot: Spot) => number) => {
    context.fillStyle = colour;
    for (const spot of spots) {
      const r = radius(spot, view);
      const half = Math.max(r, 5);
      const [x, y] = [Math.round(spot.x * view.scale + view.left - half), Math.round(spot.y * view.scale + view.top - r - up)];
      context.fillRect(x - grow, y - grow, 2 * half * part(spot) + 2 * grow, height + 2 * grow);
    }
  };
  bars(colours.edge, 5, 2, 1, () => 1);
  bars(colours.health, 5, 2, 0, healthLeft);
  bars(colours.shield, 7, 1, 0, shieldLeft);
}

function hasBar(spot: Spot, view: View): boolean {
  const { unit, health, shield } = spot;
  if (!unit.healthMax || unit.progress < 1 || is(unit, "REMEMBERED")) return false;
  const hurt = health + shield < (unit.healthMax + unit.shieldMax) * 0.995;
  return hurt ? radius(spot, view) > 3.2 : role(spot) === "army" && radius(spot, view) > 14;
}

function drawLetters(context: CanvasRenderingContext2D, spots: readonly Spot[], view: View, colours: Colours): void {
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = colours.letters;
  for (const spot of spots) {
    const r = radius(spot, view);
    if (r < ROOM_FOR_LETTERS) continue;
    const words = r >= ROOM_FOR_NAME && role(spot) === "structure" ? spot.unit.type : letters(spot.unit.type);
    const size = r >= ROOM_FOR_NAME && role(spot) === "structure" ? Math.min(12, (2 * r) / words.length / 0.56) : Math.min(r * 0.9, 18);
    context.font = `600 ${size}px system-ui, sans-serif`;
    context.fillText(words, spot.x * view.scale + view.left, spot.y * view.scale + view.top + 0.5);
  }
}

/** Return two letters for a type: `SiegeTank` is `ST`, `Stalker` is `St`. */
export function letters(type: string): string {
  const capitals = type.match(/[A-Z]/g) ?? [];
  return capitals.length > 1 ? capitals.slice(0, 2).join("") : type.slice(0, 2);
}
