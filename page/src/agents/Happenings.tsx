/** What happened, as a list: the marks of the time line in words, for reading and for those who do not see them. */

import { useSignal } from "@preact/signals";
import * as clock from "../clock";
import type { Match } from "../match";
import { LANES } from "../timeline/lanes";
import { clockText, indexOf, momentOf } from "../time";
import { capital } from "../words";
import { pointAt, pointAway } from "./Words";

/** Rows that are shown before and after the moment. */
const AROUND = 150;

export function Happenings({ match }: { match: Match }) {
  const kind = useSignal("");
  const timeline = match.timeline.value;
  const lane = LANES.find((l) => l.id === kind.value);
  const wanted = (timeline?.marks ?? []).filter((m) => !lane || lane.kinds.includes(m.kind));
  const now = wanted.findLastIndex((m) => m.step <= match.step.value);
  if (!timeline) return null;
  return (
    <div class="list-view">
      <label class="choice">
        Show{" "}
        <select value={kind.value} onChange={(e) => (kind.value = e.currentTarget.value)}>
          <option value="">everything</option>
          {LANES.map((l) => (
            <option value={l.id}>{l.name}</option>
          ))}
        </select>
      </label>
      {!wanted.length && <p class="muted">Nothing of this kind.</p>}
      <ol class="rows">
        {wanted.slice(Math.max(0, now - AROUND), Math.max(0, now) + AROUND).map((mark, i) => (
          <li
            key={`${mark.step} ${i}`}
            class={mark.step > match.step.value ? "later" : ""}
            onPointerEnter={() => mark.at && pointAt([], [mark.at])}
            onPointerLeave={pointAway}
          >
            <button onClick={() => clock.go(momentOf(timeline, clock.axis.value, indexOf(timeline, mark.step)))}>{clockText(timeline.time_s[indexOf(timeline, mark.step)] ?? 0)}</button>
            <span>
              <span class="muted">
                {mark.kind}
                {mark.side && ` · ${capital(mark.side)}`}
                {mark.agent && ` · ${mark.agent}`}
              </span>{" "}
              {mark.text}
            </span>
          </li>
        ))}
      </ol>
    </div>
  );
}
