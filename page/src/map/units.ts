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

type Role = keyof typeof LEAST;

/** Return what a unit is for. */
export function role({ unit }: Spot): Role {
  if (is(unit, "STRUCTURE")) return "structure";
  if (is(unit, "WORKER")) return "worker";
  return is(unit, "ARMY") ? "army" : "other";
}

/** Return the radius of a unit in pixels. */
export const radius = (spot: Spot, view: View) => Math.max(LEAST[role(spot)], spot.unit.radius * view.scale * (role(spot) === "structure" ? 0.92 : 1));

/** Draw all units, one path for each colour and shape: 400 units take 2 ms so, 9 ms one by one. */
export function drawUnits(context: CanvasRenderingContext2D, spots: readonly Spot[], view: View, colours: Colours): void {
  const groups = new Map<string, Spot[]>();
  for (const spot of spots) {
    const key = `${layer(spot)}${spot.tint}${pale(spot) ? "p" : ""}`;
    const group = groups.get(key);
    if (group) group.push(spot);
    else groups.set(key, [spot]);
  }
  for (const key of [...groups.keys()].sort()) drawGroup(context, groups.get(key)!, view, colours);
  drawBars(context, spots, view, colours);
  drawLetters(context, spots, view, colours);
}

/** Order of drawing: structures, then what walks, then what flies. */
const layer = (spot: Spot) => (role(spot) === "structure" ? 0 : is(spot.unit, "FLYING") ? 3 : role(spot) === "army" ? 2 : 1);

/** Whether a unit is not wholly there: remembered, cloaked, burrowed, a hallucination. */
const pale = ({ unit }: Spot) => is(unit, "REMEMBERED") || is(unit, "CLOAKED") || is(unit, "BURROWED") || is(unit, "HALLUCINATION");

function drawGroup(context: CanvasRenderingContext2D, group: readonly Spot[], view: View, colours: Colours): void {
  const colour = colours.sides[group[0].tint];
  const flying = is(group[0].unit, "FLYING") && role(group[0]) !== "structure";
  context.globalAlpha = pale(group[0]) ? 0.45 : 1;
  context.beginPath();
  for (const spot of group) shape(context, spot, view);
  context.lineWidth = flying ? 2 : 1.5;
  context.fillStyle = flying ? `${colour}66` : colour;
  context.strokeStyle = flying ? colour : colours.ground;
  context.fill();
  context.stroke();
  const unfinished = group.filter(({ unit }) => is(unit, "STRUCTURE") && unit.progress < 1);
  if (unfinished.length) drawUnfinished(context, unfinished, view, colours);
  context.globalAlpha = 1;
}

function shape(context: CanvasRenderingContext2D, spot: Spot, view: View): void {
  const [x, y, r] = [spot.x * view.scale + view.left, spot.y * view.scale + view.top, radius(spot, view)];
  if (role(spot) === "structure") context.roundRect(x - r, y - r, 2 * r, 2 * r, Math.min(r / 3, 6));
  else if (role(spot) !== "army") {
    context.moveTo(x + r, y);
    context.arc(x, y, r, 0, 2 * Math.PI);
  } else {
    // a disc that runs out into a point in front
    const [nose, open] = [r * 1.65, 0.62];
    context.moveTo(x + Math.cos(spot.facing) * nose, y + Math.sin(spot.facing) * nose);
    context.arc(x, y, r, spot.facing + open, spot.facing - open + 2 * Math.PI);
    context.closePath();
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

/** Draw what is left of health and shield as arcs, of those that are hurt or large enough. */
function drawBars(context: CanvasRenderingContext2D, spots: readonly Spot[], view: View, colours: Colours): void {
  const shown = spots.filter((spot) => spot.tint !== 2 && hasBar(spot, view));
  context.lineCap = "butt";
  const ring = (colour: string, out: number, part: (spot: Spot) => number) => {
    context.beginPath();
    for (const spot of shown) {
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
  ring(colours.health, 3, ({ health, unit }) => (unit.healthMax ? health / unit.healthMax : 0));
  context.lineWidth = 1.5;
  ring(colours.shield, 5.5, ({ shield, unit }) => (unit.shieldMax ? shield / unit.shieldMax : 0));
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
