/** Recordings as a table: sort by a column, open one, or put two side by side. */

import { useSignal } from "@preact/signals";
import { writeHash } from "../hash";
import { clockText } from "../time";
import { bytes, dollars, whole } from "../words";
import type { RunLine } from "../wire";
import { ordered, outcomeOf } from "./filter";

/** Rows that are shown at once; the filter finds the rest. */
const MOST_ROWS = 500;

interface Column {
  name: string;
  value: (run: RunLine) => string | number;
  words?: (run: RunLine) => string;
}

const COLUMNS: readonly Column[] = [
  { name: "Task", value: (r) => r.task },
  { name: "Map", value: (r) => r.map },
  { name: "Seed", value: (r) => r.seed },
  { name: "Models", value: (r) => r.models.join(", ") },
  { name: "Against", value: (r) => r.opponent || "each other" },
  { name: "Result", value: outcomeOf },
  { name: "Game", value: (r) => r.game_s, words: (r) => clockText(r.game_s) },
  { name: "Steps", value: (r) => r.steps, words: (r) => whole(r.steps) },
  { name: "Cost", value: (r) => r.cost_usd ?? -1, words: (r) => dollars(r.cost_usd) },
  { name: "Size", value: (r) => r.size_bytes, words: (r) => bytes(r.size_bytes) },
  { name: "Recorded", value: (r) => r.recorded_at_s, words: (r) => when(r.recorded_at_s) },
];

const when = (unix: number) => new Date(unix * 1000).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "short" });

export function RunTable({ runs }: { runs: readonly RunLine[] }) {
  const by = useSignal({ column: "Recorded", down: true });
  const pair = useSignal<readonly string[]>([]);
  const column = COLUMNS.find((c) => c.name === by.value.column)!;
  const rows = ordered(runs, column.value, by.value.down).slice(0, MOST_ROWS);
  const sort = (name: string) => (by.value = { column: name, down: by.value.column === name ? !by.value.down : false });
  const toggle = (id: string) => (pair.value = pair.value.includes(id) ? pair.value.filter((p) => p !== id) : [...pair.value, id].slice(-2));
  if (!runs.length) return <p class="muted">No match.</p>;
  return (
    <>
      {pair.value.length === 2 && (
        <p>
          <a class="button" href={writeHash({ a: pair.value[0], b: pair.value[1] })}>
            Compare the two
          </a>
        </p>
      )}
      <div class="table-box" tabIndex={0} role="region" aria-label="Matches">
        <table>
          <thead>
            <tr>
              <th title="Choose two to compare">
                <span class="hidden">Compare</span>
              </th>
              {COLUMNS.map((c) => (
                <th key={c.name} aria-sort={by.value.column === c.name ? (by.value.down ? "descending" : "ascending") : "none"}>
                  <button class="plain" onClick={() => sort(c.name)}>
                    {c.name}
                    {by.value.column === c.name && (by.value.down ? " ↓" : " ↑")}
                  </button>
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {rows.map((run) => (
              <Row key={run.id} run={run} chosen={pair.value.includes(run.id)} toggle={() => toggle(run.id)} />
            ))}
          </tbody>
        </table>
      </div>
      {runs.length > rows.length && <p class="muted">Only the first {rows.length} are shown: filter for the others.</p>}
    </>
  );
}

function Row({ run, chosen, toggle }: { run: RunLine; chosen: boolean; toggle: () => void }) {
  const outcome = outcomeOf(run);
  return (
    <tr>
      <td>
        <input type="checkbox" checked={chosen} onChange={toggle} aria-label={`Compare ${run.run}`} />
      </td>
      {COLUMNS.map((c, i) => (
        <td key={c.name} class={c.name === "Result" && /^\w+$/.test(outcome) ? outcome : typeof c.value(run) === "number" ? "number" : ""}>
          {i === 0 ? (
            <a href={writeHash({ a: run.id })} title={run.path}>
              {run.task}
            </a>
          ) : (
            (c.words ?? c.value)(run)
          )}
          {c.name === "Result" && run.live && <span class="badge good">live</span>}
          {c.name === "Result" && !run.valid && <span class="badge bad">not valid</span>}
          {c.name === "Result" && !run.complete && !run.live && <span class="badge warn">incomplete</span>}
        </td>
      ))}
    </tr>
  );
}
