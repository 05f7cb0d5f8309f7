/** Marks of the time line as rows with their time, around the moment: a click on a time goes there. */

import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import * as clock from "../clock";
import type { Match } from "../match";
import { clockText, indexOf, momentOf } from "../time";
import type { Mark } from "../wire";
import { pointAt, pointAway } from "./Words";

/** Rows before and after the moment: a long match has 50 000. */
const AROUND = 150;

export function Rows({ match, marks, write }: { match: Match; marks: readonly Mark[]; write: (mark: Mark) => ComponentChildren }) {
  const list = useRef<HTMLOListElement>(null);
  const timeline = match.timeline.value;
  const now = marks.findLastIndex((mark) => mark.step <= match.step.value);
  const first = Math.max(0, now - AROUND);
  useEffect(() => keepInSight(list.current?.children[now - first]), [now]);
  if (!timeline) return null;
  const index = (mark: Mark) => indexOf(timeline, mark.step);
  return (
    <ol class="rows" ref={list}>
      {marks.slice(first, Math.max(0, now) + AROUND).map((mark, i) => (
        <li
          key={`${mark.step} ${first + i}`}
          class={mark.step > match.step.value ? "later" : ""}
          onPointerEnter={() => mark.at && pointAt([], [mark.at])}
          onPointerLeave={pointAway}
        >
          <button onClick={() => clock.go(momentOf(timeline, clock.axis.value, index(mark)))}>{clockText(timeline.time_s[index(mark)] ?? 0)}</button>
          <span>{write(mark)}</span>
        </li>
      ))}
    </ol>
  );
}

/** Scroll a row into the middle of its box, and nothing else of the page. */
function keepInSight(row: Element | undefined): void {
  const box = row?.closest(".beside");
  if (!(row instanceof HTMLElement) || !box) return;
  const [inner, outer] = [row.getBoundingClientRect(), box.getBoundingClientRect()];
  if (inner.top < outer.top || inner.bottom > outer.bottom) box.scrollTop += inner.top - outer.top - outer.height / 2;
}
