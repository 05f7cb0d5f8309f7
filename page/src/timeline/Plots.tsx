/** Curves and time lines over one axis, with the line of the moment through all of them: drag it to go there. */

import { signal } from "@preact/signals";
import { useRef } from "preact/hooks";
import * as clock from "../clock";
import { Curves } from "../curves/Curves";
import type { Match } from "../match";
import { clockText } from "../time";
import { TimeLine } from "./TimeLine";
import { momentAt, type Scale } from "./lanes";
import { GUTTER, MARGIN } from "./measure";

/** Least part of an episode that the time line shows: a second. */
const LEAST_S = 1;

/** Where the pointer is, as a moment of the clock. */
const pointed = signal<number | null>(null);

export function Plots({ matches }: { matches: readonly Match[] }) {
  const box = useRef<HTMLDivElement>(null);
  const scale = (): Scale => ({ from: clock.shown.value[0], to: clock.shown.value[1], width: box.current!.clientWidth - GUTTER - MARGIN });
  const momentOf = (event: MouseEvent) => momentAt(scale(), event.clientX - box.current!.getBoundingClientRect().left - GUTTER);
  const down = (event: PointerEvent) => {
    if (event.button !== 0 || (event.target as HTMLElement).closest("button, select")) return;
    box.current!.setPointerCapture(event.pointerId);
    clock.go(momentOf(event));
  };
  const move = (event: PointerEvent) => {
    if (event.buttons & 1 && box.current!.hasPointerCapture(event.pointerId)) clock.go(momentOf(event));
    const moment = momentOf(event);
    pointed.value = moment >= clock.shown.value[0] && moment <= clock.shown.value[1] ? moment : null;
  };
  return (
    <div class="plots" ref={box} onPointerDown={down} onPointerMove={move} onPointerLeave={() => (pointed.value = null)} onWheel={(event) => zoom(event, momentOf(event))}>
      <Curves matches={matches} />
      {matches.map((match, i) => (
        <TimeLine key={match.id + i} match={match} name={matches.length > 1 ? "AB"[i] : ""} />
      ))}
      <Ticks />
      <Moment match={matches[0]} />
    </div>
  );
}

/** Zoom the time line by the wheel while ctrl or alt is held; shift moves it. A bare wheel scrolls the page. */
function zoom(event: WheelEvent, moment: number): void {
  if (!event.ctrlKey && !event.altKey && !event.shiftKey) return;
  event.preventDefault();
  const [from, to] = clock.shown.value;
  const [first, last] = clock.span.value;
  const delta = event.deltaY || event.deltaX;
  const factor = event.shiftKey ? 1 : Math.exp(delta * 0.002);
  const length = Math.min(Math.max((to - from) * factor, Math.min(LEAST_S, last - first)), last - first);
  const start = event.shiftKey ? from + Math.sign(delta) * length * 0.1 : moment - ((moment - from) / (to - from)) * length;
  const begin = Math.min(Math.max(start, first), last - length);
  clock.zoomed.value = length >= last - first ? null : [begin, begin + length];
}

/** Round lengths between two ticks, in seconds. */
const NICE = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 3600];

function Ticks() {
  const [from, to] = clock.shown.value;
  const every = NICE.find((n) => (to - from) / n <= 12) ?? 7200;
  const ticks = Array.from({ length: Math.max(0, Math.floor(to / every) - Math.ceil(from / every) + 1) }, (_, i) => (Math.ceil(from / every) + i) * every);
  const words = (tick: number) => (clock.axis.value === "time" ? clockText(tick) : String(tick));
  return (
    <div class="ticks" aria-hidden="true">
      {ticks.map((tick) => (
        <span key={tick} style={{ left: `${((tick - from) / (to - from)) * 100}%` }}>
          {words(tick)}
        </span>
      ))}
    </div>
  );
}

function Moment({ match }: { match: Match }) {
  const [from, to] = clock.shown.value;
  const part = (moment: number) => `${((moment - from) / (to - from)) * 100}%`;
  const now = clock.at.value;
  const words = clock.axis.value === "time" ? clockText(now) : `step ${match.step.value}`;
  const hover = pointed.value;
  const inside = now >= from && now <= to;
  return (
    <div class="moments">
      {hover !== null && (
        <span class="pointed" style={{ left: part(hover) }}>
          <i>{clock.axis.value === "time" ? clockText(hover) : `step ${Math.round(hover)}`}</i>
        </span>
      )}
      <span
        class={`now ${inside ? "" : "outside"}`}
        role="slider"
        tabIndex={0}
        aria-label="Moment"
        aria-valuemin={clock.span.value[0]}
        aria-valuemax={clock.span.value[1]}
        aria-valuenow={Math.round(now * 10) / 10}
        aria-valuetext={`${words}, step ${match.step.value}`}
        style={{ left: part(now) }}
      />
    </div>
  );
}
