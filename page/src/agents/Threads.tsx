/** Messages between agents in the order in which they were written; a click goes to their time. */

import { useSignal } from "@preact/signals";
import * as clock from "../clock";
import type { Match } from "../match";
import { clockText, indexOf, momentOf } from "../time";
import { Words } from "./Words";

/** Messages that are shown before and after the moment. */
const AROUND = 100;

export function Threads({ match }: { match: Match }) {
  const between = useSignal("");
  const timeline = match.timeline.value;
  const all = (timeline?.marks ?? []).filter((m) => m.kind === "message" || m.kind === "advice");
  const wanted = all.filter((m) => !between.value || m.text.includes(between.value) || m.agent === between.value);
  if (!timeline || !all.length) return <p class="muted pad">No messages were written.</p>;
  const now = wanted.findLastIndex((m) => m.step <= match.step.value);
  const near = wanted.slice(Math.max(0, now - AROUND), now + AROUND);
  return (
    <div class="list-view">
      <label class="choice">
        Of{" "}
        <select value={between.value} onChange={(e) => (between.value = e.currentTarget.value)}>
          <option value="">everybody</option>
          {match.agents.value.map((a) => (
            <option>{a.name}</option>
          ))}
        </select>
      </label>
      <ol class="rows">
        {near.map((mark, i) => (
          <li key={`${mark.step} ${i}`} class={`${mark.step > match.step.value ? "later" : ""} ${mark.kind}`}>
            <button onClick={() => clock.go(momentOf(timeline, clock.axis.value, indexOf(timeline, mark.step)))}>{clockText(timeline.time_s[indexOf(timeline, mark.step)] ?? 0)}</button>
            <span>
              {mark.kind === "advice" && <span class="badge warn">human</span>} <Words text={mark.text} frame="minimap" />
            </span>
          </li>
        ))}
      </ol>
    </div>
  );
}
