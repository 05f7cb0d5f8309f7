/** Messages between agents in the order in which they were written; a click goes to their time. */

import { useSignal } from "@preact/signals";
import type { Match } from "../match";
import type { Mark } from "../wire";
import { Rows } from "./Rows";
import { Words } from "./Words";

export function Threads({ match }: { match: Match }) {
  const of = useSignal("");
  const all = (match.timeline.value?.marks ?? []).filter((m) => m.kind === "message" || m.kind === "advice");
  const concerns = (mark: Mark) => !of.value || mark.agent === of.value || mark.text.startsWith(`→ ${of.value}:`);
  if (!all.length) return <p class="muted pad">No messages were written.</p>;
  return (
    <div class="list-view">
      <label class="choice">
        From or to{" "}
        <select value={of.value} onChange={(e) => (of.value = e.currentTarget.value)}>
          <option value="">everybody</option>
          {[...new Set(match.agents.value.map((a) => a.name))].map((name) => (
            <option>{name}</option>
          ))}
        </select>
      </label>
      <Rows match={match} marks={all.filter(concerns)} write={(mark) => <Message match={match} mark={mark} />} />
    </div>
  );
}

function Message({ match, mark }: { match: Match; mark: Mark }) {
  const side = Math.min(Math.max(match.sides.value.indexOf(mark.side), 0), 1);
  return (
    <>
      <b class={`side-${side}`}>{mark.agent}</b> {mark.kind === "advice" && <span class="badge warn">human</span>} <Words text={mark.text} frame="minimap" />
    </>
  );
}
