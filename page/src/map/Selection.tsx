/** What the map knows of the unit that is pointed at, and of those that were chosen. */

import { keyOf, type Match } from "../match";
import { is, type Unit } from "../scenes";
import { chosen, hovered } from "../stage";
import { capital, hex, whole } from "../words";
import type { Painter } from "./painter";
import type { Pointed } from "./pick";
import type { Spot } from "./spots";

/** Rows of the list; a box around an army may hold hundreds. */
const MOST_ROWS = 40;

export function Tip({ match, pointed, width }: { match: Match; pointed: Pointed; width: number }) {
  const { spot, x, y } = pointed;
  const right = x > width / 2;
  const style = right ? { right: `${width - x + 14}px`, top: `${y + 10}px` } : { left: `${x + 14}px`, top: `${y + 10}px` };
  return (
    <div class="tip" style={style} role="status">
      <strong class={`side-${spot.tint}`}>{spot.unit.type}</strong> <span class="muted">{hex(spot.unit.tag)}</span>
      <div>{owner(match, spot)}</div>
      <div>{condition(spot)}</div>
      {spot.unit.order && <div>{order(match, spot.unit)}</div>}
    </div>
  );
}

export function Chosen({ match, painter }: { match: Match; painter: Painter }) {
  void [match.place.value, match.scenes.arrived.value];
  const spots = painter.spots.filter(({ unit }) => chosen.value.has(unit.tag));
  if (!spots.length) return null;
  return (
    <aside class="chosen" aria-label="Chosen units" aria-live="polite">
      <header>
        <strong>{summary(spots)}</strong>
        <button class="plain" aria-label="Choose none" onClick={() => (chosen.value = new Set())}>
          ✕
        </button>
      </header>
      <ul>
        {spots.slice(0, MOST_ROWS).map((spot) => (
          <li key={spot.unit.tag} onPointerEnter={() => (hovered.value = spot.unit.tag)} onPointerLeave={() => (hovered.value = 0)}>
            <span class={`side-${spot.tint}`}>{spot.unit.type}</span>
            <span>{condition(spot)}</span>
            <span class="muted">{order(match, spot.unit) || owner(match, spot)}</span>
          </li>
        ))}
      </ul>
    </aside>
  );
}

/** Return how many of each type, `3 Stalker, 2 Zealot`. */
function summary(spots: readonly Spot[]): string {
  const counts = new Map<string, number>();
  for (const { unit } of spots) counts.set(unit.type, (counts.get(unit.type) ?? 0) + 1);
  return [...counts].map(([type, n]) => `${n} ${type}`).join(", ");
}

function condition({ unit, health, shield }: Spot): string {
  const parts = [`${whole(health)}/${whole(unit.healthMax)}`];
  if (unit.shieldMax) parts.push(`shield ${whole(shield)}/${whole(unit.shieldMax)}`);
  if (unit.energy) parts.push(`energy ${whole(unit.energy)}`);
  if (unit.progress < 1) parts.push(`${Math.floor(unit.progress * 100)}% built`);
  for (const flag of ["FLYING", "BURROWED", "CLOAKED", "HALLUCINATION", "UNPOWERED", "REMEMBERED"] as const) if (is(unit, flag)) parts.push(flag.toLowerCase());
  return parts.join(" · ");
}

function order(match: Match, unit: Unit): string {
  const target = unit.target ? match.scenes.frame(match.step.value)?.byTag.get(unit.target)?.type : undefined;
  return unit.order ? `${unit.order}${target ? ` → ${target}` : ""}` : "";
}

/** Return who commands a unit: its agent and team if one saw it, else its side. */
function owner(match: Match, spot: Spot): string {
  if (spot.tint === 2) return "nobody's";
  const side = match.sides.value[spot.tint] ?? "";
  for (const decision of match.decisions.value.values()) {
    const team = decision.teams.find((t) => t.tags.includes(spot.unit.tag));
    if (team && decision.side === side) return `${keyOf(decision)}, team ${team.name}`;
  }
  return capital(side);
}
