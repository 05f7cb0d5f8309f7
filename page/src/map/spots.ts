/** Where units are between two scenes, and which of them somebody sees. */

import { OPPONENT, type Match } from "../match";
import { type Frame, type Unit } from "../scenes";
import type { SeenTeam } from "../wire";

/** A unit as it is drawn: its place and health between two scenes. */
export interface Spot {
  unit: Unit;
  /** 0 and 1 for the two sides, 2 for nobody. */
  tint: 0 | 1 | 2;
  x: number;
  y: number;
  facing: number;
  health: number;
  shield: number;
}

/** Farther than any unit walks between two scenes: it has blinked, was loaded, or took a passage. */
const LEAP = 4;

/** Return where the units of a scene are when a part of the way to the next one has passed. */
export function blend(frame: Frame, next: Frame | undefined, part: number, tint: (player: number) => 0 | 1 | 2): Spot[] {
  return frame.units.map((unit) => {
    const to = part > 0 ? next?.byTag.get(unit.tag) : undefined;
    const spot = { unit, tint: tint(unit.player), x: unit.x, y: unit.y, facing: unit.facing, health: unit.health, shield: unit.shield };
    if (!to) return spot;
    spot.health += (to.health - unit.health) * part;
    spot.shield += (to.shield - unit.shield) * part;
    if (Math.abs(to.x - unit.x) + Math.abs(to.y - unit.y) > LEAP) return spot;
    spot.x += (to.x - unit.x) * part;
    spot.y += (to.y - unit.y) * part;
    spot.facing += turn(unit.facing, to.facing) * part;
    return spot;
  });
}

/** Return the shorter way around from one direction to another. */
export function turn(from: number, to: number): number {
  const way = (to - from) % (2 * Math.PI);
  if (way > Math.PI) return way - 2 * Math.PI;
  return way < -Math.PI ? way + 2 * Math.PI : way;
}

/** Return the tint of each player of a scene. */
export function tints(frame: Frame, sides: readonly string[]): (player: number) => 0 | 1 | 2 {
  const of = new Map(frame.players.map((p) => [p.player, Math.min(Math.max(sides.indexOf(p.side || OPPONENT), 0), 1) as 0 | 1]));
  return (player) => of.get(player) ?? 2;
}

/** What somebody sees: a test for units, and the screens of an agent. */
export interface Sight {
  side: string;
  sees(unit: Unit): boolean;
  screens: readonly SeenTeam[];
}

/** Return what the chosen eyes see of a scene; an observer sees all that was recorded. */
export function sightOf(match: Match, frame: Frame, eyes: string): Sight {
  if (!eyes) return { side: "", sees: () => true, screens: [] };
  const side = eyes.split("/")[0];
  const bit = 1 << Math.max(0, frame.sides.indexOf(side));
  const own = frame.players.find((p) => p.side === side)?.player;
  const sideSees = (unit: Unit) => unit.player === own || (unit.seenBy & bit) !== 0;
  if (!eyes.includes("/")) return { side, sees: sideSees, screens: [] };
  const screens = (match.decisions.value.get(eyes)?.teams ?? []).filter((team) => team.minimap !== null);
  return { side, sees: (unit) => sideSees(unit) && screens.some((screen) => onScreen(screen, unit.x, unit.y)), screens };
}

function onScreen(team: SeenTeam, x: number, y: number): boolean {
  const half = team.screen / 2;
  return team.minimap !== null && Math.abs(x - team.minimap[0]) <= half && Math.abs(y - team.minimap[1]) <= half;
}
