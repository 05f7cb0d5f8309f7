/** An action whose arguments are picked one after the other: which kind is next, and what will do. */

import type { ActionSpec, TeamView, UnitView, View } from "../wire";
import type { Argument } from "./draft";

type Pair = [number, number];

export interface Picking {
  team: string;
  action: ActionSpec;
  args: readonly Argument[];
}

/** Something that a list offers for the next argument. */
export interface Candidate {
  argument: Argument;
  name: string;
  /** Its place in the minimap frame, if it has one. */
  at: Pair | null;
}

/** Cells of a screen. */
export const SCREEN = 24;

/** Return the kind of the argument that is to be picked next; null if there is none left. */
export const wanted = ({ action, args }: Picking) => action.args[args.length] ?? null;

/** Return in words what is to be picked next. */
export function question(picking: Picking): string {
  const kind = wanted(picking);
  if (kind === "tag") return picking.args.length < picking.action.actors ? "which of your units" : picking.action.target === "enemy" ? "which enemy" : "which unit";
  return kind === "minimap" ? "which place on the whole map" : "which place on the screen";
}

/** Return what will do as the next argument, the likeliest first. */
export function candidates(picking: Picking, view: View): Candidate[] {
  const team = view.teams.find((t) => t.name === picking.team);
  const kind = wanted(picking);
  if (!team || !kind) return [];
  const only = team.arguments.find((valid) => valid.action === picking.action.name);
  if (kind === "tag") {
    const acts = picking.args.length < picking.action.actors;
    const units = acts ? team.units : targets(picking.action, team);
    const tags = (acts ? only?.units : only?.tags) ?? [];
    const found = [...units.map(ofUnit), ...(acts || picking.action.target ? [] : view.landmarks.map((mark) => ({ argument: mark.tag, name: `${mark.type} ${mark.about || mark.what}`, at: mark.minimap })))];
    return unique(tags.length ? tags.map((tag) => found.find((one) => one.argument === tag) ?? { argument: tag, name: tag, at: null }) : found);
  }
  if (kind === "screen") return (only?.points ?? []).map((point) => ({ argument: point, name: `[${point.join(", ")}]`, at: fromScreen(point, team, view.cell) }));
  const places = view.places.map((place) => ({ argument: place.minimap as Argument, name: place.name, at: place.minimap }));
  return [...places, ...view.alerts.map((alert) => ({ argument: alert.minimap as Argument, name: "Attacked here", at: alert.minimap }))];
}

/** Return the units that an action of a team may aim at: enemies the nearest first. */
function targets(action: ActionSpec, team: TeamView): UnitView[] {
  const enemies = [...team.enemies].sort((a, b) => (a.distance ?? 0) - (b.distance ?? 0));
  if (action.target === "enemy") return enemies;
  const own = [...team.units, ...team.allies];
  return action.target === "own" ? own : [...enemies, ...own, ...team.resources];
}

const unique = (all: readonly Candidate[]) => [...new Map(all.map((one) => [String(one.argument), one])).values()];

const ofUnit = (unit: UnitView): Candidate => ({ argument: unit.tag, name: about(unit), at: unit.minimap });

/** Return a unit in a few words: `Zealot, 100 + 50`. */
export function about(unit: UnitView): string {
  const parts = [`${unit.type}, ${Math.round(unit.health)}${unit.shield_max ? ` + ${Math.round(unit.shield)}` : ""}`];
  if (unit.energy_max) parts.push(`energy ${Math.round(unit.energy)}`);
  if (unit.cloaked) parts.push("cloaked");
  if (unit.hallucination) parts.push("hallucination");
  return parts.join(", ");
}

/** Return the place of the minimap frame under a point of a team's screen; `cell` is world units of a minimap cell. */
export function fromScreen([x, y]: readonly [number, number], team: Pick<TeamView, "minimap">, cell: number): Pair | null {
  return team.minimap && [team.minimap[0] + (x - SCREEN / 2) / cell, team.minimap[1] + (y - SCREEN / 2) / cell];
}

/** Return the argument for a place of the minimap frame: a point of the frame that is wanted, within its bounds. */
export function pointAt(at: readonly [number, number], picking: Picking, view: View): Pair | null {
  const team = view.teams.find((t) => t.name === picking.team);
  const kind = wanted(picking);
  if (!team || (kind !== "screen" && kind !== "minimap")) return null;
  if (kind === "minimap") return within(at, view.bounds);
  if (!team.minimap) return null;
  const [cx, cy] = team.minimap;
  return within([SCREEN / 2 + (at[0] - cx) * view.cell, SCREEN / 2 + (at[1] - cy) * view.cell], team.bounds);
}

/** Return a point to a tenth of a cell, within bounds whose far edges are outside. */
function within(point: readonly [number, number], [x0, y0, x1, y1]: readonly [number, number, number, number]): Pair {
  const tenth = (value: number, low: number, high: number) => Math.round(Math.min(Math.max(value, low), high - 0.1) * 10) / 10;
  return [tenth(point[0], x0, x1), tenth(point[1], y0, y1)];
}
