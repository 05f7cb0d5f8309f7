/** What happens between units: orders, shots, ways, deaths, effects, and what agents look at and ask for. */

import { is, type Frame, type Unit } from "../scenes";
import type { Colours } from "../theme";
import type { SeenDecision } from "../wire";
import type { View } from "./camera";
import type { Spot } from "./spots";

type Context = CanvasRenderingContext2D;
type Tint = (player: number) => 0 | 1 | 2;

const at = (view: View, x: number, y: number) => [x * view.scale + view.left, y * view.scale + view.top] as const;

/** Draw thin lines from units to where their orders lead; attacks are solid, the rest is dotted. */
export function drawOrders(context: Context, spots: readonly Spot[], byTag: ReadonlyMap<number, Spot>, view: View, colours: Colours): void {
  context.lineWidth = 1;
  context.globalAlpha = 0.5;
  for (const tint of [0, 1] as const)
    for (const attack of [false, true]) {
      context.beginPath();
      for (const spot of spots) {
        const unit = spot.unit;
        const target = byTag.get(unit.target);
        if (spot.tint !== tint || !unit.order || is(unit, "WORKER") || is(unit, "STRUCTURE")) continue;
        if (/attack/i.test(unit.order) !== attack) continue;
        const [toX, toY] = target ? [target.x, target.y] : [unit.toX, unit.toY];
        if (toX < 0) continue;
        context.moveTo(...at(view, spot.x, spot.y));
        context.lineTo(...at(view, toX, toY));
      }
      context.setLineDash(attack ? [] : [2, 4]);
      context.strokeStyle = colours.sides[tint];
      context.stroke();
    }
  context.setLineDash([]);
  context.globalAlpha = 1;
}

/** Draw the shots since the scene before, fading until the next one: each by itself, 70 in one path take 7 ms. */
export function drawShots(context: Context, spots: readonly Spot[], byTag: ReadonlyMap<number, Spot>, view: View, colours: Colours, part: number): void {
  context.globalAlpha = 1 - part * 0.8;
  context.lineCap = "butt";
  for (const spot of spots) {
    const target = byTag.get(spot.unit.target);
    if (!target || !is(spot.unit, "FIRES")) continue;
    context.beginPath();
    context.moveTo(...at(view, spot.x, spot.y));
    context.lineTo(...at(view, target.x, target.y));
    for (const [width, colour] of [[3.5, colours.sides[spot.tint]], [1.2, colours.flash]] as const) {
      context.lineWidth = width;
      context.strokeStyle = colour;
      context.stroke();
    }
  }
  context.globalAlpha = 1;
}

/** Draw the ways of fighters through the scenes before, the newest last in `past`. */
export function drawPaths(context: Context, spots: readonly Spot[], past: readonly Frame[], view: View, colours: Colours): void {
  context.lineWidth = 1.5;
  context.globalAlpha = 0.4;
  for (const tint of [0, 1] as const) {
    context.beginPath();
    for (const spot of spots) {
      if (spot.tint !== tint || !is(spot.unit, "ARMY")) continue;
      context.moveTo(...at(view, spot.x, spot.y));
      for (let i = past.length - 1; i >= 0; i--) {
        const before = past[i].byTag.get(spot.unit.tag);
        if (!before) break;
        context.lineTo(...at(view, before.x, before.y));
      }
    }
    context.strokeStyle = colours.sides[tint];
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** Draw a cross where units died in the scenes before, the newest last in `past`; older ones are paler. */
export function drawDeaths(context: Context, frame: Frame, past: readonly Frame[], tint: Tint, view: View, colours: Colours): void {
  const seen = new Set<number>();
  for (let i = past.length - 1; i >= 0; i--) {
    context.globalAlpha = 0.9 * (1 - (past.length - 1 - i) / past.length);
    for (const unit of past[i].units) {
      if (seen.has(unit.tag) || frame.byTag.has(unit.tag) || !mayHaveDied(unit)) continue;
      seen.add(unit.tag);
      cross(context, ...at(view, unit.x, unit.y), Math.max(4, unit.radius * view.scale * 0.8), colours.sides[tint(unit.player)]);
    }
  }
  context.globalAlpha = 1;
}

/** A worker that is gone unhurt is inside a geyser's building, others may be inside a transport. */
const mayHaveDied = (unit: Unit) => unit.player !== 16 && !is(unit, "REMEMBERED") && unit.health + unit.shield < (unit.healthMax + unit.shieldMax) * 0.9;

function cross(context: Context, x: number, y: number, r: number, colour: string): void {
  context.beginPath();
  context.moveTo(x - r, y - r);
  context.lineTo(x + r, y + r);
  context.moveTo(x + r, y - r);
  context.lineTo(x - r, y + r);
  context.lineWidth = 2.5;
  context.strokeStyle = colour;
  context.stroke();
}

/** Draw fields of power as discs below everything. */
export function drawPower(context: Context, frame: Frame, tint: Tint, view: View, colours: Colours): void {
  for (const [player, x, y, radius] of frame.power) {
    context.beginPath();
    context.arc(...at(view, x, y), radius * view.scale, 0, 2 * Math.PI);
    context.fillStyle = `${colours.sides[tint(player)]}14`;
    context.strokeStyle = `${colours.sides[tint(player)]}40`;
    context.lineWidth = 1;
    context.fill();
    context.stroke();
  }
}

/** Draw effects on the ground with their names. */
export function drawEffects(context: Context, frame: Frame, tint: Tint, view: View, colours: Colours): void {
  context.textAlign = "center";
  context.font = "11px system-ui, sans-serif";
  for (const [name, player, x, y, radius] of frame.effects) {
    const [px, py] = at(view, x, y);
    const r = Math.max(4, radius * view.scale);
    context.beginPath();
    context.arc(px, py, r, 0, 2 * Math.PI);
    context.fillStyle = `${colours.sides[tint(player)]}38`;
    context.strokeStyle = colours.sides[tint(player)];
    context.lineWidth = 1.5;
    context.setLineDash([4, 3]);
    context.fill();
    context.stroke();
    context.setLineDash([]);
    if (r > 14) label(context, name, px, py + r + 8, colours);
  }
}

/** Draw the screens of teams, with their names. */
export function drawScreens(context: Context, decision: SeenDecision, colour: string, view: View, colours: Colours): void {
  context.font = "600 11px system-ui, sans-serif";
  context.textAlign = "left";
  context.lineWidth = 1.2;
  context.strokeStyle = colour;
  context.setLineDash([6, 4]);
  for (const team of decision.teams) {
    if (!team.minimap) continue;
    const [x, y] = at(view, team.minimap[0] - team.screen / 2, team.minimap[1] - team.screen / 2);
    context.strokeRect(x, y, team.screen * view.scale, team.screen * view.scale);
    label(context, team.name, Math.max(x, 2) + 4, Math.max(y, 2) + 9, colours);
  }
  context.setLineDash([]);
}

/** Draw what an agent asked for: a ring where it was accepted, a cross where it was refused. */
export function drawDeeds(context: Context, decision: SeenDecision, byTag: ReadonlyMap<number, Spot>, view: View, colours: Colours): void {
  for (const deed of decision.deeds) {
    const team = decision.teams.find((t) => t.name === deed.team)?.minimap;
    const target = deed.at ?? targetOf(deed.tags, byTag);
    if (!target) continue;
    const [x, y] = at(view, ...target);
    const colour = deed.accepted === false ? colours.bad : colours.good;
    if (team) arrow(context, at(view, ...team), [x, y], colour);
    if (deed.accepted === false) cross(context, x, y, 6, colour);
    else {
      context.beginPath();
      context.arc(x, y, 8, 0, 2 * Math.PI);
      context.lineWidth = 2;
      context.strokeStyle = colour;
      context.stroke();
    }
  }
}

function targetOf(tags: readonly number[], byTag: ReadonlyMap<number, Spot>): readonly [number, number] | null {
  const spot = byTag.get(tags[tags.length - 1]);
  return spot ? [spot.x, spot.y] : null;
}

function arrow(context: Context, from: readonly [number, number], to: readonly [number, number], colour: string): void {
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.setLineDash([1, 5]);
  context.lineCap = "round";
  context.lineWidth = 2;
  context.strokeStyle = colour;
  context.stroke();
  context.setLineDash([]);
  context.lineCap = "butt";
}

/** Draw rings around units and places, as when a text speaks of them. */
export function drawRings(context: Context, places: readonly (readonly [number, number, number])[], view: View, colour: string): void {
  context.lineWidth = 2.5;
  context.strokeStyle = colour;
  for (const [x, y, r] of places) {
    const [px, py] = at(view, x, y);
    context.beginPath();
    context.arc(px, py, r, 0, 2 * Math.PI);
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(px + dx * (r + 1), py + dy * (r + 1));
      context.lineTo(px + dx * (r + 7), py + dy * (r + 7));
    }
    context.stroke();
  }
}

/** Write a name over the map so that it can be read on any ground. */
export function label(context: Context, words: string, x: number, y: number, colours: Colours): void {
  context.lineWidth = 3;
  context.lineJoin = "round";
  context.strokeStyle = colours.ground;
  const dash = context.getLineDash();
  context.setLineDash([]);
  context.strokeText(words, x, y);
  context.setLineDash(dash);
  context.fillStyle = colours.text;
  context.fillText(words, x, y);
}
