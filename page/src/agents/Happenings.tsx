/** What happened, as a list: the marks of the time line in words, for reading and for those who do not see them. */

import { useSignal } from "@preact/signals";
import type { Match } from "../match";
import { LANES } from "../timeline/lanes";
import { capital } from "../words";
import { Rows } from "./Rows";

export function Happenings({ match }: { match: Match }) {
  const kind = useSignal("");
  const lane = LANES.find((l) => l.id === kind.value);
  const wanted = (match.timeline.value?.marks ?? []).filter((m) => !lane || lane.kinds.includes(m.kind));
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
      <Rows
        match={match}
        marks={wanted}
        write={(mark) => (
          <>
            <span class="muted">{[mark.kind, capital(mark.side), mark.agent].filter(Boolean).join(" · ")}</span> {mark.text}
          </>
        )}
      />
    </div>
  );
}
