/** The time line of a match: its marks in lanes. */

import { effect, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import * as clock from "../clock";
import type { Match } from "../match";
import { agent } from "../stage";
import { palette } from "../theme";
import { clockText, indexOf } from "../time";
import { capital } from "../words";
import type { Mark } from "../wire";
import { ASKED, HEIGHT, LANES, drawLanes, marksAt, type Scale } from "./lanes";

/** Lines of a tip: a battle may have forty marks at one pixel. */
const MOST_TOLD = 6;

export function TimeLine({ match, name }: { match: Match; name: string }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const pointed = useSignal<{ marks: Mark[]; x: number } | null>(null);
  useEffect(() => keepDrawn(canvas.current!, match), [match]);
  const hover = (event: PointerEvent) => {
    const box = canvas.current!.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const marks = marksAt(match, clock.axis.value, scaleOf(box.width), x, y);
    pointed.value = marks.length ? { marks, x } : null;
  };
  return (
    <div class="lanes">
      <div class="lane-names" aria-hidden="true">
        {[...LANES, ASKED].map((lane, i) => (
          <span key={lane.id} style={{ height: `${lane.height}px`, lineHeight: `${lane.height}px` }}>
            {i === 0 && name ? `${name} · ${lane.name}` : lane.name}
          </span>
        ))}
      </div>
      <canvas ref={canvas} style={{ height: `${HEIGHT}px` }} onPointerMove={hover} onPointerLeave={() => (pointed.value = null)} />
      {pointed.value && <MarkTip match={match} marks={pointed.value.marks} x={pointed.value.x} />}
    </div>
  );
}

const scaleOf = (width: number): Scale => ({ from: clock.shown.value[0], to: clock.shown.value[1], width });

function MarkTip({ match, marks, x }: { match: Match; marks: readonly Mark[]; x: number }) {
  const timeline = match.timeline.value!;
  const told = marks.slice(0, MOST_TOLD);
  return (
    <div class="tip mark-tip" style={{ left: `${Math.max(80, x)}px` }}>
      {told.map((mark, i) => (
        <div key={i}>
          <span class="muted">{clockText(timeline.time_s[indexOf(timeline, mark.step)] ?? 0)}</span> {mark.side && `${capital(mark.side)} `}
          {mark.agent && `${mark.agent}: `}
          {mark.text || mark.kind}
        </div>
      ))}
      {marks.length > told.length && <div class="muted">and {marks.length - told.length} more</div>}
    </div>
  );
}

function keepDrawn(canvas: HTMLCanvasElement, match: Match): () => void {
  let request = 0;
  const draw = () => {
    request = 0;
    const { width } = canvas.getBoundingClientRect();
    canvas.width = Math.round(width * devicePixelRatio);
    canvas.height = Math.round(HEIGHT * devicePixelRatio);
    const context = canvas.getContext("2d")!;
    context.scale(devicePixelRatio, devicePixelRatio);
    drawRows(context, width, palette.value.line);
    drawLanes(context, match, clock.axis.value, scaleOf(width), agent.value, palette.value);
  };
  const ask = () => (request ||= requestAnimationFrame(draw));
  const resized = new ResizeObserver(ask);
  resized.observe(canvas);
  const stop = effect(() => {
    void [match.timeline.value, match.run.value, clock.axis.value, clock.shown.value, agent.value, palette.value];
    ask();
  });
  return () => {
    cancelAnimationFrame(request);
    resized.disconnect();
    stop();
  };
}

function drawRows(context: CanvasRenderingContext2D, width: number, colour: string): void {
  context.fillStyle = colour;
  let top = 0;
  for (const lane of [...LANES, ASKED]) context.fillRect(0, (top += lane.height) - 0.5, width, 0.5);
}
