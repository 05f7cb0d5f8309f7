/** The map as the agent is told it: units in sight, screens of teams, places. What it does not know is not drawn. */

import { signal, useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { spoken } from "../stage";
import type { SeatQuestion, TeamView, UnitView } from "../wire";
import { about, fromScreen, pointAt, SCREEN, wanted } from "./picking";
import { choose, chooseTeam, offers, pick, picking, team } from "./seat";

type Pair = readonly [number, number];

/** What the map shows: the units in sight of the chosen team, its screen, or all of it. */
const shown = signal<Reach>("units");
type Reach = "units" | "screen" | "map";
const REACHES: readonly (readonly [Reach, string])[] = [["units", "Units"], ["screen", "Screen"], ["map", "Whole map"]];
/** Room around the units, and the least that is shown, in world units. */
const ROOM = 2;
const LEAST = 12;
/** A unit is as wide as this, in world units: an observation does not tell its size. */
const UNIT = 0.9;
/** Steps of the cross for a key, in world units; with shift the larger one. */
const STEPS = [0.5, 2];
/** How far from a unit a click still means it, in world units. */
const NEAR = 1.5;

/** A unit as it is drawn: all teams see it at the same place. */
interface Spot {
  unit: UnitView;
  team: string;
}

export function SeatMap({ asked }: { asked: SeatQuestion }) {
  const svg = useRef<SVGSVGElement>(null);
  const cross = useSignal<Pair | null>(null);
  const now = team.value;
  const view = asked.view;
  const open = picking.value;
  const kind = open && wanted(open);
  const box = boxOf(now, asked, kind === "minimap" ? "map" : kind === "screen" && shown.value === "units" ? "screen" : shown.value);
  const offered = offers.value.filter((one) => one.at);
  const spots = spotsOf(asked);
  const lit = new Set(spoken.value?.tags ?? []);
  const size = 1 / view.cell;
  const aim = cross.value ?? [box[0] + box[2] / 2, box[1] + box[3] / 2];

  const act = (at: Pair) => {
    if (open && kind !== "tag") {
      const point = pointAt(at, open, view);
      if (point) pick(point);
    } else if (open) {
      const near = nearest(offered, at, (one) => one.at!, NEAR * size);
      if (near) pick(near.argument);
    } else aimAt(nearest(spots, at, (spot) => spot.unit.minimap, NEAR * size));
  };
  const key = (event: KeyboardEvent) => {
    const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (by) {
      const step = STEPS[event.shiftKey ? 1 : 0] * size;
      cross.value = [clamp(aim[0] + by[0] * step, box[0], box[0] + box[2]), clamp(aim[1] + by[1] * step, box[1], box[1] + box[3])];
    } else if (event.key === "Enter" && !event.ctrlKey) act(aim);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  const click = (event: MouseEvent) => {
    const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.current!.getScreenCTM()!.inverse());
    cross.value = [place.x, place.y];
    act([place.x, place.y]);
  };
  return (
    <section class={`seat-map ${open ? "picks" : ""}`} aria-label="Map">
      <svg
        ref={svg}
        viewBox={box.join(" ")}
        role="application"
        tabindex={0} // of an element of SVG, whose attributes have no capitals
        aria-label={`Map of ${now?.name ?? "the match"}. Arrow keys move the cross, Enter picks what is there.`}
        onClick={click}
        onKeyDown={key}
      >
        <rect class="ground" x={view.bounds[0]} y={view.bounds[1]} width={view.bounds[2] - view.bounds[0]} height={view.bounds[3] - view.bounds[1]} />
        {view.teams.map((t) => t.minimap && <Screen key={t.name} team={t} size={size} chosen={t.name === now?.name} />)}
        {view.places.map((place) => (
          <text key={place.name} class="place" x={place.minimap[0]} y={place.minimap[1]} font-size={1.1 * size}>
            {place.name}
          </text>
        ))}
        {view.landmarks.map((mark) => (
          <rect key={mark.tag} class="landmark" x={mark.minimap[0] - 0.6 * size} y={mark.minimap[1] - 0.6 * size} width={1.2 * size} height={1.2 * size}>
            <title>{`${mark.type} ${mark.about}`}</title>
          </rect>
        ))}
        {view.teams.flatMap((t) => t.effects.flatMap((effect, i) => effect.screen.map((at, k) => <Effect key={`${t.name}${i}${k}`} at={fromScreen(at, t, view.cell)} r={Math.max(effect.radius, 0.5) * size} name={effect.name} />)))}
        <Orders spots={spots} width={0.1 * size} />
        {spots.map((spot) => (
          <Unit key={spot.unit.tag} spot={spot} r={(UNIT / 2) * size} chosen={spot.team !== "" && spot.team === now?.name} lit={lit.has(Number(spot.unit.tag))} />
        ))}
        {offered.map((one) => (
          <g key={String(one.argument)} class="offered">
            <circle cx={one.at![0]} cy={one.at![1]} r={0.75 * size} stroke-width={0.16 * size} />
            <text x={one.at![0] + 0.7 * size} y={one.at![1] - 0.5 * size} font-size={0.9 * size}>
              {offers.value.indexOf(one) + 1}
            </text>
          </g>
        ))}
        {spoken.value?.at.map(([x, y]) => <circle key={`${x} ${y}`} class="spoken" cx={x} cy={y} r={0.8 * size} stroke-width={0.16 * size} />)}
        <path class="cross" d={`M${aim[0] - size} ${aim[1]}h${2 * size}M${aim[0]} ${aim[1] - size}v${2 * size}`} stroke-width={0.12 * size} />
      </svg>
      <div class="seat-map-tools">
        <div class="joined" role="group" aria-label="What the map shows">
          {REACHES.map(([reach, name]) => (
            <button key={reach} aria-pressed={shown.value === reach} onClick={() => (shown.value = reach)}>
              {name}
            </button>
          ))}
        </div>
        <output aria-live="polite">{cross.value && (whatIsAt(cross.value, spots, size) ?? (open && pointWords(pointAt(cross.value, open, view))))}</output>
      </div>
    </section>
  );
}

/** Choose the team of an own unit; of an enemy, begin to attack it. */
function aimAt(spot: Spot | undefined): void {
  if (!spot) return;
  if (spot.team) return chooseTeam(spot.team);
  const attack = team.value?.actions.find((action) => action.target === "enemy" && action.args.join() === "tag");
  if (spot.unit.alliance !== "enemy" || !attack) return;
  choose(attack);
  pick(spot.unit.tag);
}

const pointWords = (point: Pair | null) => point && `[${point.join(", ")}]`;

function whatIsAt(at: Pair, spots: readonly Spot[], size: number): string | null {
  const spot = nearest(spots, at, (one) => one.unit.minimap, NEAR * size);
  return spot ? `${spot.unit.alliance} ${about(spot.unit)}` : null;
}

const clamp = (value: number, low: number, high: number) => Math.min(Math.max(value, low), high);

function nearest<T>(all: readonly T[], at: Pair, place: (one: T) => Pair, within: number): T | undefined {
  const far = (one: T) => Math.hypot(place(one)[0] - at[0], place(one)[1] - at[1]);
  return all.filter((one) => far(one) <= within).sort((a, b) => far(a) - far(b))[0];
}

/** Return the box of the minimap frame that is shown: x, y, width, height. */
function boxOf(now: TeamView | undefined, asked: SeatQuestion, reach: Reach): [number, number, number, number] {
  const [x0, y0, x1, y1] = asked.view.bounds;
  if (reach === "map" || !now?.minimap) return [x0, y0, x1 - x0, y1 - y0];
  const cell = asked.view.cell;
  if (reach === "screen") return square(now.minimap, SCREEN / cell);
  const places = [...now.units, ...now.allies, ...now.enemies].map((unit) => unit.minimap);
  const [xs, ys] = [0, 1].map((axis) => places.map((place) => place[axis]));
  const [left, top, right, bottom] = [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
  if (!places.length) return square(now.minimap, SCREEN / cell);
  return square([(left + right) / 2, (top + bottom) / 2], Math.max(right - left + (2 * ROOM) / cell, bottom - top + (2 * ROOM) / cell, LEAST / cell));
}

const square = ([x, y]: Pair, size: number): [number, number, number, number] => [x - size / 2, y - size / 2, size, size];

/** Return each unit once: as one of its team, if it is the agent's own. */
function spotsOf(asked: SeatQuestion): Spot[] {
  const spots = new Map<string, Spot>();
  for (const t of asked.view.teams) for (const unit of [...t.resources, ...t.enemies, ...t.allies]) if (!spots.has(unit.tag)) spots.set(unit.tag, { unit, team: "" });
  for (const t of asked.view.teams) for (const unit of t.units) spots.set(unit.tag, { unit, team: t.name });
  return [...spots.values()];
}

function Screen({ team: { name, minimap }, size, chosen }: { team: TeamView; size: number; chosen: boolean }) {
  const [x, y] = minimap!;
  const half = (SCREEN / 2) * size;
  return (
    <g class={`screen ${chosen ? "is-chosen" : ""}`}>
      <rect x={x - half} y={y - half} width={2 * half} height={2 * half} stroke-width={0.12 * size} />
      <text x={x - half + 0.4 * size} y={y - half + 1.4 * size} font-size={1.1 * size}>
        {name}
      </text>
    </g>
  );
}

function Effect({ at, r, name }: { at: Pair | null; r: number; name: string }) {
  return (
    at && (
      <circle class="effect" cx={at[0]} cy={at[1]} r={r}>
        <title>{name}</title>
      </circle>
    )
  );
}

function Orders({ spots, width }: { spots: readonly Spot[]; width: number }) {
  const at = new Map(spots.map((spot) => [spot.unit.tag, spot.unit.minimap]));
  return (
    <g class="orders" stroke-width={width} stroke-dasharray={`${3 * width} ${3 * width}`}>
      {spots.map(({ unit }) => {
        const order = unit.orders[0];
        const to = order && ((order.target && at.get(order.target)) || order.minimap);
        return to && <line key={unit.tag} x1={unit.minimap[0]} y1={unit.minimap[1]} x2={to[0]} y2={to[1]} />;
      })}
    </g>
  );
}

function Unit({ spot: { unit, team: of }, r, chosen, lit }: { spot: Spot; r: number; chosen: boolean; lit: boolean }) {
  const [x, y] = unit.minimap;
  const round = 2 * Math.PI * r;
  const left = (part: number, most: number) => `${round * (most ? part / most : 0)} ${round}`;
  return (
    <g class={`unit ${unit.alliance} ${chosen ? "is-chosen" : ""} ${lit ? "is-lit" : ""}`} transform={`translate(${x} ${y})`}>
      <circle class="body" r={r} />
      <circle class="health" r={r} stroke-width={r * 0.25} stroke-dasharray={left(unit.health, unit.health_max)} transform="rotate(-90)" />
      {unit.shield_max > 0 && <circle class="shield" r={r * 1.25} stroke-width={r * 0.18} stroke-dasharray={`${1.25 * round * (unit.shield / unit.shield_max)} ${2 * round}`} transform="rotate(-90)" />}
      <text y={r * 0.35} font-size={r}>
        {initials(unit.type)}
      </text>
      <title>{`${of ? `Team ${of}: ` : ""}${about(unit)} ${unit.tag}`}</title>
    </g>
  );
}

/** Return two letters for a type: `Zealot` `Ze`, `HighTemplar` `HT`. */
const initials = (type: string) => {
  const capitals = type.replace(/[^A-Z]/g, "");
  return capitals.length > 1 ? capitals.slice(0, 2) : type.slice(0, 2);
};
