/** An experiment's table: each number with its interval as a bar; a row leads to its matches. */

import { useSignal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { get } from "../api";
import type { Cell, ExperimentView, Row } from "../wire";
import { RunTable } from "./RunTable";

export function Experiment({ id }: { id: string }) {
  const [view, setView] = useState<ExperimentView | null>(null);
  const [trouble, setTrouble] = useState("");
  const chosen = useSignal(-1);
  useEffect(() => void get<ExperimentView>(`experiments/${id}`).then(setView, (error: Error) => setTrouble(error.message)), [id]);
  if (!view) return <main class="library">{trouble ? <p class="bad">{trouble}</p> : <p class="muted">Loading…</p>}</main>;
  const ranges = view.columns.map((_, i) => rangeOf(view.rows.map((row) => row.cells[i])));
  const row = view.rows[chosen.value];
  const runs = row ? view.runs.filter((run) => row.runs.includes(run.id)) : view.runs;
  return (
    <main class="library">
      <h1>{view.line.name}</h1>
      <p>{view.line.description}</p>
      <div class="table-box" tabIndex={0} role="region" aria-label="Table">
        <table>
          <thead>
            <tr>
              {[...view.factors, "games", ...view.columns].map((name) => (
                <th key={name}>{name}</th>
              ))}
            </tr>
          </thead>
          <tbody>
            {view.rows.map((r, i) => (
              <RowView key={i} row={r} ranges={ranges} chosen={i === chosen.value} choose={() => (chosen.value = i === chosen.value ? -1 : i)} />
            ))}
          </tbody>
        </table>
      </div>
      <ul class="notes">
        {view.notes.map((words) => (
          <li key={words}>{words}</li>
        ))}
      </ul>
      <h2>{row ? `Matches of ${row.names.join(", ")}` : "Matches"}</h2>
      <RunTable runs={runs} />
    </main>
  );
}

function RowView({ row, ranges, chosen, choose }: { row: Row; ranges: readonly Range[]; chosen: boolean; choose: () => void }) {
  return (
    <tr class={chosen ? "is-chosen" : ""}>
      {row.names.map((name, i) => (
        <td key={i}>
          {i === 0 ? (
            <button class="link" aria-pressed={chosen} onClick={choose} title="Show its matches">
              {name}
            </button>
          ) : (
            name
          )}
        </td>
      ))}
      <td class="number">{row.games}</td>
      {row.cells.map((cell, i) => (
        <td key={i}>
          {cell.text}
          <Interval cell={cell} range={ranges[i]} />
        </td>
      ))}
    </tr>
  );
}

type Range = readonly [number, number];

/** Return the lowest and the highest end of the intervals of a column, from 0 on. */
function rangeOf(cells: readonly Cell[]): Range {
  const ends = cells.flatMap((c) => [c?.low, c?.value, c?.high]).filter((v): v is number => typeof v === "number");
  return [Math.min(0, ...ends), Math.max(1e-9, ...ends)];
}

function Interval({ cell, range }: { cell: Cell; range: Range }) {
  if (cell.value === null) return null;
  const part = (value: number) => ((value - range[0]) / (range[1] - range[0])) * 100;
  const [low, high] = [cell.low ?? cell.value, cell.high ?? cell.value];
  return (
    <div class="interval" aria-hidden="true">
      <span style={{ left: `${part(low)}%`, width: `${Math.max(part(high) - part(low), 0.5)}%` }} />
      <i style={{ left: `${part(cell.value)}%` }} />
    </div>
  );
}
