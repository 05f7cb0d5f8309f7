/** The lanes of the time line: which marks lie in which, and how they are drawn. */

import type { Match } from "../match";
import type { Colours } from "../theme";
import { indexOf, momentOf, type Axis } from "../time";
import type { Mark } from "../wire";

export interface Lane {
  id: string;
  name: string;
  kinds: readonly Mark["kind"][];
  height: number;
}

export const LANES: readonly Lane[] = [
  { id: "fights", name: "Fights", kinds: ["fight", "death"], height: 26 },
  { id: "built", name: "Built", kinds: ["building", "upgrade"], height: 14 },
  { id: "talk", name: "Messages", kinds: ["message", "advice"], height: 14 },
  { id: "trouble", name: "Trouble", kinds: ["late", "fallback", "refused", "incident", "end"], height: 14 },
];
/** The lane of the steps in which agents were asked. */
export const ASKED: Lane = { id: "asked", name: "Decisions", kinds: [], height: 12 };

export const HEIGHT = [...LANES, ASKED].reduce((sum, lane) => sum + lane.height, 0);

/** The part of the clock that a time line shows, on so many pixels. */
export interface Scale {
  from: number;
  to: number;
  width: number;
}

export const pixelOf = (scale: Scale, moment: number) => ((moment - scale.from) / (scale.to - scale.from)) * scale.width;
export const momentAt = (scale: Scale, pixel: number) => scale.from + (pixel / scale.width) * (scale.to - scale.from);

/** Draw the lanes of a match; decisions are those of the chosen agent, or of all. */
export function drawLanes(context: CanvasRenderingContext2D, match: Match, axis: Axis, scale: Scale, agent: string, colours: Colours): void {
  const timeline = match.timeline.value;
  if (!timeline) return;
  const where = (step: number) => pixelOf(scale, momentOf(timeline, axis, indexOf(timeline, step)));
  let top = 0;
  for (const lane of LANES) {
    const marks = timeline.marks.filter((m) => lane.kinds.includes(m.kind));
    const most = Math.max(1, ...marks.filter((m) => m.kind === "fight").map((m) => m.weight));
    for (const mark of marks) {
      const x = where(mark.step);
      if (x >= -4 && x <= scale.width + 4) drawMark(context, mark, x, top, lane.height, most, tint(match, mark.side, colours), colours);
    }
    top += lane.height;
  }
  drawAsked(context, match, where, scale, agent, top, colours);
}

const tint = (match: Match, side: string, colours: Colours) => {
  const index = match.sides.value.indexOf(side);
  return index < 0 ? colours.muted : colours.sides[Math.min(index, 1)];
};

function drawMark(context: CanvasRenderingContext2D, mark: Mark, x: number, top: number, height: number, most: number, colour: string, colours: Colours): void {
  const middle = top + height / 2;
  const bad = mark.kind === "late" || mark.kind === "fallback" || mark.kind === "refused" || mark.kind === "incident";
  context.fillStyle = context.strokeStyle = bad ? colours.bad : colour;
  context.lineWidth = 1.5;
  context.beginPath();
  switch (mark.kind) {
    case "fight": {
      const size = Math.max(3, Math.sqrt(mark.weight / most) * (height - 4));
      context.roundRect(x - 2.5, top + height - 1 - size, 5, size, 1.5);
      return context.fill();
    }
    case "building":
      context.rect(x - 3, middle - 3, 6, 6);
      return context.fill();
    case "upgrade":
      polygon(context, x, middle, 4, 4);
      return context.fill();
    case "message":
      context.arc(x, middle, 2, 0, 2 * Math.PI);
      return context.fill();
    case "advice":
      polygon(context, x, middle, 5, 3);
      return context.fill();
    case "end":
      context.fillRect(x - 1, top, 2, height);
      return;
    case "death":
    case "refused":
      return cross(context, x, mark.kind === "death" ? top + height - 5 : middle, mark.kind === "death" ? 2 : 3);
    case "late":
      context.arc(x, middle, 3, 0, 2 * Math.PI);
      return context.stroke();
    case "fallback":
      polygon(context, x, middle, 4, 3);
      return context.stroke();
    case "incident":
      context.fillRect(x - 1, middle - 5, 2, 6);
      return context.fillRect(x - 1, middle + 3, 2, 2);
  }
}

function cross(context: CanvasRenderingContext2D, x: number, y: number, r: number): void {
  context.moveTo(x - r, y - r);
  context.lineTo(x + r, y + r);
  context.moveTo(x + r, y - r);
  context.lineTo(x - r, y + r);
  context.stroke();
}

function polygon(context: CanvasRenderingContext2D, x: number, y: number, r: number, corners: number): void {
  for (let i = 0; i < corners; i++) {
    const angle = (i / corners) * 2 * Math.PI - Math.PI / 2;
    context.lineTo(x + r * Math.cos(angle), y + r * Math.sin(angle));
  }
  context.closePath();
}

/** Draw a tick for each decision, one a pixel at most: an episode may have 20 000. */
function drawAsked(context: CanvasRenderingContext2D, match: Match, where: (step: number) => number, scale: Scale, agent: string, top: number, colours: Colours): void {
  const asked = match.timeline.value?.asked ?? {};
  const sides = match.run.value?.sides ?? [];
  const height = (ASKED.height - 4) / Math.max(1, sides.length);
  context.globalAlpha = 0.75;
  for (const [key, steps] of Object.entries(asked)) {
    if (agent && key !== agent) continue;
    const [side] = key.split("/");
    context.fillStyle = tint(match, side, colours);
    let last = -9;
    for (const step of steps) {
      const x = Math.round(where(step));
      if (x === last || x < 0 || x > scale.width) continue;
      last = x;
      context.fillRect(x, top + 3 + Math.max(0, sides.indexOf(side)) * height, 1, height - 1);
    }
  }
  context.globalAlpha = 1;
}

/** Return the marks near a pixel of a time line, for the pointer. */
export function marksAt(match: Match, axis: Axis, scale: Scale, x: number, y: number): Mark[] {
  const timeline = match.timeline.value;
  let top = 0;
  const lane = LANES.find((l) => y >= top && y < (top += l.height));
  if (!timeline || !lane) return [];
  const where = (mark: Mark) => pixelOf(scale, momentOf(timeline, axis, indexOf(timeline, mark.step)));
  return timeline.marks.filter((m) => lane.kinds.includes(m.kind) && Math.abs(where(m) - x) <= 5);
}
